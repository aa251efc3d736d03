"""Which labels may be no droplet, several, or part of one, and how far all numbers may be off for them.

Doubt is weighed by area. A label is odd if its outline is bent in, if no large disc fits in it, or if it is far larger
than all others and not round: regions that ran together. What it may hide or stand for is its area over that of a
typical droplet. Labels that the edge of the picture cuts are judged as well, and weigh as much as of them is seen: a
sliver says nothing of whole droplets, a merged region at the edge says much.

What leaves correct labels less certain is in their intervals: edges, lines between labels, gaps, few or small droplets,
wide distributions of sizes. An interval wider than the limits is said in words; only one that says nothing is doubtful.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely

from jamlab.arrays import Array, Mask
from jamlab.geometry.contact_network import find_rattlers
from jamlab.micrographs.labels import PIECES
from jamlab.micrographs.picture_numbers import LIMITS, Number
from jamlab.micrographs.segmentation import Segments, edge_of, meetings
from jamlab.micrographs.walls import GAPS, SeenDroplets


@dataclass(frozen=True)
class Odd:
    """From where on labels are odd, and how far numbers may be off for them."""

    edge: float = 0.3  # pixels, by which the edge of a label is uncertain
    z: float = 16.0  # of z, for a gap of a diameter
    line: float = 0.3  # share of a line between labels that passes for a gap
    odd_z: float = 3.0  # of z, where all labels are odd
    odd_shape: float = 0.5  # of the shape factor, where all labels are odd
    voids: float = 1.0  # voids for a droplet that may be none
    voids_z: float = 0.6  # voids for a contact of a droplet: half a contact each, and of cut ones more
    limit: float = 0.1  # of count and mean area, up to which they are good
    limit_voids: float = 0.5  # of the number of droplets, up to which that of voids is good
    # pixels squared, over the squared radius: of the shape factor, for outlines of whole pixels
    pixel_shape: float = 1.0
    # scatter of gaps, of the most frequent: wide ones that vary by more are no lines that were left free
    varied: float = 0.75
    dilute: float = 0.5  # share of labelled pixels: more discs than 0.55 do not lie apart at random
    # area over area of the ellipse of the same second moments; half a disc 0.946, two in one 0.89
    ellipse: float = 0.97
    alike: float = 0.9  # share of labels that are ellipses, where all are taken for droplets as long as most
    long: float = 1.2  # aspect, beyond which droplets are elongated
    odd_part: float = 1.25  # of the bound without odd labels, up to which they widen it
    most_odd: float = 0.03  # share of labels that may be none, several or part of one, up to which z and A are good
    # area of an outline over that of its convex hull: a label below is odd, as two droplets in one are
    convex: float = 0.93
    # area of the largest disc inside over area; a hexagon 0.91, a pentagon of aspect 1.2 about 0.75
    round: float = 0.72
    rough: float = 0.5  # pixels by which walls between labels of whole pixels wander into the largest discs
    larger: float = 4.0  # area over area of the next smaller one: beyond, labels are no class of droplets
    few: float = 0.1  # share of labels that may lie beyond; more are a class
    smooth: float = 0.1  # typical radii, by which the edge of a large round droplet may leave its circle
    seen: float = 0.15  # share of its circle that a large droplet must show to be known as one


ODD = Odd()

# limits; a wider interval says nothing
EMPTY = {"area": 4.0, "rho": 12.5, "z": 4.0, "shape_factor_rim": 4.0, "voids": 4.0}
WORDS = {"area": "the mean area", "shape_factor_rim": "𝒜", "voids": "the number of voids"}


@lru_cache(maxsize=1)  # numbers, bounds and the table ask it of one picture
def doubt_labels(droplets: SeenDroplets) -> Array:
    """(n,) droplets by which the count may be off for each label, 0 for one that is a droplet. An odd one that is
    counted may be none or several; one that is cut hides as many as fit in it."""
    drawn = shapely.polygons([ring if len(ring) > 3 else np.zeros((4, 2)) for ring in droplets.outlines])
    bent = shapely.area(drawn) < ODD.convex * shapely.area(shapely.convex_hull(drawn))
    flat = elongation(droplets) * np.pi * (droplets.segments.inner + ODD.rough) ** 2 < ODD.round * droplets.areas
    odd = bent | (droplets.whole & flat) | _beyond(droplets)
    sound = droplets.areas[droplets.whole & ~odd]
    typical = float(np.mean(sound if len(sound) else droplets.areas))
    worth = droplets.areas / typical
    return np.where(odd, np.where(droplets.whole, np.maximum(worth - 1, 1.0), worth), 0.0)


def elongation(droplets: SeenDroplets) -> float:
    """Aspect of a typical droplet, by which the largest disc inside is smaller than that of a round one: the median of
    the second moments, if nearly all labels are ellipses and long ones; else 1."""
    y, x = np.nonzero(droplets.segments.droplets)
    name, n = droplets.segments.cells[y, x], len(droplets.areas)
    size = np.maximum(np.bincount(name, minlength=n), 1)
    dy, dx = (each - (np.bincount(name, each, n) / size)[name] for each in (y, x))
    xx, yy, xy = (np.bincount(name, each, n)[droplets.whole] for each in (dx**2, dy**2, dx * dy))
    size = size[droplets.whole]
    xx, yy, xy = xx / size + 1 / 12, yy / size + 1 / 12, xy / size
    within = np.sqrt(np.maximum(xx * yy - xy**2, 0.0))
    half = 0.5 * np.hypot(xx - yy, 2 * xy)
    aspects = (0.5 * (xx + yy) + half) / np.maximum(within, 1e-12)
    typical, ellipses = float(np.median(aspects)), size > ODD.ellipse * 4 * np.pi * within
    return typical if typical > ODD.long and ellipses.mean() >= ODD.alike else 1.0


def _beyond(droplets: SeenDroplets) -> Mask:
    """(n,) labels far larger than all others that are no discs."""
    areas, n = droplets.areas, len(droplets.areas)
    order = np.argsort(areas)
    steps = np.flatnonzero(areas[order[1:]] > ODD.larger * areas[order[:-1]]) + 1
    steps = steps[(n - steps <= max(1, ODD.few * n)) & (areas[order[steps]] > np.median(areas))]
    found = np.zeros(n, dtype=bool)
    if len(steps):
        radius = float(np.sqrt(np.median(areas[order[: steps[0]]]) / np.pi))
        large = order[steps[0] :]
        found[large] = [not _is_disc(droplets.segments, int(label), radius) for label in large]
    return found


def _is_disc(segments: Segments, label: int, radius: float) -> bool:
    """Whether the edge of a label inside the picture is that of a disc, within a part of the radius of others."""
    own = np.pad(segments.droplets & (segments.cells == label), 1, mode="edge")  # no edge where the picture ends
    first, second = meetings(own)
    middle = 0.5 * np.array([np.divmod(place, own.shape[1]) for place in (first, second)]).sum(axis=0)
    if middle.shape[1] < 3:
        return False
    y, x = middle - middle.mean(axis=1, keepdims=True)
    # x^2 + y^2 = 2 a x + 2 b y + c of a circle around (a, b)
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones_like(x)]), x**2 + y**2)
    wide = float(np.sqrt(max(c + a**2 + b**2, 0.0)))
    off = float(np.sqrt(np.mean((np.hypot(x - a, y - b) - wide) ** 2)))
    return off < max(ODD.smooth * radius, 1.0) and float(own.sum()) > ODD.seen * np.pi * wide**2


def in_doubt(droplets: SeenDroplets) -> dict[str, float]:
    """Droplets in doubt by odd labels and by notes, for each number that they concern."""
    own = float(doubt_labels(droplets).sum())
    return {name: own + sum(note.doubt for note in droplets.notes if name in note.concerns) for name in PIECES}


def bounds_of_labels(droplets: SeenDroplets, doubt: Mapping[str, float]) -> dict[str, float]:
    """How far the numbers of labels may be off, by the names of `Micrograph.numbers`. `doubt`: as of `in_doubt`."""
    whole, ground, edge = droplets.whole, ~droplets.segments.droplets, label_edge(droplets)
    count, typical = int(whole.sum()), float(droplets.areas[whole].mean())
    share, radius = {name: each / count for name, each in doubt.items()}, float(np.sqrt(typical / np.pi))
    beside = len(meetings(ground)[0]) * np.pi / 4  # an edge of pixels is longer
    merged = doubt["rho"] * typical
    void = min(ground.sum() / max(ground.size - merged, 1.0), 1.0)  # of what is not in doubt
    rough = ODD.pixel_shape * np.pi * float(np.mean(1 / droplets.areas[whole]))
    near = float(_near_the_edge(droplets, edge).sum())
    z = max(LIMITS["z"], ODD.z * widest_gap(droplets)) + ODD.odd_z * share["z"]
    return {
        "count": doubt["count"] + near,
        "area": typical * (share["area"] + (1 + edge / radius) ** 2 - 1),
        "rho": float(edge * beside + merged * void) / ground.size if beside else 1.0,
        "z": z,
        "shape_factor_rim": LIMITS["shape"] + rough + ODD.odd_shape * share["shape_factor_rim"],
        "voids": guessed_contacts(droplets) + near + ODD.voids * doubt["voids"] + ODD.voids_z * _touched(droplets) * z,
    }


def limits_of_labels(droplets: SeenDroplets) -> dict[str, float]:
    """How far numbers of labels may be off to be known well, by the names of `Micrograph.numbers`."""
    return {
        "area": ODD.limit * float(droplets.areas[droplets.whole].mean()),
        "rho": LIMITS["rho"],
        "z": LIMITS["z"] + ODD.odd_z * ODD.most_odd,
        "shape_factor_rim": LIMITS["shape"] + ODD.odd_shape * ODD.most_odd,
        "voids": ODD.limit_voids * _touched(droplets),
    }


def rules_of_labels(droplets: SeenDroplets) -> list[tuple[bool, str, frozenset[str]]]:
    """Whether odd labels leave numbers uncertain, why in words, and which."""
    count, doubt = int(droplets.whole.sum()), in_doubt(droplets)
    found, sharp = (bounds_of_labels(droplets, each) for each in (doubt, dict.fromkeys(doubt, 0.0)))
    limits = limits_of_labels(droplets)
    odd = {name for name, limit in limits.items() if not found[name] <= max(limit, ODD.odd_part * sharp[name])}
    odd |= {"count"} if 1 + doubt["count"] > max(ODD.limit * count, LIMITS["count"]) else set()
    last = [note.text for note in droplets.notes if np.isinf(note.doubt)]
    worth = f"labels that may be no droplet, several or part of one count as {max(doubt.values()):.3g} of {count}"
    return [(bool(odd), last[0] if last else worth, frozenset(odd))]


def widths_of_labels(
    droplets: SeenDroplets, numbers: Mapping[str, Number], scale: float
) -> list[tuple[bool, str, frozenset[str]]]:
    """Intervals wider than the limits: whether they say nothing, why in words, and of which number.

    Args:
        numbers: as in `Micrograph.numbers`, with their bounds.
        scale: length of a pixel.
    """
    edge = f"edges of labels are uncertain by {label_edge(droplets):.1f} pixels"
    gap = f"labels up to {widest_gap(droplets):.0%} of a diameter apart count as touching"
    pairs = f"it is uncertain whether {guessed_contacts(droplets):.0f} pairs of droplets touch"
    causes = {"area": edge, "rho": edge, "z": gap, "shape_factor_rim": edge, "voids": pairs}
    found = []
    for name, limit in limits_of_labels(droplets).items():
        number, word = numbers[name], WORDS.get(name, name)
        # sizes differ: few droplets leave their mean uncertain, and it says what it says
        wide, limit = (number.bound, limit * scale**2) if name == "area" else (number.uncertainty, limit)
        if wide <= limit or not np.isfinite(number.value + wide):
            continue
        few = name != "area" and number.half_width > number.bound
        why = f"it is a mean over {number.count} droplets" if few else causes[name]
        empty = wide > EMPTY[name] * limit
        found.append((empty, f"{word} is known to within {wide:.2g} (95 %): {why}", frozenset((name,))))
    return found


def _touched(droplets: SeenDroplets) -> float:
    """Droplets whose contacts bound the voids of a picture: of cut ones it shows half."""
    return float(droplets.whole.sum()) + 0.5 * float((~droplets.whole & (droplets.size > 0)).sum())


def guessed_contacts(droplets: SeenDroplets) -> float:
    """Pairs of droplets of which it is a guess whether they touch: a little farther apart than contacts may be, or
    beside a rattler, which touches by chance."""
    walls = droplets.walls
    rattlers, _ = find_rattlers(walls.pairs[walls.touching], droplets.whole)
    near = (walls.gap > walls.widest) & (walls.gap <= 2 * walls.widest - walls.film)
    return float((near | (walls.touching & rattlers[walls.pairs].any(axis=1))).sum())


def label_edge(droplets: SeenDroplets) -> float:
    """Pixels by which edges of labels are uncertain: half of the line that is left free between them belongs to
    either."""
    return ODD.edge if lie_apart(droplets) else ODD.edge + 0.5 * droplets.walls.line


def lie_apart(droplets: SeenDroplets) -> bool:
    """Whether gaps are wide and of all widths: they lie between droplets that do not touch, and are no lines."""
    walls = droplets.walls
    wide = walls.line > GAPS.thickest_film * droplets.segments.radius and droplets.segments.droplets.mean() < ODD.dilute
    return bool(wide) and walls.widest - walls.film > ODD.varied * walls.film


def widest_gap(droplets: SeenDroplets) -> float:
    """Gap that passes for a contact, beyond a line, up to which labels pass for touching, with the line, over the
    diameter."""
    walls = droplets.walls
    return float((walls.widest - (1 - ODD.line) * walls.film) / (2 * droplets.segments.radius))


def _near_the_edge(droplets: SeenDroplets, edge: float) -> Mask:
    """(n,) droplets of which it is uncertain whether the edge of the picture cuts them."""
    cells, body = droplets.segments.cells, droplets.walls.inside > 0
    chord = np.bincount(edge_of(cells)[edge_of(body)], minlength=droplets.segments.count)
    grazed: Mask = (chord > 0) & (chord**2 < 8 * (edge + 0.5) * np.sqrt(droplets.areas / np.pi))
    if edge < 2 * ODD.edge:  # no line is left free: what ends a pixel before the edge is whole
        return grazed
    beside = np.unique(edge_of(cells[1:-1, 1:-1])[edge_of(body[1:-1, 1:-1])])
    return np.asarray(grazed | ((chord == 0) & np.isin(np.arange(len(grazed)), beside)))
