"""`python -m studies`: list, draw and run evidence, compare with other codes, reduce campaigns to tables."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from jamlab.checks import check_choice
from jamlab.cli.console import err_console, out_console, print_json, print_stage, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.main import Commands
from jamlab.cli.options import Force, Json, Seed
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_targets, make_folder

if TYPE_CHECKING:
    import pandas as pd

    from studies.study import Page, Study, TableStudy

app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Evidence about jamlab: figures of the papers, cost against accuracy, where methods fail, other codes.",
    epilog="Start with: python -m studies list",
)
PAPERS, COST, FAILURE, ALL = "papers", "speed-accuracy", "stability", "all"
GROUPS = (PAPERS, COST, FAILURE, ALL)
STYLES = {"differs": "red", "undecided": "yellow"}  # of verdicts in the terminal
Names = Annotated[
    list[str], typer.Argument(help="papers, speed-accuracy, stability, all, or names that `list` prints.")
]
Source = Annotated[
    Path | None, typer.Option("--from", help="Campaign, tables or folder of results; default: the data of this folder.")
]
Results = Annotated[Path, typer.Option("--out", help="Folder of results; run again to resume.")]


def tell(share: float, text: str) -> None:
    """Print the present step on stderr."""
    print_stage(text)


@app.command("list", short_help="List all studies.", epilog="Example: python -m studies list --kind map")
def list_studies(
    kind: Annotated[str | None, typer.Option(help="figure, topic, map, comparison, sizes, calibration.")] = None,
    as_json: Json = False,
) -> None:
    """List all studies."""
    from studies.registry import studies

    chosen = {name: s for name, s in studies().items() if kind in (None, s.kind)}
    if as_json:
        print_json({name: {"kind": s.kind, "title": s.title} for name, s in chosen.items()})
        return
    print_table("studies", ["name", "kind", "shows"], [[name, s.kind, s.title] for name, s in chosen.items()])


@app.command(
    "draw", short_help="Draw pictures, tables and pages.", epilog="Example: python -m studies draw papers --out figures"
)
def draw(
    names: Names,
    source: Source = None,
    out: Annotated[Path, typer.Option(help="Folder for PNG, PDF, CSV and HTML.")] = Path("jamlab-studies"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw studies from the data of this folder, or from a campaign or results of your own."""
    from studies import registry

    if source is not None and source.resolve() == out.resolve():
        raise InputError(f"--out {out}: pictures must not lie among results: name another folder")
    expect_output(out)
    if set(names) & set(GROUPS):
        if len(names) > 1:
            raise InputError(f"{' '.join(names)}: draw one of {', '.join(GROUPS)} at a time")
        found: dict[str, Any] = {}
        if names[0] in (PAPERS, ALL):
            found |= _draw_figures(list(registry.FIGURES), source, out, force, as_json)
        if names[0] in (COST, ALL):
            found |= _draw_cost(source, out, force, as_json)
        if names[0] in (FAILURE, ALL):
            found |= _draw_failures(source, out, force, as_json)
    elif set(names) <= set(registry.FIGURES):
        found = _draw_figures(names, source, out, force, as_json)
    else:
        found = _draw_any(_chosen(names), source, out, force, as_json)
    if as_json:
        print_json({"out": str(out)} | found)


def _draw_any(
    chosen: "Mapping[str, Study]", source: Path | None, out: Path, force: bool, as_json: bool
) -> dict[str, Any]:
    from studies.study import Page, file_names, source_fact, write_page

    check_targets(out, file_names(chosen, "studies"), replace=force)
    drawn, failures = write_page(
        out,
        Page("studies", "Studies", lambda claims: ", ".join(chosen), each=True),
        {name: each.heading for name, each in chosen.items()},
        lambda name: chosen[name].draw(source),
        source_fact(source is not None),
        progress=tell,
    )
    failed = {each.name: each.reason for each in failures}
    if not as_json:
        for name, reason in failed.items():
            out_console.print(f"not drawn: {name}: {reason}", soft_wrap=True, highlight=False, markup=False)
        out_console.print(f"Open {out / 'studies.html'}", soft_wrap=True)
    return {"captions": {each.name: each.caption for each in drawn}, "not_drawn": failed}


