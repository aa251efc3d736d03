"""The least model that a scene needs: disks or droplets, contact form, number of vertices, chosen by what they cost.

The choice comes from the table behind `jamlab.estimate`. One packing asks another question than a mean over packings:
how far z, G, A and the voids of a way are from those of default droplets (Boromand et al. with the parameters of
`dp.parameters`) that the same disks carry, seed by seed. What a way is off by on average is corrected for; a third of
that, and what it scatters by from packing to packing, is its expected error. Default droplets are the last resort.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from jamlab.arrays import Array
from jamlab.checks import check_count, checked
from jamlab.errors import InputError
from jamlab.estimates.ensemble_way import EnsembleWay, default_way
from jamlab.estimates.way_table import N, WayRecord, read_ways
from jamlab.packing.law_parameters import MODELS
from jamlab.statistics.confidence import CONFIDENCE

QUANTITIES = {
    "z": "contacts per particle without rattlers, absolute",
    "g": "relaxed shear modulus, mean over directions, relative to its mean size over packings",
    "a": "mean shape factor above that of a free particle, A - A_J, absolute",
    "void_sides": "mean number of sides of a void, absolute",
}
_MOST_FAILURES = 0.1  # of the packings of a level: a way that fails more often is not offered there
_TRANSFER = 1 / 3  # part of a mean error that may be another in packings of another size


@dataclass(frozen=True)
class Choice:
    """What was chosen for a scene, and why.

    Attributes:
        way: model, contact form and vertices.
        error: expected error of each quantity asked for, after correction: 95 % of new packings are nearer; 0 for
            default droplets, against which errors are measured.
        correction: what to add to each quantity of `QUANTITIES` as measured.
        seconds: expected CPU time on the machine of the table.
        why: one sentence.

    Example:
        >>> print(jamlab.choose(rho=0.87, tolerance={"z": 0.25}, n=64).why)
        64 disks: cheapest of 4 ways expected to keep z within 0.25, with z to 0.15
    """

    way: EnsembleWay
    error: dict[str, float]
    correction: dict[str, float]
    seconds: float
    why: str


@checked
def choose(
    rho: float,
    tolerance: Mapping[str, float],
    n: int = 64,
    *,
    model: str = "auto",
    table: Mapping[EnsembleWay, WayRecord] | None = None,
) -> Choice:
    """Choose the cheapest way that is expected to meet every tolerance.

    Args:
        rho: true packing fraction of the scene.
        tolerance: quantity of `QUANTITIES` -> error allowed against default droplets on the same packing.
        n: even number of particles; errors from packing to packing go with n^-1/2.
        model: "auto", or "sp" or "dp" to choose within a model.
        table: other than the shipped one, see `jamlab.estimates.way_table.read_ways`.

    Raises:
        InputError: an unknown quantity or model, an odd n, a tolerance that is not positive, rho outside the table, or
            a tolerance that nothing meets; the message says what the best one does.
        StorageError: the table was made with other parameters than those of `dp.parameters` now.

    Example:
        >>> choice = jamlab.choose(rho=0.87, tolerance={"z": 0.25}, n=64)
        >>> choice.way.model, choice.error["z"] <= 0.25
        ('sp', True)
    """
    _check(rho, tolerance, model)
    check_count(n)
    table = read_ways() if table is None else table
    reference = table.get(default_way(N))
    if reference is None:
        raise InputError(f"the table has no {default_way(N)}: make it anew with `jamlab chart estimates`")
    levels = reference.levels
    if not levels[0] <= rho <= levels[-1]:
        raise InputError(f"rho = {rho}: the table of ways spans {levels[0]:g} .. {levels[-1]:g}; name a model instead")
    options = [
        _option(record, reference, rho, tolerance, n)
        for record in list_records(table)
        if model in ("auto", record.way.model) and _succeeds(record, reference, rho)
    ]
    good = [o for o in options if all(o.error[name] <= limit for name, limit in tolerance.items())]
    asked = ", ".join(f"{name} within {limit:g}" for name, limit in tolerance.items())
    if not good:
        best = min(options, key=lambda o: max(o.error[k] / v for k, v in tolerance.items()), default=None)
        close = "" if best is None else f"; {best.way} comes nearest with {_errors(best.error)}"
        raise InputError(f"nothing in the table meets {asked} at rho = {rho:g} with n = {n}{close}")
    first = min(good, key=lambda o: o.seconds)
    faster = [o for o in options if o.seconds < first.seconds]
    why = f"{first.way}: cheapest of {len(good)} ways expected to keep {asked}, with {_errors(first.error)}"
    if faster:
        why += "; faster but not good enough: " + "; ".join(f"{o.way} with {_errors(o.error)}" for o in faster)
    return replace(first, why=why)


def list_records(table: Mapping[EnsembleWay, WayRecord]) -> list[WayRecord]:
    """List the ways to make one packing from disks that a table knows: a packing to keep has no looser minimum."""
    return [r for w, r in table.items() if w.n == N and w.start != "droplets" and w.tolerance is None]


def errors_of(record: WayRecord, reference: WayRecord, quantity: str) -> list[Array]:
    """Value of a way minus that of a reference, packing by packing, at each level; of "g" over the mean of its size."""
    _, one, two = np.intersect1d(record.seeds, reference.seeds, return_indices=True)
    mine, true = record.values[quantity][one], reference.values[quantity][two]
    scale = np.nanmean(np.abs(true), axis=0) if quantity == "g" else np.ones(len(record.levels))
    return [column[np.isfinite(column)] for column in ((mine - true) / scale).T]


def expected_error(errors: Array, n_table: int, n: int, quantum: float = 0.0) -> float:
    """Error that 95 % of new packings of n particles stay below once the mean of the errors is taken off.

    Student's prediction interval, t s sqrt(1 + 1/m), from errors of m packings of n_table particles, scaled with
    n^-1/2; `quantum`, the least step of the quantity, bounds s from below.
    """
    m = len(errors)
    if m < 2:
        return float("inf")
    spread = max(float(np.std(errors, ddof=1)), 0.5 * quantum)
    t = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, m - 1))
    return t * spread * float(np.sqrt((1 + 1 / m) * n_table / n))


def _check(rho: float, tolerance: Mapping[str, float], model: str) -> None:
    if model not in ("auto", *MODELS):
        raise InputError(f"unknown model {model!r}: use auto, {', '.join(MODELS)}")
    if not tolerance:
        raise InputError(f"no tolerance given: state one for any of {', '.join(QUANTITIES)}")
    for name, limit in tolerance.items():
        if name not in QUANTITIES:
            raise InputError(f"no tolerance can be asked for {name!r}: use {', '.join(QUANTITIES)}")
        if not (isinstance(limit, int | float) and np.isfinite(limit) and limit > 0):
            raise InputError(f"tolerance of {name} is {limit!r}: must be a positive number")
    if not (isinstance(rho, int | float | np.floating) and 0 < rho < 1):
        raise InputError(f"rho = {rho!r}: a true packing fraction lies between 0 and 1")


def _succeeds(record: WayRecord, reference: WayRecord, rho: float) -> bool:
    """Whether a way gives a packing where default droplets do, at the levels on both sides of rho."""
    _, one, two = np.intersect1d(record.seeds, reference.seeds, return_indices=True)
    there = np.isfinite(reference.values["z"][two])
    failed = (there & ~np.isfinite(record.values["z"][one])).sum(axis=0)
    above = int(np.searchsorted(record.levels, rho))
    near = [above] if record.levels[above] == rho else [above - 1, above]
    return bool((failed[near] <= _MOST_FAILURES * there.sum(axis=0)[near]).all())


def _option(record: WayRecord, reference: WayRecord, rho: float, tolerance: Mapping[str, float], n: int) -> Choice:
    """Errors and cost of a way at rho, interpolated between the levels of the table."""

    def at_rho(values: list[float] | Array) -> float:
        return float(np.interp(rho, record.levels, values))

    error, correction = dict.fromkeys(tolerance, 0.0), dict.fromkeys(QUANTITIES, 0.0)
    for name in QUANTITIES if record is not reference else ():
        levels = errors_of(record, reference, name)
        quantum = 2 / N if name == "z" else 0.0
        mean = at_rho([float(np.mean(each)) if len(each) else float("inf") for each in levels])
        if name in tolerance:
            scatter = at_rho([expected_error(each, N, n, quantum) for each in levels])
            error[name] = scatter + (1.0 if name == "g" else _TRANSFER) * abs(mean)
        # errors of G are relative, its unit is not: a factor would be needed, and near onset there is none
        correction[name] = 0.0 if name == "g" else -mean
    seconds = at_rho(record.seconds.mean(axis=0)) * n / N
    return Choice(replace(record.way, n=n), error, correction, seconds, "")


def _errors(error: Mapping[str, float]) -> str:
    return ", ".join(f"{name} to {value:.2g}" for name, value in error.items())
