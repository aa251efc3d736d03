"""How far simpler models of flow are off, measured: runs beside them, and the error that they promise elsewhere.

`flow_errors.csv.xz` in this package, made by `python -m studies tables flow-errors`, holds runs of disks at many
conditions, each with the error of the simpler model. Two numbers carry them over to other packings: amplitude over
overlap, which says whether contacts change, and drag over elasticity of a contact that moves with the affine flow.
"""

from dataclasses import dataclass
from enum import StrEnum
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.estimates.ways import read_table
from jamlab.mechanics.stiffness import pressure
from jamlab.packing.force_laws import drag_stiffness
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import Damping
from jamlab.statistics.confidence import exceeded_by_few

SIZE = 64  # disks of the packings that make the table
STOKES = 0.0  # in the place of alpha
SLIDING_BETAS = (0.1, 10.0)
BACKGROUND = 1e-2  # drag against the affine flow in all steady flow of the table, k tau_1; power laws take ten times
# longer without
LEAST_ERROR = 0.01  # that a promise can be: runs of the table are as good as that
COLUMNS = ("kind", "part", "seed", "n", "pressure", "alpha", "drag", "amplitude", "beta", "error", "scatter", "seconds")
_CONDITION = ["alpha", "drag", "amplitude"]
_SHORT_BLOCKS = 1.5  # of standard errors: runs over a strain of 60 say 1.1 to 1.8 times those of the table, over 3
_FLOOR = 1e-3  # errors below are rounding of the runs, and no measure of how they vary
_SPRINGS = 2.0  # exponent of the repulsion of all disks of the table
_RATIO = 1.4  # of their two sizes, half and half
_DIGITS = 1e-4  # relative: the table has five digits


class Part(StrEnum):
    """Packings of the table, by what they are for."""

    CALIBRATE = "calibrate"  # a few at every condition of a grid
    MANY = "many"  # under linear drag, at strains at which few rearrange
    CHECK = "check"  # others at random conditions, which promises are held against
    SLIDING = "sliding"  # at random conditions where sliding is damped less and more than approach
    SLIDING_CHECK = "sliding check"  # others, which promises at such beta are held against


class Flow(NamedTuple):
    """What is asked of the table."""

    # "oscillation": linear spectrum, for alpha below 1 by equivalent damping; "flow": stress of linear drag at the rate
    # to the power alpha
    kind: str
    alpha: float  # of contact drag, or `STOKES`
    # over the elastic force of a contact that moves with the affine flow, (tau_1 omega)^alpha amplitude^(alpha - 1), by
    # which alone G* depends on frequency and amplitude while contacts stay; of flow, the rate of linear drag
    drag: float
    amplitude: float = 1.0  # see `relative_amplitude`; 1 of flow
    beta: float = 1.0  # of contact drag

    @classmethod
    def oscillating(cls, packing: Packing, law: Damping, omega: float, amplitude: float) -> "Flow":
        """Describe an oscillation of a packing by the two numbers that carry over to others."""
        drag = (law.tau * omega) ** law.alpha * amplitude ** (law.alpha - 1.0)
        part = relative_amplitude(packing, amplitude)
        return cls("oscillation", law.alpha if law.at_contacts else STOKES, float(drag), part, law.contrast)

    @classmethod
    def steady(cls, law: Damping, rate: float) -> "Flow":
        """Describe steady flow by the rate at which linear drag gives the same stress."""
        alpha = law.alpha if law.at_contacts else STOKES
        return cls("flow", alpha, float((law.tau * rate) ** law.alpha), beta=law.contrast)


class Outside(NamedTuple):
    """A condition that lies outside those of the table: what it is, its value, and the range that was measured."""

    name: str
    value: float | str
    low: float | str
    high: float | str

    def __str__(self) -> str:
        limits = f"from {_short(self.low)} to {_short(self.high)}"
        if self.high == np.inf:
            limits = f"{_short(self.low)} or more"
        elif self.low in (0.0, self.high):
            limits = f"up to {_short(self.high)}" if self.low == 0.0 else f"{_short(self.low)} alone"
        return f"{self.name} = {_short(self.value)}, measured {limits}"


