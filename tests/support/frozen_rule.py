"""The rule of 27 November 2026 for numbers of the papers, written once more in plain arithmetic.

`frozen_rule.csv` holds what commit 1bdf89a8 took for granted of each number: how the paper states it, its kind, its
status, settings and other analyses. It is never edited: settings that are others today are measured as well. Side by
side with `studies.papers.verdicts`, on the packings that ship:

    python tests/support/frozen_rule.py
"""

import csv
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

FILE = Path(__file__).parents[1] / "studies" / "frozen_rule.csv"
LATER = "–"  # of a number that the frozen rule does not know
STATUS = {"measured": "", "fit target": "unprinted parameters"}  # in the words of today
SHOWN = ("agrees", "small difference", "compatible, weak", "not resolved", "tension", "differs", "no data")


def frozen_rows():
    """Read the rows by id; argument as a number."""
    with FILE.open(encoding="utf-8", newline="") as file:
        return {row["id"]: row | {"argument": float(row["argument"] or 0)} for row in csv.DictReader(file)}


def size_of(kind, paper):
    """What a difference is measured by."""
    x = abs(paper)
    sizes = {"exponent": x or 0.5, "shape": max(x - 1, 1e-9), "share": max(x, 0.2)}
    return (sizes | {"ratio": 1.0, "density": 0.16, "contacts": 2.0, "decades": 5.0}).get(kind, x)


def error_of_paper(row, paper, half, statistical):
    """Standard error of the paper's number."""
    how, e, digits = row["stated"], row["argument"], half / math.sqrt(3)
    if how in ("theory", "bound"):
        return 0.0
    if how in ("fit", "digits"):
        return math.sqrt(digits**2 + (statistical**2 if how == "fit" else 0.0))
    if how == "line":
        return 0.1 / e
    if how == "share":
        return max(digits, e)
    return e * size_of(row["number"], paper) if how == "about" else e


def frozen_verdict(row, relation, paper, half, ours):
    """Judge analyses (value, low, high), the main one first, the others with the interval of the main one where theirs
    is not known."""
    value, low, high = ours[0]
    if not all(map(math.isfinite, ours[0])):
        return "no data"
    u = (high - low) / 3.92
    each = [(v, (b - a) / 3.92 if math.isfinite(a) and math.isfinite(b) else u) for v, a, b in ours]
    down, up = max(value - v for v, _ in each), max(v - value for v, _ in each)
    spread = max(down, up) / math.sqrt(3)
    if relation != "=":
        sign = {">": 1, "<": -1}[relation]
        met = sign * (value - paper) / max(math.hypot(u, spread), 1e-12)
        best = max(sign * (v - paper) / max(e, 1e-12) for v, e in each)
        return "agrees" if met >= 2 else "differs" if best <= -3 else "tension" if met <= -2 else "not resolved"
    theirs = error_of_paper(row, paper, half, u)
    tolerance = max(0.1 * size_of(row["number"], paper), half)
    toward = (down if value > paper else up) / math.sqrt(3)
    pulls = [(v - paper) / max(math.hypot(e, theirs), 1e-12) for v, e in each]
    same_side = all(pull > 0 for pull in pulls) or all(pull < 0 for pull in pulls)
    apart = same_side and min(map(abs, pulls)) >= 3
    known_to = abs(value - paper) + 1.645 * math.hypot(u, spread)
    if known_to <= tolerance:
        return "small difference" if apart else "agrees"
    if apart:
        return "differs"
    combined = math.sqrt(u**2 + toward**2 + theirs**2)
    if abs(value - paper) >= 2 * combined:
        return "tension"
    return "compatible, weak" if known_to <= 3 * tolerance else "not resolved"


def side_by_side(comparisons, tables):
    """List what decides each number: its id, the frozen verdict by the analyses of that day and by all of today, what
    it was no test for, the verdict today, and what it is no test for."""
    from studies.ensembles import name_keywords
    from studies.papers.statements import analyse, keywords

    known, lines = frozen_rows(), []
    for c in comparisons:
        s, m = c.statement, c.measured
        if not s.counted:
            continue
        if s.id not in known:
            lines.append((s.id, LATER, LATER, "", str(c.verdict), s.reason))
            continue
        row = known[s.id]
        if row["settings"] != s.settings:
            (m,) = analyse(replace(s, settings=row["settings"], variants=row["variants"]), tables)
        names = {name_keywords(keywords(text)) for text in row["variants"].split("; ") if text}
        every = {name: (float(v.value), float(v.low), float(v.high)) for name, v in m.variants.items()}
        then = [v for name, v in every.items() if name in names or "alone" in name]
        of = [
            frozen_verdict(row, s.relation, s.value, s.margin, [(m.value, m.low, m.high), *v])
            for v in (then, every.values())
        ]
        lines.append((s.id, *of, STATUS.get(row["status"], row["status"]), str(c.verdict), s.reason))
    return lines


def counts(lines):
    """Count verdicts of tests: frozen by analyses of then, by all analyses, and of today."""
    old, every = (Counter(line[k] for line in lines if not line[3]) for k in (1, 2))
    new = Counter(line[4] for line in lines if not line[5])
    return [(name, old[name], every[name], new[name]) for name in SHOWN]


def moved(lines):
    """List what changed: id -> frozen, by all analyses, today, each with what it is no test for."""
    text = lambda verdict, reason: f"{verdict} ({reason})" if reason else verdict  # noqa: E731
    return {
        name: (text(old, was), text(every, was), text(new, reason))
        for name, old, every, was, new, reason in lines
        if (old, was) != (new, reason)
    }


def main():
    from studies.papers.verdicts import compare
    from studies.reference_data import open_tables
    from studies.registry import PAPERS

    tables = open_tables()
    lines = side_by_side([c for study in PAPERS for c in compare(study.name, tables)], tables)
    print(f"{'tests':20s}{'frozen':>8s}{'all analyses':>14s}{'mended':>8s}")
    for name, *numbers in counts(lines):
        print("{:20s}{:8d}{:14d}{:8d}".format(name, *numbers))
    print("\nrows that moved: frozen | frozen, all analyses | mended")
    for name, verdicts in moved(lines).items():
        print(f"  {name}: {' | '.join(verdicts)}")


if __name__ == "__main__":
    main()
