"""Measure how the states of a task flow: steady flow and its start-up, oscillation, creep. A row for each run.

A run that has no answer, such as one whose drag is too weak to be resolved, has nan and is not converged.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.campaign.states import TaskStates
from jamlab.campaign.table_rows import Row, damping_laws, law_columns, state_columns
from jamlab.errors import ConvergenceError
from jamlab.flow.creep import creep
from jamlab.flow.flow_curve import ROWS, steady_point
from jamlab.flow.oscillate import oscillate
from jamlab.flow.shear import shear
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.nonlinear_drag import nonlinear_modulus

Pressure = NDArray[np.float64]

STEADY = (  # means of `FlowCurve`; the pressure stands apart from that of the state
    *("stress", "stress_error", "elastic_stress", "elastic_stress_error", "normal_stress_difference"),
    *("normal_stress_difference_error", "dissipation", "plastic_events"),
)
PEAK = ("peak_stress", "peak_strain")  # of start-up
OSCILLATION = ("storage", "loss", "third_over_first", "error")  # attributes of `Oscillation`
EQUIVALENT = ("equivalent_storage", "equivalent_loss", "equivalent_time")
CREEP = ("residual", "final_time", "final_strain", "final_rate", "slope")


def flow_rows(parameters: dict[str, Any], states: TaskStates, pressure: Pressure) -> list[Row]:
    """A row for each state, law and rate; rate 0 is quasi-static shear, in which there is no drag."""
    how = parameters["flow"]
    strain, discard = how["strain"] + how["discard"], how["discard"]

    def drive(packing: Packing, law: Damping, rate: float) -> Row:
        given = {"tolerance": how["tolerance"], "background": how["background"]}
        if isinstance(law, StokesDrag):
            given["background"] = None  # all of the drag is that of the background
        run = shear(packing, rate, strain, law, step=how["step"], rows=int(np.ceil(ROWS * strain)), **given)
        mean, peak = steady_point(run, discard), run.peak
        return {
            **{name: mean[name] for name in STEADY},
            "flow_pressure": mean["pressure"],
            "flow_pressure_error": mean["pressure_error"],
            "peak_stress": peak.stress if peak else np.nan,
            "peak_strain": peak.strain if peak else np.nan,
            "converged": run.steady(discard=discard).steady,
        }

    missing: Row = dict.fromkeys((*STEADY, *PEAK, "flow_pressure", "flow_pressure_error"), np.nan)
    points: list[Row] = [{"rate": rate} for rate in how["rates"]]
    return _driven_rows(parameters, "flow", states, pressure, points, drive, missing)


def oscillation_rows(parameters: dict[str, Any], states: TaskStates, pressure: Pressure) -> list[Row]:
    """A row for each state, law, frequency and amplitude, beside the linear answer by equivalent damping."""
    how = parameters["oscillation"]
    given = {name: how[name] for name in ("cycles", "tolerance", "background")}

    def drive(packing: Packing, law: Damping, omega: float, amplitude: float) -> Row:
        found = oscillate(packing, omega, amplitude, law, **given)
        row: Row = {name: getattr(found, name) for name in OSCILLATION}
        row |= _equivalent(packing, law, omega, amplitude * abs(complex(found.storage, found.loss)))
        return row | {"converged": found.converged}

    points: list[Row] = [
        {"omega": omega, "amplitude": amplitude} for omega in how["omega"] for amplitude in how["amplitudes"]
    ]
    missing: Row = dict.fromkeys((*OSCILLATION, *EQUIVALENT), np.nan)
    return _driven_rows(parameters, "oscillation", states, pressure, points, drive, missing)


def _equivalent(packing: Packing, law: Damping, omega: float, stress: float) -> Row:
    """Linear answer at the amplitude of stress that was seen, [T] eqs 23-29; nan beside balanced contact damping."""
    if isinstance(law, ContactDamping) and law.beta == 1:
        try:
            linear = nonlinear_modulus(packing, [omega], law.alpha, stress)
        except ConvergenceError:  # not jammed, or unstable in a fixed box
            pass
        else:
            return dict(zip(EQUIVALENT, (linear.storage[0], linear.loss[0], linear.tau[0]), strict=True))
    return dict.fromkeys(EQUIVALENT, np.nan)


def creep_rows(parameters: dict[str, Any], states: TaskStates, pressure: Pressure) -> list[Row]:
    """A row for each state, law and stress; the stress is that beside the residual one."""
    how = parameters["creep"]
    given = {name: how[name] for name in ("largest_strain", "tolerance", "background")}

    def drive(packing: Packing, law: Damping, stress: float) -> Row:
        found = creep(packing, stress, how["duration"], law, **given)
        return {
            **{"residual": found.residual, "final_rate": found.final_rate, "slope": found.slope},
            **{"final_time": found.time[-1], "final_strain": found.strain[-1]},
            **{"flows": "flows" in found.verdict, "rests": "at rest" in found.verdict},
            "converged": True,
        }

    points: list[Row] = [{"stress": stress} for stress in how["stresses"]]
    missing: Row = {**dict.fromkeys(CREEP, np.nan), "flows": False, "rests": False}
    return _driven_rows(parameters, "creep", states, pressure, points, drive, missing)


def _driven_rows(
    parameters: dict[str, Any],
    table: str,
    states: TaskStates,
    pressure: Pressure,
    points: Sequence[Row],
    drive: Callable[..., Row],
    missing: Row,
) -> list[Row]:
    """A row for each state, or the last one alone, law and point; `missing` where the run has no answer."""
    how = parameters[table]
    first = len(states.packings) - 1 if how.get("last") else 0
    rows = []
    for k, packing in list(enumerate(states.packings))[first:]:
        for law in _with_power(damping_laws(parameters), how["alpha"]):
            for point in points:
                try:
                    found = drive(packing, law, **point)
                except ConvergenceError:
                    found = missing | {"converged": False}
                row = state_columns(states, pressure, k) | _flow_columns(law) | point | found
                row["converged"] = states.converged[k] and found["converged"]
                rows.append(row)
    return rows


def _with_power(laws: list[Damping], alpha: float) -> list[Damping]:
    return [replace(law, alpha=alpha) if isinstance(law, ContactDamping) else law for law in laws]


def _flow_columns(law: Damping) -> Row:
    return law_columns(law) | {"alpha": law.alpha if isinstance(law, ContactDamping) else np.nan}
