"""Render a packing, measure the picture, and compare with the truth: errors of count, rho, z and shape.

The truth of a picture whose edges cut droplets is that of the droplets that it shows whole, and of the whole cell for
rho, since one period shows every droplet once. Shapes are those of the outlines that are drawn, polygons grown by
their rims: bare polygons are less round, by 0.006 at rho = 0.84 and 0.014 at 0.95. Where rims overlap, a picture shows
half of the overlap on either side, which the truth does not cut away: that adds 0.004 at rho = 0.95, and less below.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
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
from jamlab.micrographs.droplet_sources import LEAST_RING
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.micrograph import micrograph
from jamlab.micrographs.picture_numbers import LIMITS
from jamlab.micrographs.quality import RING_LIMIT
from jamlab.micrographs.synthetic import synthetic_micrograph
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam


def kept(name: str, row: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """A row of a benchmark, taken from the folder JAMLAB_RESULTS if it is there, so that a stopped run goes on."""
    folder = os.environ.get("JAMLAB_RESULTS")
    path = Path(folder or ".", f"{name}.json")
    if folder and path.exists():
        return dict(json.loads(path.read_text()))
    found = row()
    if folder:
        path.write_text(json.dumps(found))
    return found


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


def droplets_seen(packing: Packing, found: Micrograph) -> tuple[Array, Array]:
    """(count,) droplet of the packing that each one seen is, and (count,) distance of their centres."""
    apart = found.centres[:, None] - packing.centroids
    apart = apart - np.rint(apart @ np.linalg.inv(packing.box)) @ packing.box
    distance = np.hypot(apart[..., 0], apart[..., 1])
    return distance.argmin(axis=1), distance.min(axis=1)


def forces_seen(packing: Packing, found: Micrograph) -> Array:
    """(3, m) force over tension in the packing, force seen and its standard error, of contacts between whole ones."""
    own, known = droplets_seen(packing, found)[0], contacts(packing)
    size = known.forces.size / packing.params["gamma"]
    true = {frozenset(pair): force for pair, force in zip(known.pairs.tolist(), size, strict=True)}
    forces = found.forces
    kept = (forces.pairs.min(axis=1) >= 0) & np.isfinite(forces.size)
    pairs = own[forces.pairs[kept]].tolist()
    return np.array([[true.get(frozenset(pair), 0.0) for pair in pairs], forces.size[kept], forces.error[kept]])


def wall_distance(packing: Packing, pixels: int) -> Array:
    """(h, w) distance to the nearest outline, negative in droplets, in pixels of a picture `pixels` wide, `FINER`
    samples to each. Disks, by their diameters, end where they meet: outlines are those of a power diagram."""
    if packing.model == "sp":
        return _disk_distance(packing, FINER * pixels) / FINER
    droplet = synthetic_micrograph(packing, FINER * pixels, film=FINER * FILM, blur=0.0) > 0.5
    margin = 8 * FINER
    near = [ndimage.distance_transform_edt(np.pad(side, margin, mode="wrap")) for side in (droplet, ~droplet)]
    return np.asarray((near[1] - near[0])[margin:-margin, margin:-margin] / FINER)


def _disk_distance(packing: Packing, pixels: int) -> Array:
    scale = pixels / packing.box[0, 0]
    shape = round(packing.box[1, 1] * scale), pixels
    y, x = (np.arange(count) + 0.5 for count in shape)
    first, second = np.full(shape, np.inf), np.full(shape, np.inf)
    places = np.mod(packing.positions * scale, [shape[1], shape[0]])
    for place, radius in zip(places, 0.5 * packing.diameters * scale, strict=True):
        for move in product((-shape[1], 0, shape[1]), (-shape[0], 0, shape[0])):
            cx, cy = place + move
            rows, columns = (
                slice(*np.searchsorted(line, [c - 1.6 * radius - 20, c + 1.6 * radius + 20]))
                for line, c in ((y, cy), (x, cx))
            )
            away = np.hypot(x[columns] - cx, y[rows, None] - cy) - radius
            near = first[rows, columns]
            second[rows, columns] = np.where(away < near, near, np.minimum(second[rows, columns], away))
            first[rows, columns] = np.minimum(near, away)
    return np.where(first < 0, -np.minimum(-first, 0.5 * (second - first)), first)


def ring_truth(away: Array, wall: float) -> tuple[Array, float]:
    """Areas in pixels of the light inside the droplets that a picture of rings shows whole, and share of the picture
    that light inside droplets covers. `away`: as `wall_distance` gives it; `wall`: width of the wall in pixels."""
    inside, count = ndimage.label(away < -wall / 2)
    cut = np.unique(np.concatenate([inside[0], inside[-1], inside[:, 0], inside[:, -1]]))
    areas = np.bincount(inside.ravel(), minlength=count + 1) / FINER**2
    return np.delete(areas, np.append(cut, 0)), float((inside > 0).mean())


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
    fine = np.where(abs(away) <= wall / 2, 0.2, 1.0)
    h, w = (size // FINER for size in fine.shape)
    picture = fine[: FINER * h, : FINER * w].reshape(h, FINER, w, FINER).mean(axis=(1, 3))
    picture = ndimage.gaussian_filter(picture, blur, mode="wrap") * np.linspace(1, light, w)
    return np.asarray(picture + noise * np.random.default_rng(seed).normal(size=picture.shape))


def ring_errors(found: Micrograph, areas: Array, light: float) -> dict[str, Any]:
    """Of count, area and interior_fraction of rings: relative error (of the last one absolute), error over its limit
    and over half of the interval, and quality. `areas`: true areas of the light inside whole droplets, pixels; `light`:
    share of the picture that light inside droplets covers. "right" if none is good and beyond its limit."""
    large = areas[areas >= np.pi * LEAST_RING**2]
    few = max(RING_LIMIT, LIMITS["count"] / len(large))
    truths = {
        "count": (len(large), few),
        "area": (large.mean(), RING_LIMIT),
        "interior_fraction": (light, LIMITS["rho"]),
    }
    row: dict[str, Any] = {"contrast": found.contrast, "quality": found.quality, "right": True, "truth": len(large)}
    for name, (true, limit) in truths.items():
        number = found.numbers[name]
        unit = 1.0 if name == "interior_fraction" else true
        off = float(number.value - true)
        row[name] = (
            round(off / unit, 4),
            round(off / unit / limit, 3),
            round(off / number.half_width, 3),
            number.quality,
        )
        row["right"] &= number.quality == "doubtful" or bool(abs(off) <= limit * unit)
    others = {found.numbers[name].quality for name in ("rho", "z", "shape_rim", "voids")}
    return row | {"others": sorted(others), "reasons": "; ".join(found.reasons)}


def print_ring_errors(rows: Sequence[Mapping[str, Any]]) -> None:
    """What `ring_errors` said of several pictures."""
    print(f"{sum(row['quality'] == 'good' for row in rows)} of {len(rows)} good")
    for name in ("count", "area", "interior_fraction"):
        off, over, inside, quality = (np.array(column) for column in zip(*(row[name] for row in rows), strict=True))
        good = quality == "good"
        print(
            f"{name}: median error {np.median(abs(off)):.4f}; {good.sum()} good, "
            f"{(abs(over[good]) > 1).sum()} of them wrong; {(abs(inside) <= 1).mean():.0%} within their interval"
        )


def rendered_ring(
    pixels: int, n: int, spread: float, swell: float, wall: float, blur: float, noise: float, light: float, seed: int
) -> tuple[Array, Array]:
    """A picture of rings, and its `wall_distance`: n disks of lognormal sizes at onset, `swell` times as large."""
    packing = jam(model="sp", n=n, seed=seed, sizes=f"lognormal:{spread}")
    away = wall_distance(replace(packing, diameters=packing.diameters * swell), pixels)
    return ring_picture(away, wall, blur, noise, light, seed), away


def ring_conditions(count: int, seed: int) -> list[dict[str, Any]]:
    """Arguments of `rendered_ring` for that many pictures: narrow to wide sizes, wet to dry, thin to thick walls."""
    rng = np.random.default_rng(seed)
    return [
        {
            "pixels": int(rng.choice([300, 400])),
            "n": int(rng.choice([50, 80])),
            "spread": float(rng.choice([0.1, 0.3, 0.5])),
            "swell": float(rng.choice([0.97, 1.0, 1.03, 1.07])),
            "wall": float(rng.uniform(1.5, 5)),
            "blur": float(rng.uniform(0.4, 1.8)),
            "noise": float(rng.choice([0, 0.03, 0.1])),
            "light": float(rng.choice([1, 0.6, 0.4])),
            "seed": 1000 * seed + k,
        }
        for k in range(count)
    ]


def small_ring_conditions(count: int, seed: int) -> list[dict[str, Any]]:
    """The same for droplets of 5 to 12 pixels in radius with thin walls, as in pictures of wet foams."""
    found = []
    for k in range(seed, seed + count):
        rng = np.random.default_rng(k)
        radius, n, spread = rng.uniform(5.5, 12), int(rng.choice([40, 60, 80])), float(rng.choice([0.3, 0.45, 0.6]))
        found.append(
            {
                "n": n,
                "spread": spread,
                "pixels": round(radius * np.sqrt(np.pi * n / 0.85) * np.exp(0.5 * spread**2)),
                "swell": float(rng.choice([0.93, 0.97, 1.0, 1.03, 1.06])),
                "wall": float(rng.uniform(1.2, 2.8)),
                "blur": float(rng.uniform(0.3, 0.9)),
                "noise": float(rng.choice([0, 0.02, 0.05])),
                "light": float(rng.choice([1, 0.7])),
                "seed": k,
            }
        )
    return found


SMALL_RINGS_TO_JUDGE = small_ring_conditions(12, 8000)  # never used for a rule; those from 7000 on were
RINGS_TO_JUDGE = ring_conditions(30, 2)  # never used for a rule
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
                how |= {"seed": k, "scale_bar": bool(k % 2)}
                row = kept(f"{parameter}-{k}-{state}", lambda: picture_errors(packing, pixels, known, **how))  # noqa: B023
                print(parameter, value, state, row, flush=True)
                rows.append({"parameter": parameter, "value": value, "state": state} | row)
    return pd.DataFrame(rows)
