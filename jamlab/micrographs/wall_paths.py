"""Outlines of droplets with dark walls: closed paths on which darkness rises outward, and how likely each is a droplet.

Around the middle of a region rays are cast. The path that crosses every ray once and gathers the steepest rise of
darkness (dynamic programming) is the inner edge of a wall, also where the wall has a gap or is as light as noise. How
evenly dark that wall is, how round and how light what it encloses, and how far it is from the region it was started
from, say how likely it is a droplet: a logistic regression on nine foams, nine rendered packings and eight lattices of
rings. The weights are frozen: no picture is used to fit them any more.

Source: A. A. Amini, T. E. Weymouth & R. C. Jain, IEEE Trans. PAMI 12, 855 (1990), for paths by dynamic programming.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask

RAYS, STEPS = 48, 56
ANGLES = np.arange(RAYS) * (2 * np.pi / RAYS)
REACH = np.linspace(0.04, 1.7, STEPS)  # along a ray, in radii of the region
NEAREST = 0.35  # radii: no wall is nearer to the middle
BENT = 0.02  # of the depth of walls, that a step of a path from ray to ray costs
BEYOND = 0.1  # gain beyond the edge of the picture: less than a wall has, more than noise
MODES = 9  # of a path around the middle, from the mean on
ROUNDS = 2  # the second path begins in the middle of the first
BATCH = 500  # paths at once, which bounds memory
LIGHT_EDGE = 0.3  # of the way from the steepest rise to the darkest line, where hands draw the edge of the light

# log odds of a droplet: constant, and a weight for each term of `path_terms`
CONSTANT = -13.83
WEIGHTS = np.array(
    """3.9 0.68 2.27 -2.53 1.33 4.46 3.35 -1.29 -9.38 6.96 1.31 26.14 -19.12 -4.84 2.7
    0.28 0.38 0.46 3.65 0.28 -0.03 -1.23 -0.08 -0.14""".split(),
    dtype=np.float64,
)


@dataclass(frozen=True)
class WallPaths:
    """Closed paths on the inner edge of walls, n of them, in pixels of the darkness that they were sought in."""

    inner: Array  # (n, RAYS, 2) x and y where darkness rises steepest
    light: Array  # (n, RAYS, 2) x and y where the light inside ends
    outer: Array  # (n, RAYS, 2) x and y of the darkest line
    features: Array  # (n, 11) see `_features`


def find_paths(dark: Array, depth: float, finer: int, middles: Array, radii: Array) -> WallPaths:
    """Find the wall around every region. `dark`: (h, w) darkness; `depth`: that of walls; `finer`: pixels of `dark` to
    one of the picture; `middles`: (n, 2) x and y; `radii`: (n,) of the regions, pixels of `dark`."""
    if not len(radii):
        none = np.zeros((0, RAYS, 2))
        return WallPaths(none, none, none, np.zeros((0, 11)))
    parts = [
        _paths(dark, depth, finer, middles[k : k + BATCH], radii[k : k + BATCH]) for k in range(0, len(radii), BATCH)
    ]
    return WallPaths(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _paths(dark: Array, depth: float, finer: int, middle: Array, radius: Array) -> tuple[Array, ...]:
    for turn in range(ROUNDS):
        along = radius[:, None, None] * REACH  # (n, 1, STEPS)
        x = middle[:, 0, None, None] + along * np.cos(ANGLES)[:, None]
        y = middle[:, 1, None, None] + along * np.sin(ANGLES)[:, None]
        seen = (x >= -0.5) & (x <= dark.shape[1] - 0.5) & (y >= -0.5) & (y <= dark.shape[0] - 0.5)
        values = ndimage.map_coordinates(dark, [y, x], order=1, mode="nearest")
        rise = _rise(values, 0.5 * finer / ((REACH[1] - REACH[0]) * radius)) / depth
        gain = np.where(seen, np.clip(rise, -1, 1), BEYOND)
        gain[:, :, REACH < NEAREST] = -0.5
        steps = _closed_path(gain)
        inner = _smooth(REACH[steps] * radius[:, None])
        if turn < ROUNDS - 1:
            enclosed = shapely.polygons(_points(middle, inner))
            middle = shapely.get_coordinates(shapely.centroid(enclosed))
            middle = np.clip(middle, 0, np.array(dark.shape[::-1]) - 1.0)
            radius = np.sqrt(np.maximum(shapely.area(enclosed), 1.0) / np.pi)
    on = np.take_along_axis(seen, steps[:, :, None], 2)[:, :, 0]
    behind = np.maximum(2.0 * finer, 0.25 * radius)[:, None, None]
    wall = np.where(
        (along >= inner[:, :, None] - 0.5 * finer) & (along <= inner[:, :, None] + behind) & seen, values, -9
    )
    outer = np.maximum(_smooth(np.take_along_axis(along[:, 0], wall.argmax(2), 1)), inner)
    found = _features(values, seen, along / inner[:, :, None], wall.max(2), on, _points(middle, inner), depth)
    light = inner + LIGHT_EDGE * (outer - inner)
    size = np.log(radius / finer)
    return (*(_points(middle, r) for r in (inner, light, outer)), np.column_stack([found, size]))


def _rise(values: Array, width: Array) -> Array:
    """Rise of darkness over a step of a ray, smoothed over half a pixel of the picture. `width`: (n,) that in steps."""
    rise, width = np.empty_like(values), np.clip(width, 0.8, 8.0)
    kinds = np.rint(2 * np.log2(width)).astype(np.int64)
    for kind in np.unique(kinds):
        mine = kinds == kind
        scale = float(width[mine].mean())
        rise[mine] = scale * ndimage.gaussian_filter1d(values[mine], scale, axis=2, order=1, mode="nearest")
    return rise


def _closed_path(gain: Array) -> Indices:
    """(n, RAYS) step on each ray that the path of most gain crosses; it moves by one step at most from ray to ray. Two
    turns are made, of which the middle one is closed."""
    count, back, best = len(gain), [], gain[:, 0]
    wide = np.full((count, STEPS + 2), -np.inf)
    for ray in range(1, 2 * RAYS + 1):
        wide[:, 1:-1] = best
        less, more = wide[:, :-2] - BENT, wide[:, 2:] - BENT
        back.append((more > best).astype(np.int8))
        best = np.maximum(best, more)
        back[-1][less >= best] = -1
        best = np.maximum(best, less) + gain[:, ray % RAYS]
    step, every = best.argmax(1), np.arange(count)
    path = np.zeros((count, 2 * RAYS), dtype=np.int64)
    for ray in range(2 * RAYS - 1, -1, -1):
        step = step + back[ray][every, step]
        path[:, ray] = step
    half = RAYS // 2
    return np.roll(path[:, half : half + RAYS], half, axis=1)


def _smooth(radius: Array) -> Array:
    """(n, RAYS) distances from the middle without their higher Fourier modes."""
    modes = np.fft.rfft(radius, axis=1)
    modes[:, MODES:] = 0
    return np.asarray(np.fft.irfft(modes, RAYS, axis=1), dtype=np.float64)


def _points(middle: Array, radius: Array) -> Array:
    return np.asarray(middle[:, None] + radius[:, :, None] * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]))


def path_areas(points: Array) -> Array:
    """(n,) areas of closed paths (n, k, 2), one pixel at least."""
    return np.asarray(np.maximum(shapely.area(shapely.polygons(points)), 1.0))


def _features(values: Array, seen: Mask, share: Array, top: Array, on: Mask, points: Array, depth: float) -> Array:
    """(n, 10) of each path: depth of the wall that all but a tenth, a quarter and half of it exceed, rise of darkness
    that all but a tenth exceeds and mean rise, level inside and what nine tenths of the inside stay below, all over
    `depth`; concavity, roundness 4 pi A/P^2, and share of the path beyond the picture. `share`: of the way to the path;
    `top`: (n, RAYS) darkest of the wall; `on`: (n, RAYS) rays whose path the picture shows."""
    n = len(values)
    within = ((share < 0.8) & seen).reshape(n, -1)
    within |= ~np.asarray(within.any(axis=1))[:, None]
    level, high = _quantiles(values.reshape(n, -1), within, 0.5, 0.9)
    beside = ((share < 0.95) & (share > 0.6) & seen).reshape(n * RAYS, -1)
    (near,) = _quantiles(values.reshape(n * RAYS, -1), beside, 0.5)
    near = np.where(beside.any(axis=1).reshape(n, RAYS), near.reshape(n, RAYS), level[:, None])
    counted = on | ~np.asarray(on.any(axis=1))[:, None]
    wall, step, shown = top - level[:, None], top - near, counted.sum(axis=1)
    z = points[..., 0] + 1j * points[..., 1]
    first, second = (np.roll(z, -1, 1) - np.roll(z, 1, 1)) / 2, np.roll(z, -1, 1) - 2 * z + np.roll(z, 1, 1)
    area = path_areas(points)
    bend = (np.conj(first) * second).imag / np.maximum(np.abs(first), 1e-9) ** 3 * np.sqrt(area / np.pi)[:, None]
    concave = (counted * np.minimum(bend, 0)).sum(axis=1) / shown
    solid = 4 * np.pi * area / np.abs(np.roll(z, -1, 1) - z).sum(axis=1) ** 2
    mean = (counted * np.clip(step, -0.5 * depth, 1.5 * depth)).sum(axis=1) / shown
    steep = [*_quantiles(wall, counted, 0.1, 0.25, 0.5), *_quantiles(step, counted, 0.1), mean]
    levels = np.stack([*steep, level, high - level]) / depth
    return np.column_stack([levels.T, concave, solid, on.mean(axis=1)])


def _quantiles(values: Array, kept: Mask, *shares: float) -> list[Array]:
    """(n,) of each share: that quantile of what is kept of every row; 9 where nothing is. `values`, `kept`: (n, k)."""
    order, last = np.sort(np.where(kept, values, 9.0), axis=1), np.maximum(kept.sum(axis=1) - 1, 0)
    found, every = [], np.arange(len(values))
    for share in shares:
        place = share * last
        low = place.astype(np.int64)
        less, more = order[every, low], order[every, np.minimum(low + 1, last)]
        found.append(np.asarray(less + (place - low) * (more - less)))
    return found


def path_odds(terms: Array) -> Array:
    """(n,) log odds that what a path encloses is a droplet. `terms`: (n, 24) of `path_terms`."""
    return np.asarray(CONSTANT + terms @ WEIGHTS)


def path_terms(paths: WallPaths, compact: Array, radii: Array, joined: Array, height: Array) -> Array:
    """(n, 24) what the log odds are linear in: levels over the median depth of the own wall, sizes as logarithms, also
    over the typical size of what is certainly a droplet. `compact`, `radii`, `joined`, `height`: (n,) A^2/(2 pi I) and
    radius of the region that a path was started from, and depths of the wall by which that region merged and of the
    deepest wall within, over the depth of walls."""
    grown = np.log(path_areas(paths.inner) / (np.pi * radii**2))
    tenth, quarter, half, rise, mean, level, high, concave, solid, seen, size = paths.features.T
    wall = np.maximum(half, 0.15)
    sure = (tenth > 0.4 * wall) & (solid > 0.93) & (compact > 0.93) & (np.abs(grown) < 0.35)
    if not len(size):
        return np.zeros((0, len(WEIGHTS)))
    sure = sure if sure.sum() >= 3 else np.ones(len(size), dtype=bool)
    order = np.sort(size[sure])
    along = np.cumsum(np.exp(order))
    relative = np.clip(size - order[np.searchsorted(along, 0.5 * along[-1])], -3, 1)
    depth, size = np.clip(np.log(wall), -2, 1.5), np.clip(size, -1, 4)
    tenth, quarter = np.clip(tenth / wall, -0.5, 1), np.clip(quarter / wall, 0, 1)
    high, solid, concave = np.clip(high / wall, 0, 1), np.clip(solid, 0.5, 1), np.clip(concave, -1, 0)
    own = [depth, depth**2, tenth, np.minimum(tenth, 0.3), quarter, np.clip(rise / wall, -0.5, 1)]
    own += [np.clip(mean / wall, 0, 1.5), high, concave, 1 - seen, np.clip(level / wall, -1, 2)]
    region = [compact, np.minimum(compact, 0.93), np.abs(np.clip(grown, -1, 0.5))]
    region += [np.clip(joined / wall, 0, 2), np.clip(height / wall, 0, 1.5)]
    sized = [size * term for term in (1.0, solid, concave, tenth, quarter, high)]
    return np.column_stack([*own, *region, *sized, relative, relative * compact])
