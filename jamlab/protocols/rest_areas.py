"""Rest areas of droplets that have given areas when nothing touches them, and the unit of length that follows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError
from jamlab.models.droplets import free_area, free_polygon_area
from jamlab.outline_laws.outline_law import laws_that_act


def rest_areas_of(nv: Indices, free: Array, params: Mapping[str, Any], *, rims: bool = True) -> Array:
    """(n,) rest areas a0 of droplets whose area is `free` (n,) when nothing touches them, with their rims or without.

    With rims it is the inverse of `jamlab.models.droplets.free_area`: with p = sqrt(4 c a) the rim makes
    a + p delta/2 + pi delta^2/4 = free, a square equation for sqrt(a). Balance of line tension and area elasticity
    gives a0 = a + (gamma/ka) sqrt(c/a).
    """
    c, half = nv * np.tan(np.pi / nv), 0.5 * float(params["delta"]) * rims
    root = np.sqrt(np.maximum(c * half**2 + free - np.pi * half**2, 0.0)) - np.sqrt(c) * half
    if root.min() <= 0:
        raise InputError(f"delta = {params['delta']:g} leaves no area inside the smallest droplet: use a smaller delta")
    rest = np.asarray(root**2 + params["gamma"] / params["ka"] * np.sqrt(c) / root)
    return _with_outline_laws(nv, free, params, rest, rims) if laws_that_act(params) else rest


def _with_outline_laws(nv: Indices, free: Array, params: Mapping[str, Any], rest: Array, rims: bool) -> Array:
    """(n,) rest areas where laws of outlines act, from those without, by the area that follows from a rest area."""
    from scipy.optimize import brentq

    area = free_area if rims else free_polygon_area

    def off(a0: float, k: int) -> float:
        return float(area(nv[k : k + 1], {**params, "a0": np.array([a0])})[0] - free[k])

    kinds, first, number = np.unique(np.column_stack([nv, free]), axis=0, return_index=True, return_inverse=True)
    found = np.empty(len(kinds))
    for kind, k in enumerate(first):
        collapse = 3 * (0.5 * params["gamma"] / params["ka"] * np.sqrt(nv[k] * np.tan(np.pi / nv[k]))) ** (2 / 3)
        low, high = max(rest[k] / 4, (1 + 1e-9) * collapse), 4 * rest[k]
        if off(low, k) * off(high, k) > 0:
            raise InputError(
                f"params: with these laws of outlines no rest area near {rest[k]:.4g} gives a free droplet of area "
                f"{free[k]:.4g}; use a larger ka, or smaller strengths"
            )
        found[kind] = brentq(off, low, high, args=(k,), xtol=1e-14 * float(rest[k]), rtol=1e-14)
    return np.asarray(found[number.reshape(-1)])


def length_scale(nv: Indices, free: Array, params: Mapping[str, Any], *, rims: bool = True) -> float:
    """Factor from any unit of length to l, in which the mean of sqrt(a0) is 1; arguments as in `rest_areas_of`."""

    if not rims and not params["gamma"]:
        return 1.0 / float(np.sqrt(free).mean())
    from scipy.optimize import brentq

    def excess(s: float) -> float:
        return float(np.sqrt(rest_areas_of(nv, s**2 * free, params, rims=rims)).mean()) - 1.0

    low = high = 1.0 / float(np.sqrt(free).mean())  # of droplets without rims and tension
    if rims:  # they take more than tension does
        high *= 10
    else:  # from the smallest droplet that tension does not shrink to a point
        tension = params["gamma"] / params["ka"] * np.sqrt(nv * np.tan(np.pi / nv))
        low = float(np.sqrt(((0.5 * tension) ** (2 / 3) / free).max()))
        if laws_that_act(params):  # which leave no droplet that small
            low = max(low, 0.5 * high)
    if excess(low) >= 0:
        ratio = params["gamma"] / params["ka"]
        raise InputError(f"gamma/ka = {ratio:g} l^3 compresses droplets to less than half their size: use a larger ka")
    return float(brentq(excess, low, high))
