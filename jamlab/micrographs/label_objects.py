"""Which objects of a label image are droplets: rules for what segmenters and hands leave in label images.

An object is a connected region of one number. In this order:

1. A number beside most others, on all four sides of the picture or where no pixel is 0, is the ground.
2. Objects off the edge that are far smaller than droplets, below a gap in the distribution of sizes, and too small to
   show a shape, are specks: they are set aside.
3. What an object encloses belongs to it: a droplet has no holes, and no droplet lies in another.
4. Two objects that together are rounder than either, of which one is odd, are pieces of one droplet.

Every other object is a droplet. A mask is first parted into droplets at its necks. What a rule changed is a note, with
the number of droplets by which the count may be off for it; objects of a size class of their own are such a number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.picture_files import distance_inside, scikit_image
from jamlab.micrographs.segmentation import edge_of, find_droplets, meetings

GAP = 1.5  # ratio of successive radii, in order of size, above which specks end
SPECK = 0.25  # of the typical radius: larger objects are no specks
UNRESOLVED = 4.0  # pixels, radius: nor are those that show a shape
DEBRIS = 2.0  # pixels, radius: specks from here on may be droplets of a small size class
CLASS_GAP, CLASS_SHARE = 2.0, 0.1  # ratio of radii between size classes; of the area that a class of droplets covers
ODD_PIECE, ROUNDER = 0.72, 1.05  # roundness of one of two pieces, at most; of both together over that of the rounder
LINE = 2  # pixels without a label between two pieces, at most
AROUND, LEAST_AROUND = 0.5, 8  # share of all other objects that the ground lies beside, and their number
CONVEX, PEPPER = 0.9, 2  # area over that of the convex hull, and pixels, of holes in a mask that are no voids
MOST_PIECES = 3000  # pairs that may be pieces: noise has more, and no droplets
PARTED = 0.1  # of the droplets that are parted at necks: necks that are waists, and waists that are necks


@dataclass(frozen=True)
class Note:
    """What a rule found in labels."""

    text: str
    doubt: int = 0  # droplets by which the count may be off for it
    area: float = 0.0  # pixels by which the area of all droplets may be off for it


def sort_objects(names: Indices) -> tuple[Indices, list[Note]]:
    """Make every droplet one object and every object a droplet. `names`: (h, w) labels, 0 on the ground. Returns
    (h, w) labels from 1, and what was found."""
    notes: list[Note] = []
    ground = _ground(names)
    if ground:
        notes.append(Note(f"label {ground} lies around the others: it is taken for the ground"))
    objects = scikit_image().measure.label(np.where(names == ground, 0, names), connectivity=2).astype(np.int64)
    pieces = in_pieces(names, objects)
    objects = _joined(_filled(_without_specks(objects, notes), notes), notes)
    torn = in_pieces(names, objects)
    if torn or pieces:
        text = f"{pieces} labels lie in several pieces; of {torn} of them each piece counts as a droplet"
        notes.append(Note(text))
    return objects, notes + _of_another_size(objects)


def part_mask(mask: Mask) -> tuple[Indices, list[Note]]:
    """Pieces of a mask, parted at their necks where several droplets touch. `mask`: (h, w), True in droplets. Returns
    (h, w) labels from 1, and what was found."""
    full = mask | _holes_of_mask(mask)
    pieces, count = ndimage.label(full)
    segments = find_droplets((~full).astype(np.float64))
    if segments is None or not count:
        return pieces.astype(np.int64), []
    pairs, pixels = np.unique(np.stack([pieces[full], segments.cells[full]]), axis=1, return_counts=True)
    held = np.bincount(pairs[0], pixels > LINE**2, minlength=count + 1)
    several = held > 1
    notes = []
    if several.any():
        text = f"{several.sum()} pieces of the mask are parted at necks into {held[several].sum():.0f} droplets"
        notes.append(Note(text, int(np.ceil(PARTED * held[several].sum()))))
    parted = np.where(several[pieces], segments.cells + count + 1, pieces)
    return np.where(full, parted, 0).astype(np.int64), notes


def _holes_of_mask(mask: Mask) -> Mask:
    """(h, w) holes that are no voids between droplets: voids are concave."""
    label, count = ndimage.label(~mask)
    fill = np.zeros(count + 1, dtype=bool)
    for hole in scikit_image().measure.regionprops(label):
        (top, left, low, right), (h, w) = hole.bbox, mask.shape
        if top > 0 and left > 0 and low < h and right < w:
            fill[hole.label] = hole.area <= PEPPER or hole.area >= CONVEX * hole.area_convex
    return np.asarray(fill[label])


def _ground(names: Indices) -> int:
    """Number that is the ground, 0 if that is what it should be."""
    pairs = _beside(names)
    if not len(pairs):
        return 0
    number, count = np.unique(pairs, return_counts=True)
    most, others = int(number[count.argmax()]), len(np.unique(names[names > 0])) - 1
    around = all((side == most).any() for side in (names[0], names[-1], names[:, 0], names[:, -1]))
    return most if others >= LEAST_AROUND and count.max() > AROUND * others and (around or names.all()) else 0


def _beside(names: Indices) -> Indices:
    """(m, 2) numbers that meet, or nearly so."""
    wide = scikit_image().segmentation.expand_labels(names, LINE)
    found = np.sort(wide.ravel()[np.stack(meetings(wide), axis=1)], axis=1)
    return np.unique(found[found[:, 0] > 0], axis=0)


def _radii(objects: Indices) -> tuple[Array, Mask, float]:
    """(n + 1,) radii in pixels, (n + 1,) objects off the edge, and the radius above which half of their area lies."""
    areas = np.bincount(objects.ravel()).astype(np.float64)
    areas[0] = 0.0
    inner = areas > 0
    inner[edge_of(objects)] = False
    radii, order = np.sqrt(areas / np.pi), np.sort(areas)
    return radii, inner, float(np.sqrt(order[np.searchsorted(np.cumsum(order), 0.5 * order.sum())] / np.pi))


def _without_specks(objects: Indices, notes: list[Note]) -> Indices:
    radii, inner, typical = _radii(objects)
    numbers = np.flatnonzero(inner)
    order = numbers[np.argsort(radii[numbers], kind="stable")]
    ratio = np.append(radii[order][1:], typical) / radii[order]
    last = np.flatnonzero((ratio >= GAP) & (radii[order] < min(SPECK * typical, UNRESOLVED)))
    if not len(last):
        return objects
    specks = order[: last[-1] + 1]
    low, high = (round(np.pi * radii[specks[k]] ** 2) for k in (0, -1))
    doubt = int((radii[specks] >= DEBRIS).sum())
    may_be = f"; {doubt} of them may be droplets" if doubt else ""
    notes.append(Note(f"{len(specks)} specks of {low} to {high} pixels are set aside{may_be}", doubt))
    return np.where(np.isin(objects, specks), 0, objects)


def _filled(objects: Indices, notes: list[Note]) -> Indices:
    found, enclosed, holed, area = objects.copy(), 0, 0, 0
    for number, box in enumerate(ndimage.find_objects(objects), 1):
        if box is None:
            continue
        own = found[box] == number
        added = ndimage.binary_fill_holes(own) & ~own
        if added.any():
            other = np.setdiff1d(found[box][added], [0])
            holed, enclosed, area = holed + 1, enclosed + len(other), area + int(added.sum())
            found[box][added] = number
    if holed:
        share = area / max(int((found > 0).sum()), 1)
        text = f"{holed} labels have holes, {share:.2g} of the area of all: they are filled"
        notes.append(Note(text + (f", with {enclosed} labels in them" if enclosed else ""), enclosed))
    return found


def _joined(objects: Indices, notes: list[Note]) -> Indices:
    found, count = objects.copy(), 0
    while True:
        boxes = ndimage.find_objects(found)
        areas = np.bincount(found.ravel(), minlength=len(boxes) + 1)
        depth = distance_inside(np.pad(found, 1).astype(np.uint32))[1:-1, 1:-1]
        inner = np.zeros(len(boxes) + 1)
        np.maximum.at(inner, found.ravel(), depth.ravel())
        own = np.pi * inner**2 / np.maximum(areas, 1)
        pairs = _beside(found)
        odd = (own[pairs].min(axis=1) < ODD_PIECE) & (areas[pairs].sum(axis=1) >= np.pi * UNRESOLVED**2)
        better = []
        for a, b in pairs[odd].tolist() if odd.sum() <= MOST_PIECES else ():
            box, both = _together(found, boxes, a, b)
            together = np.pi * distance_inside(both).max() ** 2 / both.sum()
            if together > ROUNDER * max(own[a], own[b]):
                better.append((together, a, b, box, both))
        if not better:
            break
        used: set[int] = set()
        for _, a, b, box, both in sorted(better, key=lambda part: -part[0]):
            if used.isdisjoint((a, b)):
                used |= {a, b}
                part = both[tuple(slice(LINE + 1, LINE + 1 + side.stop - side.start) for side in box)]
                found[box][part & np.isin(found[box], (0, a, b))] = a
                count += 1
    if count:
        notes.append(Note(f"{count} labels are pieces of others that they make round: they are joined", count))
    return found


def _together(objects: Indices, boxes: list[tuple[slice, slice]], a: int, b: int) -> tuple[tuple[slice, ...], Mask]:
    """Bounding box of two objects, and the two in it, without the line between them and padded by its width and one."""
    sides = zip(boxes[a - 1], boxes[b - 1], strict=True)
    box = tuple(slice(min(p.start, q.start), max(p.stop, q.stop)) for p, q in sides)
    both = np.pad((objects[box] == a) | (objects[box] == b), LINE + 1)
    return box, np.asarray(ndimage.binary_closing(both, np.ones((3, 3)), iterations=LINE // 2 + 1)) | both


def in_pieces(names: Indices, objects: Indices) -> int:
    """Number of labels that lie in several objects."""
    own = np.unique(np.stack([names.ravel(), objects.ravel()])[:, (names > 0).ravel() & (objects > 0).ravel()], axis=1)
    return int((np.unique(own[0], return_counts=True)[1] > 1).sum())


def _of_another_size(objects: Indices) -> list[Note]:
    """Objects off the edge that are so small, beside others, that they may be no droplets."""
    radii, inner, typical = _radii(objects)
    order = np.sort(radii[inner])
    if not len(order):
        return []
    gaps = np.flatnonzero(np.append(order[1:], typical) >= CLASS_GAP * order)
    share = np.cumsum(order**2) / (order**2).sum()
    classes = [int(k) + 1 for k in gaps if order[k] < typical and share[k] < CLASS_SHARE]
    count = int(max((order < SPECK * typical).sum(), *classes, 0))
    if not count:
        return []
    text = f"{count} labels have radii of {order[0]:.1f} to {order[count - 1]:.1f} pixels, half of the area of all lies"
    return [Note(f"{text} in larger ones than {typical:.1f}: they may be no droplets", count)]
