"""Plan an ensemble: the way to make packings and the number of them that give a mean to an error at least cost.

The interval of a mean over m packings made in some way has two parts: their scatter, t s / sqrt(m), which more packings
reduce, and what is not known about the way itself, the standard error of its difference from the reference in the
table, which they do not. A way is used only where the second part leaves room for the first.
"""

import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import Any

import pandas as pd
from scipy.special import stdtrit

from jamlab.checks import check_choice, check_number
from jamlab.errors import InputError
from jamlab.estimates.ensemble_way import ONSET, EnsembleWay, default_vertices
from jamlab.estimates.options import OldWords, Why, judge, taken
from jamlab.estimates.way_table import N, Scatter, WayRecord, Ways, difference, is_known, read_ways, scatter
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


@dataclass(frozen=True, eq=False)
class EnsemblePlan(OldWords):
    """How a mean will be estimated, and what that should cost."""

    # quantity, rho: of which the mean is wanted; rho is nan for "rho-J"
    quantity: str
    rho: float
    way: EnsembleWay  # how packings are made
    packings: int  # number of them with a value that is expected to do
    error: float  # half the width expected of the 95 % interval
    bias_error: float  # part of `error` that more packings do not reduce: what the table knows about the way
    correction: float  # to add to the mean over packings, from the table; 0 for droplets
    seconds: float  # expected CPU time on the machine of the table
    scatter: Scatter  # of one packing
    options: pd.DataFrame  # a row for each way, see `jamlab.Choice`; also `packings` and `bias_error`

    __repr__ = short_repr


def plan_mean(
    quantity: str, rho: float | None, error: float, *, model: str = "auto", table: Ways | None = None
) -> EnsemblePlan:
    """Choose the cheapest ensemble that is expected to give a mean to an error, see `jamlab.estimate`; nothing runs."""
    table = read_ways() if table is None else table
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
    options = judge(rows, "seconds", nearest="bias_error")
    row = taken(options)
    if row is None:
        raise InputError(f"model = {model!r}: too few of its packings in the table have {quantity}, take 'auto'")
    best = rows[row]
    if best["why"] is None and best["error"] > error:
        raise InputError(f"error = {error:g}: takes more than {MOST} packings, which give {best['error']:.2g}")
    one = scatter(records[row], quantity, at)
    correction = 0.0
    if records[row] is not reference:
        correction = -difference(records[row], reference, quantity, at).value
    facts = {name: value for name, value in best.items() if name != "why"}
    return EnsemblePlan(quantity, at, scatter=one, correction=correction, options=options, **facts)


def interval(deviation: float, freedom: float, packings: int = 1) -> float:
    """Half the width of the 95 % interval of a mean over some packings."""
    return float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * deviation / math.sqrt(packings)


def reference_way() -> EnsembleWay:
    """Droplets from the start, whose mean is estimated."""
    return EnsembleWay("droplets", N, default_vertices())


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
            f"the table has no {reference_way()}: `dp.parameters` changed; make it anew with `jamlab chart estimates`"
        )
    if quantity == ONSET:
        return math.nan
    low, high = reference.levels[0], reference.levels[-1]
    if rho is None:
        raise InputError(f"{quantity} needs rho, a true packing fraction: give one in {low:g} .. {high:g}")
    if not low <= rho <= high:
        raise InputError(f"rho = {rho}: the table of ways spans {low:g} .. {high:g}; take a campaign beyond it")
    return rho
