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
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit
from threadpoolctl import threadpool_limits

from jamlab.arguments.choices import EnsembleQuantity, ModelOrAuto
from jamlab.arrays import Array
from jamlab.checks import check_choice, checked
from jamlab.errors import ConvergenceError, InputError, named
from jamlab.estimates import ways
from jamlab.estimates.choice import Choice, Why, judge
from jamlab.estimates.ways import (
    ONSET,
    EnsembleWay,
    N,
    Scatter,
    WayRecord,
    Ways,
    difference,
    is_known,
    reference_record,
    scatter,
)
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.mechanics.negative_moduli import warn_of_negative_rows
from jamlab.models.disks import DISKS
from jamlab.models.droplets import DROPLETS
from jamlab.packing.kinds import MODELS
from jamlab.packing.result import Result
from jamlab.processes.progress import Progress, told
from jamlab.processes.side_by_side import run_side_by_side, workers_there
from jamlab.statistics.confidence import CONFIDENCE, room

ENSEMBLE_QUANTITIES = {
    "z": "contacts per particle without rattlers",
    "g": "relaxed shear modulus, mean over directions, eps/l^2",
    "b": "relaxed bulk modulus, eps/l^2",
    ONSET: "true packing fraction at jamming onset",
    "d_shape_factor": "mean excess shape factor A - A_J (A_J: free particle)",
    "void_sides": "mean number of sides of a void",
}
FEWEST, MOST = 4, 100_000  # packings


@dataclass(frozen=True)
class Plan:
    """How many packings are made before an estimate is given up."""

    # of the share of seeds of which droplets have a value: the few that jam stand for no others
    least_yield: float = 0.5
    largest_share: float = 0.6  # of the error asked for that the way itself may take in an automatic choice
    most_growth: float = 2.0  # of the number of packings where the first ones do not do
    over_plan: int = 16  # times the packings planned: beyond, the table does not fit what is seen
    tried: int = 20  # seeds that are made before their share is judged
    least_share: float = 0.1  # of them, that must have given a value


PLAN = Plan()


def plan_mean(
    quantity: str, rho: float | None, error: float, *, model: ModelOrAuto = "auto", table: Ways | None = None
) -> MeanPlan:
    """Choose the cheapest ensemble that is expected to give a mean to an error, see `jamlab.estimate`; nothing runs."""
    table = ways.read_ways() if table is None else table
    check_choice("quantity", quantity, ENSEMBLE_QUANTITIES)
    if model not in ("auto", DISKS.name, DROPLETS.name):
        MODELS.get(model)  # refuses one that is unknown
        check_choice("model", model, ("auto", DISKS.name, DROPLETS.name))
    reference = reference_record(table, reference_way(), rho, onset=quantity == ONSET)
    at = math.nan if rho is None or quantity == ONSET else rho
    if not is_known(reference, reference, quantity, at):
        raise InputError(
            f"{named('rho', rho)}: too few packings in the reference table have {quantity}; use another rho"
        )
    records = [r for r in table.values() if model in ("auto", r.way.model)]
    if quantity == ONSET:  # carried droplets have none of their own
        records = [r for r in records if r.way.start != "carried"]
    if quantity in ("g", "b"):  # disks have other moduli
        records = [r for r in records if r.way.nv is not None]
    if not records:
        raise InputError(
            f"{named('model', model)}: {quantity} of droplets cannot be estimated from disks; use {DROPLETS.name!r}"
        )
    rows = [_option(record, reference, quantity, at, error) for record in records]
    options, row = judge(rows, "seconds", nearest="bias_error")
    if row is None:
        raise InputError(
            f"{named('model', model)}: too few reference packings of this model have {quantity}; use 'auto'"
        )
    best = rows[row]
    if best["why"] is None and best["error"] > error:
        raise InputError(
            f"{named('error', error, 'g')}: needs more than {MOST} packings (they give {best['error']:.2g})"
        )
    correction = -difference(records[row], reference, quantity, at).value if records[row] is not reference else 0.0
    choice = Choice(
        way=best["way"], bound={quantity: best["error"]}, options=options, correction={quantity: correction},
        seconds=best["seconds"], packings=best["packings"],
    )  # fmt: skip
    return MeanPlan(quantity, at, choice, scatter(records[row], quantity, at), best["bias_error"])


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
    if one.share < PLAN.least_yield * scatter(reference, quantity, rho).share:
        why, bias_error = Why.FAILS, math.nan
    elif bias_error > PLAN.largest_share * error:
        why = Why.UNSURE
    columns = {"packings": packings, "error": reached, "bias_error": bias_error, "seconds": seconds}
    return {"way": record.way, **columns, "why": why}


