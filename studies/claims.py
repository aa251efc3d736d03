"""A claim sets a number of a paper beside ours, and says whether the two agree, and if not, why."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.statistics.bootstrap import Interval
from studies.published_numbers import Published

SUMMARY = "summary.txt"  # beside the figures, and beside the reference data
_OF_NO_PAPER = ("dynamics-", "beyond-")  # figures whose numbers neither paper has


class Verdict(StrEnum):
    """What a number of a paper comes to."""

    # by the rule of `Claim.compared`; the cause of a difference stands beside it, with the figure that shows it
    AGREES = "agrees"
    DIFFERS = "differs"
    INCONSISTENT = "paper inconsistent"  # the paper contradicts itself, so that no measurement could settle the number
    CALIBRATED = "calibrated"  # parameters that the paper does not print were chosen to meet it: no independent test
    UNDECIDED = "undecided"  # neither, by the same rule
    MISSING = "not measured"  # the data do not give it with an interval, which takes five packings


class Kind(StrEnum):
    """How much a number tells."""

    MEASURED = "measured"  # it could have come out otherwise
    IDENTITY = "identity"  # it follows from counting or from the equations, whatever the packings are
    DUPLICATE = "duplicate"  # another claim measures the same number on the same packings
    FIT_TARGET = "fit target"  # parameters that the paper does not print were chosen to meet it


@dataclass(frozen=True)
class Claim:
    """One number of a paper beside ours."""

    figure: str  # name, such as "boromand-6"
    quantity: str  # in plain words
    # value, low, high: measured, with the ends of its 95 % interval; nan where the data do not give it
    value: float
    low: float
    high: float
    # paper, margin, relation: see `studies.published_numbers.Published`
    paper: float
    margin: float = 0.0
    relation: str = "="
    how: str = ""  # window, rule and convention of the measurement
    cause: str = ""  # why ours differs, in numbers where they come from the same tables
    shown_by: str = ""  # figure or command that shows the cause or the contradiction
    contradiction: str = ""  # of the paper with itself
    calibrated: str = ""  # why the number is no independent test
    unlike: str = ""  # why ours was measured under other conditions, so that a difference would tell nothing
    where: str = ""  # section, figure or table of the paper
    kind: Kind = Kind.MEASURED  # see `Kind`
    family: Mapping[str, Interval] = field(default_factory=dict, hash=False)  # other windows, offsets, sizes -> number

    @property
    def measured(self) -> bool:
        """Whether the data give a value with an interval."""
        return bool(np.isfinite([self.value, self.low, self.high]).all())

    @property
    def systematic(self) -> tuple[float, float]:
        """How far the family lies below and above the value; the interval over packings knows nothing of it."""
        moved = [float(other.value) - self.value for other in self.family.values()]
        return max([0.0, *(-m for m in moved)]), max([0.0, *moved])

    @property
    def intervals(self) -> list[tuple[float, float]]:
        """Ends of the interval of the number, and of that of every choice, each with the packings that it has. One of
        too few packings for an interval has that of the number, moved by as much as it lies off."""
        every = [(self.low, self.high)]
        for other in self.family.values():
            ends, moved = (float(other.low), float(other.high)), float(other.value) - self.value
            every.append(ends if np.isfinite(ends).all() else (self.low + moved, self.high + moved))
        return every

    @property
    def allowed(self) -> tuple[float, float]:
        """Lowest and highest number that the data allow by any choice."""
        lows, highs = zip(*self.intervals, strict=True)
        return min(lows), max(highs)

    @property
    def asked(self) -> tuple[float, float]:
        """Lowest and highest number that the paper's words mean: its value within its margin, or all beyond a bound."""
        low, high = self.paper - self.margin, self.paper + self.margin
        return {"=": (low, high), ">": (low, np.inf), "<": (-np.inf, high)}[self.relation]

    @property
    def compared(self) -> Verdict:
        """The rule, the same for every number, and for every choice of the fit with its own interval: it agrees if by
        each all that the packings allow is what the paper's words mean, differs if by each nothing is, all on the same
        side, and is undecided else. If choices lie on either side, one between them would meet the paper."""
        (low, high), (least, most) = self.allowed, self.asked
        if high < least or most < low:
            return Verdict.DIFFERS
        return Verdict.AGREES if least <= low and high <= most else Verdict.UNDECIDED

    @property
    def verdict(self) -> Verdict:
        """See `Verdict`."""
        if self.contradiction:
            return Verdict.INCONSISTENT
        if not self.measured:
            return Verdict.MISSING
        if self.calibrated:
            return Verdict.CALIBRATED
        return Verdict.UNDECIDED if self.unlike else self.compared

    @property
    def counted(self) -> bool:
        """Whether the number is a test of its own: neither an identity nor a duplicate."""
        return self.kind not in (Kind.IDENTITY, Kind.DUPLICATE)

    @property
    def reason(self) -> str:
        """Write what stands behind the verdict; "" where ours agrees."""
        shown = f" ({self.shown_by})" if self.shown_by else ""
        if self.verdict is Verdict.MISSING:
            why = "no interval: fewer than five packings, or most of their resamples have no such value"
            return why if np.isfinite(self.value) else self.how or "too few data"
        return {
            Verdict.AGREES: "",
            Verdict.DIFFERS: (self.cause or "no cause has been measured in these data") + shown,
            Verdict.INCONSISTENT: self.contradiction + shown,
            Verdict.CALIBRATED: f"{self.compared}; {self.calibrated}{shown}",
            Verdict.UNDECIDED: self._width,
        }[self.verdict]

    @property
    def _width(self) -> str:
        """Write why the number decides nothing."""
        (low, high), half = self.allowed, 0.5 * (self.high - self.low)
        wide = f", half of it {half:.2g} of packings" if half > self.margin and self.relation == "=" else ""
        return "; ".join(filter(None, (self.unlike, f"from {low:.4g} to {high:.4g}{wide}", self.spread, self.cause)))

    @property
    def spread(self) -> str:
        """Write how far the family of windows moves the number, and which of it the most; "" without a family."""
        if not self.family:
            return ""
        below, above = self.systematic
        most = max(self.family, key=lambda choice: abs(self.family[choice].value - self.value))
        return f"systematic -{below:.2g} +{above:.2g}, the most by {most}: {float(self.family[most].value):.4g}"

    @property
    def text(self) -> str:
        """Write the verdict and what stands behind it."""
        return f"{self.verdict}: {self.reason}" if self.reason else str(self.verdict)

    @property
    def line(self) -> str:
        """Write one line for the terminal and the summary."""
        ends = f"[{self.low:.4g}, {self.high:.4g}]" + (f", {self.spread}," if self.family else "")
        aside = "" if self.counted else f" ({self.kind})"
        return f"{self.figure}: {self.quantity} | {self.value:.4g} {ends} for {self.paper_text} | {self.text}{aside}"

    @property
    def record(self) -> str:
        """Write all that decides the verdict: the paper's words, interval, definition, window, data, every choice."""
        (low, high), (least, most) = self.allowed, self.asked
        every = ", ".join(f"{choice}: {float(v.value):.4g}{_ends(v)}" for choice, v in self.family.items())
        aside = "" if self.counted else f" ({self.kind}, not counted)"
        lines = [
            f"{self.figure}: {self.quantity}: {self.verdict}{aside}",
            f"  paper    {self.paper_text}, that is {least:.4g} to {most:.4g} ({self.where})",
            f"  ours     {self.value:.4g} [{self.low:.4g}, {self.high:.4g}], with choices {low:.4g} to {high:.4g}",
            f"  data     {self.how}" if self.how else "",
            f"  choices  {every}" if every else "",
            f"  because  {self.reason}" if self.reason else "",
        ]
        return "\n".join(filter(None, lines))

    @property
    def paper_text(self) -> str:
        """Write the paper's value as text."""
        sign = "" if self.relation == "=" else f"{self.relation} "
        return f"{sign}{self.paper:.4g}" + (f" ± {self.margin:.2g}" if self.margin else "")

    @property
    def choices(self) -> dict[str, list[float | None]]:
        """List value, low and high of every choice, plain for JSON."""
        every = {choice: (v.value, v.low, v.high) for choice, v in self.family.items()}
        return {choice: [float(x) if np.isfinite(x) else None for x in numbers] for choice, numbers in every.items()}

    def row(self) -> dict[str, Any]:
        """List plain values for CSV and JSON."""
        below, above = self.systematic
        more = {"below": below, "above": above, "verdict": str(self.verdict), "kind": str(self.kind)}
        return asdict(self) | more | {"family": self.spread, "reason": self.reason}


