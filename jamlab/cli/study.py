"""`jamlab study`, `chart`, `figure`, `calibrate`, `compare`: evidence planned, run and drawn."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from jamlab.cli.console import err_console, out_console, print_json, print_stage, print_table, write_rows
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Force, Json, Seed
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_targets, make_folder

if TYPE_CHECKING:
    import pandas as pd

    from jamlab.studies.study import Page, Study, TableStudy


chart = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="What methods cost, how accurate they are, and where they fail.",
    epilog="Start with: jamlab chart speed-accuracy --out charts",
)
Out = Annotated[Path, typer.Option(help="Folder for CSV, PNG and HTML.")]
Measure = Annotated[bool, typer.Option("--measure", help="Measure anew into --out, on with what is there.")]
Plan = Annotated[bool, typer.Option("--plan", help="Only say what --measure would do, and how long it takes.")]


@chart.command(
    "speed-accuracy",
    short_help="Draw cost against error of every method.",
    epilog="Example: jamlab chart speed-accuracy --topic spectrum --out charts",
)
def speed_accuracy(
    topic: Annotated[list[str] | None, typer.Option(help="One topic; can be repeated; default: all.")] = None,
    measure: Measure = False,
    plan: Plan = False,
    out: Out = Path("jamlab-charts"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw cost against error of every method along its dial, over many packings: curves, CSV, one HTML page."""
    from jamlab.studies.cost.chart import OFF_COLUMNS, PAGE, defaults_off_the_front
    from jamlab.studies.registry import CHARTS, chosen

    charts = chosen(CHARTS, topic or ())
    tables = _draw_page(charts, PAGE, measure, plan, out, force, as_json)
    found = {name: charts[name].average(rows) for name, rows in tables.items()}
    beaten = defaults_off_the_front(charts, found)
    if as_json:
        points: dict[str, Any] = {name: [asdict(p) for p in rows] for name, rows in found.items()}
        print_json({"out": str(out), "defaults_off_the_front": beaten, "topics": points})
        return
    if beaten:
        print_table("defaults off their front", OFF_COLUMNS[:-1], [row[:-1] for row in beaten])
        for reason, name in {row[-1]: row[0].partition(":")[0] for row in beaten}.items():
            out_console.print(f"{name}: {reason}", soft_wrap=True, highlight=False)
    out_console.print(f"Open {out / 'speed-accuracy.html'}", soft_wrap=True)


def _draw_page(studies: "Mapping[str, TableStudy]", page: "Page", *options: Any) -> "dict[str, pd.DataFrame]":
    """Draw one page of charts or maps by the options of the command, and end it if it only asks for the plan."""
    from jamlab.studies.study import draw_tables, file_names

    measure, plan, out, force, as_json = options
    if plan:
        print_plan(studies.values(), out, as_json)
        raise typer.Exit
    check_targets(out, file_names(studies, page.name, each=False), replace=force)
    expect_output(out)
    return draw_tables(out, studies, page, measure=measure, progress=tell)


def tell(share: float, text: str) -> None:
    """Print what is done now on stderr."""
    print_stage(text)


def print_plan(studies: "Iterable[Study]", out: Path, as_json: bool) -> None:
    """Print what a measurement into a folder would do, and how long it takes."""
    plans, kinds = [study.plan(out) for study in studies], list(dict.fromkeys(study.kind for study in studies))
    rows = [[p.name, str(p.left), "unknown" if p.seconds is None else f"{p.seconds:.0f}"] for p in plans]
    total = sum(p.seconds or 0.0 for p in plans)
    if as_json:
        print_json({"plan": rows, "seconds": total})
        return
    print_table("to measure", [" or ".join(kinds), "left", "CPU s"], rows)
    long = f"{total / 60:.0f} CPU minutes" if total > 90 else f"{total:.0f} CPU seconds"
    out_console.print(f"{long}; an interrupted run goes on where it stopped", highlight=False)


