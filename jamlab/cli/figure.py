"""`jamlab figure`: figures of both papers."""

from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from jamlab.cli.console import err_console, out_console, print_json, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Json
from jamlab.errors import InputError

STYLES = {"differs": "red", "undecided": "yellow"}  # of verdicts in the terminal


def figure(
    names: Annotated[
        list[str],
        typer.Argument(
            help="Figures such as boromand-6; all; list: show their names; reference: reduce a campaign's tables."
        ),
    ],
    source: Annotated[
        Path | None, typer.Option("--from", help="Campaign or folder of reference tables; default: those installed.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for PNG, PDF, CSV and HTML.")] = Path("jamlab-figures"),
    commit: Annotated[str, typer.Option(help="With the name reference: commit to record.")] = "unknown",
    add: Annotated[
        bool, typer.Option("--add", help="With the name reference: keep packings that the folder has already.")
    ] = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="With the name reference: a table to write; default: all.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Draw figures of both papers from our own packings, and compare each of their numbers with ours."""
    expect_output(out)
    if names == ["list"]:
        _list_figures(as_json)
    elif names == ["reference"]:
        _write_reference(source, out, commit, add, only or [], as_json)
    else:
        _draw_figures(names, source, out, as_json)


def _list_figures(as_json: bool) -> None:
    from jamlab.studies import gallery

    titles = gallery.titles()
    if as_json:
        print_json(titles)
    else:
        print_table("figures", ["name", "shows"], [[name, title] for name, title in titles.items()])


def _write_reference(source: Path | None, out: Path, commit: str, add: bool, only: list[str], as_json: bool) -> None:
    from jamlab.studies.reference_data import save_reference

    if source is None:
        raise InputError("reference needs a campaign: name its file or folder with --from")
    written = save_reference(source, out, commit, add, only)
    if as_json:
        print_json({"out": str(out), "bytes": written})
    else:
        print_table(f"wrote {out}", ["table", "bytes"], [[name, str(size)] for name, size in written.items()])


def _draw_figures(names: list[str], source: Path | None, out: Path, as_json: bool) -> None:
    from jamlab.processes.cores import available_cores
    from jamlab.studies import gallery
    from jamlab.studies.claims import summary
    from jamlab.studies.page import write_files
    from jamlab.studies.reference_data import example_sections, open_tables

    chosen, tables = gallery.check_names(names), open_tables(source)
    whole = len(chosen) == len(gallery.FIGURES)
    with err_console.status("drawing") as status:
        if whole:
            opening = example_sections() if source is None else ()
            drawn, failures = gallery.write_all(
                chosen, tables, out, lambda share, name: status.update(f"drawing {name}"), opening, available_cores()
            )
        else:
            drawn, failures = [gallery.draw_shown(name, tables) for name in chosen], []
            for each in drawn:
                write_files(each.name, each, out)
    claims = [c for each in drawn for c in each.claims]
    if as_json:
        values, captions = ({each.name: getattr(each, part) for each in drawn} for part in ("numbers", "caption"))
        missing = {f.name: f.reason for f in failures}
        rows = [c.row() for c in claims]
        print_json({"out": str(out), "claims": rows, "values": values, "captions": captions, "not_drawn": missing})
    else:
        for line in summary(claims) if whole else ():
            out_console.print(Text(line), soft_wrap=True)
        for c in claims:
            out_console.print(Text(c.line, style=STYLES.get(c.verdict, "")), soft_wrap=True)
        for each in [] if whole else drawn:
            if not each.claims:
                out_console.print(f"{each.name}: {each.caption}", soft_wrap=True, highlight=False, markup=False)
        names_written = gallery.PAGE if whole else ", ".join(f"{name}.png .pdf .csv" for name in chosen)
        out_console.print(f"wrote {names_written} to {out}", soft_wrap=True)
    for f in failures:
        err_console.print(Text(f"not drawn: {f.name}: {f.reason}", style="red"), soft_wrap=True)