Made = list[tuple[float, float]]  # value of each packing, nan if it has none, and its CPU seconds


@dataclass(frozen=True)
class MeanPlan:
    """How packings are made whose mean is wanted, and what the table knows of them."""

    # quantity, rho: of which the mean is wanted; rho is nan for "rho_J"
    quantity: str
    rho: float
    choice: Choice
    scatter: Scatter  # of one packing
    bias_error: float  # part of the error that more packings do not reduce: what the table knows about the way

    def collect(self, error: float, make: Callable[[int], Made]) -> Made:
        """Make packings, so many at a time, until their interval is `error` or their scatter is negligible."""
        found: Made = []
        wanted, aim = self.choice.packings, room(error, self.bias_error)
        while True:
            while (missing := wanted - len(good := finite(found))) > 0:
                if len(found) >= PLAN.tried and len(good) < PLAN.least_share * len(found):
                    raise ConvergenceError(
                        f"only {len(good)} of {len(found)} packings have {self.quantity} at rho = {self.rho:g}, where "
                        "most are still unjammed: increase rho"
                    )
                found.extend(make(missing))
            ratio = self.half_width(good) / aim
            if ratio <= 1 or wanted >= PLAN.over_plan * self.choice.packings:
                return found
            wanted = math.ceil(wanted * min(max(ratio**2, 1 + 1 / wanted), PLAN.most_growth))

    def half_width(self, values: Sequence[float] | Array) -> float:
        """Scatter of the interval: packings and table together, or the table alone if larger.
        Packings that happen to lie close together are no better known than the table says."""
        known, more = self.scatter, len(values) - 1
        freedom = known.freedom + more
        variance = (known.freedom * known.deviation**2 + more * float(np.var(values, ddof=1))) / freedom
        return interval(max(math.sqrt(variance), known.deviation), freedom, len(values))

    def ci95(self, values: Sequence[float] | Array) -> float:
        """Half the width of the interval of the mean, with what the table does not know."""
        return math.hypot(self.half_width(values), self.bias_error)


def finite(found: Made) -> list[float]:
    """Values of the packings that have one."""
    return [value for value, _ in found if math.isfinite(value)]


@dataclass(frozen=True)
class Estimate(Result):
    """A mean over packings, with its 95 % interval value -+ ci95.

    Attributes:
        value: mean, in the unit of `jamlab.estimates.estimate.ENSEMBLE_QUANTITIES`.
        ci95: half the width of the 95 % interval, from the scatter of the packings and the uncertainty of the bias.
        met: whether `ci95` is at most the error asked for.
        packings: number of packings in the mean.
        left_out: seeds without a value: unjammed at rho, not stable, or failed.
        seconds: CPU time that it took.
        choice: the plan: protocol (`way`), number of packings, correction, expected cost, and alternatives.
        values: (packings,) value of each packing, before the correction of the plan.
        seeds: (packings,) int64, seed of each packing.

    Example:
        >>> from dataclasses import fields
        >>> [field.name for field in fields(jamlab.results.Estimate)][:4]
        ['value', 'ci95', 'met', 'packings']
    """

    _rows = ("seeds", "values")

    value: float
    ci95: float
    met: bool
    packings: int
    left_out: int
    seconds: float
    choice: Choice
    values: Array
    seeds: NDArray[np.int64]


