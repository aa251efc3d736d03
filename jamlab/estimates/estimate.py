"""A mean over packings of droplets to an error asked for, from the cheapest packings that give it.

The interval of a mean over m packings made in some way has two parts: their scatter, t s / sqrt(m), which more packings
reduce, and what is not known about the way itself, the standard error of its difference from the reference in the
table, which they do not. A way is used only where the second part leaves room for the first.
"""

from __future__ import annotations

import math
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit
from threadpoolctl import threadpool_limits

from jamlab.arrays import Array
from jamlab.checks import check_choice, check_number, check_seed, checked
from jamlab.errors import ConvergenceError, InputError, Renamed
from jamlab.estimates import ways
from jamlab.estimates.choice import Choice, Why, judge
from jamlab.estimates.ways import ONSET, EnsembleWay, N, Scatter, WayRecord, Ways, difference, is_known, scatter
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.packing.result import Result
from jamlab.processes.progress import Progress, no_progress
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.statistics.confidence import CONFIDENCE, room

ENSEMBLE_QUANTITIES = {
    "z": "contacts per particle without rattlers",
    "g": "relaxed shear modulus, mean over directions, eps/l^2",
    "b": "relaxed bulk modulus, eps/l^2",
    ONSET: "true packing fraction at jamming onset",
    "a": "mean shape factor above that of a free particle, A - A_J",
    "void_sides": "mean number of sides of a void",
}
FEWEST, MOST = 4, 100_000  # packings
_LEAST_YIELD = 0.5  # of the share of seeds of which droplets have a value: the few that jam stand for no others
_LARGEST_SHARE = 0.6  # of the error asked for that the way itself may take in an automatic choice


def plan_mean(
    quantity: str, rho: float | None, error: float, *, model: str = "auto", table: Ways | None = None
) -> Sample:
    """Choose the cheapest ensemble that is expected to give a mean to an error, see `jamlab.estimate`; nothing runs."""
    table = ways.read_ways() if table is None else table
    at = _check(table, quantity, rho, error, model)
    reference = table[reference_way()]
    if not is_known(reference, reference, quantity, at):
        raise InputError(f"rho = {rho}: too few packings of {reference.way} in the table have {quantity}; take another")
    records = [r for r in table.values() if model in ("auto", r.way.model)]
    if quantity == ONSET:  # carried droplets have none of their own
        records = [r for r in records if r.way.start != "carried"]
    if quantity in ("g", "b"):  # disks have other moduli
        records = [r for r in records if r.way.nv is not None]
    if not records:
        raise InputError(f"model = {model!r}: disks do not tell {quantity} of droplets, take 'dp'")
    rows = [_option(record, reference, quantity, at, error) for record in records]
    options, row = judge(rows, "seconds", nearest="bias_error")
    if row is None:
        raise InputError(f"model = {model!r}: too few of its packings in the table have {quantity}, take 'auto'")
    best = rows[row]
    if best["why"] is None and best["error"] > error:
        raise InputError(f"error = {error:g}: takes more than {MOST} packings, which give {best['error']:.2g}")
    one = scatter(records[row], quantity, at)
    correction = 0.0
    if records[row] is not reference:
        correction = -difference(records[row], reference, quantity, at).value
    bound, corrections = {quantity: best["error"]}, {quantity: correction}
    cost = {"seconds": best["seconds"], "packings": best["packings"]}
    choice = Choice(way=best["way"], bound=bound, options=options, correction=corrections, **cost)
    return Sample(quantity, at, choice, one, best["bias_error"])


def interval(deviation: float, freedom: float, packings: int = 1) -> float:
    """Half the width of the 95 % interval of a mean over some packings."""
    return float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * deviation / math.sqrt(packings)


def reference_way() -> EnsembleWay:
    """Droplets from the start, whose mean is estimated."""
    return EnsembleWay("droplets", N, ways.default_vertices())


