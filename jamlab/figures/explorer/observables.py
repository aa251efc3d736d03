"""What stands beside the picture: rho, z, G and pressure of every state with units, and why a state has no G."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jamlab.errors import InputError
from jamlab.figures.explorer.states import shear_between
from jamlab.measure import measure, why_no_modulus
from jamlab.packing.hdf5 import LABELS, NEGATIVE_G
from jamlab.packing.law_parameters import UNIT_OF_FORCE, UNIT_OF_LENGTH, UNIT_OF_STRESS
from jamlab.packing.packing import Packing

_MEANING = {
    ("sp", "k"): "k: stiffness of a contact, d: mean diameter",
    ("sp", "eps"): "ε: energy of a contact, σ: mean diameter",
    ("dp", "eps"): "ε: energy of a contact, l: mean of √a₀ over the two sizes",
}


def unit_labels(packing: Packing) -> dict[str, str]:
    """Quantity -> unit; `meaning` says what the letters stand for."""
    system = packing.model, packing.units
    length = UNIT_OF_LENGTH[system]
    return {
        "length": length,
        "area": f"{length}²",
        "force": UNIT_OF_FORCE[system],
        "stress": UNIT_OF_STRESS[system],
        "meaning": _MEANING[system],
    }


SHOWN = ("rho", "z", "rattlers", "pressure", "g")
SHEARED = 1e-9  # change of the strain, or relative one of phi, that is more than rounding


@dataclass(frozen=True)
class Quantity:
    """A quantity as the page shows it."""

    name: str  # its key
    symbol: str  # before a number
    label: str  # of an axis, without unit
    unit: str = ""  # "" for a pure number


def stored_columns(observables: Mapping[str, ArrayLike], frames: int) -> dict[str, NDArray[np.float64]]:
    """Those of the observables that the page shows."""
    columns = {name: np.asarray(observables[name], dtype=np.float64) for name in SHOWN if name in observables}
    for name, values in columns.items():
        if values.shape != (frames,):
            raise InputError(f"observable {name!r} has shape {values.shape}: give a number for each of {frames} states")
    return columns


def observe(packing: Packing, known: Mapping[str, float], strain: float) -> dict[str, Any]:
    """Numbers of one state for the page: those that are known, others measured; JSON has no nan, so that is None.
    `converged` is None where no minimisation is known, as in a dump that does not say."""
    row = {**measure(packing, [name for name in SHOWN if name not in known]), **known}
    numbers = {name: float(row[name]) if np.isfinite(row[name]) else None for name in SHOWN}
    return {
        **numbers,
        "phi": packing.phi,
        "strain": strain,
        "why": _why(packing, numbers["g"]),
        "converged": None if packing.max_force is None and not packing.converged else packing.converged,
        "on_target": packing.on_target,
        "max_force": packing.max_force,
    }


def _why(packing: Packing, g: float | None) -> str:
    """Why a state has no G, or one below 0; "" for the others."""
    if g is None:
        return why_no_modulus(packing) or "the file holds no value"
    return NEGATIVE_G if g < 0 else ""


def strains(packings: Sequence[Packing]) -> NDArray[np.float64]:
    """(m,) shear strain of each state: what a flow says of itself, else tilt over height, without flips of the box. A
    box that leans by half its width is the same lattice as one that leans the other way, and boxes flip in a flow."""
    first = packings[0]
    start = float(first.provenance.get("flow_strain", first.box[1, 0] / first.box[1, 1]))
    return np.cumsum([start, *(shear_between(before, after) for before, after in pairwise(packings))])


def along(packings: Sequence[Packing]) -> Quantity:
    """What changes from state to state: rho, the strain at fixed phi, or nothing but the number of the state."""
    phi = np.array([packing.phi for packing in packings])
    if np.ptp(phi) > SHEARED * phi.max():
        return Quantity("rho", "ρ", "true packing fraction ρ")
    if np.ptp(strains(packings)) > SHEARED:
        return Quantity("strain", "γ", "shear strain γ")
    return Quantity("number", "state", "state")


def curves(packing: Packing) -> list[Quantity]:
    """The curves beside the picture."""
    stress = unit_labels(packing)["stress"]
    return [
        Quantity("z", "z", "contacts per particle z, without rattlers"),
        Quantity("g", "G", f"G: {LABELS['g']}", stress),
        Quantity("pressure", "p", "pressure p", stress),
    ]
