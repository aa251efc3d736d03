"""Droplets that are labelled already, by a segmentation or by another program, made ready to be measured.

A label image holds a whole number for every pixel: 0 is no droplet, equal numbers are one droplet. Cellpose, StarDist,
ilastik, ImageJ and hands write such images. What is labelled is droplet, and its edge is where the label ends.

An object is a connected region of one number. In this order:

1. A number on all four sides of the picture is the ground.
2. Objects off the edge that are far smaller than droplets, and too small to show a shape, are specks: they are set
   aside. Dust, a tenth as large as droplets or less, is no evidence against droplets; larger specks may be droplets.
3. What an object encloses belongs to it: a droplet has no holes, and no droplet lies in another.

Every other object is a droplet. A mask is first parted into droplets by the watershed that parts those of a picture.
What a rule changed is a note, with the number of droplets by which the count may be off for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from jamlab.arrays import Array, ArrayLike, Indices, Mask
from jamlab.errors import InputError
from jamlab.micrographs.illumination import Darkness
from jamlab.micrographs.picture_files import (
    NoDropletsError,
    check_pixels,
    distance_inside,
    read_values,
    scikit_image,
)
from jamlab.micrographs.segmentation import Segments, borders, edge_of, find_droplets


@dataclass(frozen=True)
class Objects:
    """Which objects of a label image are droplets."""

    flat: float = 0.5  # share of pixels that equal those above and beside: fewer, and it is a picture of grey
    few_regions: int = 4  # regions to a level: more, and it is a picture of grey
    speck: float = 0.25  # of the typical radius: larger objects are no specks
    unresolved: float = 4.0  # pixels, radius: nor are those that show a shape
    dust: float = 0.1  # of the typical radius: specks up to this, or
    dust_pixels: float = 2.0  # radius, are no droplets
    parted: float = 0.05  # of the droplets that are parted at necks: necks that are waists, and waists that are necks


OBJECTS = Objects()


def read_labels(source: str | Path | ArrayLike | Mask, shape: tuple[int, ...] | None) -> tuple[Indices, list[Note]]:
    """Read labels. Returns (h, w) labels from 1 without gaps, 0 on the ground, and what was found.

    Args:
        source: (h, w) whole numbers, or a file: TIFF, PNG or BMP of 8, 16 or 32 bit, or NPY. Black and white, with two
            values, is a mask: its pieces, parted where several droplets touch, are droplets.
        shape: of the picture; None if there is none.
    """
    values = _numbers(source)
    if shape is not None and values.shape != shape:
        raise InputError(f"labels have the shape {values.shape}, the picture {shape}: give uncropped labels")
    if not np.isfinite(values.astype(np.float64)).all() or (values != np.rint(values)).any():
        raise InputError("labels must be whole numbers: these are grey values, or a probability map")
    if values.min() < 0:
        raise InputError(f"the lowest label is {values.min()}: must be 0 (background) or more")
    kinds = np.unique(values)
    if kinds.tolist() == [0]:
        raise NoDropletsError("every pixel has the label 0: there is no droplet")
    if len(kinds) == 1:
        raise InputError(f"every pixel has the label {kinds[0]:g}: there is no background, or no droplet")
    if len(kinds) == 2:
        parted, notes = part_mask(values == kinds[1])
        found, more = sort_objects(parted, grounded=False)
        return found, notes + more
    found, notes = sort_objects(values.astype(np.int64))
    if int(kinds[-1]) in LAST:
        text = f"labels end at {kinds[-1]:g}, the largest number of {LAST[int(kinds[-1])]} bit: higher ones may be lost"
        last = tuple(np.setdiff1d(found[values == kinds[-1]], [0]).tolist())
        notes.append(Note(f"{text} or joined; save labels with more bits", np.inf, last))
    return found, notes


def looks_labelled(values: NDArray[Any]) -> bool:
    """Whether a picture looks like a mask or like labels: flat, with few regions to a level. `values`: (h, w) or (h, w,
    colours)."""
    if values.ndim == 3:
        values = values[..., :3] @ np.array([1, 1 << 16, 1 << 32])[: min(values.shape[2], 3)]
    if values.ndim != 2 or not values.size or not (values == np.rint(values)).all():
        return False
    levels, levelled = np.unique(values, return_inverse=True)
    if levels.size == 2:  # of floats a drawn picture of black and white
        return values.dtype.kind in "iub"
    alike = (values[1:, 1:] == values[:-1, 1:]) & (values[1:, 1:] == values[1:, :-1])
    if alike.mean() < OBJECTS.flat:
        return False
    regions = scikit_image().measure.label(levelled.reshape(values.shape) + 1, connectivity=2).max()
    return bool(regions <= OBJECTS.few_regions * levels.size)


def _numbers(source: str | Path | ArrayLike | Mask) -> NDArray[Any]:
    """(h, w) numbers of a file or an array."""
    values = read_values(Path(source), numbers=True) if isinstance(source, str | Path) else np.asarray(source)
    if values.ndim == 3 and values.shape[2] in (3, 4) and (values[..., :3] == values[..., :1]).all():
        values = values[..., 0]
    if values.ndim == 3 and len(values) == 1:
        values = values[0]
    if values.ndim == 3 and values.dtype.kind in "buif" and values.shape[2] not in (3, 4):
        raise InputError(f"labels are a stack of {len(values)} pages, {values.shape}: give one, or track_droplets all")
    if values.ndim != 2 or not values.size or values.dtype.kind not in "buif":
        raise InputError(f"labels must be (h, w) whole numbers, one for each pixel, got {values.shape} {values.dtype}")
    check_pixels(values.shape)
    return values


def labelled_picture(labels: Indices) -> tuple[Darkness, Segments]:
    """Labels (h, w) as a picture without its background, noise or blur, droplets 0 and the ground 1, and as droplets
    with their cells: a pixel belongs to the nearest label."""
    dark, areas = (labels == 0).astype(np.float64), np.bincount(labels.ravel())[1:].astype(np.float64)
    nearest = ndimage.distance_transform_edt(labels == 0, return_distances=False, return_indices=True)
    cells = labels[tuple(nearest)] - 1
    depth = np.minimum(distance_inside((labels > 0) & ~borders(cells)), float(max(dark.shape)))
    names = np.arange(len(areas))
    inner, middle = ndimage.maximum(depth, cells, names), np.array(ndimage.maximum_position(depth, cells, names))
    segments = Segments(cells, labels > 0, inner, middle, _radius(areas))
    return Darkness(dark, dark, 0.0, 0.0, 1.0, 0, 0.0), segments


def _radius(areas: Array) -> float:
    """Radius of the droplet below which half of the area of all droplets lies."""
    order = np.sort(areas)
    return float(np.sqrt(order[np.searchsorted(np.cumsum(order), 0.5 * order.sum())] / np.pi))


LAST = {2**bits - 1: bits for bits in (8, 16, 32)}  # largest numbers of files of labels, and their bits
PIECES = frozenset(("count", "area", "rho", "z", "shape_factor_rim", "voids"))  # numbers that droplets in doubt concern
SIZES = frozenset(("count", "area"))  # that small droplets concern, which hold no others


@dataclass(frozen=True)
class Note:
    """What a rule found in labels."""

    text: str
    doubt: float = 0.0  # droplets by which the count may be off for it; inf: by any number
    droplets: tuple[int, ...] = ()  # numbers of the labels that it concerns
    concerns: frozenset[str] = PIECES  # numbers that may be off for it


def sort_objects(names: Indices, grounded: bool = True) -> tuple[Indices, list[Note]]:
    """Make every droplet one object and every object a droplet.

    Args:
        names: (h, w) labels, 0 on the ground.
        grounded: a label on all sides of the picture is the ground.

    Returns:
        (h, w) labels from 1, and what was found.
    """
    notes: list[Note] = []
    ground = reduce(np.intersect1d, (names[0], names[-1], names[:, 0], names[:, -1])) if grounded else np.zeros(0)
    if ground.any():
        names = _without_ground(names, int(ground[-1]), notes)
    objects = scikit_image().measure.label(names, connectivity=2).astype(np.int64)
    objects, enclosing = _filled(_without_specks(objects, notes), notes)
    both = (names > 0) & (objects > 0)
    own, piece = np.unique(np.stack([names[both], objects[both]]), axis=1)
    number, pieces = np.unique(own, return_counts=True)
    found, forward, _ = scikit_image().segmentation.relabel_sequential(objects)
    if enclosing:
        text = f"{sum(enclosing.values())} labels lie in holes of others, and are joined with them"
        notes.append(Note(text, sum(enclosing.values()), tuple(int(forward[each]) for each in enclosing)))
    if (pieces > 1).any():
        torn = tuple(int(forward[each]) for each in piece[np.isin(own, number[pieces > 1])])
        text = f"{(pieces > 1).sum()} labels lie in several pieces: each piece counts as a droplet"
        notes.append(Note(text, int((pieces - 1).sum()), torn))
    return found.astype(np.int64), notes


def _without_ground(names: Indices, ground: int, notes: list[Note]) -> Indices:
    """Labels without the one on all sides of the picture, which is doubted where 0 is the ground besides."""
    rest = np.where(names == ground, 0, names)
    text = f"label {ground} is on all sides of the picture: it is taken for the ground"
    if not rest.any():
        raise InputError(f"label {ground} is on all sides of the picture, and the only one: show all of the droplets")
    if (names == 0).any():
        size = float((names == ground).sum()) / float(np.median(np.unique(rest[rest > 0], return_counts=True)[1]))
        notes.append(Note(f"{text}, as 0 is", max(size, 1.0)))
    else:
        notes.append(Note(text))
    return rest


def part_mask(mask: Mask) -> tuple[Indices, list[Note]]:
    """Droplets of a mask, parted at their necks where several touch. `mask`: (h, w), True in droplets. Returns (h, w)
    labels from 1, and what was found."""
    pieces, count = ndimage.label(mask)
    segments = find_droplets((~mask).astype(np.float64))
    if segments is None:
        return pieces.astype(np.int64), []
    more = segments.count - count
    doubt = int(np.ceil(OBJECTS.parted * (more + 1)))
    notes = [Note(f"{count} pieces of the mask are parted at necks into {segments.count} droplets", doubt)]
    return np.where(mask, segments.cells + 1, 0), notes if more > 0 else []


def _without_specks(objects: Indices, notes: list[Note]) -> Indices:
    areas = np.bincount(objects.ravel(), minlength=2).astype(np.float64)[1:]
    inner = np.ones(len(areas) + 1, dtype=bool)
    inner[edge_of(objects)] = False
    radii, typical = np.sqrt(areas / np.pi), _radius(areas)
    small = inner[1:] & (radii < min(OBJECTS.speck * typical, OBJECTS.unresolved))
    if not small.any():
        return objects
    low, high = areas[small].min(), areas[small].max()
    text = f"{small.sum()} specks of {low:.0f} to {high:.0f} pixels are set aside"
    seen = int((small & (radii >= max(OBJECTS.dust * typical, OBJECTS.dust_pixels))).sum())
    notes.append(Note(text + (f", {seen} of them large enough to be droplets" if seen else ""), seen, (), SIZES))
    return np.where(np.append(False, small)[objects], 0, objects)


def _filled(objects: Indices, notes: list[Note]) -> tuple[Indices, dict[int, int]]:
    """Objects without holes, and how many others lay in those of each."""
    found, enclosing, holed, area = objects.copy(), {}, 0, 0
    for number, box in enumerate(ndimage.find_objects(objects), 1):
        if box is None:
            continue
        own = found[box] == number
        added = ndimage.binary_fill_holes(own) & ~own
        if added.any():
            if other := len(np.setdiff1d(found[box][added], [0])):
                enclosing[number] = other
            holed, area = holed + 1, area + int(added.sum())
            found[box][added] = number
    if holed:
        share = area / max(int((found > 0).sum()), 1)
        notes.append(Note(f"{holed} labels have holes, {share:.2g} of the area of all: they are filled"))
    return found, enclosing
