"""Render a packing, measure the picture, and compare with the truth: errors of count, rho, z and shape.

The truth of a picture whose edges cut droplets is that of the droplets that it shows whole, and of the whole cell for
rho, since one period shows every droplet once. Shapes are those of the outlines that are drawn, polygons grown by
their rims: bare polygons are less round, by 0.006 at rho = 0.84 and 0.014 at 0.95. Where rims overlap, a picture shows
half of the overlap on either side, which the truth does not cut away: that adds 0.004 at rho = 0.95, and less below.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from jamlab.arrays import Array, Mask
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.rims import rims
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.micrograph import micrograph
from jamlab.micrographs.picture_numbers import LIMITS
from jamlab.micrographs.synthetic import synthetic_micrograph
from jamlab.packing.packing import Packing


@dataclass(frozen=True)
class Truth:
    """What one period of a packing shows whole: number of droplets, rho, z (nan if all rattle), mean A with rims."""

    count: int
    rho: float
    z: float
    shape: float


def truth(packing: Packing) -> Truth:
    """Truth of a picture of one period of a packing of droplets in a rectangular box."""
    size = np.diag(packing.box)
    home = packing.centroids - np.floor(packing.centroids / size) * size
    bounds = shapely.bounds(rims(packing).outlines) + np.tile(home, 2)
    whole: Mask = (bounds[:, :2] > 0).all(axis=1) & (bounds[:, 2:] < size).all(axis=1)
    network = contacts(packing)
    bearing = network.pairs[~network.rattlers[network.pairs].any(axis=1)]
    number = np.bincount(bearing.ravel(), minlength=packing.n)
    held = whole & ~network.rattlers
    z = float(number[held].mean()) if held.any() else float("nan")
    return Truth(int(whole.sum()), packing_fraction(packing), z, float(shape_factors(packing, rim=True)[whole].mean()))


def picture_errors(packing: Packing, pixels: int, known: Truth | None = None, **how: Any) -> dict[str, Any]:
    """Errors (measured minus true) of one rendered picture.

    Args:
        packing: DP in a rectangular box.
        pixels: width of the picture.
        known: `truth` of the packing, if it is known by now.
        how: further arguments of `synthetic_micrograph`.

    Returns:
        count, rho, z, shape; quality: "good", "doubtful" or "refused"; reasons; right: all errors within `LIMITS`.
    """
    return measured_errors(synthetic_micrograph(packing, pixels, **how), known or truth(packing))


def measured_errors(picture: Array, known: Truth) -> dict[str, Any]:
    """The same of a picture at hand, with its truth."""
    try:
        found = micrograph(picture)
    except InputError as error:
        nan = float("nan")
        return dict.fromkeys(LIMITS, nan) | {"quality": "refused", "reasons": str(error), "right": False}
    errors = {
        "count": float(found.count - known.count),
        "rho": found.rho - known.rho,
        "z": found.z - known.z,
        "shape": float(found.shape_factor.mean()) - known.shape,
    }
    right = all(abs(errors[name]) <= limit for name, limit in LIMITS.items())
    return errors | {"quality": found.quality, "reasons": "; ".join(found.reasons), "right": right}


def droplets_seen(packing: Packing, found: Micrograph) -> tuple[Array, Array]:
    """(count,) droplet of the packing that each one seen is, and (count,) distance of their centres."""
    apart = found.centres[:, None] - packing.centroids
    apart = apart - np.rint(apart @ np.linalg.inv(packing.box)) @ packing.box
    distance = np.hypot(apart[..., 0], apart[..., 1])
    return distance.argmin(axis=1), distance.min(axis=1)
