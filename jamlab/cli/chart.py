"""`jamlab chart`: speed, accuracy and limits of methods."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.console import out_console, print_json, print_stage, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Json

chart = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="What methods cost, how accurate they are, and where they fail.",
    epilog="Start with: jamlab chart speed-accuracy --quick --out charts",
)
Out = Annotated[Path, typer.Option(help="Folder for CSV, PNG and HTML.")]
Quick = Annotated[bool, typer.Option("--quick", help="Smaller and fewer packings, under a minute.")]


@chart.command("speed-accuracy", epilog="Example: jamlab chart speed-accuracy --topic minimisers --out charts")
def speed_accuracy(
    topic: Annotated[list[str] | None, typer.Option(help="One topic; can be repeated; default: all.")] = None,
    quick: Quick = False,
    out: Out = Path("jamlab-charts"),
    as_json: Json = False,
) -> None:
    """Chart time and error of every method against a stated reference: Pareto charts, CSV, one HTML page."""
    from dataclasses import asdict

    from jamlab.benchmarks.speed_accuracy.page import defaults_off_the_front
    from jamlab.benchmarks.speed_accuracy.page import speed_accuracy as run

    expect_output(out)
    found = run(out, topic or (), quick=quick, progress=print_stage)
    beaten = defaults_off_the_front(found)
    if as_json:
        trials: dict[str, Any] = {name: [asdict(t) for t in rows] for name, rows in found.items()}
        print_json({"out": str(out), "defaults_off_the_front": beaten, "topics": trials})
        return
    for line in beaten:
        out_console.print(f"a default that another method beats: {line}", soft_wrap=True, highlight=False)
    out_console.print(f"Open {out / 'speed-accuracy.html'}", soft_wrap=True)


@chart.command("stability", epilog="Example: jamlab chart stability --quick --out charts")
def stability(
    maps: Annotated[list[str] | None, typer.Option("--map", help="One map; can be repeated; default: all.")] = None,
    quick: Quick = False,
    out: Out = Path("jamlab-charts"),
    as_json: Json = False,
) -> None:
    """Map where methods fail, one verdict for each run: maps, CSV, one HTML page."""
    from dataclasses import asdict

    from jamlab.benchmarks.failure_maps.page import counts
    from jamlab.benchmarks.failure_maps.page import stability as run
    from jamlab.benchmarks.failure_maps.verdict import VERDICTS

    expect_output(out)
    found = run(out, maps or (), quick=quick, progress=print_stage)
    if as_json:
        runs: dict[str, Any] = {name: [asdict(r) for r in rows] for name, rows in found.items()}
        print_json({"out": str(out), "maps": runs})
        return
    print_table("runs by verdict", ["map", *VERDICTS], counts(found))
    out_console.print(f"Open {out / 'stability.html'}", soft_wrap=True)


@chart.command("table", epilog="Example: jamlab chart table --out model_choice.json")
def table(
    out: Annotated[Path, typer.Option(help="JSON file to write; in a checkout, beside model_choice.py.")] = Path(
        "model_choice.json"
    ),
    quick: Annotated[bool, typer.Option("--quick", help="Two packings at two levels, as a trial.")] = False,
) -> None:
    """Measure the table from which model="auto" chooses, in under ten minutes."""
    from jamlab.benchmarks.model_table import make_table

    expect_output(out)
    smaller: dict[str, Any] = {"n": 16, "seeds": range(1001, 1003), "levels": (0.87, 0.9)} if quick else {}
    made = make_table(out, progress=print_stage, **smaller)
    out_console.print(f"wrote {out}: {len(made['rows'])} rows in {made['provenance']['wall_time']} s", soft_wrap=True)


@chart.command("estimates", epilog="Example: jamlab chart estimates --out ways.csv.gz")
def estimates(
    out: Annotated[Path, typer.Option(help="File to write; in a checkout, jamlab/estimates/ways.csv.gz.")] = Path(
        "ways.csv.gz"
    ),
    seeds: Annotated[int, typer.Option(help="Packings of each way, 12 s of one core each.")] = 100,
    trials: Annotated[int, typer.Option(help="Requests in worlds drawn from the table, to check intervals.")] = 1200,
    as_json: Json = False,
) -> None:
    """Measure the table behind `jamlab estimate`, and check its intervals; goes on where it was stopped."""
    from jamlab.benchmarks.estimate_calibration import calibrate, summarize
    from jamlab.benchmarks.estimate_table import SEEDS, make_table

    expect_output(out)
    made = make_table(out, range(SEEDS.start, SEEDS.start + seeds), progress=print_stage)
    checked = summarize(calibrate(made, trials))
    if as_json:
        print_json({"out": str(out), "calibration": checked})
        return
    lines = [[name, f"{share:.3f}"] for name, share in checked.items()]
    print_table(f"share of {trials} intervals that hold the truth", ["requests", "share"], lines)
