"""Shear at a constant rate, from rest through start-up into steady flow: overshoot, steady state, plastic events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from jamlab.arguments.table import argument
from jamlab.arrays import Array, Indices
from jamlab.checks import check_number, check_range, checked
from jamlab.errors import InputError, named, typed
from jamlab.flow.flow_run import FlowRun
from jamlab.flow.overdamped_session import End, check_flow_tolerance, default_background
from jamlab.flow.report import say_balance
from jamlab.flow.run import TimedRun
from jamlab.flow.steady_state import AVERAGED, SteadyState
from jamlab.flow.velocity_profile import VelocityProfile, velocity_profile
from jamlab.geometry.walls import walled
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import COLOURS
from jamlab.processes.progress import Progress
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.statistics.confidence import AVERAGES, BlockAverage, block_average


class StressDrops(NamedTuple):
    """Falls of the stress, one after the other: the `strain` (k,) where each begins, and its `size` (k,), positive."""

    strain: Array
    size: Array


def stress_drops(strain: Array, stress: Array, least: float = 0.0) -> StressDrops:
    """Find the falls of a stress (m,) over growing strain (m,), each from a local maximum to the next minimum; `least`:
    smallest one that counts."""
    falling = np.concatenate([[False], np.diff(stress) < 0, [False]])
    edges = np.flatnonzero(np.diff(falling.astype(int)))  # of the steps, where falling begins and where it ends
    begin, end = edges[::2], edges[1::2]
    size = stress[begin] - stress[end]
    kept = size > least
    return StressDrops(strain[begin[kept]], size[kept])


@dataclass(frozen=True)
class Events:
    """From where on a change of stress is an event of a flow."""

    least_drop: float = 0.01  # of the range of elastic stresses in a run: smaller falls are no plastic events
    transient: float = 1.0  # strain at which start-up is over: the overshoot lies at 0.1 to 0.4
    over: float = 0.02  # by which a peak must exceed the last stress, to be one
    rounding: float = 1e-12  # of the stiffness of a contact: smaller changes of a stress are no physics


EVENTS = Events()


class Peak(NamedTuple):
    """Largest shear stress of a start-up, and where it is."""

    strain: float
    stress: float


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ShearRun(FlowRun):
    """Shear at a constant rate; rows and packings as in `FlowRun`.

    Attributes:
        shear_rate: rate that was asked for, 1/tau_1; 0: see `QuasistaticShear`; of several parts the last one.
        strain_asked: strain to be sheared by, of all parts; less is reached by a run that was interrupted.
        parts: (p, 2) rate and strain of each part of a protocol; None: one rate all the way.
    """

    numbers: ClassVar[tuple[str, ...]] = (*FlowRun.numbers, "plastic_events")

    shear_rate: float
    strain_asked: float
    parts: Array | None = None

    @property
    def velocity_profile(self) -> VelocityProfile:
        """Mean velocity at each height, between the packings that were kept; not across the brackets of events, whose
        strain is next to none."""
        rows = self.frame_rows
        return velocity_profile([self.frames[k] for k in np.flatnonzero(~np.isin(rows, self._inner))])

    @property
    def path(self) -> Array:
        """(m,) accumulated strain, both directions added."""
        return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.strain)))])

    @property
    def least_stress(self) -> float:
        """Stress below which a change is rounding."""
        return EVENTS.rounding * natural_scales(self.packing).stress

    @property
    def _inner(self) -> Indices:
        """Rows that stand within steps, beside those at equal strains of which means are taken."""
        return np.zeros(0, dtype=np.int64)

    @property
    def _first_part(self) -> tuple[float, float]:
        """Rate or strain of the first part, and the path at which it ends."""
        if self.parts is None:
            return self.shear_rate or float(self.strain[-1]), np.inf
        return float(self.parts[0, 0]), float(self.parts[0, 1])

    @property
    def _last_part(self) -> float:
        """Path at which the last part begins."""
        return 0.0 if self.parts is None else float(self.parts[:-1, 1].sum())

    @property
    def peak(self) -> Peak | None:
        """Overshoot: largest stress up to strain 1, if it falls by 2 % or more from there; else None.

        For shear in the negative direction the lowest stress; for several parts the peak of the first.
        """
        first, ends = self._first_part
        path = self.path
        rows = path <= ends * (1 + 1e-9)
        stress, strain = (-1.0 if first < 0 else 1.0) * self.stress[rows], self.strain[rows]
        k = int(np.argmax(stress[path[rows] <= EVENTS.transient]))
        if k == 0 or k == len(stress) - 1 or stress[k] < self.least_stress:
            return None
        if stress[k] < (1 + EVENTS.over) * stress[k + 1 :].min():
            return None
        return Peak(float(strain[k]), float(self.stress[k]))

    @property
    def drops(self) -> StressDrops:
        """Falls of the elastic stress along the flow, by more than 1 % of its range."""
        along = np.cumsum(np.sign(np.diff(self.strain)) * np.diff(self.elastic_stress))
        least = max(EVENTS.least_drop * float(np.ptp(self.elastic_stress)), self.least_stress)
        return stress_drops(self.strain, np.append(0.0, along), least)

    @property
    def plastic_events(self) -> int:
        """Number of drops. At a finite rate events overlap and small ones are hidden: it counts what is seen."""
        return len(self.drops.size)

    @checked
    def steady(self, discard: float = EVENTS.transient) -> SteadyState:
        """Average over the steady flow, with standard errors: stress, pressure, friction, coordination and more.

        Rows are correlated; `jamlab.statistics.confidence.block_average` names the estimate of the errors. Errors of
        the steps of the run come in addition. At a finite rate the mean shear stress is the work done between rows over
        the strain, so that nothing between them is missed; a quasi-static run has its minima.

        Args:
            discard: strain of start-up that is left out; for several parts, of the last one, which is averaged.

        Raises:
            InputError: fewer than seventeen rows lie beyond `discard`.

        Example:
            >>> run = jamlab.quasistatic_shear(jamlab.pack(16, 1e-2, seed=1), 0.2, strain_step=5e-3)
            >>> mean = run.steady(discard=0.1)
            >>> 0 < mean.mu < 1, bool(mean.stress_stderr > 0)
            (True, True)
        """
        rows = self._steady_rows(discard)
        series = {name: self._series(name, rows) for name in AVERAGED}
        means = {name: block_average(values) for name, values in series.items()}
        stress, pressure = means["stress"].value, means["pressure"].value
        if pressure > 0:  # to first order, with the correlation of both
            around = (series["stress"] - stress / pressure * series["pressure"]) / pressure
            mu = replace(block_average(around), value=stress / pressure)
        else:
            mu = BlockAverage(float("nan"), float("nan"), float("nan"), float("nan"))
        drops = self.drops
        kept = drops.size[np.abs(drops.strain) >= discard] if self._last_part == 0 else np.zeros(0)
        strain = abs(float(self.strain[rows[-1]] - self.strain[rows[0]]))
        return SteadyState._of(means, mu, kept, discard, strain, self.unit)

    def _steady_rows(self, discard: float) -> Indices:
        """(m,) rows beyond a strain of start-up, the first of which only begins the average."""
        beyond = self.path >= (self._last_part + discard) * (1 - 1e-9)
        rows = np.setdiff1d(np.flatnonzero(beyond), self._inner)
        if len(rows) <= 2 * AVERAGES.blocks:
            last = float(self.path[-1])
            remedy = "shear further, or ask for more rows"
            if last <= (needed := self._last_part + discard):
                remedy = f"shear to more than {needed:g}, or discard less than {last - self._last_part:g}"
            raise InputError(
                f"only {len(rows)} rows lie beyond strain {discard:g}, but {2 * AVERAGES.blocks + 1} are "
                f"needed: {remedy}"
            )
        return rows

    def _series(self, name: str, rows: Indices) -> Array:
        """A quantity from row to row."""
        if name == "stress" and self.shear_rate:
            return np.asarray(np.diff(self.work[rows]) / np.diff(self.strain[rows]))
        return np.asarray(getattr(self, name)[rows][1:], dtype=np.float64)

    @property
    def state(self) -> Literal["interrupted", "start-up", "steady", "drifting"]:
        """Whether the strain asked for is reached, strain 1 with enough rows for a mean, and whether the stress has one
        mean in both halves beyond."""
        if not self.finished:
            return "interrupted"
        mean = self._mean
        return "start-up" if mean is None else "steady" if mean.steady else "drifting"

    @property
    def _mean(self) -> BlockAverage | None:
        """Of the stress beyond strain 1; None if it is not reached, or in too few rows."""
        try:
            return block_average(self._series("stress", self._steady_rows(EVENTS.transient)))
        except InputError:
            return None

    @property
    def summary(self) -> dict[str, Any]:
        """Last strain, overshoot, and mean stress of steady flow with its standard error, of those that there are."""
        peak, mean = self.peak, self._mean
        found: dict[str, Any] = {"rate": self.parts[:, 0]} if self.parts is not None else {}
        found |= {"rate": self.shear_rate} if self.shear_rate and not found else {}
        found["strain"] = float(self.path[-1])
        found |= {"peak stress": peak.stress, "at strain": peak.strain} if peak else {}
        return found | ({"stress": (mean.value, mean.error)} if mean else {})

    @property
    def finished(self) -> bool:
        """Whether the strain asked for is reached."""
        return bool(self.path[-1] >= self.strain_asked * (1 - 1e-9))

    @drawn("Line2D, of both curves; `label` names them in the legend")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the shear stress (solid) and its elastic part (dashed) over strain."""
        colour = COLOURS[len(axes.lines) // 2 % len(COLOURS)]
        name = label or (f"rate {self.shear_rate:g}/$\\tau_1$" if self.shear_rate else "quasi-static")
        parts = ((self.stress, name, "-", 1.6), (self.elastic_stress, "elastic part", "--", 1.2))
        for stress, text, line, width in parts:
            look = {"color": colour, "linestyle": line, "linewidth": width, "label": text}
            axes.plot(self.strain, stress, **merged_line(look, style))
        label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", self.unit))
        axes.legend(fontsize=LEGEND)
        say_balance(axes, self)


TOLERANCE = 1e-2  # relative error of velocities in a step: the stress of steady flow is known to 2 % seldom enough
ROWS = 200


@checked
def shear(
    packing: Packing,
    rate: float | Sequence[Sequence[float]],
    strain: float | None = None,
    damping: DragLaw | None = None,
    *,
    rows: int = ROWS,
    snapshot_every: float | None = None,
    tolerance: float = TOLERANCE,
    background_drag: float | None = None,
    walls: bool | None = None,
    trajectory_error: bool = False,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> ShearRun:
    """Shear a packing along x at a constant rate (overdamped: drag balances elastic forces at all times).

    Solves B u = F - rate b for the non-affine velocities u, with B and b of `dynamical_matrices`; see Durian, Phys.
    Rev. E 55, 1739 (1997), with the drag of Baumgarten & Tighe.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1.0, strain=0.05, rows=5)
    >>> r.strain.round(6), r.packing.converged
    (array([0.  , 0.01, 0.02, 0.03, 0.04, 0.05]), False)
    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), [(1.0, 0.04), (-1.0, 0.02)], rows=6)  # reversal
    >>> r.strain.round(6)
    array([0.  , 0.01, 0.02, 0.03, 0.04, 0.03, 0.02])

    Args:
        packing: SP or DP, usually at a minimum.
        rate: shear rate, 1/tau_1; negative: reverse direction. Or a protocol of parts, [(rate, strain), ...] or an
            array (p, 2), with positive strains.
        strain: total strain, default 1; not with a protocol.
        damping: `ContactDamping` (default, beta = 1), linear or a power law, or `StokesDrag`.
        rows: number of rows of the result, at equal strain intervals; more if `snapshot_every` requires it.
        snapshot_every: strain between stored packings; must divide `strain`. Default: only the first and the last.
        tolerance: relative error of velocities per step, 1e-9 to 0.1, default 1e-2. It does not bound the error of
            stresses: errors change the order in which contacts open and close, and thus the trajectory. Near onset the
            error of the stress at the default is up to 60 %. `energy_error` of the result, the energy balance, does
            not contain this error; `trajectory_error` measures it. For time steps and marginal contacts see
            docs/explanation/drag.md.
        background_drag: Stokes drag in addition to contact damping, in units of k tau_1. It determines motion that
            contact damping leaves without drag. Default: 1e-4 for disks, 1e-2 for droplets. 1e-2 changes the mean
            stress of disks by less than 3 %.
        walls: True: shear between the walls of `jamlab.with_walls`; the upper wall moves by strain times box height.
            False: remove the walls. Default: as in the packing.
        trajectory_error: True: repeat the run at a tenth of the tolerance, at 1 to 3 times the cost of the run alone,
            and return the largest difference of the stress so far, row by row, as `trajectory_error`. Default: False;
            the error of the stresses is then unknown. Once two trajectories have separated, their stresses differ as
            much as the stresses of two packings; means of steady flow remain valid.
        path: HDF5 file of the run, saved regularly, see `jamlab.read_flow`. If it contains a part of the same run, the
            run resumes; a complete run is returned from the file.
        progress: called after each row with (fraction done, text); True: print it.

    Raises:
        InputError: a value out of range.
        ConvergenceError: the flow is too fast or the drag too weak to be resolved, or it needs more than 1e8 steps.
        StorageError: `path` cannot be written, or contains another run.
    """
    packing = walled(packing, walls)
    parts = _parts(rate, strain)
    law = damping or ContactDamping()
    whole = float(parts[:, 1].sum())
    counts = [_rows_of_part(length, snapshot_every, rows * length / whole) for length in parts[:, 1]]
    several = len(parts) > 1
    task = {"rate": parts.tolist() if several else float(parts[0, 0])}
    slowest = float(np.abs(parts[:, 0]).min())
    end = End(
        float((parts[:, 1] / np.abs(parts[:, 0])).sum()),
        f"a higher rate than {slowest:g}, a smaller strain than {whole:g}, or use quasistatic_shear",
    )
    accuracy = tolerance, default_background(packing, law, background_drag)
    check_flow_tolerance(tolerance, trajectory_error)
    with TimedRun(ShearRun, packing, law, accuracy, task, end, path, progress) as flow:
        flow.facts |= {"shear_rate": float(parts[-1, 0]), "strain_asked": whole, "parts": parts if several else None}
        flow.warn_beyond("strain", flow.path, whole)
        begin = 0.0
        for (speed, by), (count, every) in zip(parts, counts, strict=True):
            done = round(max(0.0, flow.path - begin) / by * count)
            if done < count:
                flow.drive(f"rate {speed:.17g}", by / count / abs(speed))
            for row in range(done + 1, count + 1):
                keep = (row == count and several) or (every > 0 and row % every == 0)
                state = flow.advance(keep=keep)
                flow.report(min(1.0, flow.path / whole), f"strain {state.strain:.3g}")
            begin += by
        if trajectory_error:
            how: dict[str, Any] = {
                "rows": rows,
                "snapshot_every": snapshot_every,
                "background_drag": background_drag,
            }
            flow.measure_trajectory_error(
                lambda finer, told: shear(packing, rate, strain, damping, tolerance=finer, progress=told, **how)
            )
        return flow.finish()


def _parts(rate: float | Sequence[Sequence[float]], strain: float | None) -> Array:
    """(p, 2) rate and strain of each part."""
    if isinstance(rate, Sequence | np.ndarray):
        if strain is not None:
            raise InputError(f"strain = {strain!r}: each part of the protocol has its own strain; leave strain out")
        parts = [list(part) for part in rate]
        if not parts or any(len(part) != 2 for part in parts):
            raise InputError(f"rate = {parts!r}: give a protocol of one or more parts, [(rate, strain), ...]")
    else:
        parts = [[rate, 1.0 if strain is None else strain]]
    for speed, by in parts:
        check_range("rate", speed, "shear")
        if abs(speed) < (least := argument("rate").least or 0.0):
            remedy = typed("quasistatic_shear", "jamlab quasistatic-shear")
            raise InputError(f"{named('rate', speed)}: must be {least:g} or more in magnitude; at rate 0 use {remedy}")
        check_range("strain", by, "shear")
    return np.array(parts, dtype=np.float64)


def _rows_of_part(strain: float, frames: float | None, rows: float) -> tuple[int, int]:
    """Rows of a part, and after how many of them a packing is kept; 0: none on the way."""
    count = max(1, round(rows))
    if frames is None:
        return count, 0
    check_number("snapshot_every", frames, strain)
    if abs(strain / frames - round(strain / frames)) > 1e-6:
        raise InputError(
            f"snapshot_every = {frames:g} must divide strain = {strain:g}: use an integer fraction of the strain"
        )
    every = int(np.ceil(count * frames / strain))
    return every * round(strain / frames), every


def check_rates(rates: Sequence[float] | Array) -> list[float]:
    """Rates from the fastest to the slowest, each once."""
    values = sorted({float(rate) for rate in np.ravel(rates)}, reverse=True)
    line = argument("rates")
    if not values or not all(map(line.admits, values)):
        raise InputError(
            f"rates = {np.ravel(rates).tolist()!r}: must be one or more, each {line.allowed()}, in {line.unit}"
        )
    return values
