"""`jamlab chart`: speed, accuracy and limits of methods."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.console import err_console, out_console, print_json, print_stage, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Json, Seed

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


@chart.command("speed-accuracy", epilog="Example: jamlab chart speed-accuracy --topic spectrum --out charts")
def speed_accuracy(
    topic: Annotated[list[str] | None, typer.Option(help="One topic; can be repeated; default: all.")] = None,
    measure: Measure = False,
    plan: Plan = False,
    out: Out = Path("jamlab-charts"),
    as_json: Json = False,
) -> None:
    """Draw cost against error of every method along its dial, over many packings: curves, CSV, one HTML page."""
    from dataclasses import asdict

    from jamlab.studies.cost.chart import OFF_COLUMNS, defaults_off_the_front, write_charts
    from jamlab.studies.registry import CHARTS, chosen

    charts = chosen(CHARTS, topic or ())
    if plan:
        print_plan(charts.values(), out, as_json)
        return
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


@chart.command("stability", epilog="Example: jamlab chart stability --map fire-timestep --out charts")
def stability(
    maps: Annotated[list[str] | None, typer.Option("--map", help="One map; can be repeated; default: all.")] = None,
    measure: Measure = False,
    plan: Plan = False,
    out: Out = Path("jamlab-charts"),
    as_json: Json = False,
) -> None:
    """Draw where methods fail, as shares of seeds, every number checked: maps, CSV, one HTML page."""
    from jamlab.studies.failure.map import COUNTED, counts, write_maps
    from jamlab.studies.registry import MAPS, chosen

    named = chosen(MAPS, maps or ())
    if plan:
        print_plan(named.values(), out, as_json)
        return
    expect_output(out)
    found = write_maps(out, named, measure=measure, progress=tell)
    if as_json:
        cells: dict[str, Any] = {name: table.to_dict("records") for name, table in found.items()}
        print_json({"out": str(out), "maps": cells})
        return
    print_table("runs by how they ended", COUNTED, counts(named, found))
    out_console.print(f"Open {out / 'stability.html'}", soft_wrap=True)


@chart.command("all", epilog="Example: jamlab chart all --measure --out charts")
def all_charts(measure: Measure = False, plan: Plan = False, out: Out = Path("jamlab-charts")) -> None:
    """Draw, or measure anew, all curves of speed-accuracy and all maps of stability, into one folder."""
    if plan:
        from jamlab.studies.registry import CHARTS, MAPS

        print_plan([*CHARTS.values(), *MAPS.values()], out, as_json=False)
        return
    speed_accuracy(measure=measure, out=out)
    stability(measure=measure, out=out)


@chart.command("flow-table", epilog="Example: jamlab chart flow-table --out flow_errors.csv.gz")
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


@chart.command("estimates", epilog="Example: jamlab chart estimates --out ways.csv.gz")
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


def calibrate(
    out: Annotated[Path, typer.Option(help="Folder of the scan; run again to go on.")] = Path("calibration"),
    n: Annotated[int, typer.Option("--n", help="Number of droplets, even.")] = 32,
    seeds: Annotated[int, typer.Option(help="Number of packings for each set of parameters.")] = 8,
    workers: Annotated[int | None, typer.Option(help="Number of processes; default: all cores.")] = None,
    as_json: Json = False,
) -> None:
    """Fit gamma, ka and delta of droplets to tables 1 and 2 of Boromand et al., and show how much each matters."""
    from jamlab.studies.droplet_calibration import DropletCalibration, targets_as_text

    study = DropletCalibration(n=n, seeds=seeds)
    expect_output(out)
    study.run(out, tell, workers=workers)
    changes, found = study.fit(out)
    changes.to_csv(out / "sensitivity.csv", index=False)
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
    as_json: Json = False,
) -> None:
    """Compare energy, minimum, time on one core with jax-md, JaxDEM, OpenMM, ASE, LAMMPS; analysis: freud, matscipy."""
    from jamlab.storage.atomic_file import make_folder
    from jamlab.studies.other_codes.compare import (
        Comparison,
        comparison_tables,
        jolted_minimum,
        notes,
        summary,
        write_comparison,
        write_recipe,
    )

    if recipe is not None:
        folder = out or Path(f"jamlab-{recipe}")
        out_console.print(write_recipe(recipe, folder, jolted_minimum(n, seed, phi)[0]), soft_wrap=True)
        return
    if out is not None:
        make_folder(out)
        expect_output(out)
    rows, analysis = Comparison(sizes=(n,), seed=seed, phi=phi).measure(n, tell)
    if out is not None:
        write_comparison(out, rows, analysis, n, phi)
    if as_json:
        print_json(summary(rows, analysis))
        return
    for table in comparison_tables(rows, analysis, n, phi):
        print_table(table.heading, list(table.columns), [list(row) for row in table.rows])
    for name, note in notes(rows, analysis).items():
        out_console.print(f"{name}: {note}", soft_wrap=True, highlight=False, markup=False)
    if out is not None:
        out_console.print(f"Open {out / 'index.html'}", soft_wrap=True)
