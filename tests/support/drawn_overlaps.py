"""Areas of droplets from overlaps of drawn outlines, by GEOS: an overlap errs by about 1e-5 of the squared rim."""

import numpy as np
import shapely

from jamlab.geometry.rims import rims
from jamlab.packing.neighbors import periodic_pairs


def drawn_shares(packing):
    """(n,) area of each grown outline, every overlap shared equally between the particles that meet there.

    A point that m outlines cover counts 1/m for each of them. By inclusion and exclusion, with the sums over the
    overlaps O_a = (outline of the particle) intersected with that of its neighbour a,

        area - (1/2) sum_a |O_a| + (1/3) sum_{a<b} |O_a O_b| - (1/4) sum_{a<b<c} |O_a O_b O_c| + ...

    The series ends by itself where no more outlines meet; the sum over particles is the area of their union.
    """
    grown, n = rims(packing), packing.n
    reach = np.hypot(*np.abs(shapely.bounds(grown.outlines)).reshape(-1, 2, 2).max(axis=1).T)
    near = periodic_pairs(packing.centroids, packing.box, reach)
    common = shapely.intersection(grown.outlines[near.i], moved(grown.outlines[near.j], near.r))
    real = shapely.area(common) > 0
    near, common = near.select(real), common[real]
    # every overlap from both sides, relative to the centroid of the owner; owners ascend
    owner = np.concatenate([near.i, near.j])
    order = np.argsort(owner, kind="stable")
    owner, overlaps = owner[order], np.concatenate([common, moved(common, -near.r)])[order]
    stop = np.searchsorted(owner, np.arange(n), side="right")
    shares, covers, regions, last = grown.area.copy(), 2, overlaps, np.arange(len(owner))
    while len(regions):
        sign = 1 if covers % 2 else -1
        shares += sign / covers * np.bincount(owner, shapely.area(regions), minlength=n)
        more = stop[owner] - last - 1
        region = np.repeat(np.arange(len(regions)), more)
        added = last[region] + 1 + np.arange(len(region)) - np.searchsorted(region, region)
        common = shapely.intersection(regions[region], overlaps[added])
        real = shapely.area(common) > 0
        owner, regions, last, covers = owner[region[real]], common[real], added[real], covers + 1
    return shares


def moved(shapes, r):
    """The same shapes, each moved by its row of r, (m, 2)."""
    points, index = shapely.get_coordinates(shapes, return_index=True)
    return np.asarray(shapely.set_coordinates(shapes.copy(), points + r[index]))
