"""The least model that a scene needs: disks or droplets, contact form, number of vertices, chosen by what they cost.

The choice comes from a small table in this package, measured by `jamlab chart table`: for each way to model a scene and
some true packing fractions, how far z, G, A and the voids are from those of default droplets (Boromand et al. with the
parameters of `dp.parameters`) on the same packing, and what it took. What a way is off by on average is corrected for;
a third of that, and what it scatters by from packing to packing, is its expected error. Default droplets themselves are
the last resort. A table made with other DP parameters than the present defaults is used, but the choice says so.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from jamlab.checks import MOST_PARTICLES, checked
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError, StorageError
from jamlab.packing.law_parameters import CONTACT_FORMS, MODELS

QUANTITIES = {
    "z": "contacts per particle without rattlers, absolute",
    "g": "relaxed shear modulus, mean over directions, relative to its mean size over packings",
    "a": "mean shape factor above that of a free particle, A - A_J, absolute",
    "void_sides": "mean number of sides of a void, absolute",
}
TABLE_MARGIN = 0.01  # beyond the ends of the table that its errors still hold
CONFIDENCE = 0.95
_MOST_FAILURES = 0.1  # of the packings of a row: a way that fails more often is not offered
_TRANSFER = 1 / 3  # part of a mean error that may be another in packings of another size
_SCHEMA = 1


@dataclass(frozen=True)
class Way:
    """A way to model a scene.

    Attributes:
        model: "sp" or "dp".
        contact: DP contact form, None for disks.
        nv: (small, large) number of vertices, None for disks.
    """

    model: str
    contact: str | None = None
    nv: tuple[int, int] | None = None

    def __str__(self) -> str:
        return "disks (SP)" if self.nv is None else f"polygons (DP), {self.contact}, {self.nv[0]}/{self.nv[1]} vertices"


@dataclass(frozen=True)
class Choice:
    """What was chosen for a scene, and why.

    Attributes:
        way: model, contact form and vertices.
        error: expected error of each quantity asked for, after correction: 95 % of new packings are nearer; 0 for
            default droplets, against which errors are measured.
        correction: what to add to each quantity of `QUANTITIES` as measured.
        seconds: expected wall time on the machine of the table.
        why: one sentence.
        warning: what makes the table doubtful here; empty if nothing does.

    Example:
        >>> print(jamlab.choose(rho=0.87, tolerance={"z": 0.25}, n=64).why)
        disks (SP): cheapest of 4 ways expected to keep z within 0.25, with z to 0.17
    """

    way: Way
    error: dict[str, float]
    correction: dict[str, float]
    seconds: float
    why: str
    warning: str = ""


@checked
def choose(
    rho: float, tolerance: Mapping[str, float], n: int = 64, *, model: str = "auto", table: dict[str, Any] | None = None
) -> Choice:
    """Choose the cheapest way that is expected to meet every tolerance.

    Args:
        rho: true packing fraction of the scene.
        tolerance: quantity of `QUANTITIES` -> error allowed against default droplets on the same packing.
        n: particles; errors from packing to packing go with n^-1/2.
        model: "auto", or "sp" or "dp" to choose within a model.
        table: other than the shipped one, see `read_table`.

    Raises:
        InputError: an unknown quantity or model, a tolerance that is not positive, rho outside the table, or a
            tolerance that nothing meets; the message says what the best one does.

    Example:
        >>> choice = jamlab.choose(rho=0.87, tolerance={"z": 0.25}, n=64)
        >>> choice.way.model, choice.error["z"] <= 0.25
        ('sp', True)
    """
    _check(rho, tolerance, model)
    if not 1 <= n <= MOST_PARTICLES:
        raise InputError(f"n = {n}: must be a number of particles from 1 to {MOST_PARTICLES}")
    table = read_table() if table is None else table
    if not {"rows"} <= table.keys():
        raise InputError(f"table: has {sorted(map(str, table))} and no rows; take one that `read_table` returned")
    levels = sorted({row["rho"] for row in table["rows"]})
    if not levels[0] - TABLE_MARGIN <= rho <= levels[-1] + TABLE_MARGIN:
        raise InputError(f"rho = {rho}: the table of errors spans {levels[0]} .. {levels[-1]}; name a model instead")
    options = [_option(table, way, rho, tolerance, n) for way in list_ways(table) if model in ("auto", way.model)]
    usable = [o for o in options if o is not None]
    good = [o for o in usable if all(o.error[name] <= limit for name, limit in tolerance.items())]
    asked = ", ".join(f"{name} within {limit:g}" for name, limit in tolerance.items())
    if not good:
        best = min(usable, key=lambda o: max(o.error[k] / v for k, v in tolerance.items()), default=None)
        close = "" if best is None else f"; {best.way} comes nearest with {_errors(best.error)}"
        raise InputError(f"nothing in the table meets {asked} at rho = {rho:g} with n = {n}{close}")
    first = min(good, key=lambda o: o.seconds)
    faster = [o for o in usable if o.seconds < first.seconds]
    why = f"{first.way}: cheapest of {len(good)} ways expected to keep {asked}, with {_errors(first.error)}"
    if faster:
        why += "; faster but not good enough: " + "; ".join(f"{o.way} with {_errors(o.error)}" for o in faster)
    return replace(first, why=why, warning=_stale(table))


def list_ways(table: dict[str, Any]) -> list[Way]:
    """List the ways that a table knows."""
    return list(dict.fromkeys(_way(row["way"]) for row in table["rows"]))


def read_table(path: Path | None = None) -> dict[str, Any]:
    """Read the shipped table, or one written by `jamlab chart table`.

    Raises:
        StorageError: it cannot be read, or is not such a table.
    """
    source = path or resources.files("jamlab.protocols").joinpath("model_choice.json")
    try:
        table = json.loads(source.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StorageError(f"cannot read the table {source}: {error}; make one with `jamlab chart table`") from error
    if not isinstance(table, dict) or table.get("schema") != _SCHEMA:
        raise StorageError(f"{source} is no table of schema {_SCHEMA}: make one with `jamlab chart table`")
    return table


def expected_error(errors: list[float], n_table: int, n: int, quantum: float = 0.0) -> float:
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


def _option(table: dict[str, Any], way: Way, rho: float, tolerance: Mapping[str, float], n: int) -> Choice | None:
    """Errors and cost of a way at rho, interpolated between the levels of the table; None if it fails there."""
    rows = sorted((row for row in table["rows"] if _way(row["way"]) == way), key=lambda row: row["rho"])
    if way.contact is not None and way.contact not in CONTACT_FORMS:
        return None
    if not rows or any(row["failed"] > _MOST_FAILURES * row["of"] for row in rows):
        return None
    levels = [row["rho"] for row in rows]

    def at_rho(values: list[float]) -> float:
        return float(np.interp(rho, levels, values))

    error, correction = {}, {}
    for name in QUANTITIES:
        quantum = 2 / table["n"] if name == "z" else 0.0
        exact = way == _way(table["reference"])
        each = [0.0 if exact else expected_error(row["errors"][name], table["n"], n, quantum) for row in rows]
        error[name] = at_rho(each)
        # errors of G are relative, its unit is not: a factor would be needed, and near onset there is none
        off = [0.0 if name == "g" or not row["errors"][name] else -float(np.mean(row["errors"][name])) for row in rows]
        if not exact:
            bias = [abs(float(np.mean(row["errors"][name]))) if row["errors"][name] else np.inf for row in rows]
            error[name] += (1.0 if name == "g" else _TRANSFER) * at_rho(bias)
        correction[name] = at_rho(off)
    seconds = at_rho([row["seconds"] for row in rows]) * n / table["n"]
    return Choice(way, {name: error[name] for name in tolerance}, correction, seconds, "")


def _way(entry: dict[str, Any]) -> Way:
    nv = entry["nv"]
    return Way(entry["model"], entry["contact"], None if nv is None else (int(nv[0]), int(nv[1])))


def _stale(table: dict[str, Any]) -> str:
    now = {k: v for k, v in defaults("dp").items() if k in table["parameters"]}
    changed = [f"{k} = {table['parameters'][k]} (now {v})" for k, v in now.items() if table["parameters"][k] != v]
    if not changed:
        return ""
    return f"the table was made with {', '.join(changed)}: make it anew with `jamlab chart table`"


def _errors(error: Mapping[str, float]) -> str:
    return ", ".join(f"{name} to {value:.2g}" for name, value in error.items())
