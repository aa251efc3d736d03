"""Check the intervals of `jamlab.estimate` without a run: requests in worlds drawn from its own table.

In each trial the packings of the table are the world: the truth is the mean of its droplets. The table that the plan
sees is drawn from them with replacement, packing by packing, and so are the packings that the plan then asks for. What
an interval should cover, the error of the table, the scatter, and stopping when the error is met, is all in it; that
the differences of ways are smooth in rho is taken for granted.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from jamlab.estimates.ensemble_plan import ENSEMBLE_QUANTITIES, EnsemblePlan, plan_estimate, reference_way
from jamlab.estimates.ensemble_way import EnsembleWay
from jamlab.estimates.sampling import sample
from jamlab.estimates.way_errors import deviations, difference, is_known
from jamlab.estimates.way_table import ONSET, WayRecord

ERRORS = (0.3, 1.5)  # asked for, in units of the scatter of droplets: some 40 to 4 packings


@dataclass(frozen=True)
class Trial:
    """One request.

    Attributes:
        quantity, rho, error: what was asked for.
        start: of the way that was chosen.
        value, reached, truth: estimate, half the width of its interval, and the mean of the world.
        expected, seconds: cost.
    """

    quantity: str
    rho: float
    error: float
    start: str
    value: float
    reached: float
    truth: float
    expected: float
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether the interval holds the truth."""
        return abs(self.value - self.truth) <= self.reached


def calibrate(world: Mapping[EnsembleWay, WayRecord], trials: int, seed: int = 1) -> list[Trial]:
    """Ask for means in worlds drawn from a table, at its levels."""
    rng = np.random.default_rng(seed)
    world = {way: _smooth(record, world[reference_way()]) for way, record in world.items()}
    names = list(ENSEMBLE_QUANTITIES)
    return [_trial(world, names[k % len(names)], rng) for k in range(trials)]


def summarize(trials: list[Trial]) -> dict[str, float]:
    """Share of intervals that hold the truth, in all and by quantity and way, and of expected costs within 1.5."""
    close = np.mean([1 / 1.5 <= t.seconds / t.expected <= 1.5 for t in trials])
    found = {"holds": float(np.mean([t.holds for t in trials])), "cost within 1.5": float(close)}
    for kind in ("quantity", "start"):
        count = Counter(getattr(t, kind) for t in trials)
        held = Counter(getattr(t, kind) for t in trials if t.holds)
        found |= {name: held[name] / count[name] for name in count}
    return found


def _trial(world: Mapping[EnsembleWay, WayRecord], quantity: str, rng: np.random.Generator) -> Trial:
    droplets = world[reference_way()]
    k = 0 if quantity == ONSET else int(rng.integers(len(droplets.levels)))
    rho = float(droplets.levels[k])
    error = float(deviations(droplets, quantity)[k] * np.exp(rng.uniform(*np.log(ERRORS))))
    plan = plan_estimate(quantity, rho, error, table={way: _drawn(record, rng) for way, record in world.items()})
    return _run(plan, world[plan.way], k, error, float(np.nanmean(droplets.values[quantity][:, k])), rng)


def _run(plan: EnsemblePlan, record: WayRecord, k: int, error: float, truth: float, rng: np.random.Generator) -> Trial:
    def make(count: int) -> list[tuple[float, float]]:
        drawn = rng.integers(len(record.seeds), size=count)
        values, seconds = record.values[plan.quantity][drawn, k], record.seconds[drawn, k]
        return list(zip(values.tolist(), seconds.tolist(), strict=True))

    found, _ = sample(plan, error, make)
    value = float(np.mean(found.good)) + plan.correction
    rho = float(record.levels[k])
    return Trial(plan.quantity, rho, error, plan.way.start, value, found.error, truth, plan.seconds, found.seconds)


def _smooth(record: WayRecord, reference: WayRecord) -> WayRecord:
    """Shift a way's values so that its difference from the reference is the one that the table's fit says."""
    if record is reference or not is_known(record, reference, "z"):
        return record
    values = dict(record.values)
    for name in values.keys() - {ONSET}:
        fitted = [difference(record, reference, name, rho).value for rho in record.levels]
        own, other = (np.nanmean(r.values[name], axis=0) for r in (record, reference))
        values[name] = record.values[name] + (other + fitted - own)
    return replace(record, values=values)


def _drawn(record: WayRecord, rng: np.random.Generator) -> WayRecord:
    chosen = rng.integers(len(record.seeds), size=len(record.seeds))
    values = {name: column[chosen] for name, column in record.values.items()}
    return replace(record, seeds=record.seeds[chosen], values=values, seconds=record.seconds[chosen])