def _option(record: WayRecord, reference: WayRecord, quantity: str, rho: float, error: float) -> dict[str, Any]:
    """What a way takes, and whether something speaks against it."""
    if not is_known(record, reference, quantity, rho):
        unknown = dict.fromkeys(("error", "bias_error", "seconds"), math.nan)
        return {"way": record.way, "packings": 0, **unknown, "why": Why.UNKNOWN}
    bias_error = 0.0
    if record is not reference:
        off = difference(record, reference, quantity, rho)
        bias_error = interval(off.error, off.freedom)
    one = scatter(record, quantity, rho)
    aim = room(error, bias_error)
    packings = bisect_left(
        range(MOST), True, FEWEST, key=lambda m: interval(one.deviation, one.freedom + m - 1, m) <= aim
    )
    reached = math.hypot(interval(one.deviation, one.freedom + packings - 1, packings), bias_error)
    seconds = packings / max(one.share, 1e-3) * one.seconds
    why = None
    if one.share < _LEAST_YIELD * scatter(reference, quantity, rho).share:
        why, bias_error = Why.FAILS, math.nan
    elif bias_error > _LARGEST_SHARE * error:
        why = Why.UNSURE
    columns = {"packings": packings, "error": reached, "bias_error": bias_error, "seconds": seconds}
    return {"way": record.way, **columns, "why": why}


def _check(table: Ways, quantity: str, rho: float | None, error: float, model: str) -> float:
    """Refuse what the table does not tell; gives the packing fraction, nan at onset."""
    check_choice("quantity", quantity, ENSEMBLE_QUANTITIES)
    check_choice("model", model, ("auto", "sp", "dp"))
    check_number("error", error, math.inf)
    reference = table.get(reference_way())
    if reference is None:
        raise InputError(
            f"the table has no {reference_way()}: `dp.parameters` changed; make it anew with `python -m studies tables "
            "ways`"
        )
    if quantity == ONSET:
        return math.nan
    low, high = reference.levels[0], reference.levels[-1]
    if rho is None:
        raise InputError(f"{quantity} needs rho, a true packing fraction: give one in {low:g} .. {high:g}")
    if not low <= rho <= high:
        raise InputError(f"rho = {rho}: the table of ways spans {low:g} .. {high:g}; take a campaign beyond it")
    return rho


Make = Callable[[int], Sequence[tuple[float, float]]]  # number of seeds -> value (nan: none) and seconds of each

_MOST_GROWTH = 2.0  # of the number of packings where the first ones do not do
_OVER_PLAN = 16  # times the packings planned: beyond, the table does not fit what is seen
_TRIED, _LEAST_SHARE = 20, 0.1  # seeds after which at least this share must have given a value


class Stop(StrEnum):
    """Why no more packings were made."""

    MET = "the interval is met"
    WAY = "the calibration of this way limits the error: more packings do not help, another model does"
    SCATTER = "packings scatter more than the table says"


@dataclass
class Sample:
    """Packings made so far."""

    # quantity, rho: of which the mean is wanted; rho is nan for "rho-J"
    quantity: str
    rho: float
    choice: Choice  # how they are made
    scatter: Scatter  # of one packing, by the table
    bias_error: float  # part of the error that more packings do not reduce: what the table knows about the way
    values: list[float] = field(default_factory=list)  # one for each seed that was tried; nan where it has none
    seconds: float = 0.0  # CPU time of all

    @property
    def good(self) -> list[float]:
        """Values of the packings that have one."""
        return [value for value in self.values if math.isfinite(value)]

    @property
    def error(self) -> float:
        """Half the width of the interval of the mean, with what the table does not know."""
        return math.hypot(self.half_width(), self.bias_error)

    def extend(self, wanted: int, make: Make) -> None:
        """Make packings until so many have a value."""
        while (missing := wanted - len(self.good)) > 0:
            for value, seconds in make(missing):
                self.values.append(value)
                self.seconds += seconds
            tried, good = len(self.values), len(self.good)
            if tried >= _TRIED and good < _LEAST_SHARE * tried:
                raise ConvergenceError(
                    f"only {good} of {tried} packings have {self.quantity} at rho = {self.rho:g}, where most are still "
                    "unjammed: increase rho"
                )

    def half_width(self) -> float:
        """Of the interval by scatter: that of the packings together with that of the table, or the latter if larger.
        Packings that happen to lie close together are no better known than the table says."""
        count, known = len(self.good), self.scatter
        freedom = known.freedom + count - 1
        own = float(np.var(self.good, ddof=1))
        variance = (known.freedom * known.deviation**2 + (count - 1) * own) / freedom
        return interval(max(math.sqrt(variance), known.deviation), freedom, count)

    def fill(self, error: float, make: Make) -> Stop:
        """Make packings until the error is reached, or until more would not help; and say which."""
        wanted, aim = self.choice.packings, room(error, self.bias_error)
        while True:
            self.extend(wanted, make)
            ratio = self.half_width() / aim
            if ratio <= 1:
                return Stop.MET if self.error <= error else Stop.WAY
            if wanted >= _OVER_PLAN * self.choice.packings:
                return Stop.SCATTER
            wanted = math.ceil(wanted * min(max(ratio**2, 1 + 1 / wanted), _MOST_GROWTH))