@dataclass(frozen=True, eq=False)
class FlowErrors:
    """A table of runs, and what it promises; what was worked out of it once is remembered."""

    rows: pd.DataFrame

    def promise(self, flow: Flow) -> float:
        """Relative error that the simpler model keeps in 95 % of new packings; infinite where nothing was measured.

        At a condition with enough runs it is the error that few of them exceed. Elsewhere the median counts, times the
        ratio to it that few runs exceed, of all drags at one amplitude together. Between conditions it lies on lines;
        where drag or strain are less than in the table, and errors tend to a limit, it is that of the least. One
        packing in twenty rearranges early, which a few do not show: no G* is promised better than that under linear
        drag, of which there are many. At another beta all of this is wider, see `sliding_factor`.
        """
        factor = self.sliding_factor(flow.kind, flow.beta)
        return factor * self._promise_at_one(flow) if np.isfinite(factor) else np.inf

    def sliding_factor(self, kind: str, beta: float) -> float:
        """Factor by which promises are wider where sliding is not damped as approach is, at least 1. 95 % of the runs
        at either of `SLIDING_BETAS` would have kept promises that much wider, or of those at both where one has too
        few; beta between them counts as they do. Infinite beyond, or if there are too few runs."""
        if beta == 1.0:
            return 1.0
        return self._factors[kind] if SLIDING_BETAS[0] <= beta <= SLIDING_BETAS[1] else np.inf

    def kept(self, part: str = Part.CHECK, kind: str | None = None, beta: float | None = None) -> tuple[int, int]:
        """How many checks, on other packings at random conditions, stayed below the error promised, and of how many for
        which one was; `part` is `CHECK`, of beta = 1, or `SLIDING_CHECK`; None: of both kinds, of all beta."""
        checks = self.rows[self.rows["part"] == part]
        for name, only in (("kind", kind), ("beta", beta)):
            checks = checks if only is None else checks[checks[name] == only]
        promised = self.promises(checks)
        known = np.isfinite(promised)
        return int(np.sum(checks["error"].to_numpy()[known] <= promised[known])), int(known.sum())

    def promises(self, rows: pd.DataFrame, *, at_one: bool = False) -> Array:
        """(m,) what is promised for some rows of the table; as if all had beta = 1, if that is asked for."""
        flows = [Flow(*row) for row in rows[["kind", *_CONDITION, "beta"]].itertuples(index=False)]
        return np.array([self._promise_at_one(flow) if at_one else self.promise(flow) for flow in flows])

    def scatter_of_flow(self, beta: float = 1.0) -> float:
        """Standard error of a mean stress over that stress, of 64 disks at unit strain: the mean over runs at beta = 1.
        For another beta that of the runs at the end of `SLIDING_BETAS` on its side counts, if it is larger. Stress of
        64 disks remembers more strain than blocks of a short run are long: the table's is raised by as much."""
        rows = self.rows[(self.rows["kind"] == "flow") & (self.rows["n"] == SIZE)]
        means = rows.groupby("beta")["scatter"].mean()
        usual = float(means.loc[1.0])
        end = float(means.get(SLIDING_BETAS[0] if beta < 1 else SLIDING_BETAS[1], usual))
        return _SHORT_BLOCKS * (usual if beta == 1.0 else max(usual, end))

    def outside(self, packing: Packing, flow: Flow) -> tuple[Outside, ...]:
        """What of a packing and a flow lies outside the rows of its kind; larger packings than measured do not."""
        rows = self.rows[self.rows["kind"] == flow.kind]
        power = rows[rows["alpha"].isin([STOKES, 1.0]) == (flow.alpha in (STOKES, 1.0))]
        found = [] if packing.model == "sp" else [Outside("model", packing.model, "sp", "sp")]
        if (exponent := float(packing.params.get("exponent", _SPRINGS))) != _SPRINGS:
            found += [Outside("exponent", exponent, _SPRINGS, _SPRINGS)]
        given: list[tuple[str, float, float, float]] = []
        if (d := packing.diameters) is not None:
            given += [("large over small diameter", d.max() / d.min(), _RATIO, _RATIO)]
            given += [("width of the diameters", d.std() / d.mean(), *2 * [(_RATIO - 1) / (_RATIO + 1)])]
        given += [("particles", packing.n, rows["n"].min(), np.inf)]
        given += [("pressure over stiffness", mean_overlap(packing), rows["pressure"].min(), rows["pressure"].max())]
        given += [("beta", flow.beta, *SLIDING_BETAS)]
        if flow.alpha != STOKES:
            given += [("alpha", flow.alpha, rows.loc[rows["alpha"] != STOKES, "alpha"].min(), rows["alpha"].max())]
        elif flow.kind == "flow":
            found += [Outside("drag", "Stokes", "contact damping", "contact damping")]
        if flow.kind == "flow":
            given += [("linear rate (tau rate)^alpha", flow.drag, rows["drag"].min(), rows["drag"].max())]
        else:
            least = 0.0 if flow.alpha in (STOKES, 1.0) else power["drag"].min()
            given += [("drag over elasticity", flow.drag, least, np.inf)]
            given += [("strain over overlap", flow.amplitude, 0.0, power["amplitude"].max())]
        for name, value, low, high in given:
            if not low * (1 - _DIGITS) <= value <= high * (1 + _DIGITS):
                found.append(Outside(name, float(value), float(low), float(high)))
        return tuple(found)

    def _promise_at_one(self, flow: Flow) -> float:
        axes, upper = self._grids[flow.kind, flow.alpha == STOKES]
        if not upper.size:
            return np.inf
        alphas, drags, amplitudes = axes
        alpha, x, y = flow.alpha, float(np.log(flow.drag)), float(np.log(flow.amplitude))
        if flow.kind == "flow":
            alpha = min(alpha, alphas[-1])
        else:  # linear drag tends to the limit of slow shear, and all drag to that of small strains
            x = max(x, drags[0]) if alpha in (STOKES, 1.0) else x
            x, y = min(x, drags[-1]), max(y, amplitudes[0])
        places = ((alpha, alphas), (x, drags), (y, amplitudes))
        if any(not axis[0] - _DIGITS <= at <= axis[-1] + _DIGITS for at, axis in places):
            return np.inf
        found = [np.interp(y, amplitudes, [np.interp(x, drags, each) for each in grid.T]) for grid in upper]
        promised = max(float(np.interp(alpha, alphas, np.exp(found))), LEAST_ERROR)  # linear in 1 - alpha
        if flow.kind == "flow" or alpha == 1.0:
            return promised
        return max(promised, self._promise_at_one(flow._replace(alpha=1.0)))

    @cached_property
    def _factors(self) -> dict[str, float]:
        found = {}
        for kind in ("oscillation", "flow"):
            rows = self.rows[(self.rows["part"] == Part.SLIDING) & (self.rows["kind"] == kind)]
            ratio = rows["error"] / self.promises(rows, at_one=True)
            ratio = ratio[ratio > 0]  # where nothing is promised it is 0
            each = [exceeded_by_few(part.to_numpy()) for _, part in ratio.groupby(rows["beta"])]
            enough = bool(each) and np.isfinite(each).all()
            found[kind] = max([1.0, *(each if enough else [exceeded_by_few(ratio.to_numpy())])])
        return found

    @cached_property
    def _grids(self) -> dict[tuple[str, bool], tuple[list[Array], Array]]:
        rows = self.rows[self.rows["part"].isin([Part.CALIBRATE, Part.MANY])]
        rows = rows[(rows["kind"] != "flow") | (rows["alpha"] < 1.0)]  # linear drag beside itself has no error
        stokes = rows["alpha"] == STOKES
        return {
            (kind, law): _upper_errors(rows[(rows["kind"] == kind) & (stokes == law)])
            for kind in ("oscillation", "flow")
            for law in (False, True)
        }


