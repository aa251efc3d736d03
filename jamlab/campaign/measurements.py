"""Measure the states of one task: one table of columns for each observable."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.campaign.flow_rows import (
    CREEP,
    EQUIVALENT,
    OSCILLATION,
    PEAK,
    STEADY,
    creep_rows,
    flow_rows,
    oscillation_rows,
)
from jamlab.campaign.states import TaskStates
from jamlab.campaign.table_rows import Row, damping_laws, law_columns, state_columns
from jamlab.errors import BoundaryError, ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.slow_shear import slow_shear
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import Damping
from jamlab.rheology.displacement_correlation import displacement_correlations
from jamlab.rheology.mode_motion import MOTIONS, mode_motion

Columns = dict[str, NDArray[Any]]

# columns of each table in a task file; `state` is the frame to which a row belongs
FLOAT, WHOLE, FLAG = np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.bool_)
_STATE = {"state": WHOLE, "pressure": FLOAT, "target_pressure": FLOAT}
_LAW = {"stokes": FLAG, "beta": FLOAT, "eta_f": FLOAT, "prestress": FLAG}
_FLOW_LAW = {"stokes": FLAG, "beta": FLOAT, "eta_f": FLOAT, "alpha": FLOAT}
_MODE = ("rates", "strengths", *MOTIONS, "sliding")  # attributes of `ModeMotion`
_SPECTRUM = ("storage", "loss", "g0", "eta0", "eta_inf", "error")  # attributes of `ComplexModulus`
SCHEMA: dict[str, dict[str, np.dtype[Any]]] = {
    "onset": {"rho_J": FLOAT, "phi_J": FLOAT, "z_J": FLOAT, "n_contacts": WHOLE, "rattlers": WHOLE, "converged": FLAG},
    "spectra": {**_STATE, **_LAW, **dict.fromkeys(("omega", *_SPECTRUM), FLOAT), "converged": FLAG},
    "quasistatic": {**_STATE, "prestress": FLAG, **dict.fromkeys(("approach", "sliding", "nonaffine"), FLOAT)},
    "correlation": {**_STATE, **_LAW, **dict.fromkeys(("omega", "delta", "c", "box"), FLOAT)},
    "modes": {**_STATE, "stokes": FLAG, "beta": FLOAT, "eta_f": FLOAT, **dict.fromkeys(_MODE, FLOAT)},
    "flow": {
        **_STATE,
        **_FLOW_LAW,
        **dict.fromkeys(("rate", *STEADY, "flow_pressure", "flow_pressure_error", *PEAK), FLOAT),
        "converged": FLAG,
    },
    "oscillation": {
        **_STATE,
        **_FLOW_LAW,
        **dict.fromkeys(("omega", "amplitude", *OSCILLATION, *EQUIVALENT), FLOAT),
        "converged": FLAG,
    },
    "creep": {
        **_STATE,
        **_FLOW_LAW,
        **dict.fromkeys(("stress", *CREEP), FLOAT),
        **dict.fromkeys(("flows", "rests", "converged"), FLAG),
    },
    "voids": {"state": WHOLE, "sides": WHOLE} | dict.fromkeys(("area", "perimeter", "shape", "particle_area"), FLOAT),
}


def measure_tables(
    parameters: dict[str, Any],
    states: TaskStates,
    pressure: NDArray[np.float64],
    known: Mapping[str, Columns] | None = None,
) -> dict[str, Columns]:
    """Measure every table of jamlab's own that the task asks for.

    Args:
        parameters: of the task, see `tasks.py`.
        states: packings of the task.
        pressure: (packings,) measured pressure.
        known: tables of these states that are measured already; they are returned as they are.

    Returns:
        Table -> column -> values. An unstable packing has nan in "spectra", where it is not converged, and in
        "quasistatic", and no rows in "correlation" and "modes"; one whose outlines cross has no rows in "voids".
    """
    known = known or {}
    observables = [name for name in parameters["observables"] if name not in known]
    tables: dict[str, list[Row]] = {}
    if not {"pressures", "phi"} & parameters.keys() and "onset" not in known:
        tables["onset"] = [_onset_row(states)]
    if "spectra" in observables:
        tables["spectra"] = _spectrum_rows(parameters, states, pressure)
    if "quasistatic" in observables:
        tables["quasistatic"] = _quasistatic_rows(parameters, states, pressure)
    if "correlation" in observables:
        tables["correlation"] = _correlation_rows(parameters, states, pressure)
    if "modes" in observables:
        tables["modes"] = _mode_rows(parameters, states, pressure)
    for name, rows in {"flow": flow_rows, "oscillation": oscillation_rows, "creep": creep_rows}.items():
        if name in observables:
            tables[name] = rows(parameters, states, pressure)
    if "voids" in observables:
        tables["voids"] = _void_rows(states)
    return {**known, **{name: _stack(name, rows) for name, rows in tables.items()}}


def _stack(table: str, rows: list[Row]) -> Columns:
    """Concatenate rows to columns; numbers in a row are repeated to the length of its arrays."""
    lengths = [max(np.size(value) for value in row.values()) for row in rows]
    columns: Columns = {}
    for name, kind in SCHEMA[table].items():
        parts = [np.broadcast_to(row[name], length) for row, length in zip(rows, lengths, strict=True)]
        columns[name] = np.concatenate(parts).astype(kind) if parts else np.empty(0, kind)
    return columns


def _onset_row(states: TaskStates) -> Row:
    packing = states.packings[0]
    network = contacts(packing)
    return {
        "rho_J": packing_fraction(packing),
        "phi_J": packing.phi,
        "z_J": network.z,
        "n_contacts": network.count,
        "rattlers": int(network.rattlers.sum()),
        "converged": states.converged[0],
    }


def _spectrum_rows(parameters: dict[str, Any], states: TaskStates, pressure: NDArray[np.float64]) -> list[Row]:
    omega = np.array(parameters["omega"])
    limit = parameters["tolerances"]["spectrum_error"]
    rows = []
    for k, packing in enumerate(states.packings):
        for law, prestress in _laws(parameters):
            row = state_columns(states, pressure, k) | law_columns(law) | {"prestress": prestress} | {"omega": omega}
            try:
                spectrum = complex_modulus(packing, omega, law, prestress)
            except ConvergenceError:  # not jammed, or unstable in a fixed box
                row |= dict.fromkeys(_SPECTRUM, np.nan) | {"converged": False}
            else:
                row |= {name: getattr(spectrum, name) for name in _SPECTRUM}
                row["converged"] = states.converged[k] & (spectrum.error <= limit)
            rows.append(row)
    return rows


def _quasistatic_rows(parameters: dict[str, Any], states: TaskStates, pressure: NDArray[np.float64]) -> list[Row]:
    rows = []
    for k, packing in enumerate(states.packings):
        for prestress in parameters["prestress"]:
            row = state_columns(states, pressure, k) | {"prestress": prestress}
            try:
                motion = slow_shear(packing, prestress=prestress)
            except ConvergenceError:  # not jammed, or unstable in a fixed box
                row |= dict.fromkeys(("approach", "sliding", "nonaffine"), np.nan)
            else:
                row |= {"approach": motion.median_normal, "sliding": motion.median_tangential}
                row["nonaffine"] = motion.median_nonaffine
            rows.append(row)
    return rows


def _correlation_rows(parameters: dict[str, Any], states: TaskStates, pressure: NDArray[np.float64]) -> list[Row]:
    rows = []
    for k, packing in enumerate(states.packings):
        for law, prestress in _laws(parameters):
            frequencies = parameters["correlation_omega"]
            try:
                correlations = displacement_correlations(packing, frequencies, law, prestress)
            except ConvergenceError:  # not jammed, or unstable in a fixed box
                continue
            for omega, found in zip(frequencies, correlations, strict=True):
                row = state_columns(states, pressure, k) | law_columns(law) | {"prestress": prestress}
                row |= {"omega": omega, "delta": found.delta, "c": found.correlation, "box": packing.box[0, 0]}
                rows.append(row)
    return rows


def _mode_rows(parameters: dict[str, Any], states: TaskStates, pressure: NDArray[np.float64]) -> list[Row]:
    rows = []
    for k, packing in enumerate(states.packings):
        for law in damping_laws(parameters):
            try:
                found = mode_motion(packing, law)
            except ConvergenceError:  # not jammed, or unstable in a fixed box
                continue
            row = state_columns(states, pressure, k) | law_columns(law)
            rows.append(row | {name: getattr(found, name) for name in _MODE})
    return rows


def _void_rows(states: TaskStates) -> list[Row]:
    rows: list[Row] = []
    for k, packing in enumerate(states.packings):
        try:
            found = voids(packing)
        except BoundaryError:  # outlines cross
            continue
        closed = found.percolating == 0
        if not closed.any():
            continue
        row: Row = {name: getattr(found, name)[closed] for name in ("sides", "area", "perimeter", "shape")}
        particle_area = (packing.area - found.area.sum()) / packing.n
        rows.append(row | {"state": k, "particle_area": particle_area})
    return rows


def _laws(parameters: dict[str, Any]) -> list[tuple[Damping, bool]]:
    """List every damping law with and without prestress, as the task asks."""
    return [(law, prestress) for law in damping_laws(parameters) for prestress in parameters["prestress"]]
