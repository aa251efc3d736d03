"""Set numbers of the papers beside ours, and say whether the two agree, by one rule for all numbers.

`rule.md` has the rule in words. It was fixed when the values were known. A change of a constant below, or of an entry
of the columns `stated`, `argument`, `number`, `sentence`, `no_test`, `settings` and `variants` of `statements.csv`, is
a commit of its own, whose message names the reason and the rows that it moves; `rule.md` lists these commits.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import copysign, hypot
from typing import Any

import numpy as np

from jamlab.plotting.palette import BLACK, BLUE, GREEN, ORANGE, RED, SKY
from studies.ensemble_tables import EnsembleTables
from studies.html_page import with_symbols
from studies.papers.controls.passed import failed
from studies.papers.statements import Measured, Statement, explanations, measure, names, statements

SUMMARY = "summary.txt"  # beside the figures, and beside the data
COLUMNS = ("quantity", "ours ± packings ± analyses", "paper", "known to", "verdict", "because")
RULE = (
    "One rule for every number: ours with the standard errors of packings and of other analyses, the paper's by how "
    "it states the number, and a tolerance of a tenth of the scale of such numbers. It agrees if the difference is "
    "known to lie within the tolerance, and differs if it is three standard errors and one tolerance by every "
    "analysis. Guesses, definitions, and numbers that unprinted parameters decide are no tests. The rule was fixed "
    "when the values were known; changes since are commits of their own."
)
TOLERANCE, WEAK = 0.10, 3.0  # of the scale of a number; tolerances within which it is known weakly
TENSION, DIFFERS = 2.0, 3.0  # combined standard errors
ONE_SIDED = 1.645  # 95 % upper limit of |difference|
NORMAL = 3.92  # standard errors in a 95 % interval
FIT_BY_EYE = 0.10  # decades: two straight lines that part by a factor of 1.26 at the end look like one
SCALES = {  # of a number, by its kind; those that are not here are of the size of the number itself
    "ratio": 1.0,
    "density": 0.16,  # rho, phi: from onset to confluence, [B] sec 3
    "contacts": 2.0,  # z: from 4 to 6
    "decades": 5.0,  # so that the tolerance is half a decade
}
NO_EXPONENT, LEAST_SHARE = 0.5, 0.2  # scale of an exponent that is 0: the least that the papers argue for; of a share


class Verdict(StrEnum):
    """What a number of a paper comes to."""

    AGREES = "agrees"
    SMALL = "small difference"
    WEAK = "compatible, weak"
    UNRESOLVED = "not resolved"
    TENSION = "tension"
    DIFFERS = "differs"
    NONE = "no verdict"  # the estimator fails a control
    MISSING = "no data"


SAID = {  # of how many numbers, in one sentence
    Verdict.AGREES: "agree within the tolerance (a tenth of the scale or half a last digit)",
    Verdict.SMALL: "are within the tolerance, but significantly off",
    Verdict.WEAK: "are compatible within three tolerances",
    Verdict.UNRESOLVED: "are not resolved",
    Verdict.TENSION: "are in tension",
    Verdict.DIFFERS: "differ",
}
APART = (Verdict.UNRESOLVED, Verdict.TENSION, Verdict.DIFFERS)  # all others are compatible
LOOKS = {
    Verdict.AGREES: (BLUE, "o"),
    Verdict.SMALL: (GREEN, "D"),
    Verdict.WEAK: (SKY, "s"),
    Verdict.UNRESOLVED: ("#888888", "s"),
    Verdict.TENSION: (ORANGE, "^"),
    Verdict.DIFFERS: (RED, "X"),
    Verdict.NONE: ("#888888", "v"),
    Verdict.MISSING: (BLACK, "x"),
}


def scale(number: str, value: float) -> float:
    """What a difference is measured by, from the kind of a number and the paper's value."""
    size = abs(value)
    if number == "exponent":
        return size or NO_EXPONENT
    if number == "shape":  # of particles: A - 1
        return max(size - 1, 1e-9)
    if number == "share":
        return max(size, LEAST_SHARE)
    return SCALES.get(number, size)


def paper_error(s: Statement, statistical: float) -> float:
    """Standard error of what a paper states, by how it does; a fit has a sampling error like ours beside its digits."""
    rounding = s.margin / 3**0.5
    return {
        "fit": hypot(rounding, statistical),
        "line": _error_of_line(s),
        "share": max(rounding, s.argument),
        "about": s.argument * scale(s.number, s.value),
        "theory": 0.0,
        "bound": 0.0,
        "digits": rounding,
    }.get(s.stated, s.argument)