def _upper_errors(rows: pd.DataFrame) -> tuple[list[Array], Array]:
    """Axes (alpha, ln drag, ln amplitude) of some rows, and on them the logarithm of the error that is promised."""
    error, places = rows["error"].clip(lower=_FLOOR), [rows[name] for name in _CONDITION]
    median = error.groupby(places).transform("median")
    alike = [rows["alpha"].isin([STOKES, 1.0]), rows["amplitude"]]  # power laws together, and drags
    pooled = median * _quantile((error / median).groupby(alike))
    own = _quantile(error.groupby(places))
    promised = own.where(np.isfinite(own), pooled).groupby(places).first().map(np.log).unstack("amplitude")
    alphas, drags = (np.unique(rows[name].to_numpy(dtype=np.float64)) for name in _CONDITION[:2])
    every = pd.MultiIndex.from_product([alphas, drags])
    grid = promised.reindex(every).bfill(axis=1).cummax(axis=1)  # errors grow with amplitude
    amplitudes = np.log(grid.columns.to_numpy(dtype=np.float64))
    upper = grid.fillna(np.inf).to_numpy().reshape(len(alphas), len(drags), len(amplitudes))
    return [alphas, np.log(drags), amplitudes], upper


def _quantile(errors: Any) -> Any:
    """What few of a group exceed, for each of its rows."""
    return errors.transform(lambda group: exceeded_by_few(group.to_numpy()))


def read_errors(path: Path | None = None) -> FlowErrors:
    """Read the shipped runs, or those written by `python -m studies tables flow-errors`."""
    return FlowErrors(read_table(path, "flow_errors.csv.xz", COLUMNS, "python -m studies tables flow-errors"))


@cache
def shipped_errors() -> FlowErrors:
    """The shipped runs, read once."""
    return read_errors()


def relative_amplitude(packing: Packing, amplitude: float) -> float:
    """Strain over the mean overlap of contacts, pressure over stiffness: at 1 a good part of the contacts changes."""
    return amplitude / mean_overlap(packing)


def mean_overlap(packing: Packing) -> float:
    """Pressure over stiffness, the column `pressure` of the table."""
    return pressure(packing) / drag_stiffness(packing)


def _short(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.2g}"
