"""Particles between two flat walls and their mirror images: what tessellations and unions of particles know of walls.

A packing and its image behind a wall, one after the other, fill a box of twice the height of the slab without walls.
The points of the slab are nearer to its particles than to their images, so that cells, particles cut by them and the
boundary of what they cover end at the planes of the walls.
"""

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing


def mirrored(packing: Packing) -> Packing:
    """The particles between flat walls, then their images; a packing without flat walls is itself."""
    return _mirrored(packing) if packing.flat_walls.any() else packing


@per_packing
def _mirrored(packing: Packing) -> Packing:
    low, high = packing.planes
    free, lattice = packing.select(~packing.flat_walls), packing.box[1]
    site, n = free.particle, np.arange(len(free.positions))
    x = free.positions - np.outer(np.floor(free.centroids[:, 1] / lattice[1]), lattice)[site]
    first = np.searchsorted(site, np.arange(free.n))
    reversed_ = (first + np.append(first[1:], len(n)) - 1)[site] - n  # polygons stay counter-clockwise
    own = {name: np.tile(free.params[name], 2) for name, each in free.parameters.items() if each.each}
    return Packing(
        model=free.model,
        box=np.diag([packing.box[0, 0], 2 * (high - low)]),
        positions=np.concatenate([x, x[reversed_] * [1, -1] + [0, 2 * low]]) - [0, low],
        params={**free.params, **own},
        units=free.units,
        diameters=None if free.diameters is None else np.tile(free.diameters, 2),
        offsets=None if free.offsets is None else np.append(free.offsets, free.offsets[1:] + len(n)),
    )


def in_slab(packing: Packing, values: Array, of_walls: float = 0.0) -> Array:
    """(n,) values of the particles of a packing, and that of flat walls, from those of `mirrored`."""
    return np.append(values[: packing.n - 2], [of_walls] * 2) if packing.flat_walls.any() else values
