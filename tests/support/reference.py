"""Energy, forces and stress of a packing by `studies.stability.plain_physics`, which looks at all pairs."""

from functools import cached_property

from studies.stability.plain_physics import droplet_contacts, plain_forces, plain_stress


class Reference:
    """Sums over all terms of a packing; `contact_energy` is the part between different particles."""

    def __init__(self, packing):
        self._packing = packing
        self.energy, self.forces = plain_forces(packing)

    @cached_property
    def contact_energy(self):
        p = self._packing
        return self.energy if p.model == "sp" else droplet_contacts(p, p.positions, p.box)[0]

    @cached_property
    def stress(self):
        return plain_stress(self._packing)


def evaluate(packing):
    """Reference values of any packing."""
    return Reference(packing)