def _draw_page(
    studies: "Mapping[str, TableStudy]", page: "Page", source: Path | None, out: Path, force: bool
) -> "dict[str, pd.DataFrame]":
    from studies.study import draw_tables, file_names

    check_targets(out, file_names(studies, page.name, each=False), replace=force)
    return draw_tables(out, studies, page, source=source, progress=tell)


def _draw_cost(source: Path | None, out: Path, force: bool, as_json: bool) -> dict[str, Any]:
    """Draw cost against error of every method, one page."""
    from studies.cost.chart import OFF_COLUMNS, PAGE, defaults_off_the_front
    from studies.registry import CHARTS

    tables = _draw_page(CHARTS, PAGE, source, out, force)
    found = {name: CHARTS[name].average(rows) for name, rows in tables.items()}
    beaten = defaults_off_the_front(CHARTS, found)
    if beaten and not as_json:
        print_table("defaults off their front", OFF_COLUMNS[:-1], [row[:-1] for row in beaten])
        for reason, name in {row[-1]: row[0].partition(":")[0] for row in beaten}.items():
            out_console.print(f"{name}: {reason}", soft_wrap=True, highlight=False)
    if not as_json:
        out_console.print(f"Open {out / 'speed-accuracy.html'}", soft_wrap=True)
    topics = {name: [asdict(p) for p in rows] for name, rows in found.items()}
    return {"defaults_off_the_front": beaten, "topics": topics}


def _draw_failures(source: Path | None, out: Path, force: bool, as_json: bool) -> dict[str, Any]:
    """Draw where methods fail, one page."""
    from studies.failure.map import COUNTED, PAGE, counts
    from studies.registry import MAPS

    found = _draw_page(MAPS, PAGE, source, out, force)
    if not as_json:
        print_table("runs by how they ended", COUNTED, counts(MAPS, found))
        out_console.print(f"Open {out / 'stability.html'}", soft_wrap=True)
    return {"maps": {name: table.to_dict("records") for name, table in found.items()}}


def _draw_figures(names: list[str], source: Path | None, out: Path, force: bool, as_json: bool) -> dict[str, Any]:
    """Draw figures of the papers and beyond, with every number of the papers beside ours."""
    from jamlab.processes.cores import available_cores
    from studies import gallery
    from studies.claims import summary
    from studies.reference_data import example_sections, open_tables
    from studies.study import write_files

    tables, whole = open_tables(source), len(names) == len(gallery.FIGURES)
    check_targets(out, gallery.file_names(names, whole=whole), replace=force)
    with err_console.status("drawing") as status:
        if whole:
            opening = example_sections() if source is None else ()
            drawn, failures = gallery.write_all(
                names, tables, out, lambda share, name: status.update(f"drawing {name}"), opening, available_cores()
            )
        else:
            drawn, failures = [gallery.draw_shown(name, tables) for name in names], []
            for each in drawn:
                write_files(each.name, each, out)
    claims = [c for each in drawn for c in each.claims]
    if not as_json:
        for line in summary(claims) if whole else ():
            out_console.print(Text(line), soft_wrap=True)
        for c in claims:
            out_console.print(Text(c.line, style=STYLES.get(c.verdict, "")), soft_wrap=True)
        for each in [] if whole else drawn:
            if not each.claims:
                out_console.print(f"{each.name}: {each.caption}", soft_wrap=True, highlight=False, markup=False)
        written = gallery.PAGE if whole else ", ".join(f"{name}.png .pdf .csv" for name in names)
        out_console.print(f"wrote {written} to {out}", soft_wrap=True)
        for f in failures:
            err_console.print(Text(f"not drawn: {f.name}: {f.reason}", style="red"), soft_wrap=True)
    values, captions = ({each.name: getattr(each, part) for each in drawn} for part in ("numbers", "caption"))
    missing = {f.name: f.reason for f in failures}
    return {"claims": [c.row() for c in claims], "values": values, "captions": captions, "not_drawn": missing}