def _error_of_line(s: Statement) -> float:
    """Standard error of the slope of a line over `argument` decades, or of its height."""
    if s.stated != "line":
        return 0.0
    return abs(s.value) * (10**FIT_BY_EYE - 1) if s.number == "coefficient" else FIT_BY_EYE / s.argument


@dataclass(frozen=True)
class Comparison:
    """A number of a paper beside ours, the verdict, and what decides it; nan without data."""

    statement: Statement
    measured: Measured
    verdict: Verdict = Verdict.MISSING
    pull: float = np.nan  # difference over the combined standard error; of a bound by how many it is met
    kindest: float = np.nan  # the same by the analysis that is kindest to the paper
    resolution: float = np.nan  # 95 % upper limit of |difference|
    # statistical, systematic, paper: standard errors
    statistical: float = np.nan
    systematic: float = np.nan
    paper: float = np.nan

    @property
    def explanation(self) -> str:
        """Why it differs, is no test, or is not measured."""
        return failed(self.statement.id) or explanations().get(self.statement.id, self.measured.lacking)

    @property
    def text(self) -> str:
        """Write our number with its standard errors, of packings and of the analysis."""
        m = self.measured
        return f"{m.value:.4g} ± {self.statistical:.2g} ± {self.systematic:.2g}" if m.known else "–"

    @property
    def said(self) -> str:
        """Write the verdict, and why the number is no test if it is none."""
        return f"{self.verdict}{f' ({self.statement.reason})' if self.statement.reason else ''}"

    @property
    def cells(self) -> tuple[str, ...]:
        """Write the `COLUMNS` of a page."""
        known = f"{self.resolution:.2g}" if self.measured.known else "–"
        return self.statement.quantity, self.text, self.statement.text, known, self.said, self.explanation

    @property
    def line(self) -> str:
        """Write one line for the terminal and the summary."""
        s = self.statement
        both = f"{self.text} for {s.text_with(self.paper)}"
        known = f"; pull {self.pull:+.1f}, known to {self.resolution:.2g}" if self.measured.known else ""
        return f"{s.figure}: {with_symbols(s.quantity)} | {both}{known} | {self.said}"

    def row(self) -> dict[str, Any]:
        """List plain values for CSV and JSON."""
        s, m = self.statement, self.measured
        below, above = m.systematic
        names = ("id", "figure", "quantity", "where", "words", "margin", "relation", "stated", "number", "note")
        words = {"sentence": str(s.sentence), "no_test": s.reason, "paper": s.value, "verdict": str(self.verdict)}
        words |= {"how": m.how}
        words |= {"because": self.explanation}
        numbers = {"value": m.value, "low": m.low, "high": m.high, "below": below, "above": above}
        numbers |= {name: getattr(self, name) for name in ("pull", "kindest", "resolution")}
        numbers |= {"u_stat": self.statistical, "u_syst": self.systematic, "u_paper": self.paper}
        numbers |= {"scale": scale(s.number, s.value)}
        family = {name: [_plain(x) for x in (v.value, v.low, v.high)] for name, v in m.variants.items()}
        plain = {name: _plain(value) for name, value in numbers.items()}
        return {name: getattr(s, name) for name in names} | words | plain | {"family": family}