@dataclass(frozen=True)
class Estimate(Result):
    """A mean over packings, with its 95 % interval value -+ ci95.

    Attributes:
        value: mean, in the unit of `jamlab.estimates.estimate.ENSEMBLE_QUANTITIES`.
        ci95: half the width of its 95 % interval; of the scatter of the packings and of what is known of their way.
        met: whether `ci95` is at most the error asked for.
        packings: that the mean is over.
        left_out: seeds without a value: unjammed at rho, not stable, or failed.
        seconds: CPU time that it took.
        choice: what it followed: way, number of packings, correction, expected cost, and the options there were.
        values: (packings,) of the packings as made, without the correction of the plan.
        seeds: (packings,) int64 of the packings.
        stopped: why no more packings were made, see `jamlab.estimates.estimate.Stop`.

    Example:
        >>> from dataclasses import fields
        >>> [field.name for field in fields(jamlab.results.Estimate)][:4]
        ['value', 'ci95', 'met', 'packings']
    """

    value: float
    ci95: float
    met: bool
    packings: int
    left_out: int
    seconds: float
    choice: Choice
    values: Array
    seeds: NDArray[np.int64]
    stopped: Stop

    error = Renamed("ci95")


@checked
def estimate_cost(quantity: str, rho: float | None, error: float, *, model: str = "auto") -> Choice:
    """Choose how `estimate` would make its packings, and what they are expected to cost; nothing is made.

    Args:
        quantity: see `estimate`.
        rho: see `estimate`.
        error: see `estimate`.
        model: see `estimate`.

    Raises:
        InputError: see `estimate`.
        StorageError: see `estimate`.

    Example:
        >>> loose, tight = (jamlab.estimate_cost("z", rho=0.9, error=e) for e in (0.1, 0.005))
        >>> loose.seconds < tight.seconds, tight.way.start
        (True, 'droplets')
    """
    return plan_mean(quantity, rho, error, model=model).choice


