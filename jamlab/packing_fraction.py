"""Packing fraction: the part of the cell that particles cover, overlaps counted once, approximately or not at all."""

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import InputError
from jamlab.neighbors import periodic_pairs
from jamlab.packing import Packing
from jamlab.power_cells import nested, radical_height
from jamlab.shape import particle_areas

Array = NDArray[np.float64]

METHODS = {"sp": ("exact", "pairs", "triples", "nominal"), "dp": ("exact", "nominal")}


def packing_fraction(packing: Packing, method: str = "exact") -> float:
    """Area that the particles cover over the area of the cell.

    Args:
        packing: SP or DP.
        method:
            "exact": rho, area of the union of the particles. SP: disks cut by their power cells, closed form. DP:
                polygons grown by their rims, to about 1e-7 (see `rims`).
            "pairs" (SP): rho of Boromand et al. eq 9, phi - (1/A) sum over pairs of the lens that two disks share. Too
                low where three disks overlap; falls without bound, even below zero, in deep compression.
            "triples" (SP): eq 12, adds what three disks share. Not available yet.
            "nominal": phi, undeformed particles with every overlap counted twice.

    Raises:
        InputError: unknown method, or one that the model does not have.
    """
    if method not in METHODS[packing.model]:
        choices = ", ".join(METHODS[packing.model])
        raise InputError(f"unknown packing fraction {method!r} for model {packing.model}: use one of {choices}")
    if method == "nominal":
        return packing.phi
    if method == "exact":
        return float(particle_areas(packing).sum() / packing.area)
    if method == "pairs":
        return packing.phi - _shared_by_pairs(packing) / packing.area
    raise InputError("method 'triples' is not available yet: use 'exact', which counts overlaps of any order")


def lens_area(distance: Array, radius_i: Array, radius_j: Array) -> Array:
    """(m,) area shared by two circles at distance r.

    Each circle adds the segment beyond the common chord, R^2 alpha - h c, with h the distance of the chord from its
    centre, c its half length and cos(alpha) = h/R:

        R_i^2 arccos(h_i/R_i) + R_j^2 arccos(h_j/R_j) - (1/2) sqrt((s-r)(r+d)(r-d)(r+s)),

    s = R_i + R_j, d = R_i - R_j. Boromand et al. eq 10 prints the square root alone, without the two arccos terms and
    without the minus sign. Zero if the circles are apart, the smaller disk if one lies inside the other.

    Args:
        distance: (m,) r >= 0.
        radius_i: (m,).
        radius_j: (m,).
    """
    smaller = np.minimum(radius_i, radius_j)
    inside = nested(distance, smaller, np.maximum(radius_i, radius_j))
    apart = distance >= radius_i + radius_j
    r = np.where(inside | apart, radius_i + radius_j, distance)
    h_i, h_j = radical_height(r, radius_i, radius_j), radical_height(r, radius_j, radius_i)
    chord = np.sqrt(np.maximum((radius_i - h_i) * (radius_i + h_i), 0.0))
    lens = radius_i**2 * np.arctan2(chord, h_i) + radius_j**2 * np.arctan2(chord, h_j) - r * chord
    return np.where(inside, np.pi * smaller**2, np.where(apart, 0.0, lens))


def _shared_by_pairs(packing: Packing) -> float:
    assert packing.diameters is not None
    radius = 0.5 * packing.diameters
    near = periodic_pairs(packing.positions, packing.box, float(packing.diameters.max()))
    return float(lens_area(np.hypot(*near.r.T), radius[near.i], radius[near.j]).sum())
