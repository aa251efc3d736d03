"""The force network: the part of a packing that carries load, found once and handed to every linear response."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import Contacts, Meetings, contacts, find_rattlers
from jamlab.geometry.vertex_contacts import VertexContacts
from jamlab.mechanics.energy_terms import Terms, energy_terms
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.force_laws import rim_law
from jamlab.packing.natural_units import mean_size
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing

LARGEST_IMBALANCE = (
    0.01  # of pressure times particle size: minima of disks leave 1e-12 (pressure 1e-2 k) to 2e-5 (onset)
)


@dataclass(frozen=True)
class ForceNetwork:
    """Particles that bear force, what presses on what among them, and their energy."""

    whole: Packing  # with its rattlers: area, mean size and typical stiffness are those of this packing
    packing: Packing  # without its rattlers; droplets that two contacts squeeze are among those of z, and remain here
    held: NDArray[np.bool_]  # (n_sites,) bool, positions of the whole packing that remain
    meetings: Meetings  # disks that touch, or vertices and edges, numbered as in `packing`
    terms: list[Terms]  # energy terms, numbered as in `packing`

    def check_at_rest(self) -> None:
        """Refuse forces that do not balance: a response to strain is that of a minimum."""
        if self.packing.rounding:
            raise ConvergenceError(
                f"positions are known to {self.packing.rounding:.2g} only, so it is at no energy minimum: relax "
                "the packing first, jamlab.relaxed(packing)"
            )
        imbalance = np.hypot(*forces(self.packing, self.terms).T).max()
        pressure = 0.5 * np.trace(stress(self.packing, self.terms))
        size = mean_size(self.whole)
        if imbalance > LARGEST_IMBALANCE * pressure * size:
            raise ConvergenceError(
                f"the packing is not at an energy minimum: a force of {imbalance:.2g} is left at pressure "
                f"{pressure:.2g} on particles of size {size:.2g}; relax it first"
            )


def force_network(packing: Packing, *, prestress: bool = True, network: Contacts | None = None) -> ForceNetwork:
    """Take the rattlers out of a packing and build the energy terms of the others. `prestress`: see
    `jamlab.mechanics.energy_terms.energy_terms`; `network`: all contacts of the packing, if they are known already."""
    network = network or contacts(packing)
    if network.loose:
        raise ConvergenceError("every particle rattles: the packing is not jammed and has no elastic modulus")
    loose = _without_load(packing, network)
    held = ~loose[packing.particle]
    bearing, meetings = packing.select(~loose), _renumber(network.meetings, held)
    return ForceNetwork(packing, bearing, held, meetings, energy_terms(bearing, meetings, prestress=prestress))


def _without_load(packing: Packing, network: Contacts) -> NDArray[np.bool_]:
    """(n,) rattlers, but for the droplets that bear a load between two contacts. Two forces hold a disk on one line
    only, and it gives way to the side; the flats of a droplet hold it. Without it its neighbors would be out of
    balance. A load below the imbalance that is allowed is left out as before."""
    if not isinstance(network.meetings, VertexContacts):
        return network.rattlers
    rattlers = network.rattlers
    squeezed = rattlers & ~find_rattlers(network.pairs, rattlers, least=2)[0]
    if not squeezed.any():
        return rattlers
    load = np.zeros(packing.n)
    push = np.abs(rim_law(packing, network.meetings.distance)[1])
    for site in (network.meetings.vertex, network.meetings.tail):
        np.maximum.at(load, packing.particle[site], push)
    pressure = 0.5 * float(np.trace(stress(packing, energy_terms(packing, network.meetings))))
    return rattlers & ~(squeezed & (load > LARGEST_IMBALANCE * pressure * mean_size(packing)))


def _renumber(meetings: Meetings, held: NDArray[np.bool_]) -> Meetings:
    """Meetings among the sites that are held, numbered as if there were no others."""
    number = np.cumsum(held) - 1
    if isinstance(meetings, Pairs):
        kept = meetings.select(held[meetings.i] & held[meetings.j])
        return Pairs(number[kept.i], number[kept.j], kept.r, kept.shift)
    found = meetings.select(held[meetings.vertex] & held[meetings.tail])
    return VertexContacts(number[found.vertex], number[found.tail], found.place, found.separation, found.shift)
