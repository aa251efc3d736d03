"""Power cells from the lower convex hull of points lifted to z = |x|^2 - R^2, by Qhull."""

import numpy as np
from scipy.spatial import ConvexHull

from jamlab.geometry.power_cells import radical_height
from jamlab.packing.neighbors import periodic_copies
from jamlab.packing.outlines import cross


def hull_areas(points, radius, box, reach):
    """(n,) areas of the cells of points, from their copies up to `reach` beyond the box. Source: Aurenhammer 1987."""
    source, shift = periodic_copies(points, box, reach)
    x, r = points[source] + shift @ box, radius[source]
    middle = x.mean(axis=0)
    lifted = np.einsum("ij,ij->i", x - middle, x - middle) - r**2
    hull = ConvexHull(np.column_stack([x - middle, lifted / np.sqrt(np.abs(box).max())]))
    below = hull.simplices[hull.equations[:, 2] < -1e-12]  # upright faces are rounding of the rim of the hull
    ccw = cross(x[below[:, 1]] - x[below[:, 0]], x[below[:, 2]] - x[below[:, 0]]) > 0
    below = np.where(ccw[:, None], below, below[:, ::-1])

    a, b, c = np.concatenate([below, np.roll(below, -1, axis=1), np.roll(below, -2, axis=1)]).T
    home = a < len(points)
    a, b, c = a[home], b[home], c[home]
    ab, ac = x[b] - x[a], x[c] - x[a]
    d_ab, d_ac, det = np.hypot(*ab.T), np.hypot(*ac.T), cross(ab, ac)
    solid = det > 1e-14 * d_ab * d_ac  # three points on one line have no circle
    a, b, c, ab, ac, d_ab, d_ac, det = (v[solid] for v in (a, b, c, ab, ac, d_ab, d_ac, det))
    h_ab, h_ac = radical_height(d_ab, r[a], r[b]), radical_height(d_ac, r[a], r[c])
    p, q = (d_ab * h_ab)[:, None], (d_ac * h_ac)[:, None]
    corner = (p * np.column_stack([ac[:, 1], -ac[:, 0]]) + q * np.column_stack([-ab[:, 1], ab[:, 0]])) / det[:, None]
    walls = [h_ab * cross(ab, corner) / d_ab, -h_ac * cross(ac, corner) / d_ac]
    return np.bincount(a, 0.5 * (walls[0] + walls[1]), len(points))
