"""Flow curves: the steady shear stress of a packing at several rates, and beforehand what they cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import ConvergenceError, InputError, named
from jamlab.flow.flow_run import FlowResult, energy_gap, energy_imbalance
from jamlab.flow.overdamped_session import OverdampedSession, check_flowing, default_background
from jamlab.flow.report import say_balance
from jamlab.flow.run import RunFile
from jamlab.flow.shear import EVENTS, TOLERANCE, ShearRun, check_rates, shear
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line, positive
from jamlab.plotting.palette import COLOURS
from jamlab.processes.progress import Progress, told
from jamlab.processes.side_by_side import run_side_by_side, workers_there
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.statistics.confidence import AVERAGES
from jamlab.statistics.herschel_bulkley import HerschelBulkley, herschel_bulkley

if TYPE_CHECKING:
    import pandas as pd


_AVERAGED = ("stress", "elastic_stress", "pressure", "normal_stress_difference", "z_all")
_POINTS = (
    *(*_AVERAGED, *(f"{name}_stderr" for name in _AVERAGED)),
    *("dissipation", "drift", "plastic_events", "energy_error", "ambiguous_contacts", "seconds"),
)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FlowCurve(FlowResult):
    """Steady states at m rates, in the packing's unit of stress and with times in tau_1; errors are standard errors
    for correlated rows, see `ShearRun.steady`. Errors of the steps come in addition; at other tolerances they differ.

    Attributes:
        rate: (m,) shear rates, ascending.
        stress, stress_stderr: (m,) mean shear stress.
        elastic_stress, pressure, normal_stress_difference, z_all: (m,) means, each with `..._stderr`; z_all as in
            `FlowRun`.
        dissipation: (m,) mean, per time and area, over all steps; stress times rate, less the change of elastic energy.
        drift: (m,) change of the stress from the first to the second half of the average, in its standard errors.
        plastic_events: (m,) number per unit of strain.
        energy_error: (m,) part of the work during the average that is neither stored nor dissipated.
        ambiguous_contacts: (m,) see `FlowRun`, of start-up and average.
        seconds: (m,) wall time.
        discard, strain: strain of the start-up, which is left out, and strain of the average.
        failed: rates whose run failed, as text, with the reason; the arrays omit them.
        frames: the packing at the start and the last state of each rate.
        damping, background_drag, tolerance, unit: see `FlowRun`.
    """

    columns: ClassVar[tuple[str, ...]] = ("rate", *_POINTS, "finished")

    rate: Array
    stress: Array
    stress_stderr: Array
    elastic_stress: Array
    elastic_stress_stderr: Array
    pressure: Array
    pressure_stderr: Array
    normal_stress_difference: Array
    normal_stress_difference_stderr: Array
    z_all: Array
    z_all_stderr: Array
    dissipation: Array
    drift: Array
    plastic_events: Array
    energy_error: Array
    ambiguous_contacts: Array
    seconds: Array
    discard: float
    strain: float
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def finished(self) -> NDArray[np.bool_]:
        """(m,) whether the flow is steady: its stress has one mean in both halves of the average, to the errors."""
        return np.abs(self.drift) <= AVERAGES.drift

    @property
    def packings(self) -> tuple[Packing, ...]:
        """The last state of each rate."""
        return self.frames[1:]

    @property
    def state(self) -> Literal["steady", "drifting"]:
        """Whether the flow is steady at every rate."""
        return "steady" if self.finished.all() else "drifting"

    @property
    def summary(self) -> dict[str, Any]:
        """Stress at each rate with its standard error; rates that drift, lose energy or failed."""
        points = zip(self.rate, self.stress, self.stress_stderr, strict=True)
        off = {"DRIFTING at": ~self.finished, "ENERGY OFF at": self.energy_error > self.energy_tolerance}
        return {
            **{f"stress at {rate:g}": (stress, error) for rate, stress, error in points},
            **{words: self.rate[which] for words, which in off.items() if which.any()},
            **{f"FAILED at {rate}": why for rate, why in self.failed.items()},
        }

    def herschel_bulkley(self) -> HerschelBulkley:
        """Fit yield stress, consistency and exponent to three rates or more.

        The law describes slow flow: give rates well below 1/tau_1.

        Raises:
            InputError, ConvergenceError: fewer than three rates, or no fit is found.
        """
        return herschel_bulkley(self.rate, self.stress, self.stress_stderr, self.unit)

    @drawn("Line2D; `label` names the curve in the legend")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the stress over the rate with its errors, on logarithmic axes; open symbols are not steady."""
        colour = COLOURS[len(axes.containers) % len(COLOURS)]
        look = merged_line({"color": colour, "marker": "o", "markersize": 5, "linewidth": 1.2}, style)
        stress, left_out = positive(self.stress)
        name = (label or str(self.damping)) + left_out
        axes.errorbar(self.rate, stress, self.stress_stderr, capsize=2.5, label=name, **look)
        drifting = ~self.finished
        if drifting.any():
            open_symbols: dict[str, Any] = {"linestyle": "none", "markerfacecolor": "white", "zorder": 5}
            axes.plot(self.rate[drifting], stress[drifting], **look | open_symbols | {"label": "not steady"})
        axes.set_xscale("log")
        axes.set_yscale("log")
        label_axes(axes, r"rate of shear $\dot\gamma\,\tau_1$", in_unit(r"shear stress $\sigma$", self.unit))
        axes.legend(fontsize=LEGEND)
        say_balance(axes, self)