@chart.command(
    "stability",
    short_help="Draw where methods fail, as shares of seeds.",
    epilog="Example: jamlab chart stability --map fire-timestep --out charts",
)
def stability(
    maps: Annotated[list[str] | None, typer.Option("--map", help="One map; can be repeated; default: all.")] = None,
    measure: Measure = False,
    plan: Plan = False,
    out: Out = Path("jamlab-charts"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw where methods fail, as shares of seeds, every number checked: maps, CSV, one HTML page."""
    from jamlab.studies.failure.map import COUNTED, PAGE, counts
    from jamlab.studies.registry import MAPS, chosen

    named = chosen(MAPS, maps or ())
    found = _draw_page(named, PAGE, measure, plan, out, force, as_json)
    if as_json:
        print_json({"out": str(out), "maps": {name: table.to_dict("records") for name, table in found.items()}})
        return
    print_table("runs by how they ended", COUNTED, counts(named, found))
    out_console.print(f"Open {out / 'stability.html'}", soft_wrap=True)


@chart.command(
    "all", short_help="Draw both, into one folder.", epilog="Example: jamlab chart all --measure --out charts"
)
def all_charts(
    measure: Measure = False, plan: Plan = False, out: Out = Path("jamlab-charts"), force: Force = False
) -> None:
    """Draw, or measure anew, all curves of speed-accuracy and all maps of stability, into one folder."""
    from jamlab.studies.registry import CHARTS, MAPS
    from jamlab.studies.study import file_names

    if plan:
        print_plan([*CHARTS.values(), *MAPS.values()], out, as_json=False)
        return
    check_targets(out, file_names(MAPS, "stability", each=False), replace=force)
    speed_accuracy(measure=measure, out=out, force=force)
    stability(measure=measure, out=out, force=force)


@chart.command(
    "flow-table",
    short_help="Measure the errors behind choose_flow.",
    epilog="Example: jamlab chart flow-table --out flow_errors.csv.xz",
)
def flow_table(
    out: Annotated[
        Path, typer.Option(help="File to write; in a checkout, jamlab/estimates/flow_errors.csv.xz.")
    ] = Path("flow_errors.csv.xz"),
    quick: Annotated[bool, typer.Option("--quick", help="A few packings and one check, as a trial.")] = False,
) -> None:
    """Measure the errors from which choose_flow chooses, in twenty minutes; goes on from a part of the file."""
    from jamlab.estimates.flow_errors import Part
    from jamlab.studies.least_model import FLOW_SEEDS, measure_errors

    expect_output(out)
    quick_parts = {part: seeds[: 2 if part == Part.CALIBRATE else 1] for part, seeds in FLOW_SEEDS.items()}
    made = measure_errors(out, quick_parts if quick else FLOW_SEEDS, progress=tell)
    (kept, of), (others, of_others) = made.kept(), made.kept(Part.SLIDING_CHECK)
    held = f"promised errors held in {kept} of {of} checks, at other beta in {others} of {of_others}"
    out_console.print(f"wrote {out}: {len(made.rows)} runs; {held}", soft_wrap=True)


@chart.command(
    "estimates",
    short_help="Measure the table behind estimate.",
    epilog="Example: jamlab chart estimates --out ways.csv.xz",
)
def estimates(
    out: Annotated[Path, typer.Option(help="File to write; in a checkout, jamlab/estimates/ways.csv.xz.")] = Path(
        "ways.csv.xz"
    ),
    seeds: Annotated[int, typer.Option(help="Packings of each way, 12 s of one core each.")] = 200,
    as_json: Json = False,
) -> None:
    """Measure the table behind `estimate`, `choose` and `scene`; goes on where it was stopped."""
    from jamlab.studies.least_model import SEEDS, make_table

    expect_output(out)
    made = make_table(out, range(SEEDS.start, SEEDS.start + seeds), progress=tell)
    count = {str(way): len(record.seeds) for way, record in made.items()}
    if as_json:
        print_json({"out": str(out), "packings": count})
        return
    print_table(f"wrote {out}", ["way", "packings"], [[way, str(number)] for way, number in count.items()])


def calibrate(
    out: Annotated[Path, typer.Option(help="Folder of the scan; run again to go on.")] = Path("calibration"),
    n: Annotated[int, typer.Option("--n", help="Number of droplets, even.")] = 32,
    seeds: Annotated[int, typer.Option(help="Number of packings for each set of parameters.")] = 8,
    workers: Annotated[int | None, typer.Option(help="Number of processes; default: all cores.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Fit gamma, ka and delta of droplets to tables 1 and 2 of Boromand et al., and show how much each matters."""
    from jamlab.studies.droplet_calibration import DropletCalibration, targets_as_text

    study = DropletCalibration(n=n, seeds=seeds)
    check_targets(out, ["sensitivity.csv"], replace=force)
    expect_output(out)
    study.run(out, tell, workers=workers)
    changes, found = study.fit(out)
    write_rows(changes, out / "sensitivity.csv")
    if as_json:
        print_json({"sensitivity": changes.to_dict("records"), **vars(found)})
        return
    table = study.changes_as_text(changes)
    print_table(table.heading, table.columns, table.rows)
    table = targets_as_text(found)
    print_table(study.words(found), table.columns, table.rows)
    for name in found.at_edge:
        err_console.print(f"{name} ended at the edge of the scan: scan again from there", soft_wrap=True)


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
    from jamlab.studies.other_codes import compare as codes

    if recipe is not None:
        folder = out or Path(f"jamlab-{recipe}")
        check_targets(folder, ["packing.npz", f"{recipe}_check.py"], replace=force)
        out_console.print(codes.write_recipe(recipe, folder, codes.jolted_minimum(n, seed, phi)[0]), soft_wrap=True)
        return
    if out is not None:
        make_folder(out)
        check_targets(out, codes.FILES, replace=force)
        expect_output(out)
    rows, analysis = codes.Comparison(sizes=(n,), seed=seed, phi=phi).measure(n, tell)
    if out is not None:
        codes.write_comparison(out, rows, analysis, n, phi)
    if as_json:
        print_json({"rows": rows, "analysis": analysis})
        return
    for table in codes.comparison_tables(rows, analysis, n, phi):
        print_table(table.heading, list(table.columns), [list(row) for row in table.rows])
    for name, note in codes.notes(rows, analysis).items():
        out_console.print(f"{name}: {note}", soft_wrap=True, highlight=False, markup=False)
    if out is not None:
        out_console.print(f"Open {out / 'index.html'}", soft_wrap=True)


study = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Evidence: figures, charts of cost against error, stability maps, comparisons.",
    epilog="Start with: jamlab study list",
)
Names = Annotated[list[str], typer.Argument(help="Studies, by the names that `jamlab study list` prints.")]
Results = Annotated[Path, typer.Option("--out", help="Folder of results: run goes on with what is there.")]


@study.command("list", epilog="Example: jamlab study list --kind map")
def list_studies(
    kind: Annotated[str | None, typer.Option(help="figure, topic, map, comparison, sizes, calibration.")] = None,
    as_json: Json = False,
) -> None:
    """List all studies."""
    from jamlab.studies.registry import studies

    chosen = {name: s for name, s in studies().items() if kind in (None, s.kind)}
    if as_json:
        print_json({name: {"kind": s.kind, "title": s.title} for name, s in chosen.items()})
        return
    print_table("studies", ["name", "kind", "shows"], [[name, s.kind, s.title] for name, s in chosen.items()])


@study.command(
    "plan",
    short_help="Count tasks that are left, and their time.",
    epilog="Example: jamlab study plan spectrum boromand-6 --out results",
)
def plan(names: Names, out: Results = Path("jamlab-results"), as_json: Json = False) -> None:
    """Say how many tasks are left and how long they take, without running anything."""
    print_plan(_chosen(names).values(), out, as_json)


@study.command(
    "run",
    short_help="Measure what a folder of results lacks.",
    epilog="Example: jamlab study run spectrum --out results",
)
def run(names: Names, out: Results = Path("jamlab-results")) -> None:
    """Measure what a folder of results does not hold; saved task by task, so that it goes on where it stopped."""
    chosen = _chosen(names)
    expect_output(out)
    for each in chosen.values():
        each.run(out, tell)
    out_console.print(f"Draw it: jamlab study draw {' '.join(names)} --from {out}", soft_wrap=True, highlight=False)


@study.command(
    "draw",
    short_help="Draw pictures, numbers and one page.",
    epilog="Example: jamlab study draw spectrum moved boromand-6 --out drawn",
)
def draw(
    names: Names,
    source: Annotated[Path | None, typer.Option("--from", help="Folder of results; default: what ships.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for PNG, PDF, CSV and HTML.")] = Path("jamlab-studies"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw studies from a folder of results, or from the data that ship: pictures, numbers, one HTML page."""
    from jamlab.studies.study import Page, file_names, source_fact, write_page

    chosen = _chosen(names)
    if source is not None and source.resolve() == out.resolve():
        raise InputError(f"--out {out}: pictures must not lie among results: name another folder")
    check_targets(out, file_names(chosen, "studies"), replace=force)
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


def _chosen(names: list[str]) -> "dict[str, Study]":
    from jamlab.studies.registry import chosen, studies

    return chosen(studies(), names, "study")


STYLES = {"differs": "red", "undecided": "yellow"}  # of verdicts in the terminal


def figure(
    names: Annotated[
        list[str],
        typer.Argument(
            help="Figures such as boromand-6; all; list: show their names; rows: print every number, of all or those "
            "named after it, with what decides its verdict; reference: reduce a campaign's tables."
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
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw figures of both papers from our own packings, and compare each of their numbers with ours."""
    from jamlab.studies import gallery
    from jamlab.studies.reference_data import has_record

    expect_output(out)
    if names == ["list"] and as_json:
        print_json(gallery.titles())
    elif names == ["list"]:
        print_table("figures", ["name", "shows"], [[name, title] for name, title in gallery.titles().items()])
    elif names[0] == "rows":
        _print_rows(names[1:] or ["all"], source, as_json)
    elif names == ["reference"]:
        if source is None:
            raise InputError("reference needs a campaign: name its file or folder with --from")
        _save_tables(source, out, commit, only or [], keep=add and has_record(out), replace=force, as_json=as_json)
    else:
        _draw_figures(names, source, out, force, as_json)


def _save_tables(
    source: Path, out: Path, commit: str, only: list[str], *, keep: bool, replace: bool = False, as_json: bool = False
) -> None:
    """Reduce the tables of a campaign to what figures are drawn from; with `keep` packings that are there stay."""
    from jamlab.studies.ensemble_tables import NAMES
    from jamlab.studies.reference_data import RECORD, TABLE_FILE, save_reference

    check_targets(out, [RECORD, *map(TABLE_FILE.format, only or NAMES)], replace=replace or keep)
    written = save_reference(source, out, commit, keep, only)
    if as_json:
        print_json({"out": str(out), "bytes": written})
    else:
        print_table(f"wrote {out}", ["table", "bytes"], [[name, str(size)] for name, size in written.items()])


def _print_rows(names: list[str], source: Path | None, as_json: bool) -> None:
    """Print every number of figures with what decides it, without drawing a picture."""
    from jamlab.studies import gallery
    from jamlab.studies.claims import first_line
    from jamlab.studies.reference_data import open_tables

    chosen, tables, claims = gallery.check_names(names), open_tables(source), []
    for name in chosen:
        found = gallery.draw(name, tables).claims
        claims += found
        for c in () if as_json else found:
            out_console.print(c.record, soft_wrap=True, highlight=False, markup=False)
    if as_json:
        print_json({"rows": [c.row() | {"family": c.choices} for c in claims]})
    else:
        out_console.print(first_line(claims), soft_wrap=True, highlight=False)


def _draw_figures(names: list[str], source: Path | None, out: Path, force: bool, as_json: bool) -> None:
    from jamlab.processes.cores import available_cores
    from jamlab.studies import gallery
    from jamlab.studies.claims import summary
    from jamlab.studies.reference_data import example_sections, open_tables
    from jamlab.studies.study import write_files

    chosen, tables = gallery.check_names(names), open_tables(source)
    whole = len(chosen) == len(gallery.FIGURES)
    check_targets(out, gallery.file_names(chosen, whole=whole), replace=force)
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
