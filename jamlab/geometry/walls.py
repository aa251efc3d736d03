"""Walls, rough or flat, below and above a slab: the stress on each, and what lies between them."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError, typed
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import particle_areas
from jamlab.geometry.tessellation import tessellation
from jamlab.geometry.voids.voids import voids
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import changed
from jamlab.packing.result import Result

_MORE = 0.25  # mean sizes that a slab between flat walls is wider: six packings at 1e-2 k keep 86 % of it or more


@checked
def with_walls(packing: Packing, thickness: float = 2.0, *, flat: bool = False) -> Packing:
    """Make two walls with a slab between them: of the particles at the bottom and the top of a packing, or flat ones.

    Rough walls are made of particles that are fixed. The box stays periodic, so both walls touch each other across its
    edge. A packing at a minimum remains at a minimum. Simple shear along x shifts the upper wall as a whole;
    compression moves it along y, at constant width. No other strain is defined between walls.

    Flat walls are lines along x in a taller box, with all particles between them. They are stored as two extra
    particles of size 0 at the end of the packing. Disks touch a wall at a distance of half a diameter, vertices of
    droplets at `delta`. Relax the packing afterwards: the walls change its pressure. Only tangential drag shears it;
    its static G is 0.

    Args:
        packing: SP or DP.
        flat: flat walls.
        thickness: of each wall, in mean sizes. Particles whose centre is within this distance of the bottom or the top
            are fixed. Between the size of the largest particle (no particle may touch both sides of a wall) and a
            third of the box height. Flat: from each wall to the edge of the new box, at most 10.

    Returns:
        The packing with `fixed` and `walls` set, in the ensemble "fixed-box".

    Raises:
        InputError: a thickness out of range, or one that leaves a wall or the slab without particles, or fixed
            particles between rough walls; flat walls of a packing with fixed particles.

    Example:
        >>> w = jamlab.with_walls(jamlab.pack(n=64, pressure=1e-2, seed=1))
        >>> w.walls, bool(0 < w.frame.fixed.sum() < w.n), w.converged
        (True, True, True)
    """
    return changed(packing, _with_walls(packing, thickness, flat), "with_walls", thickness=thickness, flat=flat)


def _with_walls(packing: Packing, thickness: float, flat: bool) -> Packing:
    size, height, largest = mean_size(packing), float(packing.box[1, 1]), float(packing.kind.sizes(packing).max())
    if not flat and height < 3 * largest:
        raise InputError(
            f"the box is {height / largest:.3g} largest particles high: two rough walls and a slab need 3; use more "
            "particles, or flat=True"
        )
    check_number("thickness", thickness, 10.0 if flat else height / size / 3, largest / size)
    if flat:
        return _with_flat_walls(packing, thickness * size)
    y = packing.centroids[:, 1] % height
    low, high = y < thickness * size, y >= height - thickness * size
    if not (low.any() and high.any() and (~low & ~high).any()):
        raise InputError(f"thickness = {thickness:g}: no particle in a wall or between the walls; use another value")
    if freed := int((packing.frame.fixed & ~(low | high)).sum()):
        raise InputError(
            f"thickness = {thickness:g}: {freed} particles that are fixed lie between the walls; give a larger "
            "thickness, or free them before with packing.with_state(fixed=None, walls=False), and relax"
        )
    minimum = {name: getattr(packing, name) for name in ("max_force", "converged", "force_tolerance", "on_rattlers")}
    return packing.with_state(fixed=low | high, walls=True, ensemble="fixed-box", **minimum)


def _with_flat_walls(packing: Packing, thickness: float) -> Packing:
    if not packing.kind.meets_flat_walls:
        raise InputError(
            f"flat: model {packing.model} does not say how {packing.kind.particles} meet flat walls, see "
            "`Contacts.meets_flat_walls` of jamlab.packing.model; use flat=False"
        )
    if not packing.frame.all_free:
        raise InputError(f"flat: {int(packing.frame.fixed.sum())} particles are fixed; use flat=False, or free them")
    box, x = np.array(packing.box), np.array(packing.positions)
    between, rim = box[1, 1] + _MORE * mean_size(packing), 0.5 * packing.params.get("delta", 0.0)
    x -= np.outer(np.floor(packing.centroids[:, 1] / box[1, 1]), box[1])[packing.particle]
    if packing.kind.has_outlines:  # all is squeezed, so that no outlines cross
        low, high = x[:, 1].min() - rim, x[:, 1].max() + rim
        y = thickness + (x[:, 1] - low) * between / (high - low)
    else:
        diameters = packing.disk_diameters
        y = thickness + 0.5 * diameters + x[:, 1] * (between - diameters) / box[1, 1]
    lean, height = box[1, 0] / box[1, 1], between + 2 * thickness
    x = np.column_stack([x[:, 0] + lean * (y - x[:, 1]), y])
    box[1] = height * np.array([lean, 1.0])
    walls = np.outer([thickness - rim, height - thickness + rim], [lean, 1.0])  # their surfaces are half a rim before
    own = {name: np.append(packing.params[name], [0, 0]) for name, each in packing.parameters.items() if each.each}
    return packing.with_state(
        box=box,
        positions=np.append(x, walls, axis=0),
        params={**packing.params, **own},
        diameters=None if packing.diameters is None else np.append(packing.diameters, [0.0, 0.0]),
        offsets=None if packing.offsets is None else np.append(packing.offsets, packing.offsets[-1] + [1, 2]),
        fixed=np.arange(packing.n + 2) >= packing.n,
        walls=True,
        phi_J=None,
        ensemble="fixed-box",
    )


def walled(packing: Packing, walls: bool | None) -> Packing:
    """The packing with its walls, or without (`walls` False); None: as it is."""
    if walls and not packing.frame.has_walls:
        raise InputError(
            f"{typed('walls=True', '--walls')}: the packing has no walls; use jamlab.with_walls(packing) in Python"
        )
    return packing.with_state(fixed=None, walls=False) if walls is False and packing.frame.has_walls else packing


def wall_stress(packing: Packing) -> Array:
    """(2, 2) stress of the slab on the lower and on the upper wall, by contact forces: shear stress, conjugate to the
    strain, and pressure; (0, 2) without walls. At force balance both walls feel the same."""
    if not packing.frame.has_walls:
        return np.zeros((0, 2))
    network, fixed, height = contacts(packing), packing.frame.fixed, packing.box[1, 1]
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
        bottom, top: highest centre in the lower wall and lowest in the upper one; planes of flat walls.
        packing_fraction: area of the free particles, overlaps shared, over the area of their cells.
        voids: (m,) bool, which of `jamlab.voids(packing)` have their centre between `bottom` and `top`.
    """

    _apart = ("voids",)

    bottom: float
    top: float
    packing_fraction: float
    voids: Array


@checked
def slab(packing: Packing) -> Slab:
    """Measure the slab between two walls: its extent, packing fraction and voids.

    Args:
        packing: result of `with_walls`.

    Example:
        >>> s = jamlab.slab(jamlab.with_walls(jamlab.pack(n=64, pressure=1e-2, seed=1)))
        >>> s.bottom < s.top, round(s.packing_fraction, 3)
        (True, 0.855)
    """
    walled(packing, walls=True)
    found = voids(packing)
    if packing.frame.is_flat:
        return Slab(*packing.frame.planes, packing_fraction(packing), np.ones(len(found.area), dtype=bool))
    fixed, height = packing.frame.fixed, packing.box[1, 1]
    y, centre = packing.centroids[fixed, 1] % height, found.centroid[:, 1] % height
    bottom, top = float(y[y < 0.5 * height].max()), float(y[y > 0.5 * height].min())
    covered = float(particle_areas(packing)[~fixed].sum() / tessellation(packing).area[~fixed].sum())
    return Slab(bottom, top, covered, (centre > bottom) & (centre < top))  # what percolates has no centre
