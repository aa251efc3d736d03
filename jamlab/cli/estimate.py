"""`jamlab estimate`: a mean over packings of droplets to an error asked for, or what it will cost."""

from typing import TYPE_CHECKING, Any

from jamlab.arguments.choices import ModelOrAuto, Registered
from jamlab.cli.console import print_json, print_line, print_note, print_table, progress_bar
from jamlab.cli.interruption import describe_kept
from jamlab.cli.options import command
from jamlab.errors import InputError

if TYPE_CHECKING:
    from jamlab.estimates.choice import Choice

_COLUMNS = ("way", "packings", "seconds", "error", "why")  # of the options


@command("estimate", "estimate_cost")
def estimate(
    quantity: str,
    *,
    error: float,
    rho: float | None,
    model: ModelOrAuto,
    seed: int,
    workers: int,
    dry_run: bool,
    json: bool,
) -> None:
    """Estimate a mean over packings of droplets to a given error.

    The mean is over packings of 64 droplets with default parameters in a fixed box; the cheapest packings that give it
    are made, and none is kept.
    """
    from jamlab.estimates.estimate import estimate as run
    from jamlab.estimates.estimate import estimate_cost
    from jamlab.estimates.ways import ONSET

    if rho is None and quantity != ONSET:
        raise InputError(f"give --rho, the true packing fraction at which {quantity} is estimated")
    asked: Any = quantity  # which the call refuses if it is none
    if dry_run:
        choice = estimate_cost(asked, rho, error, model=Registered(model))
        if json:
            print_json(_plan(choice, quantity))
        else:
            _print_plan(choice, quantity)
        return
    told = "no packing"

    def tell(share: float, text: str) -> None:
        nonlocal told
        told = text
        progress(share, text)

    describe_kept(lambda: f"so far {told}; nothing was written")
    with progress_bar("estimate") as progress:
        found = run(asked, rho, error, seed=seed, model=Registered(model), workers=workers, progress=tell)
    numbers = {name: getattr(found, name) for name in ("value", "ci95", "met", "packings", "left_out", "seconds")}
    if json:
        rows = {"seeds": found.seeds.tolist(), "values": found.values.tolist()}
        print_json({"quantity": quantity, **numbers, **rows, "plan": _plan(found.choice, quantity)})
        return
    missed = "" if found.met else f": {error:g} was NOT MET"
    print_line(f"{quantity} = {found.value:.6g}, within {found.ci95:.2g} (95 %){missed}")
    also = f", {found.left_out} left out" * bool(found.left_out)
    print_note(f"{found.packings} packings of {found.choice.way}{also}, {found.seconds:.3g} s of CPU time")


def _plan(choice: "Choice", quantity: str) -> dict[str, Any]:
    """Plain numbers; None where nothing is known."""
    rows = [{name: _plain(row[name]) for name in _COLUMNS} for row in choice.options.to_dict("records")]
    expected = {"packings": choice.packings, "error": choice.bound[quantity], "seconds": choice.seconds}
    return {"way": str(choice.way), **expected, "options": rows}


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if value == value else None
    return value if isinstance(value, int) else str(value)


def _print_plan(choice: "Choice", quantity: str) -> None:
    plan = _plan(choice, quantity)
    known = [row for row in plan["options"] if row["seconds"] is not None]
    known.sort(key=lambda row: (row["way"] != plan["way"], row["seconds"]))
    cells = [["" if row[n] is None else f"{row[n]:.3g}" if n in ("seconds", "error") else str(row[n]) for n in _COLUMNS]
             for row in known]  # fmt: skip
    print_table(f"mean of {quantity}", _COLUMNS, cells)
    print_line(
        f"{choice.packings} packings of {choice.way}: within {plan['error']:.2g} (95 %), {choice.seconds:.3g} s of CPU "
        "time"
    )