@app.command("rows", short_help="Print every number of figures.", epilog="Example: python -m studies rows boromand-6")
def rows(names: Names, source: Source = None, as_json: Json = False) -> None:
    """Print every number of figures with what decides its verdict, without drawing a picture."""
    from studies import gallery
    from studies.claims import first_line
    from studies.reference_data import open_tables

    chosen = gallery.check_names([ALL if name == PAPERS else name for name in names])
    tables, claims = open_tables(source), []
    for name in chosen:
        found = gallery.draw(name, tables).claims
        claims += found
        for c in () if as_json else found:
            out_console.print(c.record, soft_wrap=True, highlight=False, markup=False)
    if as_json:
        print_json({"rows": [c.row() | {"family": c.choices} for c in claims]})
    else:
        out_console.print(first_line(claims), soft_wrap=True, highlight=False)


@app.command(
    "run",
    short_help="Measure what a folder of results lacks.",
    epilog="Example: python -m studies run spectrum --out results",
)
def run(
    names: Names,
    out: Results = Path("jamlab-results"),
    plan: Annotated[bool, typer.Option("--plan", help="Only count what is left, and its CPU time.")] = False,
    as_json: Json = False,
) -> None:
    """Measure what a folder of results does not hold. Results are saved task by task; run again to resume."""
    chosen = _chosen(names)
    if plan:
        print_plan(chosen.values(), out, as_json)
        return
    expect_output(out)
    for each in chosen.values():
        each.run(out, tell)
    drawn = f"python -m studies draw {' '.join(names)} --from {out}"
    out_console.print(f"Draw it: {drawn}", soft_wrap=True, highlight=False)


def print_plan(studies: "Iterable[Study]", out: Path, as_json: bool) -> None:
    """Print what a measurement into a folder would do, and its CPU time."""
    plans, kinds = [study.plan(out) for study in studies], list(dict.fromkeys(study.kind for study in studies))
    lines = [[p.name, str(p.left), "unknown" if p.seconds is None else f"{p.seconds:.0f}"] for p in plans]
    total = sum(p.seconds or 0.0 for p in plans)
    if as_json:
        print_json({"plan": lines, "seconds": total})
        return
    print_table("to measure", [" or ".join(kinds), "left", "CPU s"], lines)
    long = f"{total / 60:.0f} CPU minutes" if total > 90 else f"{total:.0f} CPU seconds"
    out_console.print(f"{long}; an interrupted run resumes", highlight=False)


def _chosen(names: list[str]) -> "dict[str, Study]":
    """Studies by name; a group stands for all of its studies."""
    from studies import registry

    every = registry.studies()
    groups: dict[str, Iterable[str]] = {PAPERS: registry.FIGURES, COST: registry.CHARTS, FAILURE: registry.MAPS}
    wanted = [each for name in names for each in (every if name == ALL else groups.get(name, [name]))]
    for name in wanted:
        check_choice("study", name, every)
    return {name: every[name] for name in wanted}