def judge(s: Statement, m: Measured) -> Comparison:
    """Set one number beside ours by the rule of this module."""
    if not m.known:
        return Comparison(s, m)
    off, statistical = m.value - s.value, (m.high - m.low) / NORMAL
    below, above = m.systematic
    systematic, theirs = max(below, above) / 3**0.5, paper_error(s, statistical)
    resolution = abs(off) + ONE_SIDED * hypot(statistical, systematic)
    each = [(m.value, statistical)]
    for v in m.variants.values():
        known = np.isfinite([v.low, v.high]).all()
        each.append((float(v.value), float(v.high - v.low) / NORMAL if known else statistical))
    errors = {"resolution": resolution, "statistical": statistical, "systematic": systematic, "paper": theirs}
    tolerance = max(TOLERANCE * scale(s.number, s.value), s.margin)
    if s.relation != "=":
        sign = 1 if s.relation == ">" else -1
        met = sign * off / max(hypot(statistical, systematic), 1e-12)
        best = max(sign * (v - s.value) / max(u, 1e-12) for v, u in each)
        apart = best <= -DIFFERS and max(sign * (v - s.value) for v, _ in each) <= -tolerance
        missed = Verdict.DIFFERS if apart else Verdict.TENSION if met <= -TENSION else Verdict.UNRESOLVED
        return Comparison(s, m, Verdict.AGREES if met >= TENSION else missed, met, best, **errors)
    combined = np.sqrt(statistical**2 + ((below if off > 0 else above) ** 2) / 3 + theirs**2)
    pull = off / combined if combined else copysign(np.inf, off)
    pulls = [(v - s.value) / max(hypot(u, theirs), 1e-12) for v, u in each]
    one_side = min(pulls) > 0 or max(pulls) < 0
    kindest = min(pulls, key=abs) if one_side else 0.0
    if resolution <= tolerance:
        verdict = Verdict.SMALL if abs(kindest) >= DIFFERS else Verdict.AGREES
    elif abs(kindest) >= DIFFERS and min(abs(v - s.value) for v, _ in each) >= tolerance:
        verdict = Verdict.DIFFERS
    elif abs(pull) >= TENSION:
        verdict = Verdict.TENSION
    else:
        verdict = Verdict.WEAK if resolution <= WEAK * tolerance else Verdict.UNRESOLVED
    return Comparison(s, m, verdict, float(pull), kindest, **errors)


def _plain(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def compare(figure: str, tables: EnsembleTables) -> list[Comparison]:
    """Set every number of a figure beside ours."""
    return [withdraw(judge(statements()[name], measure(name, tables))) for name in names(figure)]


def withdraw(found: Comparison) -> Comparison:
    """Take back the verdict on a number whose estimator fails a control."""
    return replace(found, verdict=Verdict.NONE) if found.measured.known and failed(found.statement.id) else found


def first_line(comparisons: Sequence[Comparison]) -> str:
    """Write how many numbers of both papers that can be tested agree, differ, and so on."""
    counted = [c.statement for c in comparisons if c.statement.counted]
    tests = [c for c in comparisons if c.statement.counted and c.statement.tested]
    known = [c for c in tests if c.measured.known]
    met = sum(c.verdict == Verdict.AGREES and c.statement.relation != "=" for c in known)
    values = Counter(c.verdict for c in known) - Counter({Verdict.AGREES: met})
    agree = f"{values[Verdict.AGREES]} {SAID[Verdict.AGREES]}, and {met} bounds are met."
    others = [
        f"{values[verdict]} {words}" for verdict, words in SAID.items() if verdict != Verdict.AGREES and values[verdict]
    ]
    rest = f"{len(tests) - len(known)} lack data, and {len(counted) - len(tests)} are no tests."
    told = [
        f"Our packings test {len(known)} numbers of both papers.",
        agree,
        *([f"{', '.join(others)}."] if others else []),
    ]
    return " ".join([*told, f"Of the other numbers, {rest}"])


def short_line(comparisons: Sequence[Comparison]) -> str:
    """Write in one sentence how many numbers of the papers are compatible with ours, for the README."""
    known = [c for c in comparisons if c.statement.counted and c.statement.tested and c.measured.known]
    values = Counter(c.verdict for c in known)
    *others, last = [f"{values[verdict]} {SAID[verdict]}" for verdict in APART]
    compatible = len(known) - sum(values[verdict] for verdict in APART)
    return f"Of {len(known)} published numbers, {compatible} are compatible with ours, {', '.join(others)} and {last}."


def summary(comparisons: Sequence[Comparison]) -> list[str]:
    """Write the first line, the line of the README, how many tests are bounded to 30 % of their scale by either count,
    and a line a number."""
    tests = [c for c in comparisons if c.statement.counted and c.statement.tested and c.measured.known]
    held = sum(c.verdict in (Verdict.AGREES, Verdict.SMALL, Verdict.WEAK) for c in tests)
    near = sum(c.resolution <= WEAK * TOLERANCE * scale(c.statement.number, c.statement.value) for c in tests)
    bounded = f"Bounded to 30 % of the scale: {held} by their verdict; {near} by r alone, whatever the pull."
    return [first_line(comparisons), short_line(comparisons), bounded, *(f"  {c.line}" for c in comparisons)]
