"""Count the verdicts of all figures, and say in a few lines why numbers differ."""

from collections import Counter
from collections.abc import Sequence

from jamlab.studies.claims import Claim, Verdict

SUMMARY = "summary.txt"  # beside the figures, and beside the reference data
_BESIDE = ("dynamics-", "beyond-")  # figures whose numbers neither paper has


def count(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Verdict -> number of claims, in the order of `Verdict`."""
    found = Counter(c.verdict for c in claims)
    return {verdict: found[verdict] for verdict in Verdict}


def first_line(claims: Sequence[Claim]) -> str:
    """How many numbers of the papers agree, differ, and so on."""
    theirs = _of_papers(claims)
    numbers = ", ".join(f"{verdict} {number}" for verdict, number in count(theirs).items() if number)
    return f"{len(theirs)} numbers of both papers: {numbers}."


def summary(claims: Sequence[Claim]) -> list[str]:
    """The first line, then one line for each number of the papers that differs, with its cause."""
    lines = [first_line(claims)]
    for c in _of_papers(claims):
        if c.verdict is Verdict.DIFFERS:
            lines.append(f"  {c.figure}, {c.quantity}: {c.value:.4g} for {c.paper_text}: {c.reason}")
    return lines


def _of_papers(claims: Sequence[Claim]) -> list[Claim]:
    return [c for c in claims if not c.figure.startswith(_BESIDE)]
