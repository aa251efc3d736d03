"""The force network: the part of a packing that carries load, which every linear response is of."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Mask
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts, find_rattlers
from jamlab.mechanics.stiffness import energy_terms, forces
from jamlab.packing.derived import keep, per_packing
from jamlab.packing.packing import Packing

LARGEST_IMBALANCE = 0.01  # of `force_scale`: minima of disks leave 1e-12 (pressure 1e-2 k) to 2e-5 (onset)


def force_scale(packing: Packing) -> float:
    """Mean magnitude of the forces between pairs in contact; 0 without contacts. Pressure would do for pure repulsion
    alone."""
    size = _pair_forces(packing)
    return float(size.mean()) if len(size) else 0.0


@per_packing
def _pair_forces(packing: Packing) -> Array:
    """(m,) magnitude of the force of every contact."""
    size: Array = packing.kind.contact_forces(packing).size
    return size


@dataclass(frozen=True)
class ForceNetwork:
    """Particles that bear force."""

    whole: Packing  # with its rattlers: area, mean size and typical stiffness are those of this packing
    held: Mask  # (n_sites,) bool, positions of the whole packing that remain

    @property
    def packing(self) -> Packing:
        """Without its rattlers; droplets that two contacts squeeze are among those of z, and remain here. It has the
        contacts and energy terms of the whole, renumbered."""
        bearing = _bearing(self.whole)
        return self.whole if bearing is None else bearing

    def check_at_rest(self) -> None:
        """Refuse forces that do not balance: linear response is defined at a minimum."""
        self.check_known()
        self.check_balance(forces(self.packing))

    def check_known(self) -> None:
        """Refuse positions that are rounded."""
        if self.whole.rounding:
            raise ConvergenceError(
                f"positions are known only to {self.whole.rounding:.2g}, so the packing is not at an energy "
                "minimum: relax it first, jamlab.relax(packing)"
            )

    def check_balance(self, forces: Array) -> None:
        """Refuse forces on its sites, (m, 2), that do not balance."""
        check_balance(self.whole, forces, self._force_scale, "relax it first")

    @property
    def _force_scale(self) -> float:
        """`force_scale` of the bearing packing."""
        pairs, bears = contacts(self.whole).pairs, ~without_load(self.whole)
        size = _pair_forces(self.whole)[bears[pairs].all(axis=1)]
        return float(size.mean()) if len(size) else 0.0


def check_at_rest(packing: Packing, remedy: str) -> None:
    """Refuse a packing whose forces do not balance; `remedy`: what to do."""
    check_balance(packing, forces(packing), force_scale(packing), remedy)


def check_balance(packing: Packing, forces: Array, scale: float, remedy: str) -> None:
    """Refuse forces (m, 2) that do not balance, beside the mean force of a contact."""
    largest = float(np.hypot(*forces.T).max())
    if largest > max(LARGEST_IMBALANCE * scale, packing.law.slack):
        raise ConvergenceError(
            f"the packing is not at an energy minimum: the largest residual force is {largest:.2g}, the "
            f"mean contact force {scale:.2g}; {remedy}"
        )


def force_network(packing: Packing) -> ForceNetwork:
    """Find the rattlers of a packing, and what remains without them."""
    return ForceNetwork(packing, _held(packing))


@per_packing
def _held(packing: Packing) -> Mask:
    """`held` of the force network."""
    if contacts(packing).unjammed:
        raise ConvergenceError("every particle is a rattler: the packing is unjammed and has no elastic modulus")
    return np.asarray(~without_load(packing)[packing.particle])


@per_packing
def _bearing(packing: Packing) -> Packing | None:
    """`packing` of the force network; None for the packing itself."""
    held, loose = _held(packing), without_load(packing)
    if not loose.any():
        return None
    bearing = packing.select(~loose)
    keep(packing.kind.points, bearing, packing.kind.points(packing).among(held))
    keep(energy_terms, bearing, [term.among(held) for term in energy_terms(packing)])
    return bearing


@per_packing
def without_load(packing: Packing) -> Mask:
    """(n,) rattlers, except droplets that carry a load between two contacts. Two forces hold a disk on one line
    only, and it gives way to the side; the flats of a droplet hold it. Without it its neighbors would be out of
    balance. A load below the imbalance that is allowed is left out as before."""
    network, least = contacts(packing), packing.law.least_bearing
    rattlers = network.rattlers
    if packing.law.range:  # clusters beside the largest, which hang on nothing and no wall, follow no strain
        from scipy import sparse
        from scipy.sparse import csgraph

        pairs = network.pairs[network.bearing]
        joined = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(packing.n, packing.n))
        cluster = csgraph.connected_components(joined, directed=False)[1]
        held = [np.bincount(cluster[~rattlers]).argmax(), *cluster[packing.frame.fixed]]
        return np.asarray(rattlers | ~np.isin(cluster, held))
    squeezed = rattlers & ~find_rattlers(network.pairs, rattlers, least, packing.kind.places(packing))[0]
    if not squeezed.any():
        return rattlers
    load = packing.kind.loads(packing)
    return rattlers & ~(squeezed & (load > LARGEST_IMBALANCE * force_scale(packing)))
