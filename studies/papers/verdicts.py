"""Set numbers of the papers beside ours, and say whether the two agree."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from jamlab.plotting.palette import BLUE, GREEN, ORANGE, RED
from studies.ensemble_tables import EnsembleTables
from studies.papers.statements import Measured, Statement, explanations, measure, names, statements

SUMMARY = "summary.txt"  # beside the figures, and beside the data
COLUMNS = ("quantity", "ours", "paper", "verdict", "because")
RULE = (
    "One rule for every number: it agrees if the 95 % interval over packings of every analysis lies within what the "
    "paper's words mean, its value within its margin, differs if all lie beyond it on one side, and is undecided else. "
    "Numbers that unprinted parameters were chosen for are no test."
)


class Verdict(StrEnum):
    """What a number of a paper comes to."""

    AGREES = "agrees"
    DIFFERS = "differs"
    INCONSISTENT = "paper inconsistent"  # the paper contradicts itself, so that no measurement could settle the number
    CALIBRATED = "calibrated"  # parameters that the paper does not print were chosen to meet it: no independent test
    UNDECIDED = "undecided"
    MISSING = "not measured"  # the data do not give it with an interval, which takes five packings


LOOKS = {
    Verdict.AGREES: (BLUE, "o"),
    Verdict.DIFFERS: (RED, "X"),
    Verdict.INCONSISTENT: (ORANGE, "^"),
    Verdict.CALIBRATED: (GREEN, "D"),
    Verdict.UNDECIDED: ("#888888", "s"),
    Verdict.MISSING: ("#888888", "x"),
}


@dataclass(frozen=True)
class Comparison:
    """A number of a paper beside ours."""

    statement: Statement
    measured: Measured

    @property
    def verdict(self) -> Verdict:
        """See `Verdict`. It agrees if by each analysis all that the packings allow is what the paper's words mean,
        differs if by each nothing is, all on the same side, and is undecided else."""
        s, m = self.statement, self.measured
        if s.status == "paper inconsistent":
            return Verdict.INCONSISTENT
        if not m.known:
            return Verdict.MISSING
        if s.status == "fit target":
            return Verdict.CALIBRATED
        every = [(m.low, m.high)]
        for other in m.variants.values():
            ends, moved = (float(other.low), float(other.high)), float(other.value) - m.value
            every.append(ends if np.isfinite(ends).all() else (m.low + moved, m.high + moved))
        low, high = min(low for low, _ in every), max(high for _, high in every)
        least = -np.inf if s.relation == "<" else s.value - s.margin
        most = np.inf if s.relation == ">" else s.value + s.margin
        if s.status == "not comparable":
            return Verdict.UNDECIDED
        if high < least or most < low:
            return Verdict.DIFFERS
        return Verdict.AGREES if least <= low and high <= most else Verdict.UNDECIDED

    @property
    def explanation(self) -> str:
        """Why it differs, or why it is not measured."""
        return explanations().get(self.statement.id, self.measured.lacking)

    @property
    def text(self) -> str:
        """Write our number with its interval, and how far other analyses lie off."""
        m = self.measured
        below, above = m.systematic
        return f"{m.value:.4g} [{m.low:.4g}, {m.high:.4g}], analyses -{below:.2g} +{above:.2g}" if m.known else "–"

    @property
    def cells(self) -> tuple[str, ...]:
        """Write the `COLUMNS` of a page."""
        return self.statement.quantity, self.text, self.statement.text, str(self.verdict), self.explanation

    @property
    def line(self) -> str:
        """Write one line for the terminal and the summary."""
        s = self.statement
        return f"{s.figure}: {s.quantity} | {self.text} for {s.text} | {self.verdict}"

    @property
    def record(self) -> str:
        """Write all that decides the verdict: the paper's words, interval, definition, every analysis."""
        s, m = self.statement, self.measured
        every = ", ".join(f"{name}: {float(v.value):.4g}" for name, v in m.variants.items())
        lines = (
            self.line,
            f"  paper     {s.sentence} ({s.where}; {s.stated or s.status})",
            f"  ours      {m.how}" if m.how else "",
            f"  analyses  {every}" if every else "",
            f"  because   {self.explanation}" if self.explanation else "",
        )
        return "\n".join(filter(None, lines))

    def row(self) -> dict[str, Any]:
        """List plain values for CSV and JSON."""
        s, m = self.statement, self.measured
        below, above = m.systematic
        numbers = {"value": m.value, "low": m.low, "high": m.high, "below": below, "above": above}
        words = {"id": s.id, "figure": s.figure, "quantity": s.quantity, "where": s.where, "kind": s.status}
        theirs = {"paper": s.value, "margin": s.margin, "relation": s.relation}
        marks = {"calibrated": s.status == "fit target", "contradiction": s.status == "paper inconsistent"}
        family = {name: [_plain(x) for x in (v.value, v.low, v.high)] for name, v in m.variants.items()}
        judged = {"verdict": str(self.verdict), "how": m.how, "because": self.explanation}
        return words | {k: _plain(v) for k, v in numbers.items()} | theirs | marks | judged | {"family": family}


def _plain(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def compare(figure: str, tables: EnsembleTables) -> list[Comparison]:
    """Set every number of a figure beside ours."""
    return [Comparison(statements()[name], measure(name, tables)) for name in names(figure)]


def first_line(comparisons: Sequence[Comparison]) -> str:
    """Write how many numbers of both papers agree, differ, and so on."""
    counted = Counter(c.verdict for c in comparisons if c.statement.counted)
    numbers = ", ".join(f"{verdict} {counted[verdict]}" for verdict in Verdict if counted[verdict])
    return f"{counted.total()} numbers of both papers: {numbers}."


def summary(comparisons: Sequence[Comparison]) -> list[str]:
    """Write the first line, then one for each number."""
    return [first_line(comparisons), *(f"  {c.line}" for c in comparisons)]
