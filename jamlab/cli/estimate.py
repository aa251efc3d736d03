"""`jamlab estimate`: a mean over packings of droplets to an error asked for."""

from typing import Annotated, Any

import typer

from jamlab.cli.console import print_json, print_note, print_table, progress_bar
from jamlab.cli.interruption import describe_kept
from jamlab.cli.options import Json, Seed


def estimate(
    quantity: Annotated[str, typer.Argument(help="z, g, b, rho-J, a or void_sides.")],
    error: Annotated[float, typer.Option(help="Target half-width of the 95 % interval, in the quantity's unit.")],
    rho: Annotated[float | None, typer.Option(help="True packing fraction, 0.84 to 0.98; not used for rho-J.")] = None,
    seed: Seed = 1,
    model: Annotated[str, typer.Option(help="auto, or sp or dp: disks or droplets only.")] = "auto",
    processes: Annotated[int, typer.Option(help="Packings made at once.")] = 1,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the plan and its cost, and make nothing.")] = False,
    as_json: Json = False,
) -> None:
    """Estimate a mean over packings of droplets to a requested uncertainty, from the cheapest packings."""
    from jamlab.estimates.choice import Why
    from jamlab.estimates.estimate import estimate as run
    from jamlab.estimates.estimate import estimate_cost

    said = ""

    def show(share: float, text: str) -> None:
        nonlocal said
        said = text
        progress(share, text)

    found: dict[str, Any]
    if dry_run:
        choice = estimate_cost(quantity, rho, error, model=model)
        found = {"packings": choice.packings, "error": choice.bound[quantity]}
    else:
        describe_kept(lambda: f"so far {said or 'no packing'}; nothing was written")
        with progress_bar("estimate") as progress:
            made = run(quantity, rho, error, seed=seed, model=model, processes=processes, progress=show)
        choice = made.choice
        found = {"value": made.value, "packings": made.packings, "error": made.ci95, "met": made.met}
        found |= {"left_out": made.left_out, "seconds": made.seconds, "stopped": str(made.stopped)}
    options: list[dict[str, Any]] = [
        {str(name): _plain(value) for name, value in row.items()} for row in choice.options.to_dict("records")
    ]
    if as_json:
        print_json(found | {"expected_seconds": choice.seconds, "options": options})
        return
    if not dry_run:
        print_table(f"mean of {quantity}", list(found), [[_cell(value) for value in found.values()]])
    shown = [row for row in options if row["seconds"] is not None]
    shown.sort(key=lambda row: (row["why"] != Why.TAKEN, row["why"] != Why.COSTS_MORE, row["seconds"]))
    columns = ["way", "packings", "seconds", "error", "why"]
    print_table(
        f"{choice.packings} packings of {choice.way} are expected to give {quantity} within "
        f"{choice.bound[quantity]:.2g} (95 %) in {choice.seconds:.3g} s",
        columns,
        [[_cell(row[name]) for name in columns] for row in shown],
    )
    if silent := len(options) - len(shown):
        print_note(f"no promise of {silent} more: too few packings in the table")


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if value == value else None
    return value if isinstance(value, int) else str(value)


def _cell(value: object) -> str:
    return "" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)
