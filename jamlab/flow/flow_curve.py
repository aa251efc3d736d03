"""Measure the steady flow of a packing at several rates, from the fastest to the slowest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.energy_balance import energy_gap, energy_imbalance
from jamlab.flow.flow_run import Progress
from jamlab.flow.overdamped_session import background_drag, check_flowing
from jamlab.flow.run_file import RunFile
from jamlab.flow.shear import TOLERANCE, check_rates, shear
from jamlab.flow.shear_run import TRANSIENT, ShearRun
from jamlab.flow.steady_flow import FlowCurve
from jamlab.packing.law_parameters import UNIT_OF_STRESS
from jamlab.packing.packing import Packing
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.rheology.damping import ContactDamping, Damping

ROWS = 50  # per unit of strain: stresses forget each other within 0.1
MOST_PROCESSES = 1024
AVERAGE = 4.0  # strain: 2 to 3 % of error at N = 256
_AVERAGED = ("stress", "elastic_stress", "pressure", "normal_stress_difference")
_POINTS = (
    *_AVERAGED,
    *(f"{name}_error" for name in _AVERAGED),
    "dissipation",
    "drift",
    "plastic_events",
    "imbalance",
    "seconds",
)


@checked
def flow_curve(
    packing: Packing,
    rates: Sequence[float],
    damping: Damping | None = None,
    *,
    strain: float = AVERAGE,
    discard: float = TRANSIENT,
    tolerance: float = TOLERANCE,
    background: float | None = None,
    processes: int = 1,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> FlowCurve:
    """Shear a packing into steady flow at each rate, from the same packing, and average.

    `plan_flow` says before how long it takes.

    >>> c = jamlab.flow_curve(jamlab.pack(n=32, pressure=1e-2, seed=1), rates=[0.3, 1.0], strain=1.0, discard=0.2)
    >>> c.rates, bool(c.stress[1] > c.stress[0])
    (array([0.3, 1. ]), True)

    Args:
        packing: SP or DP.
        rates: of shear, 1/tau_1.
        damping: see `shear`.
        strain: of the average, one at least.
        discard: strain of start-up before.
        tolerance, background: see `shear`.
        processes: rates side by side, each on one core.
        out: HDF5 file, see `jamlab.read_flow`; rates that it holds already are not run again.
        progress: called with the share of all strain that is done.

    Raises:
        InputError: a value out of range.
        ConvergenceError: see `shear`.
        StorageError: `out` cannot be written.
    """
    law = damping or ContactDamping()
    background = background_drag(packing, law, background)
    wanted = check_rates(rates)
    check_number("strain", strain, 1e4)
    if strain < 1:
        raise InputError(f"strain = {strain:g}: average over 1 at least, or the mean says nothing")
    check_number("discard", discard, 1e4)
    check_flowing(law, tolerance, background)
    if not 1 <= processes <= MOST_PROCESSES:
        raise InputError(f"processes = {processes}: must lie between 1 and {MOST_PROCESSES}")
    task = {"strain": strain, "discard": discard, "tolerance": tolerance, "background": background}
    file = RunFile(out, FlowCurve, packing, law, task)
    facts = {**task, "damping": law, "unit": UNIT_OF_STRESS[packing.model, packing.units]}
    points = _known_points(file.before)
    missing = [rate for rate in wanted if rate not in points]
    done = dict.fromkeys(missing, 0.0)

    def report(item: _Item, *step: Any) -> None:
        if len(step) == 1:
            done[item[1]] = step[0]
            if progress is not None:
                progress(f"rate {item[1]:g}", sum(done.values()) / len(done))
            return
        points[item[1]] = step
        file.save(lambda: _curve(packing, points, facts))

    items: list[_Item] = [(packing, rate, law, discard, strain, tolerance, background) for rate in missing]
    if processes == 1:
        for item in items:
            _measure(item, lambda *step, item=item: report(item, *step))
    else:
        run_side_by_side(_measure, items, processes, report=report)
    curve = _curve(packing, points, facts)
    file.save(lambda: curve, now=True)
    return curve


_Item = tuple[Packing, float, Damping, float, float, float, float]
_Point = tuple[Any, ...]  # numbers of `_POINTS`, and the last packing


def _measure(item: _Item, report: Callable[..., None]) -> None:
    """One rate: reports the share of its strain that is done, and at the end its numbers and its last packing."""
    packing, rate, law, discard, strain, tolerance, background = item
    rows = int(np.ceil(ROWS * (discard + strain)))
    run = shear(
        *(packing, rate, discard + strain, law),
        rows=rows,
        tolerance=tolerance,
        background=background,
        progress=lambda _, share: report(share),
    )
    report(steady_point(run, discard), run.packing)


def steady_point(run: ShearRun, discard: float) -> dict[str, float]:
    """Means of a start-up beyond some strain, with their errors, by the names of `FlowCurve`."""
    means = {name: run.steady(name, discard=discard) for name in _AVERAGED}
    kept = run.strain >= discard * (1 - 1e-9)
    time, lost, strain = run.time[kept], run.dissipated[kept], run.strain[kept]
    return {
        **{name: mean.value for name, mean in means.items()},
        **{f"{name}_error": mean.error for name, mean in means.items()},
        "dissipation": float((lost[-1] - lost[0]) / (time[-1] - time[0])) if run.shear_rate else 0.0,
        "drift": means["stress"].drift,
        "plastic_events": float(np.sum(run.drops.strain >= discard) / (strain[-1] - strain[0])),
        "imbalance": energy_imbalance(energy_gap(run.work[kept], lost, run.energy[kept]), run.work[kept], lost),
        "seconds": run.seconds,
    }


def _known_points(before: FlowCurve | None) -> dict[float, _Point]:
    if before is None:
        return {}
    return {
        float(rate): ({name: float(getattr(before, name)[k]) for name in _POINTS}, before.packings[k])
        for k, rate in enumerate(before.rates)
    }


def _curve(packing: Packing, points: dict[float, _Point], facts: dict[str, Any]) -> FlowCurve:
    rates = sorted(points)
    columns = {name: np.array([points[rate][0][name] for rate in rates]) for name in _POINTS}
    frames = (packing, *(points[rate][1] for rate in rates))
    return FlowCurve(**facts | columns, rates=np.array(rates), frames=frames)
