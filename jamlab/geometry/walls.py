"""Rough walls: layers of fixed particles below and above a slab, the stress on each, and what lies between them."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.particle_shape import particle_areas
from jamlab.geometry.tessellation import tessellation
from jamlab.geometry.voids.voids import voids
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result


@checked
def with_walls(packing: Packing, thickness: float = 2.0) -> Packing:
    """Fix the particles at the bottom and the top of a packing: two rough walls with a slab between them.

    The box stays periodic, so both walls touch each other across its edge. A packing at a minimum remains at a minimum.
    Simple shear of the box shifts the upper wall as a whole.

    Args:
        packing: SP or DP.
        thickness: of each wall, mean sizes: particles whose centre lies that near the bottom or the top are fixed; from
            the largest particle, since nothing may touch both sides of it, to a third of the height.

    Returns:
        The packing with `fixed` and `walls` set, in the ensemble "fixed-box".

    Raises:
        InputError: a thickness out of range, or one that leaves a wall or the slab without particles.

    Example:
        >>> w = jamlab.with_walls(jamlab.pack(n=64, pressure=1e-2, seed=1))
        >>> w.walls, bool(0 < w.fixed.sum() < w.n), w.converged
        (True, True, True)
    """
    size, height = mean_size(packing), float(packing.box[1, 1])
    check_number("thickness", thickness, height / size / 3, packing.kind.sizes(packing).max() / size)
    y = packing.centroids[:, 1] % height
    low, high = y < thickness * size, y >= height - thickness * size
    if not (low.any() and high.any() and (~low & ~high).any()):
        raise InputError(f"thickness = {thickness:g}: no particle in a wall or between the walls; use another value")
    minimum = {name: getattr(packing, name) for name in ("max_force", "converged", "tolerance", "on_rattlers")}
    return packing.with_state(fixed=low | high, walls=True, ensemble="fixed-box", **minimum)


def walled(packing: Packing, walls: bool | None) -> Packing:
    """The packing with its walls, or without (`walls` False); None: as it is."""
    if walls and not packing.walls:
        raise InputError("walls=True: the packing has no walls; use jamlab.with_walls(packing)")
    return packing.with_state(fixed=None, walls=False) if walls is False and packing.walls else packing


def wall_stress(packing: Packing) -> Array:
    """(2, 2) stress of the slab on the lower and on the upper wall, by contact forces: shear stress, conjugate to the
    strain, and pressure. At force balance both walls feel the same."""
    network, fixed, height = contacts(packing), packing.fixed_particles, packing.box[1, 1]
    mixed = fixed[network.pairs].sum(axis=1) == 1
    i, j = network.pairs[mixed].T
    sign = np.where(fixed[j], 1.0, -1.0)
    push = network.forces.on_j[mixed] * sign[:, None]
    image = packing.centroids[np.where(fixed[j], i, j), 1] % height + network.r[mixed, 1] * sign  # of what is fixed
    upper = image > 0.5 * height
    low, high = push[~upper].sum(axis=0), push[upper].sum(axis=0)
    return np.asarray(np.array([[low[0], -low[1]], [-high[0], high[1]]]) / packing.box[0, 0])


@dataclass(frozen=True)
class Slab(Result):
    """What lies between two walls.

    Attributes:
        bottom, top: highest centre in the lower wall and lowest in the upper one.
        packing_fraction: area of the free particles, overlaps shared, over the area of their cells.
        voids: (m,) bool, which of `jamlab.voids(packing)` have their centre between `bottom` and `top`.
    """

    bottom: float
    top: float
    packing_fraction: float
    voids: Array


@checked
def slab(packing: Packing) -> Slab:
    """Measure the slab between two walls: its extent, packing fraction and voids.

    Args:
        packing: of `with_walls`.

    Example:
        >>> s = jamlab.slab(jamlab.with_walls(jamlab.pack(n=64, pressure=1e-2, seed=1)))
        >>> s.bottom < s.top, round(s.packing_fraction, 3)
        (True, 0.855)
    """
    walled(packing, walls=True)
    fixed, height = packing.fixed_particles, packing.box[1, 1]
    y = packing.centroids[fixed, 1] % height
    bottom, top = float(y[y < 0.5 * height].max()), float(y[y > 0.5 * height].min())
    covered, cells = particle_areas(packing)[~fixed].sum(), tessellation(packing).area[~fixed].sum()
    centre = voids(packing).centroid[:, 1] % height
    return Slab(bottom, top, float(covered / cells), (centre > bottom) & (centre < top))
