"""`jamlab campaign page`: what a campaign has made so far, as one interactive page."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.console import print_note
from jamlab.cli.interruption import expect_output
from jamlab.cli.progress import count_bar
from jamlab.storage.atomic_file import check_target


def page(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Campaign file (TOML), or the folder of a campaign.")],
    to: Annotated[Path, typer.Option(help="HTML file to write.")] = Path("campaign.html"),
    out: Annotated[Path | None, typer.Option(help="Folder of the tasks; default: beside the file.")] = None,
) -> None:
    """Write a page of all sweeps: one packing of each to look through, means over packings, tasks done."""
    from jamlab.campaign.campaign import open_campaign
    from jamlab.cli.campaign_report import write_campaign_page

    campaign = open_campaign(file, out)
    check_target(to, file)
    expect_output(to)
    with count_bar("sweeps") as progress:
        write_campaign_page(campaign, to, progress)
    print_note(f"wrote {to}; open it in a browser")
