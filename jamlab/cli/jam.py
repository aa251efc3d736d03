"""`jamlab jam`: a packing at onset."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.console import print_packings, progress_bar
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Ensemble, Json, N, Out, Seed, Tolerance
from jamlab.packing.atomic_file import check_target


def jam(
    model: Annotated[str, typer.Option(help="sp (disks) or dp (droplets).")] = "sp",
    n: N = 64,
    seed: Seed = 1,
    contact: Annotated[str | None, typer.Option(help="Contact form (dp): outline, segment or segment/smooth.")] = None,
    search: Annotated[str, typer.Option(help="bisection, or paper: steps of 1e-4 throughout.")] = "bisection",
    ensemble: Ensemble = "fixed-box",
    tolerance: Tolerance = None,
    out: Out = Path("onset.h5"),
    as_json: Json = False,
) -> None:
    """Make a packing at jamming onset, after Boromand et al., section 2.3."""
    from jamlab.protocols.onset import jam as run

    check_target(out)
    expect_output(out)
    with progress_bar("to onset", 0.84) as progress:
        how: dict[str, Any] = {"search": search, "ensemble": ensemble, "tolerance": tolerance}
        how |= {} if contact is None else {"contact": contact}
        packing = run(model, n, seed, progress=progress, **how)
    print_packings([packing], out, as_json)
