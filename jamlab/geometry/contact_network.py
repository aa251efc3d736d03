"""The contact network: who touches whom, which particles rattle, and the coordination number z."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.geometry.vertex_contacts import polygon_pairs, vertex_contacts
from jamlab.packing.neighbors import periodic_pairs
from jamlab.packing.packing import Packing

# A particle held by fewer forces than this is not in stable equilibrium: two forces balance only on one line. Boromand
# et al. say "less than 2", which leaves such disks in.
LEAST_CONTACTS = 3


@dataclass(frozen=True)
class Contacts:
    """Force-bearing contacts of a packing.

    Attributes:
        pairs: (m, 2) int64, particles i < j that touch. Several circulo-line contacts of one pair of polygons are one
            contact; contacts with two periodic images of one particle, in very small boxes, are two.
        rattlers: (n,) bool, particles with fewer than three contacts, found recursively.
        bearing: (m,) bool, contacts between two particles that are not rattlers.
        count: N_c, number of bearing contacts.
        backbone: N', number of particles that are not rattlers.
        z: 2 N_c / N' (Boromand et al. print N_c/N); nan if there is no backbone.
        isostatic: N_c of a frictionless packing at onset, 2 N' - 1.
    """

    pairs: NDArray[np.int64]
    rattlers: NDArray[np.bool_]
    bearing: NDArray[np.bool_]

    @property
    def count(self) -> int:
        return int(self.bearing.sum())

    @property
    def backbone(self) -> int:
        return int((~self.rattlers).sum())

    @property
    def z(self) -> float:
        return 2 * self.count / self.backbone if self.backbone else float("nan")

    @property
    def isostatic(self) -> int:
        return 2 * self.backbone - 1


def contacts(packing: Packing) -> Contacts:
    """Contacts, rattlers and coordination of a packing.

    SP: disks touch when r < (d_i + d_j)/2. DP: polygons touch when their circulo-lines overlap, d < delta, in the
    contact form of the packing.
    """
    if packing.diameters is not None:
        near = periodic_pairs(packing.positions, packing.box, float(packing.diameters.max()))
        pairs = np.column_stack([near.i, near.j])
        pairs = pairs[np.hypot(*near.r.T) < 0.5 * packing.diameters[pairs].sum(axis=1)]
    else:
        pairs = polygon_pairs(packing, vertex_contacts(packing))
    rattlers, bearing = _prune(pairs, packing.n)
    return Contacts(pairs, rattlers, bearing)


def contacts_are_certain(packing: Packing) -> bool:
    """Whether the rounding of positions, `Packing.rounding`, can neither open nor close a contact.

    Both coordinates of both ends may be off, so a gap by 2 sqrt(2) times as much: particles that much larger and
    smaller must touch the same others.
    """
    if not packing.rounding:
        return True
    reach = 3 * packing.rounding
    if reach >= (packing.params["delta"] if packing.diameters is None else packing.diameters.min()):
        return False
    larger, smaller = (contacts(_grown(packing, growth)) for growth in (reach, -reach))
    return np.array_equal(larger.pairs, smaller.pairs)


def _grown(packing: Packing, growth: float) -> Packing:
    """Particles that touch at distances larger by `growth`."""
    if packing.diameters is not None:
        return packing.with_state(diameters=packing.diameters + growth)
    return packing.with_state(params={**packing.params, "delta": packing.params["delta"] + growth})


def _prune(pairs: NDArray[np.int64], n: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Take out particles with too few contacts until none is left."""
    rattlers = np.zeros(n, dtype=bool)
    while True:
        bearing = ~rattlers[pairs].any(axis=1)
        degree = np.bincount(pairs[bearing].ravel(), minlength=n)
        loose = (degree < LEAST_CONTACTS) & ~rattlers
        if not loose.any():
            return rattlers, np.asarray(bearing)
        rattlers |= loose
