"""Droplets that are labelled already, by a segmentation or by another program, made ready to be measured.

A label image holds a whole number for every pixel: 0 is no droplet, equal numbers are one droplet. Cellpose, StarDist,
ilastik, ImageJ and hands write such images. What is labelled is droplet, and its edge is where the label ends.

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

import json
import struct
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.errors import InputError
from jamlab.micrographs.illumination import Darkness
from jamlab.micrographs.picture_files import check_pixels, distance_inside, read_values, scikit_image
from jamlab.micrographs.segmentation import Segments, borders, edge_of, find_droplets, highest, meetings, roundness

ROUGH = 0.5  # pixels by which walls between whole pixels wander into the largest discs
TRIED = 256  # pixels along a side on which a mask and its inverse are compared
FLAT, FEW_REGIONS = 0.5, 4  # share of pixels as those above and beside; regions to a level: of a picture of labels
TWICE = 0.75  # of the smaller of two outlines that the other covers: one droplet
LIKELY_COLOURS = 3  # channels: a picture of labels in colours, as programs draw them for the eye


@dataclass(frozen=True)
class Labelled:
    """Labelled droplets."""

    labels: Indices  # (h, w) int64, from 1 without gaps; 0 is the ground
    areas: Array  # (n,) pixels
    coverage: Array  # (h, w) share of each pixel that is labelled
    pieces: int  # number of labels that lie in several pieces
    light_areas: Array  # (n,) pixels of the light inside walls; `areas` where labels are all that is known
    light_share: float  # of the picture that it covers
    names: Indices  # (n,) number that each had before
    notes: tuple[Note, ...] = ()  # what was found in labels of another program and changed

    @cached_property
    def nearest(self) -> tuple[Array, Indices]:
        """(h, w) distance to the nearest droplet, 0 in one, and (2, h, w) row and column of its pixel there."""
        away, place = ndimage.distance_transform_edt(self.labels == 0, return_indices=True)
        return np.asarray(away), np.asarray(place)


def read_labels(source: str | Path | ArrayLike | Mask, shape: tuple[int, ...] | None) -> Labelled:
    """Read labels: an image of whole numbers, or outlines. `source`: (h, w) whole numbers, or a file: TIFF, PNG or BMP
    of 8, 16 or 32 bit, NPY, or outlines as JSON or as ImageJ's ROI or ZIP. Black and white, with two values, is a mask:
    its pieces, parted where several droplets touch, are droplets; `shape`: of the picture; None if there is none."""
    values, notes = _numbers(source, shape)
    if shape is not None and values.shape != shape:
        raise InputError(f"labels are {values.shape}, the picture is {shape}: give labels of this picture, uncropped")
    if not np.isfinite(values.astype(np.float64)).all() or (values != np.rint(values)).any():
        raise InputError("labels must be whole numbers: these are grey values, or a probability map")
    if values.min() < 0:
        raise InputError(f"the lowest label is {values.min()}: must be 0 (ground) or more")
    kinds = np.unique(values)
    if len(kinds) == 1:
        raise InputError(f"every pixel has the label {kinds[0]:g}: there is no ground, or no droplet")
    if len(kinds) == 2 and not notes:
        values, parted = part_mask(_upright(values == kinds[1]))
        notes = notes + parted
    values, found = sort_objects(values.astype(np.int64))
    return replace(labelled(values), notes=tuple(notes + found))


def looks_labelled(values: NDArray[Any]) -> bool:
    """Whether a picture looks like a mask or like labels: flat, with few regions to a level. `values`: (h, w) or (h, w,
    colours)."""
    values = values if values.dtype.kind in "iub" else np.where(values == np.rint(values), values, np.nan)
    if values.ndim == 3 and values.dtype.kind == "u":
        values = values[..., :3].astype(np.int64) @ np.array([1, 1 << 16, 1 << 32])[: min(values.shape[2], 3)]
    if values.ndim != 2 or not values.size or np.isnan(values.astype(np.float64)).any():
        return False
    levels, levelled = np.unique(values, return_inverse=True)
    if levels.size == 2:  # of floats a drawn picture of black and white
        return values.dtype.kind in "iub"
    alike = (values[1:, 1:] == values[:-1, 1:]) & (values[1:, 1:] == values[1:, :-1])
    if alike.mean() < FLAT:
        return False
    regions = scikit_image().measure.label(levelled.reshape(values.shape) + 1, connectivity=2).max()
    return bool(regions <= FEW_REGIONS * levels.size)


def _upright(mask: Mask) -> Mask:
    """The same mask, refused if what it leaves out is rounder than what it holds."""
    step = max(1, max(mask.shape) // TRIED)
    few = mask[::step, ::step]
    held, left = (roundness(find_droplets(part.astype(np.float64)), False) for part in (~few, few))
    if left > held:
        raise InputError(
            f"the discs in what is 0 fill {left:.0%} of it, those in what is not 0 fill {held:.0%}: give it inverted"
        )
    return mask


def _numbers(source: str | Path | ArrayLike | Mask, shape: tuple[int, ...] | None) -> tuple[NDArray[Any], list[Note]]:
    """(h, w) numbers of a file or an array, and what was found in outlines."""
    read = _read(Path(source), shape) if isinstance(source, str | Path) else np.asarray(source)
    values, notes = read if isinstance(read, tuple) else (read, [])
    if values.ndim == 3:
        if 1 < values.shape[2] < LIKELY_COLOURS or (values[..., :3] != values[..., :1]).any():
            raise InputError(f"labels are colours, {values.shape}: save the label image itself, one number a pixel")
        values = values[..., 0]
    if values.ndim != 2 or not values.size or values.dtype.kind not in "buif":
        raise InputError(f"labels must be (h, w) whole numbers, got {values.shape} of {values.dtype}")
    check_pixels(values.shape)
    return values, notes


def _read(path: Path, shape: tuple[int, ...] | None) -> NDArray[Any] | tuple[NDArray[Any], list[Note]]:
    """Numbers of a file, by its ending; of outlines with what was found in them."""
    ending = path.suffix.lower()
    try:
        if ending == ".npy":
            return np.asarray(np.load(path, allow_pickle=False))
        if ending == ".json":
            return _fill_outlines(json.loads(path.read_text(encoding="utf-8")), shape)
        if ending in (".zip", ".roi"):
            return _fill_outlines(_read_rois(path), shape)
    except InputError:
        raise
    except (OSError, ValueError, TypeError, KeyError, IndexError, EOFError, BadZipFile, struct.error) as error:
        lines = str(error).splitlines() or [type(error).__name__]
        raise InputError(
            f"{path} cannot be read as labels ({lines[0]}): save whole numbers as TIFF, PNG or NPY, or outlines as JSON"
        ) from None
    return read_values(path, numbers=True)


def _read_rois(path: Path) -> list[Array]:
    """Outlines that ImageJ keeps, (k, 2) x and y each."""
    try:
        import roifile
    except ImportError:
        raise InputError("ROI of ImageJ need roifile: install it with pip install 'jamlab[imagej]'") from None
    found = roifile.roiread(path)
    return [np.asarray(roi.coordinates(), dtype=np.float64) for roi in (found if isinstance(found, list) else [found])]


def _fill_outlines(content: Any, shape: tuple[int, ...] | None) -> tuple[Indices, list[Note]]:
    """Labels of outlines: a list of rings of (x, y) in pixels. A pixel in several outlines belongs to the nearest pixel
    that is in one alone; of two outlines of one droplet the first is kept."""
    if not isinstance(content, list):
        raise InputError("outlines must be a list of rings of points (x, y); of GeoJSON give the outer rings")
    if shape is None:
        raise InputError("outlines need their picture beside them, which says how large it is")
    pixels: list[Indices] = []  # of every outline, in the flattened picture
    twice = 0
    labels, covers = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.int64)
    for number, ring in enumerate(content, 1):
        points = np.asarray(ring, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] < 2 or len(points) < 3 or not np.isfinite(points[:, :2]).all():
            raise InputError(f"outline {number} is {points.shape}: must be three or more points (x, y), all finite")
        inside = scikit_image().draw.polygon(points[:, 1], points[:, 0], shape)
        own = np.ravel_multi_index(inside, shape).astype(np.int64)
        others = [pixels[k - 1] for k in np.unique(labels[inside]) if k]
        if any(len(np.intersect1d(own, other)) > TWICE * min(len(own), len(other)) for other in others):
            twice, own = twice + 1, own[:0]
        pixels.append(own)
        covers.flat[own] += 1
        labels.flat[own] = number
    several = covers > 1
    notes = [Note(f"{twice} outlines lie on others: they are left out", twice)] if twice else []
    if several.any():
        share = several.sum() / (covers > 0).sum()
        nearest = ndimage.distance_transform_edt(covers != 1, return_distances=False, return_indices=True)
        labels = np.where(several, labels[tuple(nearest)], labels)
        notes.append(Note(f"outlines overlap on {share:.2g} of their area: it is divided", area=float(several.sum())))
    return labels, notes


def labelled(values: ArrayLike, finer: int = 1, light: Indices | None = None) -> Labelled:
    """Number labels anew, without gaps. `values`: (f h, f w) labels, 0 for the ground; `finer`: f, the number of labels
    to a pixel of the picture, along either side; `light`: (f h, f w) the same of the light inside walls, if known."""
    fine = np.asarray(values).astype(np.int64)
    middle = fine[finer // 2 :: finer, finer // 2 :: finer]
    kept = np.unique(middle[middle > 0])
    fine, middle = (
        np.where(np.isin(part, kept), np.searchsorted(kept, part) + 1, 0).astype(np.int64) for part in (fine, middle)
    )
    h, w = middle.shape
    coverage = (fine > 0).astype(np.float64).reshape(h, finer, w, finer).mean(axis=(1, 3))
    areas = np.bincount(fine.ravel(), minlength=len(kept) + 1)[1:] / finer**2
    pieces = in_pieces(middle, scikit_image().measure.label(middle, connectivity=2))
    if light is None:
        return Labelled(middle, areas, coverage, pieces, areas, float(coverage.mean()), kept)
    inside = np.bincount(light.ravel(), minlength=int(kept[-1]) + 1 if len(kept) else 1)[kept] / finer**2
    return Labelled(middle, areas, coverage, pieces, inside, float((light > 0).mean()), kept)


def label_darkness(found: Labelled) -> Darkness:
    """Labels as a picture without its background, noise or blur: droplets are 0, the ground is 1."""
    dark = 1.0 - found.coverage
    return Darkness(dark, dark, 0.0, 0.0, 1.0, _radius(found.areas, 0.5), 0, 0.0, 1.0)


def label_segments(found: Labelled) -> Segments:
    """Labels as droplets and their cells: a pixel belongs to the nearest label."""
    cells = found.labels[tuple(found.nearest[1])] - 1
    wall = (found.labels == 0) | borders(cells)
    depth = np.minimum(distance_inside(~wall), float(max(wall.shape)))
    inner, middle = highest(depth, cells)
    return Segments(cells, found.labels > 0, inner, middle, _radius(found.areas, 0.5), _radius(found.areas, 0.08))


def _radius(areas: Array, share: float) -> float:
    """Radius of the droplet below which that share of the area of all droplets lies."""
    order = np.sort(areas)
    return float(np.sqrt(order[np.searchsorted(np.cumsum(order), share * order.sum())] / np.pi))


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
