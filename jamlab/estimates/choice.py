"""What was chosen, the cheapest of what does, beside what else there was: one class and one table for all choices."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import pandas as pd

from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.rheology.drag_law import DragLaw


class Why(StrEnum):
    """What became of an option, the column `why` of all options."""

    TAKEN = "taken"
    COSTS_MORE = "more expensive"
    LARGE = "error too large"
    UNSURE = "own mean too uncertain"  # the part of the error that more packings do not reduce
    FAILS = "too few values"  # too few packings of the way have the quantity there
    UNKNOWN = "no promise"  # the table has too few packings


def judge(rows: Sequence[dict[str, Any]], cost: str = "", nearest: str = "") -> tuple[pd.DataFrame, int | None]:
    """Build the table of options, and say which row is taken: the first of the cheapest, or just the first, of those
    with `why` None; else, if there is a column `nearest`, the one whose value of it is least; else none."""
    free = [k for k, option in enumerate(rows) if option["why"] is None]
    known = [k for k, option in enumerate(rows) if nearest and not math.isnan(option[nearest])]
    row = min(free, key=lambda k: rows[k].get(cost, 0.0), default=None)
    if row is None:
        row = min(known, key=lambda k: rows[k][nearest], default=None)
    why = [Why.TAKEN if k == row else option["why"] or Why.COSTS_MORE for k, option in enumerate(rows)]
    return pd.DataFrame(rows).assign(why=list(map(str, why))), row


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Choice(Result):
    """The least model that does, of `choose`, `estimate_cost` or `choose_flow`.

    Attributes:
        way: how packings are made: model, contact form, vertices, tolerance. Of a flow its model: "static modulus",
            "linear spectrum", "equivalent damping", "oscillation", "linear flow" or "flow".
        bound: quantity -> error that 95 % of new packings stay below, after correction. Of `choose` against default
            droplets; of `estimate_cost` half the width of the 95 % interval; of a flow relative, of G* or the stress,
            with half the 95 % interval of its average.
        options: pandas DataFrame, a row for each way: `way`, `error` (of `choose` one column for each quantity, such
            as `error_z`), what it costs, `seconds` or `strain`, and `why`, "taken" or why not, see
            `jamlab.estimates.choice.Why`.
        seconds, packings: expected CPU time on the machine of the table, and packings in all; 0 of a flow.
        correction: quantity -> what to add to it as measured.
        function, arguments: of a flow the public function that does it, and its arguments but the packing, see `run`.
        strain: of a flow, to shear in all: start-up and average of steady flow, or all cycles; 0 if nothing is run.
        modulus: of a flow, G* by the way chosen, if nothing is run.
        outside: what of packing and flow lies outside the table, for which it promises nothing.

    Example:
        >>> jamlab.choose(rho=0.87, error={"z": 0.25}, n=64)
        Choice(64 disks: z to 0.15, 1 packing in 0.82 s; cheapest of 4 ways that serve)
        >>> p = jamlab.pack(n=64, pressure=1e-2, seed=1)
        >>> choice = jamlab.choose_flow(p, omega=1.0, amplitude=1e-5, error=0.05)
        >>> choice.way, choice.call[:37]
        ('linear spectrum', 'jamlab.complex_modulus(p, omega=[1.0]')
    """

    _rows = ("options",)

    way: Any
    bound: dict[str, float]
    options: pd.DataFrame
    seconds: float = 0.0
    packings: int = 0
    correction: dict[str, float] = field(default_factory=dict)
    function: Callable[..., Any] | None = None
    arguments: dict[str, Any] = field(default_factory=dict)
    strain: float = 0.0
    modulus: complex | None = None
    outside: tuple[str, ...] = ()

    def _columns(self) -> dict[str, Any]:
        """The options."""
        return {str(name): self.options[name].to_numpy() for name in self.options}

    @property
    def call(self) -> str:
        """What `run` does with a packing p, as it is written."""
        given = (f"{k}={'jamlab.' * isinstance(v, DragLaw)}{v!r}" for k, v in self.arguments.items())
        return f"jamlab.{getattr(self.function, '__name__', '')}({', '.join(['p', *given])})"

    def run(self, packing: Packing) -> Any:
        """Do with a packing what was chosen of a flow, and return what the function returns."""
        return self.function and self.function(packing, **self.arguments)

    def __repr__(self) -> str:
        serve = int(self.options["why"].isin([Why.TAKEN, Why.COSTS_MORE]).sum())
        rank = f"cheapest of {serve} ways that serve" if serve > 1 else "the only way that serves"
        words = [write_bounds(self.bound)]
        words += [f"{self.packings} packing{'s' * (self.packings > 1)} in {self.seconds:.2g} s"] * bool(self.packings)
        words += [f"by {self.call}"] * bool(self.function)
        return "; ".join([f"Choice({self.way}: {', '.join(words)}", rank, *self.outside]) + ")"


def write_bounds(bound: dict[str, float]) -> str:
    """Write errors that a way keeps, such as "z to 0.1"."""
    return ", ".join(f"{name} to {value:.2g}" for name, value in bound.items())
