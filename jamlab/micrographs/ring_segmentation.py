"""Droplets with dark walls and light on both sides: regions of a watershed tree, walls around them, and a choice.

Light inside a droplet and light in a Plateau border look alike. A watershed of the darkness gives every light spot a
region, walls of droplets among its borders; regions merge pairwise, faintest wall first, into a tree whose root is the
picture. Every node that is roughly compact is a place to look for a droplet: its area A and polar moment of inertia I
are not far from those of a disc,

    A^2/(2 pi I) = 1 for a disc, 0.96 for a square, 0.83 for a triangle, 0.67 for two discs that touch.

Around each the best closed path along the inner edge of a wall is found (`wall_paths`), and how likely it is a droplet
by its wall, shape and size. The likeliest are taken, none where another one is. A droplet ends at the darkest line of
its wall, which touching droplets share; the light inside it ends before.

Sources: F. Meyer, Signal Processing 38, 113 (1994), for the watershed; M.-K. Hu, IRE Trans. Inf. Theory 8, 179 (1962),
for moments as shapes.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.illumination import ENVELOPE, envelope, noise_level, width_of_filter
from jamlab.micrographs.picture_files import distance_inside, scikit_image
from jamlab.micrographs.segmentation import highest, meetings
from jamlab.micrographs.wall_paths import WallPaths, find_paths, path_odds, path_terms

COMPACT = 0.75  # least A^2/(2 pi I) of a region in which a droplet is looked for
LEAST_PIXELS, LARGEST = 6, 0.6  # least area of such a region, and largest share of the picture
LEAST_SCORE = -0.9  # log odds that a closed path is a droplet
LEAST_ODDS = -5.0  # below, a droplet in a hundred and fifty, a path is no droplet that was missed
EDGE = (
    0.75  # pixels from the light of a whole droplet to the edge of the picture: of those nearer hands cut two in three
)
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
    if depth <= 0 or noise > MOST_NOISE * depth * between:
        return None
    inside, outer, candidates = _choose(*_paths_of(tree, dark, depth, finer), dark.shape, finer)
    droplets = _up_to_walls(leaves, dark, inside, outer)
    line = np.ones(dark.shape, dtype=bool)
    for places in meetings(droplets):
        line.flat[places] = False
    droplets[distance_inside(line) + 0.5 < HALF_LINE * finer] = 0
    return Rings(droplets, inside, finer, candidates)


def _paths_of(tree: _Tree, dark: Array, depth: float, finer: int) -> tuple[WallPaths, Array]:
    """Paths around the regions that may be droplets, and their terms."""
    moments, sides = np.array(tree.moments), zip(tree.moments, tree.touches, strict=True)
    compact = np.array([compactness(own, touches, dark.shape) for own, touches in sides])
    area, height = moments[:, 0], np.array(tree.height)
    tried = (compact > COMPACT) & (area > LEAST_PIXELS) & (area < LARGEST * dark.size) & (height < 1.3 * depth)
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
