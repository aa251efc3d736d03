"""One free droplet: the undeformed particle of the DP model.

Boromand et al. eq 7 without neighbours: E(a) = gamma p(a) + (ka/2)(a - a0)^2, and among polygons of nv vertices the
regular one has the least perimeter, p = sqrt(4 c a) with c = nv tan(pi/nv).
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.errors import InputError


def free_polygon_area(nv: ArrayLike, params: dict[str, Any]) -> Array:
    """(n,) area without rim at which line tension and area elasticity balance: ka (a - a0) + gamma dp/da = 0. `nv`:
    (n,) vertices of each droplet; `params`: `gamma`, `ka`, and `a0` of shape (n,)."""
    nv = np.asarray(nv)
    c = nv * np.tan(np.pi / nv)
    gamma, ka, a0 = params["gamma"], params["ka"], np.asarray(params["a0"], dtype=np.float64)
    # the force on the area is least at a = (gamma sqrt(c)/(2 ka))^(2/3); it must be inwards there
    largest = np.min(2 * (a0 / 3) ** 1.5 / np.sqrt(c))
    if gamma > ka * largest:
        raise InputError(
            f"gamma = {gamma:g} at ka = {ka:g}: line tension shrinks a free droplet to a point; "
            f"lower gamma or raise ka, gamma/ka must not be above {largest:.4g}"
        )
    # the largest root of the cubic s^3 - a0 s + gamma sqrt(c)/ka = 0 of s = sqrt(a), by Vieta's cosine
    angle = np.arccos(np.maximum(-1.0, -1.5 * gamma * np.sqrt(3 * c / a0) / (ka * a0))) / 3  # -1 at the largest gamma
    return np.asarray(4 / 3 * a0 * np.cos(angle) ** 2)


def free_area(nv: ArrayLike, params: dict[str, Any]) -> Array:
    """(n,) area of the free droplet with its rim of width delta/2: a + p delta/2 + pi delta^2/4."""
    nv = np.asarray(nv)
    a = free_polygon_area(nv, params)
    half = 0.5 * float(params["delta"])
    grown: Array = a + np.sqrt(4 * nv * np.tan(np.pi / nv) * a) * half + np.pi * half**2
    return grown


def regular_polygon(nv: int, area: float, angle: float = 0.0) -> Array:
    """(nv, 2) vertices of a regular polygon around the origin, counter-clockwise, first vertex at `angle`."""
    radius = np.sqrt(2 * area / (nv * np.sin(2 * np.pi / nv)))
    turn = angle + 2 * np.pi * np.arange(nv) / nv
    return np.asarray(radius * np.column_stack([np.cos(turn), np.sin(turn)]))
