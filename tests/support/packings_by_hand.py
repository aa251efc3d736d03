"""Packings whose disks and outlines a test writes down, in a box of 20 x 20 unless it says otherwise."""

import numpy as np
import shapely

from jamlab.packing.packing import Packing

LARGE = np.diag([20.0, 20.0])
HEXAGONAL = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
ANGLE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])


def disks(positions, diameters, box=LARGE):
    positions = np.atleast_2d(positions)
    return Packing("sp", np.asarray(box), positions, {"eps": 1.0}, diameters=np.broadcast_to(diameters, len(positions)))


def random_disks(seed, most=25):
    """Up to 24 disks of one of five sizes, give or take, in a cell of any shape."""
    rng = np.random.default_rng(seed)
    n = rng.integers(1, most)
    box = np.array([[1.0, 0.0], [rng.uniform(-2, 2), rng.uniform(0.3, 2)]])
    return disks(rng.random((n, 2)) @ box, rng.choice([0.05, 0.1, 0.2, 0.35, 0.6]) * rng.uniform(0.5, 1.4, n), box)


def droplets(rings, delta=0.1, box=LARGE, contact="outline", rest_area=1.0):
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": delta, "eta": 0.0, "contact": contact}
    law["a0"] = np.full(len(rings), rest_area)
    return Packing("dp", np.asarray(box, float), np.concatenate(rings), law, offsets=np.cumsum([0, *map(len, rings)]))


def capsule_unions(packing, steps):
    """Polygon united with a capsule around every edge, `steps` corners a quarter: outlines with rims, drawn anew."""
    width, unions = 0.5 * packing.params["delta"], []
    for ring in np.split(packing.positions, packing.offsets[1:-1]):
        edges = shapely.linestrings(np.stack([ring, np.roll(ring, -1, axis=0)], axis=1))
        unions.append(shapely.union_all([shapely.Polygon(ring), *shapely.buffer(edges, width, quad_segs=steps)]))
    return np.array(unions)