FLOW_DEFINITION = 3  # version, see jamlab.campaign.tasks; 1 took correlated rows for independent, 2 differs by rounding
ROWS = 50  # per unit of strain: stresses forget each other within 0.1


@checked
def flow_curve(
    packing: Packing,
    rates: Sequence[float] | Array,
    damping: DragLaw | None = None,
    *,
    strain: float = 4.0,  # strain: 2 to 3 % of error at N = 256
    discard: float = EVENTS.transient,
    tolerance: float = TOLERANCE,
    background_drag: float | None = None,
    workers: int | Executor | None = 1,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> FlowCurve:
    """Measure the flow curve: steady-state averages at each rate, started from the same packing.

    >>> c = jamlab.flow_curve(jamlab.pack(n=32, pressure=1e-2, seed=1), rates=[0.3, 1.0], strain=1.0, discard=0.2)
    >>> c.rate, bool(c.stress[1] > c.stress[0])
    (array([0.3, 1. ]), True)

    Args:
        packing: SP or DP.
        rates: shear rates, 1/tau_1.
        damping: see `shear`.
        strain: strain of the average, at least 1.
        discard: transient strain that is discarded.
        tolerance: relative error of velocities per step, see `shear`. It does not bound the error of the means. Measure
            a second curve at a tenth of it, in another file: means that differ by more than their standard errors are
            wrong at this tolerance. Single rates: `trajectory_error=True` of `shear`.
        background_drag: see `shear`.
        workers: number of processes, each of which runs a rate, or an executor (`concurrent.futures.Executor`); None:
            all cores.
        path: HDF5 file, see `jamlab.read_flow`; rates in the file are not run again.
        progress: called with (fraction of all strain, text); True: print it.

    Raises:
        InputError: a value out of range.
        ConvergenceError: all rates failed, see `shear`. If only some failed, `failed` of the curve lists them.
        StorageError: `path` cannot be written.
        EngineError: a process was killed, or the executor cannot be used; rates in the file are kept.
    """
    law = damping or ContactDamping()
    background_drag = default_background(packing, law, background_drag)
    wanted = check_rates(rates)
    check_flowing(law, tolerance, background_drag)
    where = workers_there(workers)
    task = {"strain": strain, "discard": discard, "tolerance": tolerance, "background_drag": background_drag}
    curve = _Curve(packing, law, task, path, progress)
    missing = [rate for rate in wanted if rate not in curve.points]
    curve.done = dict.fromkeys(missing, 0.0)
    items: list[_Item] = [(packing, rate, law, discard, strain, tolerance, background_drag) for rate in missing]
    if where == 1:
        for item in items:
            _measure(item, partial(curve.heard, item))
    else:
        run_side_by_side(_measure, items, where, report=curve.heard)
    if not curve.points:
        raise ConvergenceError("; ".join(f"rate {rate}: {why}" for rate, why in curve.failed.items()))
    return curve.finish()


_Item = tuple[Packing, float, DragLaw, float, float, float, float]


class _Curve(RunFile[FlowCurve]):
    """Rates as they come in. `points`: of each rate its numbers, see `_POINTS`, and its last packing; `done`: shares of
    the rates that are on their way; `failed`: why a rate found no end."""

    def __init__(
        self, packing: Packing, law: DragLaw, task: dict[str, Any], path: str | Path | None, progress: Progress | None
    ) -> None:
        super().__init__(FlowCurve, packing, law, task, path, progress)
        self.facts |= task
        self.points: dict[float, tuple[dict[str, float], Packing]] = {}
        self.done: dict[float, float] = {}
        self.failed: dict[str, str] = {}
        self._packing = packing
        if known := self.before:
            for k, rate in enumerate(known.rate.tolist()):
                self.points[rate] = {name: float(getattr(known, name)[k]) for name in _POINTS}, known.packings[k]

    def heard(self, item: _Item, *step: Any) -> None:
        """Take what `_measure` says of a rate."""
        rate = item[1]
        if isinstance(step[0], str):
            self.failed[f"{rate:g}"] = step[0]
        elif len(step) == 2:
            self.points[rate] = step
            self.save(self.result())
        else:
            self.done[rate] = step[0]
            if self.progress is not None:
                told(self.progress)(sum(self.done.values()) / len(self.done), f"rate {rate:g}")

    def result(self) -> FlowCurve:
        """All rates so far."""
        rates = sorted(self.points)
        columns = {name: np.array([self.points[rate][0][name] for rate in rates]) for name in _POINTS}
        frames = (self._packing, *(self.points[rate][1] for rate in rates))
        return FlowCurve(**self.facts | columns, rate=np.array(rates), frames=frames, failed=self.failed)


def _measure(item: _Item, report: Callable[..., None]) -> None:
    """One rate: reports the share of its strain that is done, and at the end its numbers and its last packing, or why
    it found no end."""
    packing, rate, law, discard, strain, tolerance, background = item
    how: dict[str, Any] = {"tolerance": tolerance, "background_drag": background}
    how |= {"rows": int(np.ceil(ROWS * (discard + strain))), "progress": lambda share, _: report(share)}
    try:
        run = shear(packing, rate, discard + strain, law, **how)
    except ConvergenceError as error:
        report(str(error))
        return
    report(steady_point(run, discard), run.packing)


def steady_point(run: ShearRun, discard: float) -> dict[str, float]:
    """Means of a start-up beyond some strain, with their errors, by the names of `FlowCurve`."""
    mean = run.steady(discard)
    kept = run.strain >= discard * (1 - 1e-9)
    times, lost = run.time[kept], run.dissipated[kept]
    return {
        **{each: getattr(mean, each) for name in _AVERAGED for each in (name, f"{name}_stderr")},
        "dissipation": float((lost[-1] - lost[0]) / (times[-1] - times[0])) if run.shear_rate else 0.0,
        "drift": mean.drift,
        "plastic_events": mean.plastic_events,
        "energy_error": energy_imbalance(energy_gap(run.work[kept], lost, run.energy[kept]), run.work[kept], lost),
        "ambiguous_contacts": run.ambiguous_contacts,
        "seconds": run.seconds,
    }


@dataclass(frozen=True)
class Trials:
    """Trial runs from which the cost of a flow is estimated."""

    seconds: float = 0.5  # s at each rate
    steps: int = 100  # of a trial between two looks at the clock
    longest: float = 0.2  # strain
    flow_over_start: float = 2.0  # cost of a unit of strain in flow over that of start-up, which the trial sees


TRIALS = Trials()


@checked
def flow_cost(
    packing: Packing,
    rates: Sequence[float] | Array,
    damping: DragLaw | None = None,
    *,
    strain: float = 1.0,
    tolerance: float = TOLERANCE,
    background_drag: float | None = None,
) -> pd.DataFrame:
    """Estimate the run time of shear at each rate, to a factor of two, from a trial run of half a second.

    >>> cost = jamlab.flow_cost(jamlab.pack(n=32, pressure=1e-2, seed=1), rates=[0.1, 1.0], strain=5.0)
    >>> list(cost.columns), bool(cost["seconds"][0] > 0)
    (['rate', 'strain', 'seconds'], True)

    Args:
        packing: SP or DP.
        rates: shear rates, 1/tau_1.
        damping, tolerance, background_drag: see `shear`.
        strain: strain of each run; for `flow_curve` the sum of its `strain` and `discard`.

    Returns:
        pandas DataFrame with one row per rate, ascending: `rate`, `strain` and `seconds` on one core.

    Raises:
        InputError: a value out of range.
        ConvergenceError: see `shear`.
    """
    import pandas as pd

    law = damping or ContactDamping()
    background_drag = default_background(packing, law, background_drag)
    values = check_rates(rates)[::-1]
    seconds = [strain * _cost(packing, rate, law, tolerance, background_drag) for rate in values]
    return pd.DataFrame({"rate": values, "strain": strain, "seconds": seconds})


def require_time(cost: pd.DataFrame, given: float) -> None:
    """Refuse rates of `flow_cost` that do not fit into the seconds given."""
    total, (rate, strain, seconds) = float(cost["seconds"].sum()), cost.iloc[0]
    if total > given:
        raise InputError(
            f"{named('rate', rate, 'g')}: strain {strain:g} takes about {seconds:.2g} s, and all rates {total:.2g} s, "
            f"but {given:g} s are allowed: give higher rates, or strain {strain * given / total:.2g}"
        )


def _cost(packing: Packing, rate: float, law: DragLaw, tolerance: float, background: float) -> float:
    """Seconds per unit of strain."""
    with OverdampedSession(packing, law, tolerance, background) as session:
        session.drive(f"rate {rate:.17g}", 1e3 / rate)
        begun = session.advance(TRIALS.steps).strain  # the first steps are shorter than those that follow
        clock = time.process_time()
        while True:
            strain = session.advance(TRIALS.steps).strain - begun
            seconds = time.process_time() - clock
            if seconds > TRIALS.seconds or strain > TRIALS.longest:
                return TRIALS.flow_over_start * seconds / strain
