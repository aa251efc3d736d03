"""Energy, forces and stress of a packing by `jamlab.studies.failure.plain_physics`, which looks at all pairs."""

from dataclasses import dataclass

import numpy as np

from jamlab.studies.failure.plain_physics import droplet_contacts, plain_forces, plain_stress


@dataclass
class Reference:
    """Sums over all terms; `contact_energy` is the part between different particles."""

    energy: float
    contact_energy: float
    forces: np.ndarray
    stress: np.ndarray


def evaluate(packing):
    """Reference values of any packing."""
    energy, forces = plain_forces(packing)
    contact = energy if packing.model == "sp" else droplet_contacts(packing, packing.positions, packing.box)[0]
    return Reference(energy, contact, forces, plain_stress(packing))
