"""Droplets that are labelled already, by a segmentation or by another program, made ready to be measured.

A label image holds a whole number for every pixel: 0 is no droplet, equal numbers are one droplet. Cellpose, StarDist,
ilastik, ImageJ and hands write such images. What is labelled is droplet, and its edge is where the label ends.

An object is a connected region of one number. In this order:

1. A number on all four sides of the picture is the ground.
2. Objects off the edge that are far smaller than droplets, and too small to show a shape, are specks: they are set
   aside.
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
from jamlab.micrographs.picture_files import check_pixels, distance_inside, read_values, scikit_image
from jamlab.micrographs.segmentation import Segments, borders, edge_of, find_droplets

FLAT, FEW_REGIONS = 0.5, 4  # share of pixels as those above and beside; regions to a level: of a picture of labels


def read_labels(source: str | Path | ArrayLike | Mask, shape: tuple[int, ...] | None) -> tuple[Indices, list[Note]]:
    """Read labels. Returns (h, w) labels from 1 without gaps, 0 on the ground, and what was found.

    Args:
        source: (h, w) whole numbers, or a file: TIFF, PNG or BMP of 8, 16 or 32 bit, or NPY. Black and white, with two
            values, is a mask: its pieces, parted where several droplets touch, are droplets.
        shape: of the picture; None if there is none.
    """
    values = _numbers(source)
    notes: list[Note] = []
    if shape is not None and values.shape != shape:
        raise InputError(f"labels have the shape {values.shape}, the picture {shape}: give uncropped labels")
    if not np.isfinite(values.astype(np.float64)).all() or (values != np.rint(values)).any():
        raise InputError("labels must be whole numbers: these are grey values, or a probability map")
    if values.min() < 0:
        raise InputError(f"the lowest label is {values.min()}: must be 0 (background) or more")
    kinds = np.unique(values)
    if len(kinds) == 1:
        raise InputError(f"every pixel has the label {kinds[0]:g}: there is no background, or no droplet")
    if len(kinds) == 2:
        values, notes = part_mask(values == kinds[1])
    values, found = sort_objects(values.astype(np.int64))
    return values, notes + found


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
    if alike.mean() < FLAT:
        return False
    regions = scikit_image().measure.label(levelled.reshape(values.shape) + 1, connectivity=2).max()
    return bool(regions <= FEW_REGIONS * levels.size)


def _numbers(source: str | Path | ArrayLike | Mask) -> NDArray[Any]:
    """(h, w) numbers of a file or an array."""
    values = read_values(Path(source), numbers=True) if isinstance(source, str | Path) else np.asarray(source)
    if values.ndim == 3 and (values[..., :3] == values[..., :1]).all():
        values = values[..., 0]
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


SPECK = 0.25  # of the typical radius: larger objects are no specks
UNRESOLVED = 4.0  # pixels, radius: nor are those that show a shape
PARTED = 0.1  # of the droplets that are parted at necks: necks that are waists, and waists that are necks


@dataclass(frozen=True)
class Note:
    """What a rule found in labels."""

    text: str
    doubt: int = 0  # droplets by which the count may be off for it


def sort_objects(names: Indices) -> tuple[Indices, list[Note]]:
    """Make every droplet one object and every object a droplet. `names`: (h, w) labels, 0 on the ground. Returns
    (h, w) labels from 1, and what was found."""
    notes: list[Note] = []
    ground = reduce(np.intersect1d, (names[0], names[-1], names[:, 0], names[:, -1]))
    if ground.any():
        notes.append(Note(f"label {ground[-1]} is on all sides of the picture: it is taken for the ground"))
        names = np.where(names == ground[-1], 0, names)
    objects = scikit_image().measure.label(names, connectivity=2).astype(np.int64)
    objects = _filled(_without_specks(objects, notes), notes)
    both = (names > 0) & (objects > 0)
    own, _ = np.unique(np.stack([names[both], objects[both]]), axis=1)
    torn = int((np.unique(own, return_counts=True)[1] > 1).sum())
    if torn:
        notes.append(Note(f"{torn} labels lie in several pieces: each piece counts as a droplet", torn))
    return scikit_image().segmentation.relabel_sequential(objects)[0], notes


def part_mask(mask: Mask) -> tuple[Indices, list[Note]]:
    """Droplets of a mask, parted at their necks where several touch. `mask`: (h, w), True in droplets. Returns (h, w)
    labels from 1, and what was found."""
    pieces, count = ndimage.label(mask)
    segments = find_droplets((~mask).astype(np.float64))
    if segments is None:
        return pieces.astype(np.int64), []
    more = segments.count - count
    doubt = int(np.ceil(PARTED * (more + 1)))
    notes = [Note(f"{count} pieces of the mask are parted at necks into {segments.count} droplets", doubt)]
    return np.where(mask, segments.cells + 1, 0), notes if more > 0 else []


def _without_specks(objects: Indices, notes: list[Note]) -> Indices:
    areas = np.bincount(objects.ravel(), minlength=2).astype(np.float64)[1:]
    inner = np.ones(len(areas) + 1, dtype=bool)
    inner[edge_of(objects)] = False
    radii = np.sqrt(areas / np.pi)
    small = inner[1:] & (radii < min(SPECK * _radius(areas), UNRESOLVED))
    if not small.any():
        return objects
    low, high = areas[small].min(), areas[small].max()
    notes.append(Note(f"{small.sum()} specks of {low:.0f} to {high:.0f} pixels are set aside", int(small.sum())))
    return np.where(np.append(False, small)[objects], 0, objects)


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