def claim(
    figure: str,
    quantity: str,
    found: Interval | None,
    paper: Published,
    *,
    kind: Kind = Kind.MEASURED,
    family: Mapping[str, ArrayLike | Interval | None] | None = None,
    **words: str,
) -> Claim:
    """Make a claim from an interval, None where the data do not give one. Words: how, cause, shown_by, contradiction,
    unlike and calibrated, which makes it a fit target, of `Claim`, and where, if another place than that of the number
    says it."""
    value, low, high = (np.nan,) * 3 if found is None else (float(v) for v in (found.value, found.low, found.high))
    kind = Kind.FIT_TARGET if words.get("calibrated") and kind is Kind.MEASURED else kind
    number = (value, low, high, paper.value, paper.margin, paper.relation)
    every = {choice: as_interval(other) for choice, other in (family or {}).items()}
    every = {choice: other for choice, other in every.items() if np.isfinite(other.value)}
    return Claim(figure, quantity, *number, kind=kind, family=every, **{"where": paper.where} | words)  # type: ignore[arg-type]


def as_interval(found: Any) -> Interval:
    """Take a number without an interval as one whose ends are not known; None as nan."""
    if isinstance(found, Interval):
        return found
    return Interval(*(np.asarray(np.nan if v is None else v, dtype=np.float64) for v in (found, None, None)))


