"""What a session answers: energy, forces and stress of a packing, and what a minimisation took."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.area_change import compression
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import ENERGY, FORCE, STRESS
from jamlab.packing.result import Result


@dataclass(frozen=True)
class Evaluation(Result):
    """Energy, forces and stress of a packing as it is.

    Attributes:
        energy: total potential energy. DP: line tension, area and contact terms.
        contact_energy: part of it that comes from contacts between particles (SP: all of it).
        forces: (len(positions), 2) float64, -dE/dx; 0 on fixed particles.
        stress: (2, 2) float64, (1/A) sum f r, positive in compression (Boromand et al. eq 6); all energy terms. Between
            walls: stress on the upper wall; in r the next lattice plane replaces the height of a fixed particle.
        pressure: -dU/dA, trace of the stress over 2; between walls the normal stress on them, S_yy.
        max_force: largest norm of a force.

    Example:
        >>> e = jamlab.evaluate(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> bool(np.isclose(np.trace(e.stress) / 2, e.pressure)), e.energy == e.contact_energy
        (True, True)
    """

    dimensions: ClassVar[dict[str, tuple[int, int]]] = {
        **dict.fromkeys(("energy", "contact_energy"), ENERGY),
        **dict.fromkeys(("forces", "max_force"), FORCE),
        **dict.fromkeys(("stress", "pressure"), STRESS),
    }

    _rows = ("forces",)

    energy: float
    contact_energy: float
    forces: Array
    stress: Array
    pressure: float
    max_force: float


class DescentCounts(NamedTuple):
    """What a minimisation of droplets took, as `jamlab/descend` gives it: counts, then two numbers and a flag."""

    steps: float
    forces: float  # evaluations
    factors: float  # factorisations of the Hessian
    refused: float  # of them, not positive definite with the shift that was tried
    stuck: float  # searches along a step that found no lower energy
    bent: float  # steps along which the force did not fall
    largest_force: float
    shift: float  # to try first the next time
    crossed: float  # 1 if outlines crossed on the way


def evaluation_by_terms(packing: Packing) -> Evaluation:
    """The same in numpy, for forms of contact that LAMMPS does not have."""
    from jamlab.mechanics.stiffness import energy_terms, forces, stress

    energies = [(term.name, float(term.energy.sum())) for term in energy_terms(packing)]
    energy, of_contacts = sum(u for _, u in energies), sum(u for name, u in energies if name == "contact")
    found, total = forces(packing), stress(packing)
    largest = float(np.hypot(*found.T).max())
    return Evaluation(energy, of_contacts, found, total, compression(packing).pressure(total), largest)
