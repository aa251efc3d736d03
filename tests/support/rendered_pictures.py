"""Render a packing, measure the picture, and compare with the truth: errors of count, rho, z and shape.

The truth of a picture whose edges cut droplets is that of the droplets that it shows whole, and of the whole cell for
rho, since one period shows every droplet once. Shapes are those of the outlines that are drawn, polygons grown by
their rims: bare polygons are less round, by 0.006 at rho = 0.84 and 0.014 at 0.95. Where rims overlap, a picture shows
half of the overlap on either side, which the truth does not cut away: that adds 0.004 at rho = 0.95, and less below.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import shapely

from jamlab.arrays import Mask
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.rims import rims
from jamlab.micrographs.micrograph import micrograph
from jamlab.micrographs.quality import LIMITS
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
    known = known or truth(packing)
    try:
        found = micrograph(synthetic_micrograph(packing, pixels, **how))
    except InputError as error:
        nan = float("nan")
        return dict.fromkeys(LIMITS, nan) | {"quality": "refused", "reasons": str(error), "right": False}
    errors = {
        "count": float(found.count - known.count),
        "rho": found.rho - known.rho,
        "z": found.z - known.z,
        "shape": float(found.shape.mean()) - known.shape,
    }
    right = all(abs(errors[name]) <= limit for name, limit in LIMITS.items())
    return errors | {"quality": found.quality, "reasons": "; ".join(found.reasons), "right": right}


PIXELS = 450  # width of a picture of 64 droplets: radius 30 pixels
PLAIN: dict[str, Any] = {"light": 1.0, "noise": 0.02, "blur": 0.7, "film": 2.0}  # what does not vary
SWEEPS: dict[str, tuple[float, ...]] = {
    "light": (1.0, 0.6, 0.35, 0.2),
    "noise": (0.0, 0.1, 0.2, 0.4),
    "blur": (0.0, 1.5, 3.0, 5.0),
    "film": (0.0, 1.0, 2.0, 4.0),
    "radius": (6.0, 12.0, 20.0, 45.0),
}


def error_table(packings: Mapping[float, Packing]) -> pd.DataFrame:
    """Errors along each sweep of `SWEEPS`; with 64 droplets a few minutes for each packing.

    Args:
        packings: nominal rho -> droplets at that rho.

    Returns:
        A row per picture: parameter, value (pixels, or of the contrast), state (rho), and the columns of
        `picture_errors`; half of all pictures have a scale bar.
    """
    rows = []
    for state, packing in packings.items():
        known = truth(packing)
        across = float((packing.box[0, 0] * packing.box[1, 1] / packing.n) ** 0.5 * 0.53)  # a radius near rho = 0.9
        for parameter, values in SWEEPS.items():
            for k, value in enumerate(values):
                how, pixels = dict(PLAIN), PIXELS
                if parameter == "radius":
                    pixels = round(value * float(packing.box[0, 0]) / across)
                else:
                    how[parameter] = value
                row = picture_errors(packing, pixels, known, **how, seed=k, scale_bar=bool(k % 2))
                rows.append({"parameter": parameter, "value": value, "state": state} | row)
    return pd.DataFrame(rows)
