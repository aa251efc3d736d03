"""Which works of a record are slower than those of earlier records, beyond what repeats differ by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.speed_history.record import Record

LOSS = 0.10  # of the time: what a comparison is made to show
_SURE = 1 + LOSS / 2  # ratio that is exceeded beyond the error: of a loss of 10 % known to 5 %, sure; of none, never


@dataclass(frozen=True)
class Change:
    """One work beside the same one of an earlier record."""

    work: str
    against: str  # commit of the earlier record
    ratio: float  # time over time of the earlier one, both over plain work
    error: float  # of the ratio: half of what repeats and processes span, of both records together
    another_result: bool  # whether the work gave another number: a protocol or a definition changed

    @property
    def lost(self) -> bool:
        """Whether the work has become slower beyond its error."""
        return self.ratio - self.error > _SURE

    @property
    def unsure(self) -> bool:
        """Whether a loss of 10 % would not be shown."""
        return self.error > LOSS / 2

    @property
    def cells(self) -> list[str]:
        """Ratio, error and what they say, as text."""
        loss = "LOST" if self.lost else f"not known to {LOSS:.0%}" if self.unsure else ""
        said = ", ".join(filter(None, [loss, "another result" if self.another_result else ""]))
        return [f"{self.ratio:.3f}", f"{self.error:.3f}", said]


def level(ratios: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Time over plain work, the median over processes of the median over repeats, and its relative error: half of what
    the processes span, or of the middle half of one's repeats where only one was run."""
    middles = [float(np.median(each)) for each in ratios]
    ends = [min(middles), max(middles)] if len(middles) > 1 else np.quantile(ratios[0], [0.25, 0.75])
    centre = float(np.median(middles))
    return centre, float(0.5 * (ends[1] - ends[0]) / centre)


def changes(record: Record, records: Sequence[Record]) -> list[Change]:
    """Every work of a record beside the last record of an earlier commit that has it, and beside the best of these."""
    found = []
    earlier = sorted((one for one in records if one.when < record.when), key=lambda one: one.when)
    for work, row in record.works.items():
        here, spread = level(row["ratios"])
        known = [(one, *level(one.works[work]["ratios"])) for one in earlier if work in one.works]
        beside = [known[-1], min(known, key=lambda one: one[1])] if known else []
        for other, there, theirs in beside[: 1 + (beside[:1] != beside[1:])]:
            ratio = here / there
            differs = not np.isclose(row["found"][0], other.works[work]["found"][0], rtol=1e-9, atol=0.0)
            found.append(Change(work, other.commit, ratio, ratio * float(np.hypot(spread, theirs)), bool(differs)))
    return found
