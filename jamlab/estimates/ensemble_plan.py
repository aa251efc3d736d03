"""Plan an ensemble: the way to make packings and the number of them that give a mean to an error at least cost.

The interval of a mean over m packings made in some way has two parts: their scatter, t s / sqrt(m), which more packings
reduce, and what is not known about the way itself, the standard error of its difference from the reference in the
table, which they do not. A way is used only where the second part leaves room for the first.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, replace

from scipy.special import stdtrit

from jamlab.checks import check_choice, check_number, checked
from jamlab.errors import InputError
from jamlab.estimates.ensemble_way import EnsembleWay, default_vertices
from jamlab.estimates.plan_words import absence_words, choice_words, finish_words
from jamlab.estimates.way_errors import Scatter, difference, is_known, scatter
from jamlab.estimates.way_table import ONSET, N, WayRecord, read_ways
from jamlab.packing.short_repr import short_repr
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


@dataclass(frozen=True)
class EnsemblePlan:
    """How a mean will be estimated, and what that should cost.

    Attributes:
        quantity, rho: of which the mean is wanted; rho is nan for "rho-J".
        way: how packings are made.
        packings: number of them with a value that is expected to do.
        error: half the width expected of the 95 % interval.
        bias_error: part of `error` that more packings do not reduce: what the table knows about the way.
        correction: to add to the mean over packings, from the table; 0 for droplets.
        seconds: expected CPU time on the machine of the table.
        scatter: of one packing.
        why: statements with "; " between them, each of which can be read alone.

    Example:
        >>> plan = jamlab.plan_estimate("z", rho=0.9, error=0.05)
        >>> plan.error <= 0.05, plan.packings >= 4
        (True, True)
    """

    quantity: str
    rho: float
    way: EnsembleWay
    packings: int
    error: float
    bias_error: float
    correction: float
    seconds: float
    scatter: Scatter
    why: str = ""

    __repr__ = short_repr


@checked
def plan_estimate(
    quantity: str,
    rho: float | None,
    error: float,
    *,
    model: str = "auto",
    table: Mapping[EnsembleWay, WayRecord] | None = None,
) -> EnsemblePlan:
    """Choose the cheapest ensemble that is expected to give a mean to an error; nothing runs.

    Args:
        quantity: "z", "g", "b", "rho-J", "a" or "void_sides", see `jamlab.estimate`, which also says what the mean is.
        rho: true packing fraction, 0.84 to 0.98; not used for "rho-J".
        error: half the width wanted of the 95 % interval, absolute.
        model: "auto", or "sp" or "dp" to choose among disks or droplets only.
        table: other than the shipped one, see `jamlab.estimates.way_table.read_ways`.

    Raises:
        InputError: an unknown quantity or model, rho missing or outside the table, moduli from disks, an error that is
            not positive and finite or takes more than 100 000 packings.
        StorageError: the table was made with other parameters than those of `dp.parameters` now.

    Example:
        >>> loose, tight = (jamlab.plan_estimate("z", rho=0.9, error=e) for e in (0.1, 0.005))
        >>> loose.seconds < tight.seconds, tight.way.start
        (True, 'droplets')
    """
    table = read_ways() if table is None else table
    _check(table, quantity, rho, error, model)
    reference = table[reference_way()]
    at = math.nan if rho is None or quantity == ONSET else rho
    able = {way: record for way, record in table.items() if _gives(way, quantity)}
    ways = [r for r in able.values() if model in ("auto", r.way.model) and r.way.contact is None]
    yields = _LEAST_YIELD * scatter(reference, quantity, at).share
    known = [_plan(r, reference, quantity, at, error) for r in ways if is_known(r, reference, quantity)]
    plans = [p for p in known if p.scatter.share >= yields]
    limit = _LARGEST_SHARE * error
    good = [p for p in plans if p.bias_error <= limit]
    unused = [f"rho = {rho:g} is not used: {ONSET} is that at onset"] if quantity == ONSET and rho is not None else []
    if not plans:
        raise InputError(f"model = {model!r}: disks do not tell {quantity} of droplets, take 'dp'")
    if not good:
        nearest = min(plans, key=lambda p: p.bias_error)
        why = f"{nearest.way}: known no better than {nearest.bias_error:.2g} with this model, however many packings"
        return replace(nearest, why="; ".join([why, *unused]))
    best = min(good, key=lambda p: p.seconds)
    if best.error > error:
        raise InputError(f"error = {error:g}: takes more than {MOST} packings, which give {best.error:.2g}")
    said = choice_words(best, good, [p for p in plans if p not in good], limit)
    said += absence_words(len(ways) - len(known), len(known) - len(plans), quantity, at)
    said += finish_words(able, best.way, quantity, at)
    return replace(best, why="; ".join(said + unused))


def interval(deviation: float, freedom: float, packings: int) -> float:
    """Half the width of the 95 % interval of a mean over some packings."""
    return _student(freedom) * deviation / math.sqrt(packings)


def _student(freedom: float) -> float:
    return float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE))


def reference_way() -> EnsembleWay:
    """Droplets from the start, whose mean is estimated."""
    return EnsembleWay("droplets", N, default_vertices())


def _gives(way: EnsembleWay, quantity: str) -> bool:
    """Whether a way has the quantity: carried droplets have no onset of their own, disks other moduli."""
    return not ((quantity == ONSET and way.start == "carried") or (quantity in ("g", "b") and way.nv is None))


def _plan(record: WayRecord, reference: WayRecord, quantity: str, rho: float, error: float) -> EnsemblePlan:
    bias_error = correction = 0.0
    if record is not reference:
        off = difference(record, reference, quantity, rho)
        bias_error, correction = _student(off.freedom) * off.error, -off.value
    one = scatter(record, quantity, rho)
    aim = room(error, bias_error)
    packings = bisect_left(
        range(MOST), True, FEWEST, key=lambda m: interval(one.deviation, one.freedom + m - 1, m) <= aim
    )
    reached = math.hypot(interval(one.deviation, one.freedom + packings - 1, packings), bias_error)
    seconds = packings / max(one.share, 1e-3) * one.seconds
    return EnsemblePlan(quantity, rho, record.way, packings, reached, bias_error, correction, seconds, one)


def _check(table: Mapping[EnsembleWay, WayRecord], quantity: str, rho: float | None, error: float, model: str) -> None:
    check_choice("quantity", quantity, ENSEMBLE_QUANTITIES)
    check_choice("model", model, ("auto", "sp", "dp"))
    check_number("error", error, math.inf)
    reference = table.get(reference_way())
    if reference is None:
        raise InputError(
            f"the table has no {reference_way()}: `dp.parameters` changed; make it anew with `jamlab chart estimates`"
        )
    if quantity == ONSET:
        return
    low, high = reference.levels[0], reference.levels[-1]
    if rho is None:
        raise InputError(f"{quantity} needs rho, a true packing fraction: give one in {low:g} .. {high:g}")
    if not low <= rho <= high:
        raise InputError(f"rho = {rho}: the table of ways spans {low:g} .. {high:g}; take a campaign beyond it")
