"""True packing fraction: the area that particles cover over the cell area, exact or approximate."""

from __future__ import annotations

import numpy as np

from jamlab.arguments.choices import FractionMethod
from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.droplet_cover import shared_areas
from jamlab.geometry.power_cells import disk_cells, radical_height
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.packing.packing import Packing

FRACTION_DEFINITION = 1  # version, see jamlab.campaign.tasks


@checked
def packing_fraction(packing: Packing, method: FractionMethod = "exact") -> float:
    """Compute the covered area divided by the area of the box (between flat walls: by the area of the slab).

    Args:
        packing: SP or DP.
        method: one of

            * "exact": rho, area of the union of the particles. SP: disks cut by their power cells, in closed form.
            * "pairs" (SP): rho of Boromand et al. eq 9, phi - (1/A) sum over pairs of the lens that two disks share.
              Exact if no three disks overlap in a point; otherwise too low, and even negative at strong
              compression.
            * "nominal": phi, undeformed particles with every overlap counted twice.

    Raises:
        InputError: unknown method, or one that the model does not have.
        BoundaryError: DP: too many boundaries meet in one point, within rounding.

    Example:
        >>> p = jamlab.Packing("sp", [[2.0, 0.0], [0.0, 2.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
        >>> round(jamlab.packing_fraction(p), 4), round(p.phi, 4)  # phi counts what two disks share twice
        (0.3854, 0.3927)
    """
    methods = packing.kind.fraction_methods
    if method not in methods:
        raise InputError(
            f"unknown packing fraction {method!r} for model {packing.model}: use one of {', '.join(methods)}"
        )
    return methods[method](packing.frame.images)


def cover_by_droplets(packing: Packing) -> float:
    """rho of a DP packing: areas with rims, overlaps shared, over the cell."""
    return float(shared_areas(packing).sum() / packing.area)


def cover_by_disks(packing: Packing) -> float:
    """rho of an SP packing: disks cut by their power cells, over the cell."""
    return float(disk_cells(packing).area.sum() / packing.area)


def fraction_by_pairs(packing: Packing) -> float:
    """Boromand et al. eq 9."""
    near, radius = touching_disks(packing), 0.5 * packing.disk_diameters
    lenses = lens_area(np.hypot(*near.r.T), radius[near.i], radius[near.j])
    return packing.phi - float(lenses.sum() / packing.area)


def lens_area(distance: Array, radius_i: Array, radius_j: Array) -> Array:
    """(m,) area shared by two circles at distance r.

    Each circle adds the segment beyond the common chord, R^2 alpha - h c, with h the distance of the chord from its
    centre, c its half length and cos(alpha) = h/R:

        R_i^2 arccos(h_i/R_i) + R_j^2 arccos(h_j/R_j) - (1/2) sqrt((s-r)(r+d)(r-d)(r+s)),

    s = R_i + R_j, d = R_i - R_j. Zero if the circles are apart, the smaller disk if one lies inside the other.

    Args:
        distance: (m,) r >= 0.
        radius_i: (m,).
        radius_j: (m,).
    """
    smaller = np.minimum(radius_i, radius_j)
    inside = distance + smaller <= np.maximum(radius_i, radius_j)
    apart = distance >= radius_i + radius_j
    r = np.where(inside | apart, radius_i + radius_j, distance)
    h_i, h_j = radical_height(r, radius_i, radius_j), radical_height(r, radius_j, radius_i)
    chord = np.sqrt(np.maximum((radius_i - h_i) * (radius_i + h_i), 0.0))
    lens = radius_i**2 * np.arctan2(chord, h_i) + radius_j**2 * np.arctan2(chord, h_j) - r * chord
    return np.where(inside, np.pi * smaller**2, np.where(apart, 0.0, lens))
