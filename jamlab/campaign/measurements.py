"""What is measured on the states of one task: columns, one table for each observable."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.campaign.states import SweepStates
from jamlab.errors import BoundaryError, ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.slow_shear import slow_shear
from jamlab.packing.packing import Packing
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.displacement_correlation import displacement_correlation

Columns = dict[str, NDArray[Any]]

# columns of each table in a task file; `state` is the frame that a row belongs to
FLOAT, WHOLE, FLAG = np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.bool_)
_LAW = {"stokes": FLAG, "beta": FLOAT, "eta_f": FLOAT, "prestress": FLAG}
SCHEMA: dict[str, dict[str, np.dtype[Any]]] = {
    "onset": {"rho_J": FLOAT, "phi_J": FLOAT, "z_J": FLOAT, "n_contacts": WHOLE, "rattlers": WHOLE, "converged": FLAG},
    "spectra": {"state": WHOLE, "pressure": FLOAT, "target_pressure": FLOAT, **_LAW}
    | dict.fromkeys(("omega", "storage", "loss", "g0", "eta0", "eta_inf", "error"), FLOAT)
    | {"converged": FLAG},
    "quasistatic": {"state": WHOLE, "pressure": FLOAT, "target_pressure": FLOAT, "prestress": FLAG}
    | dict.fromkeys(("approach", "sliding", "nonaffine"), FLOAT),
    "correlation": {"state": WHOLE, "pressure": FLOAT, "target_pressure": FLOAT, **_LAW}
    | dict.fromkeys(("omega", "delta", "c", "box"), FLOAT),
    "voids": {"state": WHOLE, "sides": WHOLE} | dict.fromkeys(("area", "perimeter", "shape", "particle_area"), FLOAT),
}


def sweep_tables(parameters: dict[str, Any], states: SweepStates, pressure: NDArray[np.float64]) -> dict[str, Columns]:
    """Measure every table that the task asks for.

    Args:
        parameters: of the task, see `tasks.py`.
        states: its packings.
        pressure: (packings,) measured.

    Returns:
        Table -> column -> values. What a packing refuses (an unstable one has no spectrum, one whose outlines cross has
        no voids) stands there as nan and not converged, or has no rows in "voids" and "correlation".
    """
    makers = {"spectra": _spectra, "quasistatic": _quasistatic, "correlation": _correlation, "voids": _voids}
    tables = {} if "pressures" in parameters else {"onset": _columns("onset", [_onset(states)])}
    for name, maker in makers.items():
        if name in parameters["observables"]:
            tables[name] = _columns(name, list(maker(parameters, states, pressure)))
    return tables


def _columns(table: str, rows: list[dict[str, Any]]) -> Columns:
    """Rows of numbers, or of arrays of one length, as columns."""
    found: Columns = {}
    for name, kind in SCHEMA[table].items():
        lengths = [max((np.size(value) for value in row.values()), default=1) for row in rows]
        parts = [np.broadcast_to(row[name], length) for row, length in zip(rows, lengths, strict=True)]
        found[name] = np.concatenate(parts).astype(kind) if parts else np.empty(0, kind)
    return found


def _onset(states: SweepStates) -> dict[str, Any]:
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


def _laws(parameters: dict[str, Any]) -> Iterator[tuple[Damping, bool, dict[str, Any]]]:
    """Each law with and without pre-stress as asked, and its columns."""
    chosen = parameters["damping"]
    laws: list[Damping] = [ContactDamping(beta=beta) for beta in chosen["contact"]]
    laws += [StokesDrag(eta_f=eta_f) for eta_f in chosen["stokes"]]
    for law in laws:
        stokes = isinstance(law, StokesDrag)
        beta, eta_f = (np.nan, law.eta_f) if isinstance(law, StokesDrag) else (law.beta, np.nan)
        for prestress in parameters["prestress"]:
            yield law, prestress, {"stokes": stokes, "beta": beta, "eta_f": eta_f, "prestress": prestress}


def _places(states: SweepStates, pressure: NDArray[np.float64]) -> Iterator[tuple[Packing, bool, dict[str, Any]]]:
    for k, packing in enumerate(states.packings):
        place = {"state": k, "pressure": pressure[k], "target_pressure": states.target_pressures[k]}
        yield packing, states.converged[k], place


def _spectra(
    parameters: dict[str, Any], states: SweepStates, pressure: NDArray[np.float64]
) -> Iterator[dict[str, Any]]:
    omega = np.array(parameters["omega"])
    limit = parameters["tolerances"]["spectrum_error"]
    for packing, converged, place in _places(states, pressure):
        for law, prestress, columns in _laws(parameters):
            row = place | columns | {"omega": omega}
            try:
                s = complex_modulus(packing, omega, law, prestress)
            except ConvergenceError:  # not jammed, or unstable at a fixed box
                names = ("storage", "loss", "g0", "eta0", "eta_inf", "error")
                yield row | dict.fromkeys(names, np.nan) | {"converged": False}
                continue
            values: dict[str, Any] = {"storage": s.storage, "loss": s.loss, "error": s.error}
            values |= {"g0": s.g0, "eta0": s.eta0, "eta_inf": s.eta_inf}
            yield row | values | {"converged": converged & (s.error <= limit)}


def _quasistatic(
    parameters: dict[str, Any], states: SweepStates, pressure: NDArray[np.float64]
) -> Iterator[dict[str, Any]]:
    for packing, _, place in _places(states, pressure):
        for prestress in parameters["prestress"]:
            try:
                u = slow_shear(packing, prestress=prestress)
                medians = {
                    "approach": u.median_normal,
                    "sliding": u.median_tangential,
                    "nonaffine": u.median_nonaffine,
                }
            except ConvergenceError:
                medians = dict.fromkeys(("approach", "sliding", "nonaffine"), float("nan"))
            yield place | {"prestress": prestress} | medians


def _correlation(
    parameters: dict[str, Any], states: SweepStates, pressure: NDArray[np.float64]
) -> Iterator[dict[str, Any]]:
    for packing, _, place in _places(states, pressure):
        for law, prestress, columns in _laws(parameters):
            for omega in parameters["correlation_omega"]:
                try:
                    c = displacement_correlation(packing, omega, law, prestress)
                except ConvergenceError:
                    continue
                values = {"omega": omega, "delta": c.delta, "c": c.correlation, "box": packing.box[0, 0]}
                yield place | columns | values


def _voids(parameters: dict[str, Any], states: SweepStates, pressure: NDArray[np.float64]) -> Iterator[dict[str, Any]]:
    for k, packing in enumerate(states.packings):
        try:
            v = voids(packing)
        except BoundaryError:
            continue
        closed = v.percolating == 0
        if closed.any():
            yield {
                "state": k,
                "sides": v.sides[closed],
                "area": v.area[closed],
                "perimeter": v.perimeter[closed],
                "shape": v.shape[closed],
                "particle_area": (packing.area - v.area.sum()) / packing.n,
            }
