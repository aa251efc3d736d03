"""Set a number of a paper beside ours and say whether the two agree, and if not, why."""

from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.published_numbers import Published

RESOLVED = 0.25  # half-width of an interval over the scale of a number up to which it could have disagreed


class Verdict(StrEnum):
    """What a number of a paper comes to.

    Attributes:
        AGREES: the interval meets the paper's value within its margin, and is narrow enough to have missed it.
        DIFFERS: the interval lies elsewhere; the cause stands beside it, with the figure or command that shows it.
        INCONSISTENT: the paper contradicts itself, so that no measurement could settle the number.
        CALIBRATED: parameters that the paper does not print were chosen to meet it: no independent test.
        UNDECIDED: the interval meets the value, but is so wide that it would meet many others too.
        MISSING: the data do not give it with an interval, which takes five packings.
    """

    AGREES = "agrees"
    DIFFERS = "differs"
    INCONSISTENT = "paper inconsistent"
    CALIBRATED = "calibrated"
    UNDECIDED = "undecided"
    MISSING = "not measured"


@dataclass(frozen=True)
class Claim:
    """One number of a paper beside ours.

    Attributes:
        figure: name, such as "boromand-6".
        quantity: in plain words.
        value, low, high: measured, with the ends of its 95 % interval; nan where the data do not give it.
        paper, margin, relation, scale: see `jamlab.statistics.published_numbers.Published`.
        how: window, rule and convention of the measurement.
        cause: why ours differs, in numbers where they come from the same tables.
        shown_by: figure or command that shows the cause or the contradiction.
        contradiction: of the paper with itself.
        calibrated: why the number is no independent test.
    """

    figure: str
    quantity: str
    value: float
    low: float
    high: float
    paper: float
    margin: float = 0.0
    relation: str = "="
    scale: float = 0.0
    how: str = ""
    cause: str = ""
    shown_by: str = ""
    contradiction: str = ""
    calibrated: str = ""

    @property
    def measured(self) -> bool:
        """Whether the data give a value with an interval."""
        return bool(np.isfinite([self.value, self.low, self.high]).all())

    @property
    def meets(self) -> bool:
        """Whether the interval meets the paper's value within its margin, or lies on the side of its bound."""
        above, below = self.high >= self.paper - self.margin, self.low <= self.paper + self.margin
        return self.measured and {"=": above and below, ">": above, "<": below}[self.relation]

    @property
    def resolved(self) -> bool:
        """Whether the interval is narrow enough to have disagreed; that of a bound must lie on one side of it."""
        if self.relation != "=":
            return not self.low < self.paper < self.high
        return 0.5 * (self.high - self.low) <= max(RESOLVED * (self.scale or abs(self.paper)), self.margin)

    @property
    def verdict(self) -> Verdict:
        """See `Verdict`."""
        if self.contradiction:
            return Verdict.INCONSISTENT
        if not self.measured:
            return Verdict.MISSING
        if self.calibrated:
            return Verdict.CALIBRATED
        if not self.meets:
            return Verdict.DIFFERS
        return Verdict.AGREES if self.resolved else Verdict.UNDECIDED

    @property
    def agrees(self) -> bool:
        """Whether the verdict is `Verdict.AGREES`."""
        return self.verdict is Verdict.AGREES

    @property
    def reason(self) -> str:
        """What stands behind the verdict; "" where ours agrees."""
        shown = f" ({self.shown_by})" if self.shown_by else ""
        if self.verdict is Verdict.MISSING:
            why = "no interval: fewer than five packings, or most of their resamples have no such value"
            return why if np.isfinite(self.value) else self.how or "too few data"
        return {
            Verdict.AGREES: "",
            Verdict.DIFFERS: (self.cause or "no cause has been measured in these data") + shown,
            Verdict.INCONSISTENT: self.contradiction + shown,
            Verdict.CALIBRATED: f"{'meets it; ' if self.meets else 'misses it; '}{self.calibrated}{shown}",
            Verdict.UNDECIDED: f"half the interval is {0.5 * (self.high - self.low):.2g}: it takes more packings",
        }[self.verdict]

    @property
    def text(self) -> str:
        """The verdict and what stands behind it."""
        return f"{self.verdict}: {self.reason}" if self.reason else str(self.verdict)

    @property
    def line(self) -> str:
        """One line for the terminal."""
        return (
            f"{self.figure}: {self.quantity} = {self.value:.4g} [{self.low:.4g}, {self.high:.4g}], "
            f"paper {self.paper_text}: {self.text}"
        )

    @property
    def paper_text(self) -> str:
        """The paper's value as text."""
        sign = "" if self.relation == "=" else f"{self.relation} "
        return f"{sign}{self.paper:.4g}" + (f" ± {self.margin:.2g}" if self.margin else "")

    def row(self) -> dict[str, Any]:
        """Plain values for CSV and JSON."""
        return asdict(self) | {"verdict": str(self.verdict), "reason": self.reason}


def claim(figure: str, quantity: str, found: Interval | None, paper: Published, **words: str) -> Claim:
    """Make a claim from an interval, None where the data do not give one.

    Args:
        words: how, cause, shown_by, contradiction and calibrated of `Claim`.
    """
    value, low, high = (np.nan,) * 3 if found is None else (float(v) for v in (found.value, found.low, found.high))
    number = {"paper": paper.value, "margin": paper.margin, "relation": paper.relation, "scale": paper.scale}
    return Claim(figure, quantity, value, low, high, **number | words)  # type: ignore[arg-type]