@checked
def estimate_cost(
    quantity: EnsembleQuantity, rho: float | None, error: float, *, model: ModelOrAuto = "auto"
) -> Choice:
    """Return the plan and the expected cost of `estimate` without making packings.

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
    quantity: EnsembleQuantity,
    rho: float | None,
    error: float,
    *,
    seed: int = 1,
    model: ModelOrAuto = "auto",
    workers: int | Executor | None = 1,
    progress: Progress | None = None,
) -> Estimate:
    """Estimate an ensemble mean for droplets to a requested error at the lowest expected cost.

    The mean is over packings of 64 droplets with default parameters, jammed by `start="from-disks"` of `jam` and
    compressed to rho in a fixed box. Packings that are unjammed at rho or lack the quantity are left out. Cheaper
    protocols (disks; droplets started from compressed disks) replace droplets where their bias is known from the
    shipped table. The bias is subtracted and its uncertainty is included. Packings are added until the 95 % interval is
    narrow enough. Results from one table share its errors and are not independent. Larger packings have a different
    mean.

    Args:
        quantity: "z", "g", "b", "rho_J", "d_shape_factor" or "void_sides", see `ENSEMBLE_QUANTITIES`.
        rho: true packing fraction, 0.84 to 0.98; ignored for "rho_J", the mean packing fraction at onset.
        error: target half-width of the 95 % confidence interval, in the unit of the quantity.
        seed: seed of the ensemble.
        model: "auto", or the name of a model, disks only or droplets only. If the bias of the model is too uncertain,
            the estimate stops early and `met` is False.
        workers: number of processes, each of which makes a packing, or an executor (`concurrent.futures.Executor`);
            None: all cores.
        progress: called with (fraction of the expected seeds, text); True: print it.

    Warns:
        JamlabWarning: "g" or "b" is negative in some packings, which count in the mean.

    Raises:
        InputError: an unknown quantity, rho missing or outside the table, an error that needs too many packings, moduli
            from disks, or a value out of range.
        StorageError: the table was made with other parameters than `dp.parameters`.
        ConvergenceError: most packings are unjammed at rho.
        EngineError: a process was killed, or the executor cannot be used.

    Example:
        >>> e = jamlab.estimate("rho_J", None, error=0.02)
        >>> e.met, len(e.values) == e.packings, abs(e.value - 0.834) < e.ci95
        (True, True, True)
    """
    where = workers_there(workers)
    plan = plan_mean(quantity, rho, error, model=model)
    one = partial(make_one, way=plan.choice.way, quantity=quantity, rho=plan.rho)
    expected = round(plan.choice.packings / plan.scatter.share)
    rng = np.random.default_rng([seed, 20])
    seeds: list[int] = []

    def make(count: int) -> Made:
        before = len(seeds)
        seeds.extend(int(rng.integers(1_000_000, 2**31)) for _ in range(count))  # far from the seeds of the table

        def tell(many: int) -> None:
            if progress is not None:
                told(progress)((before + many) / max(expected, len(seeds)), f"{before + many} packings")

        if where != 1:
            return run_side_by_side(one, seeds[before:], where, done=tell)
        found = []
        with threadpool_limits(1):
            for many, number in enumerate(seeds[before:], 1):
                found.append(one(number))
                tell(many)
        return found

    found = plan.collect(error, make)
    values = np.array(finite(found))
    if quantity in ("g", "b"):
        warn_of_negative_rows({quantity: values}, "packings")
    ci95 = plan.ci95(values)
    return Estimate(
        value=float(values.mean()) + plan.choice.correction[quantity],
        ci95=ci95,
        met=ci95 <= error,
        packings=len(values),
        left_out=len(found) - len(values),
        seconds=sum(seconds for _, seconds in found),
        choice=plan.choice,
        values=values,
        seeds=np.array([number for number, (value, _) in zip(seeds, found, strict=True) if math.isfinite(value)]),
    )


def make_one(
    seed: int, report: Callable[..., None] = lambda *step: None, *, way: EnsembleWay, quantity: str, rho: float
) -> tuple[float, float]:
    """Make one packing: its value, nan if it has none, and the CPU time that it took."""
    began = time.process_time()
    try:
        packing = ways.find_onset(way, seed)
        if quantity != ONSET:
            packing = ways.bring_on(way, packing, rho)
        value = packing_fraction(packing) if quantity == ONSET else ways.values_at(packing, (quantity,))[quantity]
    except ConvergenceError:
        value = math.nan
    return value, time.process_time() - began