@app.command(
    "tables", short_help="Measure the tables behind estimates.", epilog="Example: python -m studies tables ways"
)
def tables(
    name: Annotated[str, typer.Argument(help="ways (of `jamlab estimate`) or flow-errors (of `choose_flow`).")],
    out: Annotated[Path | None, typer.Option(help="File to write; default: NAME.csv.xz, for jamlab/estimates.")] = None,
    seeds: Annotated[int, typer.Option(help="Packings of each way, 12 s of one core each.")] = 200,
    quick: Annotated[bool, typer.Option("--quick", help="flow-errors: a few packings and one check.")] = False,
) -> None:
    """Measure a table that ships in jamlab/estimates; run again to resume."""
    from jamlab.estimates.flow_errors import Part
    from studies.least_model import FLOW_SEEDS, SEEDS, make_table, measure_errors

    check_choice("table", name, ("ways", "flow-errors"))
    file = out or Path(f"{name.replace('-', '_')}.csv.xz")
    expect_output(file)
    if name == "ways":
        made = make_table(file, range(SEEDS.start, SEEDS.start + seeds), progress=tell)
        lines = [[str(way), str(len(record.seeds))] for way, record in made.items()]
        print_table(f"wrote {file}", ["way", "packings"], lines)
        return
    few = {part: given[: 2 if part == Part.CALIBRATE else 1] for part, given in FLOW_SEEDS.items()}
    errors = measure_errors(file, few if quick else FLOW_SEEDS, progress=tell)
    (kept, of), (others, of_others) = errors.kept(), errors.kept(Part.SLIDING_CHECK)
    held = f"promised errors held in {kept} of {of} checks, at other beta in {others} of {of_others}"
    out_console.print(f"wrote {file}: {len(errors.rows)} runs; {held}", soft_wrap=True)


@app.command(
    "compare", short_help="Compare with other codes.", epilog="Example: python -m studies compare --n 64 --out compared"
)
def compare(
    n: Annotated[int, typer.Option("--n", help="Number of disks, even.")] = 64,
    seed: Seed = 1,
    phi: Annotated[float, typer.Option(help="Nominal packing fraction, above onset.")] = 0.88,
    recipe: Annotated[str | None, typer.Option(help="Write a recipe instead: hoomd.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for CSV and HTML, or for the recipe.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compare energy, minimum, time on one core with jax-md, JaxDEM, OpenMM, ASE, LAMMPS; analysis: freud, matscipy."""
    from studies.other_codes import compare as codes

    if recipe is not None:
        folder = out or Path(f"jamlab-{recipe}")
        check_targets(folder, ["packing.npz", f"{recipe}_check.py"], replace=force)
        out_console.print(codes.write_recipe(recipe, folder, codes.jolted_minimum(n, seed, phi)[0]), soft_wrap=True)
        return
    if out is not None:
        make_folder(out)
        check_targets(out, codes.FILES, replace=force)
        expect_output(out)
    found, analysis = codes.Comparison(sizes=(n,), seed=seed, phi=phi).measure(n, tell)
    if out is not None:
        codes.write_comparison(out, found, analysis, n, phi)
    if as_json:
        print_json({"rows": found, "analysis": analysis})
        return
    for table in codes.comparison_tables(found, analysis, n, phi):
        print_table(table.heading, list(table.columns), [list(row) for row in table.rows])
    for name, note in codes.notes(found, analysis).items():
        out_console.print(f"{name}: {note}", soft_wrap=True, highlight=False, markup=False)
    if out is not None:
        out_console.print(f"Open {out / 'index.html'}", soft_wrap=True)


@app.command(
    "reduce",
    short_help="Reduce a campaign to the tables of figures.",
    epilog="Example: python -m studies reduce studies/campaigns/reference.toml --out tables",
)
def reduce(
    campaign: Annotated[Path, typer.Argument(help="File or folder of a campaign.")],
    out: Annotated[Path, typer.Option(help="Folder of tables.")] = Path("jamlab-tables"),
    commit: Annotated[str, typer.Option(help="Commit to record.")] = "unknown",
    add: Annotated[bool, typer.Option("--add", help="Keep packings that the folder has already.")] = False,
    only: Annotated[list[str] | None, typer.Option("--only", help="A table to write; default: all.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Reduce the tables of a campaign to what figures are drawn from."""
    from studies.ensemble_tables import NAMES
    from studies.reference_data import RECORD, TABLE_FILE, has_record, save_reference

    keep = add and has_record(out)
    expect_output(out)
    check_targets(out, [RECORD, *map(TABLE_FILE.format, only or NAMES)], replace=force or keep)
    written = save_reference(campaign, out, commit, keep, only or [])
    if as_json:
        print_json({"out": str(out), "bytes": written})
    else:
        print_table(f"wrote {out}", ["table", "bytes"], [[name, str(size)] for name, size in written.items()])
