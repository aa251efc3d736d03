"""Droplets with dark walls and light on both sides: regions of a watershed tree, walls around them, and a choice.

Light inside a droplet and light in a Plateau border look alike. A watershed of the darkness gives every light spot a
region, walls of droplets among its borders; regions merge pairwise, faintest wall first, into a tree whose root is the
picture. Every node that is roughly compact is a place to look for a droplet: its area A and polar moment of inertia I
are not far from those of a disc,

    A^2/(2 pi I) = 1 for a disc, 0.96 for a square, 0.83 for a triangle, 0.67 for two discs that touch.

Around each the best closed path along the inner edge of a wall is found, and how likely it is a droplet. The likeliest
are taken, none where another one is. A droplet ends at the darkest line of its wall, which touching droplets share; the
light inside it ends before.

Around the middle of a region rays are cast. The path that crosses every ray once and gathers the steepest rise of
darkness (dynamic programming) is the inner edge of a wall, also where the wall has a gap or is as light as noise. How
evenly dark that wall is, how round and how light what it encloses, and how far it is from the region it was started
from, say how likely it is a droplet: a logistic regression on nine foams, nine rendered packings and eight lattices of
rings. The weights are frozen: no picture is used to fit them.

Sources: F. Meyer, Signal Processing 38, 113 (1994), for the watershed; M.-K. Hu, IRE Trans. Inf. Theory 8, 179 (1962),
for moments as shapes; A. A. Amini, T. E. Weymouth & R. C. Jain, IEEE Trans. PAMI 12, 855 (1990), for paths by dynamic
programming.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.illumination import ENVELOPE, envelope, noise_level, width_of_filter
from jamlab.micrographs.picture_files import distance_inside, scikit_image
from jamlab.micrographs.segmentation import highest, meetings

COMPACT = 0.75  # least A^2/(2 pi I) of a region in which a droplet is looked for
LEAST_PIXELS, LARGEST = 6, 0.6  # least area of such a region, and largest share of the picture
LEAST_SCORE = -0.9  # log odds that a closed path is a droplet
LEAST_ODDS = -5.0  # below, a droplet in a hundred and fifty, a path is no droplet that was missed
EDGE = 0.75  # pixels from the light of a whole droplet to the edge: of those nearer hands cut two in three
OVERLAP = 0.3  # of what a path encloses, that others may have taken before
TYPICAL = 0.8  # of the mean depth above Otsu's threshold: what counts as the depth of walls in the picture
LEAST_DEPTH = 0.05  # between envelopes of light and dark: spots that stand out by less have no region
NOISES = 3.0  # standard deviations of smoothed noise that spots must stand out by
MOST_NOISE = 0.6  # standard deviation of the noise over the depth of walls
FINEST, MOST = 600, 4  # pixels along the shorter side that a small picture is enlarged to, and how often at most
MOST_PIXELS = 1_300_000  # in which droplets are looked for; a larger picture is thinned
LEVELS = 6  # steps of darkness to the least that stands out
SMOOTHING = 0.6  # pixels, standard deviation
HALF_LINE = 0.5  # pixels: the darkest line of a wall is no droplet's, where the grid is fine enough to leave it out


@dataclass(frozen=True)
class Candidates:
    """Closed paths along walls, none over another: first those that are taken for droplets, by their labels."""

    odds: Array  # (m,) log odds that it is a droplet
    areas: Array  # (m,) of the light inside, pixels of the picture
    whole: Mask  # (m,) off the edge of the picture
    taken: int  # number of those taken for droplets


@dataclass(frozen=True)
class Rings:
    """Droplets of a ring picture."""

    labels: Indices  # (f h, f w) droplets from 1, 0 elsewhere, on a grid `finer` times as fine as the picture
    light: Indices  # (f h, f w) the same of the light inside their walls
    finer: int  # f
    candidates: Candidates


@dataclass
class _Tree:
    """Regions and what they merge into: n leaves and n - 1 nodes, or less where the picture falls apart.

    moments: area, and sums of x, y, x^2, y^2; touches: left, right, upper, lower edge of the picture; level: darkness
    inside; height: depth of the deepest wall within; joined: depth of the wall across which it merged with another.
    """

    moments: list[Array]
    touches: list[Mask]
    level: list[float]
    height: list[float]
    joined: list[float]

    def join(self, a: int, b: int, height: float) -> int:
        """Merge two nodes across a wall of that depth; the new node."""
        area_a, area_b = self.moments[a][0], self.moments[b][0]
        self.level.append(float((self.level[a] * area_a + self.level[b] * area_b) / (area_a + area_b)))
        self.moments.append(self.moments[a] + self.moments[b])
        self.touches.append(self.touches[a] | self.touches[b])
        self.height.append(max(height, self.height[a], self.height[b]))
        self.joined[a] = self.joined[b] = height
        self.joined.append(np.inf)
        return len(self.joined) - 1


def find_rings(grey: Array) -> Rings | None:
    """Find the droplets of a picture with dark walls; None if no wall stands out. `grey`: (h, w) grey values."""
    if grey.size > MOST_PIXELS:
        return _find_coarser(grey, int(np.ceil(np.sqrt(grey.size / MOST_PIXELS))))
    finer = int(np.clip(round(FINEST / min(grey.shape)), 1, MOST))
    noise = noise_level(grey)
    contrast = float(np.subtract(*np.percentile(grey, [95, 5])))
    width = float(np.hypot(SMOOTHING, width_of_filter(noise / max(contrast, 1e-12))))
    smooth = ndimage.gaussian_filter(grey, width, mode="nearest") if finer == 1 else grey
    if finer > 1:
        smooth = ndimage.zoom(grey, finer, order=3, grid_mode=True, mode="nearest")
        smooth = ndimage.gaussian_filter(smooth, width * finer / 2.0, mode="nearest")
    every = np.ones(smooth.shape, dtype=bool)
    high, low = (envelope(smooth, every, above) for above in (ENVELOPE, 1 - ENVELOPE))
    step = np.maximum(high - low, 0.2 * float(np.median(high - low)))
    dark = np.clip((high - smooth) / step, -0.5, 1.5)
    between = float(np.median(step))
    left = noise / between / max(2 * np.sqrt(np.pi) * width, 1.0)
    leaves = _leaves(dark, max(LEAST_DEPTH, NOISES * left))
    if leaves.max() < 1:
        return None
    tree, depth = _merge(leaves, dark)
    found = None if depth <= 0 or noise > MOST_NOISE * depth * between else _paths_of(tree, dark, depth, finer)
    if found is None:
        return None
    inside, outer, candidates = _choose(*found, dark.shape, finer)
    droplets = _up_to_walls(leaves, dark, inside, outer)
    line = np.ones(dark.shape, dtype=bool)
    for places in meetings(droplets):
        line.flat[places] = False
    droplets[distance_inside(line) + 0.5 < HALF_LINE * finer] = 0
    return Rings(droplets, inside, finer, candidates)


def _paths_of(tree: _Tree, dark: Array, depth: float, finer: int) -> tuple[WallPaths, Array] | None:
    """Paths around the regions that may be droplets, and their terms; None without such regions."""
    moments, sides = np.array(tree.moments), zip(tree.moments, tree.touches, strict=True)
    compact = np.array([compactness(own, touches, dark.shape) for own, touches in sides])
    area, height = moments[:, 0], np.array(tree.height)
    tried = (compact > COMPACT) & (area > LEAST_PIXELS) & (area < LARGEST * dark.size) & (height < 1.3 * depth)
    if not tried.any():
        return None
    radii = np.sqrt(area[tried] / np.pi)
    paths = find_paths(dark, depth, finer, moments[tried, 1:3] / area[tried, None] - 0.5, radii)
    joined = np.minimum(np.array(tree.joined)[tried], 9.0)
    return paths, path_terms(paths, compact[tried], radii, joined / depth, height[tried] / depth)


def _find_coarser(grey: Array, step: int) -> Rings | None:
    """Droplets of a large picture, found in one `step` times as coarse."""
    small = scikit_image().transform.downscale_local_mean(grey, (step, step))
    found = find_rings(small)
    if found is None:
        return None
    labels, light = (
        np.kron(part[:: found.finer, :: found.finer], np.ones((step, step), dtype=np.int64))[: len(grey), : len(grey.T)]
        for part in (found.labels, found.light)
    )
    candidates = replace(found.candidates, areas=step**2 * found.candidates.areas)
    return replace(found, labels=labels, light=light, finer=1, candidates=candidates)


def _leaves(dark: Array, least: float) -> Indices:
    """(h, w) region of each light spot that stands out, from 0."""
    skimage = scikit_image()
    steps = np.rint((dark - dark.min()) * (LEVELS / least)).astype(np.float32)  # whole numbers sort and flood faster
    top = steps.max()
    floor = top - skimage.morphology.reconstruction(top - np.minimum(steps + LEVELS, top), top - steps)
    markers, _ = ndimage.label(skimage.morphology.local_minima(floor), np.ones((3, 3)))
    return np.asarray(skimage.segmentation.watershed(steps, markers), dtype=np.int64) - 1


def _borders(regions: Indices, dark: Array) -> dict[tuple[int, int], tuple[float, float]]:
    """Length of the wall between each pair of regions, and its darkness summed along it."""
    places = np.stack(meetings(regions))
    names = np.ravel_multi_index(tuple(np.sort(regions.ravel()[places], axis=0)), (int(regions.max()) + 1,) * 2)
    pairs, short = np.unique(names, return_inverse=True)
    sums = np.bincount(short, dark.ravel()[places].max(axis=0))
    ends = np.column_stack(np.divmod(pairs, int(regions.max()) + 1)).tolist()
    return dict(zip(map(tuple, ends), zip(np.bincount(short), sums, strict=True), strict=True))


def _merge(regions: Indices, dark: Array) -> tuple[_Tree, float]:
    """Merge regions across their faintest walls until one is left; the tree, and the depth of walls in the picture."""
    count = int(regions.max()) + 1
    near: list[dict[int, tuple[float, float]]] = [{} for _ in range(count)]
    for (a, b), wall in _borders(regions, dark).items():
        near[a][b] = near[b][a] = (float(wall[0]), float(wall[1]))
    tree = _tree_of(regions, dark)
    node, level = list(range(count)), tree.level.copy()  # of the region that others have joined

    def depth(a: int, b: int) -> float:
        length, total = near[a][b]
        return total / length - max(level[a], level[b])

    heap = [(depth(a, b), a, b) for a in range(count) for b in near[a] if a < b]
    typical = _typical_depth(heap, [near[a][b][0] for _, a, b in heap])
    heapq.heapify(heap)
    while heap:
        height, a, b = heapq.heappop(heap)
        if b not in near[a]:
            continue
        now = depth(a, b)
        if now > height:  # levels have changed since
            heapq.heappush(heap, (now, a, b))
            continue
        keep, gone = (a, b) if len(near[a]) >= len(near[b]) else (b, a)
        node[keep] = tree.join(node[keep], node[gone], now)
        level[keep] = tree.level[-1]
        for other, (length, total) in near[gone].items():
            del near[other][gone]
            if other != keep:
                known = near[keep].get(other, (0.0, 0.0))
                near[keep][other] = near[other][keep] = (known[0] + length, known[1] + total)
                heapq.heappush(heap, (depth(other, keep), other, keep))
        near[gone] = {}
    return tree, typical


def _tree_of(regions: Indices, dark: Array) -> _Tree:
    """The leaves."""
    count, flat = int(regions.max()) + 1, regions.ravel()
    y, x = (place.ravel() + 0.5 for place in np.mgrid[: regions.shape[0], : regions.shape[1]])
    sums = [np.bincount(flat, weight, count) for weight in (np.ones(flat.size), x, y, x * x, y * y)]
    touches = np.zeros((count, 4), dtype=bool)
    for side, line in enumerate((regions[:, 0], regions[:, -1], regions[0], regions[-1])):
        touches[np.unique(line), side] = True
    order = np.sort(4.0 * flat + dark.ravel())  # by region, then by darkness, which is -0.5 to 1.5
    ends = np.concatenate([[0], np.cumsum(sums[0]).astype(np.int64)])
    level = (order[(ends[:-1] + ends[1:]) // 2] - 4.0 * np.arange(count)).tolist()
    return _Tree([*np.stack(sums, axis=1)], [*touches], level, [0.0] * count, [np.inf] * count)


def _typical_depth(heap: list[tuple[float, int, int]], lengths: list[float]) -> float:
    depth = np.repeat(np.maximum([row[0] for row in heap], 0.0), np.array(lengths, dtype=np.int64))
    deep = depth[depth > scikit_image().filters.threshold_otsu(depth)] if np.ptp(depth) > 0 else depth
    return float(TYPICAL * deep.mean())


def _choose(paths: WallPaths, terms: Array, shape: tuple[int, ...], finer: int) -> tuple[Indices, Mask, Candidates]:
    """(f h, f w) light inside droplets, from 1; (f h, f w) what paths along their darkest lines enclose; and which
    paths may be droplets, none over another."""
    odds = path_odds(terms)
    light, outer, taken = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    kept, last = [], np.array(shape[::-1]) - 1
    for k in np.argsort(-odds):
        if odds[k] <= LEAST_ODDS:
            break
        inside = pixels_within(paths.light[k], shape)
        own = inside[~taken.flat[inside]]
        if len(own) < (1 - OVERLAP) * max(len(inside), 1):
            continue
        taken.flat[own] = True
        away = min(paths.light[k].min(), (last - paths.light[k]).min())
        kept.append((odds[k], len(own) / finer**2, away > EDGE * finer))
        if odds[k] > LEAST_SCORE:
            light.flat[own] = len(kept)
            outer.flat[pixels_within(paths.outer[k], shape)] = True
    own_odds, areas, off = np.array(kept).reshape(-1, 3).T
    return light, outer | (light > 0), Candidates(own_odds, areas, off > 0, int((own_odds > LEAST_SCORE).sum()))


def pixels_within(points: Array, shape: tuple[int, ...]) -> Indices:
    """Flat places of the pixels of a picture that a closed path of x and y, (k, 2), encloses."""
    inside = scikit_image().draw.polygon(points[:, 1], points[:, 0], shape)
    return np.asarray(np.ravel_multi_index(inside, shape), dtype=np.int64)


def _up_to_walls(leaves: Indices, dark: Array, light: Indices, outer: Mask) -> Indices:
    """Droplets up to the darkest line around them: a watershed from the light inside, and from light spots between."""
    rows, columns = highest(-dark, leaves)[1].T
    between = ~outer[rows, columns]
    markers, found = light.copy(), int(light.max())
    markers[rows[between], columns[between]] = found + 1
    inner = (ndimage.minimum_filter(light, 3) == ndimage.maximum_filter(light, 3)) & (light > 0)  # flood nothing
    cells = np.where(inner, light, scikit_image().segmentation.watershed(dark, markers, mask=~inner))
    return np.asarray(np.where(cells > found, 0, cells), dtype=np.int64)


def compactness(moments: Array, touches: Mask, shape: tuple[int, ...]) -> float:
    """A^2/(2 pi I) with the polar moment I about the centre; of what the picture's edge cuts, with its mirror image.
    `moments`: area, and sums of x, y, x^2, y^2 over the pixels; `touches`: (4,) bool, left, right, upper, lower edge;
    `shape`: rows and columns of the picture."""
    area, x, y, xx, yy = moments
    own = np.array([xx - x * x / area, yy - y * y / area]) + area / 12  # a pixel has an extent, too
    best = area**2 / (2 * np.pi * own.sum())
    for side in np.flatnonzero(touches):
        axis, edge = (0, (0, shape[1])[side]) if side < 2 else (1, (0, shape[0])[side - 2])
        about = (xx - 2 * edge * x if axis == 0 else yy - 2 * edge * y) + area * edge**2 + area / 12
        best = max(best, 4 * area**2 / (2 * np.pi * 2 * (about + own[1 - axis])))
    return float(best)


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
