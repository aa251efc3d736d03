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
from scipy import ndimage

from jamlab.arrays import Array, Mask
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.rims import rims
from jamlab.micrographs.micrograph import micrograph
from jamlab.micrographs.quality import LIMITS
from jamlab.micrographs.synthetic import synthetic_micrograph
from jamlab.packing.packing import Packing

FINER = 2  # samples a pixel, in each direction, that a picture of rings is drawn with
FILM = 2.0  # pixels between droplets that touch, as `synthetic_micrograph` has it by default


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
        "shape": float(found.shape.mean()) - known.shape,
    }
    right = all(abs(errors[name]) <= limit for name, limit in LIMITS.items())
    return errors | {"quality": found.quality, "reasons": "; ".join(found.reasons), "right": right}


def wall_distance(packing: Packing, pixels: int) -> Array:
    """(h, w) distance to the nearest outline, in pixels of a picture `pixels` wide, `FINER` samples to each."""
    droplet = synthetic_micrograph(packing, FINER * pixels, film=FINER * FILM, blur=0.0) > 0.5
    margin = 8 * FINER
    near = [ndimage.distance_transform_edt(np.pad(side, margin, mode="wrap")) for side in (droplet, ~droplet)]
    return np.asarray(np.maximum(*near)[margin:-margin, margin:-margin] / FINER)


def ring_picture(away: Array, wall: float, blur: float, noise: float, light: float, seed: int) -> Array:
    """Droplets as rings: a dark wall along every outline, light inside and in the voids, as foams in brightfield.

    Args:
        away: `wall_distance` of the packing.
        wall: width of the wall in pixels; films between droplets that touch are dark all through.
        blur: standard deviation in pixels.
        noise: standard deviation, where walls have 0.2 and all else has 1.
        light: brightness at the right edge, 1 at the left; it falls evenly.
        seed: of the noise.
    """
    fine = np.where(away <= wall / 2, 0.2, 1.0)
    h, w = (size // FINER for size in fine.shape)
    picture = fine[: FINER * h, : FINER * w].reshape(h, FINER, w, FINER).mean(axis=(1, 3))
    picture = ndimage.gaussian_filter(picture, blur, mode="wrap") * np.linspace(1, light, w)
    return np.asarray(picture + noise * np.random.default_rng(seed).normal(size=picture.shape))


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
