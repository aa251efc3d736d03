"""The force network: the part of a packing that carries load, which every linear response is of."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Mask
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import Meetings, contacts, find_meetings, find_rattlers
from jamlab.geometry.vertex_contacts import VertexContacts
from jamlab.mechanics.energy_terms import Terms, energy_terms
from jamlab.mechanics.stiffness import forces, forces_of, pressure, pressure_of, stress_of
from jamlab.packing.derived import per_packing
from jamlab.packing.force_laws import rim_law
from jamlab.packing.natural_units import mean_size
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing

# of pressure times particle size: minima of disks leave 1e-12 (pressure 1e-2 k) to 2e-5 (onset)
LARGEST_IMBALANCE = 0.01


@dataclass(frozen=True)
class ForceNetwork:
    """Particles that bear force, what presses on what among them, and their energy."""

    whole: Packing  # with its rattlers: area, mean size and typical stiffness are those of this packing
    packing: Packing  # without its rattlers; droplets that two contacts squeeze are among those of z, and remain here
    held: Mask  # (n_sites,) bool, positions of the whole packing that remain
    meetings: Meetings  # disks that touch, or vertices and edges, numbered as in `packing`
    terms: list[Terms]  # energy terms, numbered as in `packing`

    def check_at_rest(self) -> None:
        """Refuse forces that do not balance: a response to strain is that of a minimum."""
        if self.whole.rounding:
            raise ConvergenceError(
                f"positions are known to {self.whole.rounding:.2g} only, so it is at no energy minimum: relax the "
                "packing first, jamlab.relaxed(packing)"
            )
        left = forces_of(self.terms, len(self.packing.positions))
        _refuse_motion(self.whole, left, pressure_of(stress_of(self.terms, self.packing.area)), "relax it first")


def check_at_rest(packing: Packing, remedy: str) -> None:
    """Refuse a packing whose forces do not balance, those of rattlers included; `remedy`: what to do."""
    _refuse_motion(packing, forces(packing), pressure(packing), remedy)


def _refuse_motion(packing: Packing, left: Array, pressure: float, remedy: str) -> None:
    largest, size = float(np.hypot(*left.T).max()), mean_size(packing)
    if largest > LARGEST_IMBALANCE * pressure * size:
        raise ConvergenceError(
            f"the packing is not at an energy minimum: a force of {largest:.2g} is left at pressure {pressure:.2g} on "
            f"particles of size {size:.2g}; {remedy}"
        )


def force_network(packing: Packing, *, prestress: bool = True) -> ForceNetwork:
    """Take the rattlers out of a packing and build the energy terms of the others. `prestress`: see
    `jamlab.mechanics.energy_terms.energy_terms`."""
    bearing, held, meetings = _bearing(packing)
    terms = energy_terms(packing, prestress=prestress)
    if bearing is None:
        return ForceNetwork(packing, packing, held, meetings, terms)
    return ForceNetwork(packing, bearing, held, meetings, [term.among(held) for term in terms])


@per_packing
def _bearing(packing: Packing) -> tuple[Packing | None, Mask, Meetings]:
    """`packing`, `held` and `meetings` of the force network; None for the packing itself."""
    if contacts(packing).loose:
        raise ConvergenceError("every particle rattles: the packing is not jammed and has no elastic modulus")
    loose, meetings = without_load(packing), find_meetings(packing)
    held = ~loose[packing.particle]
    return (packing.select(~loose), held, _renumber(meetings, held)) if loose.any() else (None, held, meetings)


def without_load(packing: Packing) -> Mask:
    """(n,) rattlers, but for the droplets that bear a load between two contacts. Two forces hold a disk on one line
    only, and it gives way to the side; the flats of a droplet hold it. Without it its neighbors would be out of
    balance. A load below the imbalance that is allowed is left out as before."""
    network = contacts(packing)
    rattlers, meetings = network.rattlers, network.meetings
    if not isinstance(meetings, VertexContacts):
        return rattlers
    squeezed = rattlers & ~find_rattlers(network.pairs, rattlers, least=2)[0]
    if not squeezed.any():
        return rattlers
    load = np.zeros(packing.n)
    push = np.abs(rim_law(packing, meetings.distance)[1])
    for site in (meetings.vertex, meetings.tail):
        np.maximum.at(load, packing.particle[site], push)
    return rattlers & ~(squeezed & (load > LARGEST_IMBALANCE * pressure(packing) * mean_size(packing)))


def _renumber(meetings: Meetings, held: Mask) -> Meetings:
    """Meetings among the sites that are held, numbered as if there were no others."""
    number = np.cumsum(held) - 1
    if isinstance(meetings, Pairs):
        kept = meetings.select(held[meetings.i] & held[meetings.j])
        return Pairs(number[kept.i], number[kept.j], kept.r, kept.shift)
    found = meetings.select(held[meetings.vertex] & held[meetings.tail])
    return VertexContacts(number[found.vertex], number[found.tail], found.place, found.separation, found.shift)