def name_choice(choice: Mapping[str, Any]) -> str:
    """Name a choice by its keywords, such as "low = 0.02"."""
    return ", ".join(f"{k.replace('_', ' ')} = {f'{v:g}' if isinstance(v, float) else v}" for k, v in choice.items())


def halves(low: float, high: float) -> tuple[dict[str, float], dict[str, float]]:
    """Choose the upper and the lower half of a window, in logarithms: where a power holds, both give it."""
    middle = (low * high) ** 0.5
    return {"low": middle}, {"high": middle}


# numbers as text, for captions and reasons ----------------------------------------------------------------------------


def write_interval(found: Interval | None, digits: int = 2) -> str:
    """Write a number with its 95 % interval, such as "0.21 [0.19, 0.23]"."""
    if found is None:
        return "not measured"
    return f"{_fixed(found.value, digits)} [{_fixed(found.low, digits)}, {_fixed(found.high, digits)}]"


def _ends(found: Interval) -> str:
    return f" [{found.low:.4g}, {found.high:.4g}]" if np.isfinite([found.low, found.high]).all() else ""


def _fixed(value: ArrayLike, digits: int) -> str:
    number = float(np.ravel(value)[0])
    return f"{number:.{digits}f}" if abs(number) >= 10.0**-digits or number == 0 else f"{number:.2g}"


def write_list(values: Iterable[Any], form: str = "g") -> str:
    """Write numbers in one format, with commas between; None and nan are "none"."""
    numbers = [np.nan if v is None else float(v.value if isinstance(v, Interval) else v) for v in values]
    return ", ".join(f"{v:{form}}" if np.isfinite(v) else "none" for v in numbers)


def write_by(values: Mapping[Any, Any], form: str, of: str = "N") -> str:
    """Write numbers and what they belong to, such as "0.61, 0.58 at N = 32, 64"."""
    return f"{write_list(values.values(), form)} at {of} = {write_list(values)}"


# all claims together --------------------------------------------------------------------------------------------------


def count(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Count the claims of each verdict, in the order of `Verdict`, without identities and duplicates."""
    found = Counter(c.verdict for c in claims if c.counted)
    return {verdict: found[verdict] for verdict in Verdict}


def first_line(claims: Sequence[Claim]) -> str:
    """Write how many numbers of the papers agree, differ, and so on."""
    theirs = _of_papers(claims)
    numbers = ", ".join(f"{verdict} {number}" for verdict, number in count(theirs).items() if number)
    tests = sum(c.counted for c in theirs)
    more = f"; not counted: {len(theirs) - tests} identities and duplicates" if tests < len(theirs) else ""
    return f"{tests} numbers of both papers: {numbers}{more}."


def summary(claims: Sequence[Claim], every: bool = False) -> list[str]:
    """Write the first line, then one for each number of the papers that differs, with its cause, or for every one."""
    shown = [c for c in _of_papers(claims) if every or c.verdict is Verdict.DIFFERS]
    return [first_line(claims), *(f"  {c.line}" for c in shown)]


def _of_papers(claims: Sequence[Claim]) -> list[Claim]:
    return [c for c in claims if not c.figure.startswith(_OF_NO_PAPER)]
