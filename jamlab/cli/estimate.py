"""`jamlab estimate`: a mean over packings of droplets to an error asked for."""

from dataclasses import asdict
from typing import Annotated, Any

import typer

from jamlab.cli.console import out_console, print_json, print_table
from jamlab.cli.options import Json, Seed
from jamlab.cli.progress import count_bar


def estimate(
    quantity: Annotated[str, typer.Argument(help="z, g, b, rho-J, a or void_sides.")],
    error: Annotated[float, typer.Option(help="Half the width wanted of the 95 % interval, in the quantity's unit.")],
    rho: Annotated[float | None, typer.Option(help="True packing fraction, 0.84 to 0.98; not used for rho-J.")] = None,
    seed: Seed = 1,
    model: Annotated[str, typer.Option(help="auto, or sp or dp: disks or droplets only.")] = "auto",
    processes: Annotated[int, typer.Option(help="Packings made at once.")] = 1,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the plan and its cost, and make nothing.")] = False,
    as_json: Json = False,
) -> None:
    """Estimate a mean over packings of droplets to an error, from the cheapest packings that give it."""
    from jamlab.estimates.ensemble_plan import plan_estimate
    from jamlab.estimates.estimate import check_run
    from jamlab.estimates.estimate import estimate as run

    check_run(seed, processes)
    plan = plan_estimate(quantity, rho, error, model=model)
    planned = {"expected_seconds": plan.seconds, "why": plan.why}
    if dry_run:
        found: dict[str, Any] = {"packings": plan.packings, "error": plan.error}
    else:
        with count_bar("packings") as progress:
            done = run(quantity, rho, error, seed=seed, model=model, processes=processes, progress=progress)
        names = ("value", "error", "met", "packings", "left_out", "seconds", "stopped")
        found = {name: value for name, value in asdict(done).items() if name in names}
    if as_json:
        print_json(found | planned)
        return
    print_table(f"mean of {quantity}", list(found), [[_cell(value) for value in found.values()]])
    out_console.print(f"expected {plan.seconds:.3g} s. {plan.why}", soft_wrap=True, highlight=False)


def _cell(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
