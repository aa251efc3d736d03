"""Set a number of a paper beside ours and say whether the two agree."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.published_numbers import Published

DP_UNKNOWN = "the paper prints no line tension, area stiffness or rim width"  # why numbers of droplets may differ


@dataclass(frozen=True)
class Claim:
    """One number of a paper beside ours.

    Attributes:
        figure: name, such as "boromand-6".
        quantity: in plain words.
        value, low, high: measured, with the ends of its 95 % interval; nan where the data do not give it.
        paper, margin, relation: see `jamlab.statistics.published_numbers.Published`.
        how: window or rule of the measurement.
        reason: why ours differs, where that is known.
    """

    figure: str
    quantity: str
    value: float
    low: float
    high: float
    paper: float
    margin: float = 0.0
    relation: str = "="
    how: str = ""
    reason: str = ""

    @property
    def measured(self) -> bool:
        """Whether the data give a value with an interval."""
        return bool(np.isfinite([self.value, self.low, self.high]).all())

    @property
    def undecided(self) -> bool:
        """Whether the interval meets the paper's value, and zero or twice that value as well: it would fit anything.

        A value of zero has no such scale; its margin alone decides.
        """
        above, below = self.high >= self.paper - self.margin, self.low <= self.paper + self.margin
        wide = any(self.low <= other <= self.high for other in (0.0, 2 * self.paper))
        return self.measured and self.paper != 0 and above and below and wide

    @property
    def agrees(self) -> bool:
        """Whether the interval meets the paper's value within its margin, or lies on the side of its bound."""
        above, below = self.high >= self.paper - self.margin, self.low <= self.paper + self.margin
        meets = {"=": above and below, ">": above, "<": below}[self.relation]
        return self.measured and meets and not self.undecided

    @property
    def verdict(self) -> str:
        """One of: agrees; undecided; differs, with the reason or "open"; not measured, with the cause."""
        if np.isfinite(self.value) and not self.measured:
            return "not measured: too few packings for an interval"
        if not self.measured:
            return f"not measured: {self.how or 'too few data'}"
        if self.undecided:
            return "undecided: the interval holds zero or twice the paper's value too, it takes more packings"
        return "agrees" if self.agrees else f"differs: {self.reason or 'open'}"

    @property
    def line(self) -> str:
        """One line for the terminal."""
        return (
            f"{self.figure}: {self.quantity} = {self.value:.4g} [{self.low:.4g}, {self.high:.4g}], "
            f"paper {self.paper_text}: {self.verdict}"
        )

    @property
    def paper_text(self) -> str:
        """The paper's value as text."""
        sign = "" if self.relation == "=" else f"{self.relation} "
        return f"{sign}{self.paper:.4g}" + (f" ± {self.margin:.2g}" if self.margin else "")

    def row(self) -> dict[str, Any]:
        """Plain values for CSV and JSON."""
        return asdict(self) | {"verdict": self.verdict}


def claim(
    figure: str, quantity: str, found: Interval | None, paper: Published, *, how: str = "", reason: str = ""
) -> Claim:
    """Make a claim from an interval, None where the data do not give one."""
    value, low, high = (np.nan,) * 3 if found is None else (float(v) for v in (found.value, found.low, found.high))
    return Claim(figure, quantity, value, low, high, *paper, how=how, reason=reason)
