"""Walls, rough or flat, below and above a slab: the stress on each, and what lies between them."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.particle_shape import particle_areas
from jamlab.geometry.tessellation import tessellation
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.geometry.voids.voids import voids
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result

_MORE = 0.25  # mean diameters that a slab between flat walls is wider: six packings at 1e-2 k keep 86 % of it or more


@checked
def with_walls(packing: Packing, thickness: float = 2.0, *, flat: bool = False) -> Packing:
    """Make two walls with a slab between them: of the particles at the bottom and the top of a packing, or flat ones.

    Rough walls are made of particles that are fixed. The box stays periodic, so both walls touch each other across its
    edge. A packing at a minimum remains at a minimum. Simple shear of the box shifts the upper wall as a whole.

    Flat walls are lines along x in a taller box, with all particles between them: two more disks of diameter 0, the
    last of the packing, which others meet at their distance along y, at half a diameter. Relax such a packing: its
    pressure is another. Only tangential drag shears it; its static G is 0.

    Args:
        packing: SP or DP.
        flat: SP, repulsive: flat walls.
        thickness: of each wall, mean sizes: particles whose centre lies that near the bottom or the top are fixed; from
            the largest particle, since nothing may touch both sides of it, to a third of the height. Flat: from each
            wall to the edge of the new box.

    Returns:
        The packing with `fixed` and `walls` set, in the ensemble "fixed-box".

    Raises:
        InputError: a thickness out of range, or one that leaves a wall or the slab without particles; flat walls of
            droplets or sticky disks, or of a packing with fixed particles.

    Example:
        >>> w = jamlab.with_walls(jamlab.pack(n=64, pressure=1e-2, seed=1))
        >>> w.walls, bool(0 < w.fixed.sum() < w.n), w.converged
        (True, True, True)
    """
    size, height = mean_size(packing), float(packing.box[1, 1])
    check_number("thickness", thickness, height / size / 3, packing.kind.sizes(packing).max() / size)
    if flat:
        return _with_flat_walls(packing, thickness * size)
    y = packing.centroids[:, 1] % height
    low, high = y < thickness * size, y >= height - thickness * size
    if not (low.any() and high.any() and (~low & ~high).any()):
        raise InputError(f"thickness = {thickness:g}: no particle in a wall or between the walls; use another value")
    minimum = {name: getattr(packing, name) for name in ("max_force", "converged", "tolerance", "on_rattlers")}
    return packing.with_state(fixed=low | high, walls=True, ensemble="fixed-box", **minimum)


def _with_flat_walls(packing: Packing, thickness: float) -> Packing:
    if packing.kind.deforms or packing.fixed is not None:
        what = "model dp" if packing.kind.deforms else f"{int(packing.fixed_particles.sum())} particles are fixed"
        raise InputError(f"flat: {what}; use flat=False, or disks that are all free")
    box, x, diameters = np.array(packing.box), np.array(packing.positions), packing.disk_diameters
    between = box[1, 1] + _MORE * diameters.mean()
    x -= np.outer(np.floor(x[:, 1] / box[1, 1]), box[1])
    y = thickness + 0.5 * diameters + x[:, 1] * (between - diameters) / box[1, 1]
    lean, height = box[1, 0] / box[1, 1], between + 2 * thickness
    x = np.column_stack([x[:, 0] + lean * (y - x[:, 1]), y])
    box[1] = height * np.array([lean, 1.0])
    walls = np.outer([thickness, height - thickness], [lean, 1.0])
    return packing.with_state(
        box=box,
        positions=np.append(x, walls, axis=0),
        diameters=np.append(diameters, [0.0, 0.0]),
        fixed=np.arange(packing.n + 2) >= packing.n,
        walls=True,
        onset=None,
        ensemble="fixed-box",
    )


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
        packing_fraction: area of the free particles, overlaps shared, over the area of their cells; between flat walls
            over that of the slab, without what disks overlap with walls.
        voids: (m,) bool, which of `jamlab.voids(packing)` have their centre between `bottom` and `top`; between flat
            walls without those that join the room behind them.
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
    covered, flat = particle_areas(packing)[~fixed].sum(), packing.flat_walls
    centre = voids(packing).centroid[:, 1] % height
    inside = (centre > bottom) & (centre < top)
    if not flat.any():
        return Slab(bottom, top, float(covered / tessellation(packing).area[~fixed].sum()), inside)
    pairs = touching_disks(packing)
    pairs = pairs.select(flat[pairs.j])
    radius, h = 0.5 * packing.disk_diameters[pairs.i], np.abs(pairs.r[:, 1])
    covered -= np.sum(radius**2 * np.arccos(h / radius) - h * np.sqrt(radius**2 - h**2))
    fraction = float(covered / (packing.box[0, 0] * (top - bottom)))
    return Slab(bottom, top, fraction, inside)  # what percolates has no centre
