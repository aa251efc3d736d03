"""`jamlab chart`: speed, accuracy and limits of methods."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.console import out_console, print_json, print_stage, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Force, Json
from jamlab.storage.atomic_file import check_targets

if TYPE_CHECKING:
    from jamlab.studies.study import Study

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
    from dataclasses import asdict

    from jamlab.studies.cost.chart import OFF_COLUMNS, defaults_off_the_front, write_charts
    from jamlab.studies.page import file_names
    from jamlab.studies.registry import CHARTS, chosen

    charts = chosen(CHARTS, topic or ())
    if plan:
        print_plan(charts.values(), out, as_json)
        return
    check_targets(out, file_names(charts, "speed-accuracy", each=False), replace=force)
    expect_output(out)
    found = write_charts(out, charts, measure=measure, progress=tell)
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
    from jamlab.studies.failure.map import COUNTED, counts, write_maps
    from jamlab.studies.page import file_names
    from jamlab.studies.registry import MAPS, chosen

    named = chosen(MAPS, maps or ())
    if plan:
        print_plan(named.values(), out, as_json)
        return
    check_targets(out, file_names(named, "stability", each=False), replace=force)
    expect_output(out)
    found = write_maps(out, named, measure=measure, progress=tell)
    if as_json:
        cells: dict[str, Any] = {name: table.to_dict("records") for name, table in found.items()}
        print_json({"out": str(out), "maps": cells})
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
    from jamlab.studies.page import file_names
    from jamlab.studies.registry import CHARTS, MAPS

    if plan:
        print_plan([*CHARTS.values(), *MAPS.values()], out, as_json=False)
        return
    check_targets(out, file_names(MAPS, "stability", each=False), replace=force)
    speed_accuracy(measure=measure, out=out, force=force)
    stability(measure=measure, out=out, force=force)


@chart.command(
    "flow-table",
    short_help="Measure the errors behind choose_flow.",
    epilog="Example: jamlab chart flow-table --out flow_errors.csv.gz",
)
def flow_table(
    out: Annotated[
        Path, typer.Option(help="File to write; in a checkout, jamlab/estimates/flow_errors.csv.gz.")
    ] = Path("flow_errors.csv.gz"),
    quick: Annotated[bool, typer.Option("--quick", help="A few packings and one check, as a trial.")] = False,
) -> None:
    """Measure the errors from which choose_flow chooses, in twenty minutes; goes on from a part of the file."""
    from jamlab.estimates.flow_errors import CALIBRATE, SLIDING_CHECK
    from jamlab.studies.least_model.flow_errors import SEEDS, measure_errors

    expect_output(out)
    quick_parts = {part: seeds[: 2 if part == CALIBRATE else 1] for part, seeds in SEEDS.items()}
    made = measure_errors(out, quick_parts if quick else SEEDS, progress=tell)
    (kept, of), (others, of_others) = made.kept(), made.kept(SLIDING_CHECK)
    held = f"promised errors held in {kept} of {of} checks, at other beta in {others} of {of_others}"
    out_console.print(f"wrote {out}: {len(made.rows)} runs; {held}", soft_wrap=True)


@chart.command(
    "estimates",
    short_help="Measure the table behind estimate.",
    epilog="Example: jamlab chart estimates --out ways.csv.gz",
)
def estimates(
    out: Annotated[Path, typer.Option(help="File to write; in a checkout, jamlab/estimates/ways.csv.gz.")] = Path(
        "ways.csv.gz"
    ),
    seeds: Annotated[int, typer.Option(help="Packings of each way, 12 s of one core each.")] = 200,
    as_json: Json = False,
) -> None:
    """Measure the table behind `estimate`, `choose` and `scene`; goes on where it was stopped."""
    from jamlab.studies.least_model.estimate_table import SEEDS, make_table

    expect_output(out)
    made = make_table(out, range(SEEDS.start, SEEDS.start + seeds), progress=tell)
    count = {str(way): len(record.seeds) for way, record in made.items()}
    if as_json:
        print_json({"out": str(out), "packings": count})
        return
    print_table(f"wrote {out}", ["way", "packings"], [[way, str(number)] for way, number in count.items()])
