"""How far simpler models of flow are off, measured: runs beside them, and the error that they promise elsewhere.

`flow_errors.csv` in this package, made by `jamlab chart flow-table`, holds runs of disks at many conditions, each with
the error of the simpler model. Two numbers carry them over to other packings: amplitude over overlap, which says
whether contacts change, and drag over elasticity of a contact that moves with the affine flow.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from jamlab.arrays import Array
from jamlab.errors import StorageError
from jamlab.mechanics.stiffness import stress
from jamlab.packing.force_laws import drag_stiffness
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.statistics.confidence import CONFIDENCE

SIZE = 64  # disks of the packings that make the table
STOKES = 0.0  # in the place of alpha
MANY = "many"  # part of the table: many packings, of linear drag, at strains at which few rearrange
CHECK = "check"  # part: other packings at random conditions, which promises are held against
SLIDING = "sliding"  # part: packings at random conditions where sliding is damped less and more than approach
SLIDING_CHECK = "sliding check"  # part: others, which promises at such beta are held against
SLIDING_BETAS = (0.1, 10.0)
BACKGROUND = 1e-2  # drag against the affine flow in all steady flow of the table, k tau_1; power laws take ten times
# longer without
LEAST_ERROR = 0.01  # that a promise can be: runs of the table are as good as that
_SHORT_BLOCKS = 1.5  # of standard errors: runs over a strain of 60 say 1.1 to 1.8 times those of the table, over 3
_FLOOR = 1e-3  # errors below are rounding of the runs, and would widen the scatter of logarithms
_CONDITION = ("kind", "alpha", "drag", "amplitude")
COLUMNS = ("kind", "part", "seed", "n", "pressure", "alpha", "drag", "amplitude", "beta", "error", "scatter", "seconds")


def relative_amplitude(packing: Packing, amplitude: float) -> float:
    """Strain over the mean overlap of contacts, pressure over stiffness: at 1 a good part of the contacts changes."""
    return amplitude / mean_overlap(packing)


def mean_overlap(packing: Packing) -> float:
    """Pressure over stiffness, the column `pressure` of the table."""
    return 0.5 * float(np.trace(stress(packing))) / drag_stiffness(packing)


def measured_range(kind: str, column: str) -> tuple[float, float]:
    """Least and largest value of a column of the table in the rows behind promises of a kind.

    Example:
        >>> from jamlab.estimates.flow_errors import measured_range
        >>> measured_range("flow", "drag")
        (0.01, 0.1)

    Args:
        kind: "oscillation" or "flow".
        column: "n", "pressure", "alpha" or "drag".
    """
    rows = _shipped().rows
    values = rows[rows["kind"] == kind][column]
    return float(values.min()), float(values.max())


def relative_drag(damping: Damping, omega: float, amplitude: float) -> float:
    """Drag over elastic force of a contact that moves with the affine flow: (tau_1 omega)^alpha amplitude^(alpha - 1).

    While contacts stay, G* depends on frequency and amplitude by it alone.
    """
    alpha = damping.alpha if isinstance(damping, ContactDamping) else 1.0
    return float((damping.tau * omega) ** alpha * amplitude ** (alpha - 1.0))


def law_number(damping: Damping) -> float:
    """Exponent alpha of contact drag, or `STOKES`."""
    return STOKES if isinstance(damping, StokesDrag) else damping.alpha


def read_errors(path: Path | None = None) -> pd.DataFrame:
    """The shipped runs, or those written by `jamlab chart flow-table`.

    Raises:
        StorageError: it cannot be read, or is no such table.
    """
    return _read(path) if path else _shipped().rows


@dataclass(frozen=True, eq=False)
class _Runs:
    """A table, equal to itself alone, so that what is worked out of it once is remembered."""

    rows: pd.DataFrame


def _runs(table: pd.DataFrame | None) -> _Runs:
    return _shipped() if table is None else _Runs(table)


@cache
def _shipped() -> _Runs:
    return _Runs(_read(resources.files("jamlab.estimates").joinpath("flow_errors.csv")))


def _read(source: Traversable) -> pd.DataFrame:
    try:
        with source.open("rb") as file:
            table = pd.read_csv(file, comment="#")
    except (OSError, ValueError) as error:
        raise StorageError(f"cannot read {source}: {error}; make it with `jamlab chart flow-table`") from error
    if tuple(table.columns) != COLUMNS:
        raise StorageError(f"{source} is no table of errors of flow: make one with `jamlab chart flow-table`")
    return table


def promised_error(
    kind: str, alpha: float, drag: float, amplitude: float, table: pd.DataFrame | None = None, beta: float = 1.0
) -> float:
    """Relative error that the simpler model keeps in 95 % of new packings; infinite where nothing was measured.

    Student's prediction interval at each condition of the table, of the logarithm of the errors of G*, and of the
    errors of a stress, which are mostly noise; scatter is pooled over drag. Interpolated between. Less drag or strain
    than in the table counts as its least where errors tend to a limit. No such interval foresees that one packing in
    twenty rearranges early: G* is not promised better than the error that 95 % of many packings stayed below. At
    another beta all of this is wider, see `sliding_factor`.

    Args:
        kind: "oscillation": linear spectrum, for alpha below 1 by equivalent damping; "flow": stress of linear drag at
            the rate to the power alpha.
        alpha: of contact drag, or `STOKES`.
        drag: see `relative_drag`; of flow, the rate of linear drag.
        amplitude: see `relative_amplitude`; 1 of flow.
        table: see `read_errors`.
        beta: of contact drag.
    """
    return _promise(kind, alpha, drag, amplitude, beta, _runs(table))


def _promise(kind: str, alpha: float, drag: float, amplitude: float, beta: float, runs: _Runs) -> float:
    factor = _factor_at(kind, beta, runs)
    return factor * _promise_at_one(kind, alpha, drag, amplitude, runs) if np.isfinite(factor) else factor


def _promise_at_one(kind: str, alpha: float, drag: float, amplitude: float, runs: _Runs) -> float:
    """Promise at beta = 1."""
    axes, upper = _upper_errors(kind, alpha == STOKES, runs)
    alphas, drags, amplitudes = axes
    x, y = float(np.log(drag)), float(np.log(amplitude))
    if kind == "flow":
        alpha = min(alpha, alphas[-1])
    else:  # linear drag tends to the limit of slow shear, and all drag to that of small strains
        x = max(x, drags[0]) if alpha in (STOKES, 1.0) else x
        x, y = min(x, drags[-1]), max(y, amplitudes[0])
    if any(not axis[0] - 1e-4 <= at <= axis[-1] + 1e-4 for at, axis in ((alpha, alphas), (x, drags), (y, amplitudes))):
        return float("inf")

    def along(values: Array) -> float:  # over drag; of one amplitude
        return float(np.interp(x, drags, values))

    found = [np.interp(y, amplitudes, [along(column) for column in each.T]) for each in upper]
    # as 1 - alpha, errors grow linearly
    promised = max(float(np.interp(alpha, alphas, np.exp(found))), LEAST_ERROR)
    return promised if kind == "flow" else max(promised, _rearranging(drag, amplitude, runs))


def sliding_factor(kind: str, beta: float, table: pd.DataFrame | None = None) -> float:
    """Factor by which promises are wider where sliding is not damped as approach is, at least 1.

    95 % of the runs at either of `SLIDING_BETAS` would have kept promises that much wider, or of those at both where
    one has too few; beta between them counts as they do. Infinite beyond, or if there are too few runs.
    """
    return _factor_at(kind, beta, _runs(table))


def _factor_at(kind: str, beta: float, runs: _Runs) -> float:
    if beta == 1.0:
        return 1.0
    return _factor(kind, runs) if SLIDING_BETAS[0] <= beta <= SLIDING_BETAS[1] else float("inf")


@lru_cache
def _factor(kind: str, runs: _Runs) -> float:
    rows = runs.rows[(runs.rows["part"] == SLIDING) & (runs.rows["kind"] == kind)]
    cases = zip(*(rows[name].tolist() for name in _CONDITION), strict=True)
    promised = np.array([_promise_at_one(kind, alpha, drag, part, runs) for kind, alpha, drag, part in cases])
    ratio = (rows["error"] / promised)[np.isfinite(promised)]
    each = [exceeded_by_few(part) for _, part in ratio.groupby(rows["beta"])]
    return max(1.0, *(each if np.isfinite(each).all() else [exceeded_by_few(ratio)]))


def rearranging_error(drag: float, amplitude: float, table: pd.DataFrame | None = None) -> float:
    """Error of a linear spectrum that 95 % of many packings stayed below, those that rearranged among them.

    Interpolated in a grid of drags and strains, and that of the nearest end beyond; infinite if the table has too few
    packings.
    """
    return _rearranging(drag, amplitude, _runs(table))


def _rearranging(drag: float, amplitude: float, runs: _Runs) -> float:
    drags, amplitudes, errors = _many(runs)
    if not np.isfinite(errors).all() or not errors.size:
        return float("inf")
    at_drag = [np.interp(np.log(drag), drags, column) for column in errors.T]
    return float(np.exp(np.interp(np.log(amplitude), amplitudes, at_drag)))


def exceeded_by_few(errors: Array | pd.Series) -> float:
    """Error that a new packing exceeds in 1 - `CONFIDENCE` of all cases, whatever the distribution.

    It is the k-th largest of n, k/(n + 1) = 1 - `CONFIDENCE`: a new one is as likely in every place among them.
    Infinite where not even the largest of them does.
    """
    place = int((1 - CONFIDENCE) * (len(errors) + 1) + 1e-9)
    return float(np.sort(errors)[-place]) if place else float("inf")


def kept_promises(
    table: pd.DataFrame | None = None, part: str = CHECK, kind: str | None = None, beta: float | None = None
) -> tuple[int, int]:
    """How many of the checks, on other packings at random conditions, stayed below the error promised; and of how many.

    Conditions for which nothing is promised are left out.

    Args:
        table: see `read_errors`.
        part: `CHECK`, of beta = 1, or `SLIDING_CHECK`, of others.
        kind: "oscillation" or "flow"; None: both.
        beta: of the checks; None: all of the part.
    """
    runs = _runs(table)
    checks = runs.rows[runs.rows["part"] == part]
    for name, only in (("kind", kind), ("beta", beta)):
        checks = checks if only is None else checks[checks[name] == only]
    cases = zip(*(checks[name].tolist() for name in (*_CONDITION, "beta")), strict=True)
    promised = np.array([_promise(name, alpha, drag, x, at, runs) for name, alpha, drag, x, at in cases])
    known = np.isfinite(promised)
    return int(np.sum(checks["error"].to_numpy()[known] <= promised[known])), int(known.sum())


def scatter_of_flow(table: pd.DataFrame | None = None, *, beta: float = 1.0) -> float:
    """Standard error of a mean stress over that stress, of 64 disks at unit strain: the mean over runs at beta = 1.

    For another beta that of the runs at the end of `SLIDING_BETAS` on its side counts, if it is larger. Stress of 64
    disks remembers more strain than blocks of a short run are long: what the table says is raised by as much.
    """
    rows = _runs(table).rows
    means = rows[(rows["kind"] == "flow") & (rows["n"] == SIZE)].groupby("beta")["scatter"].mean()
    end = SLIDING_BETAS[0] if beta < 1 else SLIDING_BETAS[1]
    usual = float(means.loc[1.0])
    return _SHORT_BLOCKS * (usual if beta == 1.0 else max(usual, float(means.get(end, usual))))


@lru_cache
def _many(runs: _Runs) -> tuple[Array, Array, Array]:
    """ln drags, ln amplitudes, and on them that of the error that few of many packings exceed; it grows with strain."""
    rows = runs.rows[runs.rows["part"] == MANY]
    found = rows.groupby(["drag", "amplitude"])["error"].agg(exceeded_by_few).unstack("amplitude")
    axes = np.log(found.index.to_numpy()), np.log(found.columns.to_numpy())
    return *axes, np.maximum.accumulate(np.log(np.maximum(found.to_numpy(), _FLOOR)), axis=1)


@lru_cache
def _upper_errors(kind: str, stokes: bool, runs: _Runs) -> tuple[list[Array], Array]:
    """Axes (alpha, ln drag, ln amplitude) of a table, and on them the logarithm of the error that is promised."""
    table = runs.rows
    rows = table[(table["part"] == "calibrate") & (table["kind"] == kind) & ((table["alpha"] == STOKES) == stokes)]
    if kind == "flow":  # linear drag beside itself has no error, not even noise
        rows = rows[rows["alpha"] < 1.0]
    names = ["alpha", "drag", "amplitude"]
    axes = [np.unique(rows[name].to_numpy(dtype=np.float64)) for name in names]
    shape = [len(axis) for axis in axes]
    count, mean, spread = np.zeros(shape, dtype=int), np.full(shape, np.inf), np.zeros(shape)
    for spot in np.ndindex(*shape):
        condition = [axis[k] for axis, k in zip(axes, spot, strict=True)]
        errors = np.maximum(rows[(rows[names] == condition).all(axis=1)]["error"].to_numpy(), _FLOOR)
        errors = np.log(errors) if kind == "oscillation" else errors
        if len(errors) > 1:
            count[spot], mean[spot], spread[spot] = len(errors), errors.mean(), errors.var(ddof=1)
    freedom = (count - 1) * (spread > 0)  # conditions where all errors are at the floor say nothing of scatter
    total = np.maximum(freedom.sum(axis=1, keepdims=True), 1)
    width = stats.t.ppf(CONFIDENCE, total) * np.sqrt((freedom * spread).sum(axis=1, keepdims=True) / total)
    upper = mean + np.where(spread > 0, width * np.sqrt(1 + 1 / np.maximum(count, 1)), 0.0)
    upper = upper if kind == "oscillation" else np.log(upper)
    for k in range(upper.shape[2] - 2, -1, -1):  # a frequency that no run reaches: errors grow with amplitude
        upper[:, :, k] = np.where(np.isfinite(upper[:, :, k]), upper[:, :, k], upper[:, :, k + 1])
    return [axes[0], np.log(axes[1]), np.log(axes[2])], upper
