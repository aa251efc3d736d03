"""`jamlab study`: every figure, chart, map and comparison, planned, run, drawn; and studies of your own."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.chart import print_plan, tell
from jamlab.cli.console import out_console, print_json, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Json
from jamlab.errors import InputError

if TYPE_CHECKING:
    from jamlab.studies.study import Study

study = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Evidence: figures, charts of cost against error, stability maps, comparisons; and studies of your own.",
    epilog="Start with: jamlab study list",
)
Names = Annotated[list[str], typer.Argument(help="Studies, by the names that `jamlab study list` prints.")]
Results = Annotated[Path, typer.Option("--out", help="Folder of results: run goes on with what is there.")]


@study.command("list", epilog="Example: jamlab study list --kind map")
def list_studies(
    kind: Annotated[str | None, typer.Option(help="figure, topic, map, comparison, sizes, calibration.")] = None,
    as_json: Json = False,
) -> None:
    """List all studies: those that ship, and your own."""
    from jamlab.studies.registry import studies

    chosen = {name: s for name, s in studies().items() if kind in (None, s.kind)}
    if as_json:
        print_json({name: {"kind": s.kind, "title": s.title} for name, s in chosen.items()})
        return
    print_table("studies", ["name", "kind", "shows"], [[name, s.kind, s.title] for name, s in chosen.items()])


@study.command("plan", epilog="Example: jamlab study plan spectrum boromand-6 --out results")
def plan(names: Names, out: Results = Path("jamlab-results"), as_json: Json = False) -> None:
    """Say how many tasks are left and how long they take, without running anything."""
    print_plan(_chosen(names), out, as_json)


@study.command("run", epilog="Example: jamlab study run spectrum --out results")
def run(names: Names, out: Results = Path("jamlab-results")) -> None:
    """Measure what a folder of results does not hold; saved task by task, so that it goes on where it stopped."""
    chosen = _chosen(names)
    expect_output(out)
    for each in chosen:
        each.run(out, tell)
    out_console.print(f"Draw it: jamlab study draw {' '.join(names)} --from {out}", soft_wrap=True, highlight=False)


@study.command("draw", epilog="Example: jamlab study draw spectrum moved boromand-6 --out drawn")
def draw(
    names: Names,
    source: Annotated[Path | None, typer.Option("--from", help="Folder of results; default: what ships.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for PNG, PDF, CSV and HTML.")] = Path("jamlab-studies"),
    as_json: Json = False,
) -> None:
    """Draw studies from a folder of results, or from the data that ship: pictures, numbers, one HTML page."""
    from jamlab.studies.page import Page, source_fact, write_page

    chosen = {each.name: each for each in _chosen(names)}
    if source is not None and source.resolve() == out.resolve():
        raise InputError(f"--out {out}: pictures must not lie among results: name another folder")
    expect_output(out)
    drawn, failures = write_page(
        out,
        Page("studies", "Studies", lambda claims: ", ".join(chosen), each=True),
        {name: each.heading for name, each in chosen.items()},
        lambda name: chosen[name].draw(source),
        source_fact(source is not None),
        progress=tell,
    )
    failed = {each.name: each.reason for each in failures}
    if as_json:
        captions = {each.name: each.caption for each in drawn}
        print_json({"out": str(out), "captions": captions, "not_drawn": failed})
        return
    for name, reason in failed.items():
        out_console.print(f"not drawn: {name}: {reason}", soft_wrap=True, highlight=False, markup=False)
    out_console.print(f"Open {out / 'studies.html'}", soft_wrap=True)


@study.command("add", epilog="Example: jamlab study add my_study.py")
def add(
    source: Annotated[Path, typer.Argument(help="Python file with a study, or a campaign whose packings to add.")],
    out: Annotated[Path, typer.Option(help="Of a campaign: folder of tables to add to.")] = Path("jamlab-tables"),
    commit: Annotated[str, typer.Option(help="Of a campaign: commit to record.")] = "unknown",
    only: Annotated[list[str] | None, typer.Option(help="Of a campaign: a table to write; default: all.")] = None,
) -> None:
    """Add a study of your own, or packings of a campaign to the tables that figures are drawn from.

    A Python file defines a subclass of jamlab.studies.study.TableStudy with columns, tasks and show, and makes one,
    STUDY = MyStudy(name, title); the file jamlab-studies.txt in the working folder lists it from then on. Tables of a
    campaign take packings that they lack: jamlab figure all --from FOLDER draws all.
    """
    if source.suffix == ".py":
        from jamlab.studies.registry import OWN, add_studies

        names = ", ".join(each.name for each in add_studies(source))
        out_console.print(f"added {names} to {OWN}", soft_wrap=True, highlight=False)
        return
    from jamlab.studies.reference_data import RECORD, save_reference

    expect_output(out)
    written = save_reference(source, out, commit, (out / RECORD).exists(), only or [])
    print_table(f"wrote {out}", ["table", "bytes"], [[name, str(size)] for name, size in written.items()])


def _chosen(names: list[str]) -> "list[Study]":
    from jamlab.checks import check_choice
    from jamlab.studies.registry import studies

    known = studies()
    for name in names:
        check_choice("study", name, known)
    return [known[name] for name in dict.fromkeys(names)]