@checked
def estimate(
    quantity: str,
    rho: float | None,
    error: float,
    *,
    seed: int = 1,
    model: str = "auto",
    processes: int = 1,
    progress: Progress = no_progress,
) -> Estimate:
    """Estimate a mean over packings of droplets to a given error, at the least cost that the table promises.

    The mean is that over random starts of packings of 64 droplets with the parameters of `dp.parameters`, jammed as in
    Boromand et al. 2.3 and compressed to rho in a fixed box, over those that jam below rho and have the quantity: g and
    b where a packing is stable, void_sides where it has a closed void. Cheaper packings (disks; droplets that take over
    from disks; other ways of which the table has a hundred packings) stand in for them where their mean difference
    from it is known well enough; it is taken off, and its error is part of the interval. Packings are added until the
    interval is met. Intervals of requests answered from one table share its errors: they are not independent.
    Larger packings have other means: see docs/how_to/mean_to_an_error.md.

    Args:
        quantity: "z", "g", "b", "rho-J", "a" or "void_sides", see `ENSEMBLE_QUANTITIES`.
        rho: true packing fraction, 0.84 to 0.98; not used for "rho-J", the mean packing fraction at onset.
        error: half the width wanted of the 95 % interval, absolute, in the unit of the quantity.
        seed: of the ensemble: another one gives other packings.
        model: "auto", or "sp" or "dp" to choose among disks or droplets only. Where these are not known well enough
            the estimate stops as soon as their scatter counts no more, and `met` is False.
        processes: packings made at once.
        progress: called with the share of the seeds expected in all that were tried, and their number in words.

    Raises:
        InputError: an unknown quantity, rho missing or outside the table, an error that is not positive and finite or
            takes too many packings, moduli from disks, a seed or a number of processes that there is not.
        StorageError: the table was made with other parameters than those of `dp.parameters` now.
        ConvergenceError: nearly no packing jams below rho.

    Example:
        >>> e = jamlab.estimate("rho-J", None, error=0.02)
        >>> e.met, len(e.values) == e.packings, abs(e.value - 0.834) < e.ci95
        (True, True, True)
    """
    check_seed(seed)
    if processes < 1:
        raise InputError(f"processes = {processes}: must be 1 or more")
    made = plan_mean(quantity, rho, error, model=model)
    maker = _Maker(made, seed, processes, progress)
    stopped = made.fill(error, maker)
    return Estimate(
        value=float(np.mean(made.good)) + made.choice.correction[quantity],
        ci95=made.error,
        met=made.error <= error,
        packings=len(made.good),
        left_out=len(maker.seeds) - len(made.good),
        seconds=made.seconds,
        choice=made.choice,
        values=np.array(made.good),
        seeds=np.array(maker.seeds)[np.isfinite(made.values)],
        stopped=stopped,
    )


class _Maker:
    """Makes packings as a plan says, from seeds far from those of the table, and tells how far the mean has come."""

    def __init__(self, plan: Sample, seed: int, processes: int, progress: Progress) -> None:
        self.seeds: list[int] = []
        self._found: list[tuple[float, float]] = []
        self._rng = np.random.default_rng([seed, 20])
        self._one = partial(make_one, way=plan.choice.way, quantity=plan.quantity, rho=plan.rho)
        self._correction = plan.choice.correction[plan.quantity]
        self._expected = round(plan.choice.packings / plan.scatter.share)
        self._processes, self._progress = processes, progress

    def __call__(self, count: int) -> list[tuple[float, float]]:
        before, found = len(self.seeds), self._found
        batch = [int(self._rng.integers(1_000_000, 2**31)) for _ in range(count)]
        self.seeds.extend(batch)
        if self._processes > 1:
            found.extend(
                run_side_by_side(self._one, batch, self._processes, done=lambda many: self._tell(before + many))
            )
        else:
            with threadpool_limits(1):
                for number in batch:
                    found.append(self._one(number))
                    self._tell(len(found))
        return found[before:]

    def _tell(self, tried: int) -> None:
        good = np.array([value for value, _ in self._found if math.isfinite(value)])
        text = f"{tried} packings"
        if len(good) > 1:
            text += f", mean {good.mean() + self._correction:.5g} ± {good.std(ddof=1) / len(good) ** 0.5:.1g}"
        self._progress(tried / max(self._expected, len(self.seeds)), text)


def make_one(
    seed: int, report: Callable[..., None] = lambda *step: None, *, way: EnsembleWay, quantity: str, rho: float
) -> tuple[float, float]:
    """Make one packing: its value, nan if it has none, and the CPU time that it took."""
    began = time.process_time()
    try:
        packing = ways.find_onset(way, seed)
        if quantity != ONSET:
            packing = ways.bring_on(way, packing, rho)
        value = packing_fraction(packing) if quantity == ONSET else ways.value_at(packing, quantity)
    except ConvergenceError:
        value = math.nan
    return value, time.process_time() - began
