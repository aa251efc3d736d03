"""Droplets that are labelled already, by a segmentation or by another program, made ready to be measured.

A label image holds a whole number for every pixel: 0 is no droplet, equal numbers are one droplet. Cellpose, StarDist,
ilastik, ImageJ and hands write such images. What is labelled is droplet, and its edge is where the label ends.
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
from jamlab.micrographs.label_objects import Note, in_pieces, part_mask, sort_objects
from jamlab.micrographs.picture_files import check_pixels, distance_inside, read_values, scikit_image
from jamlab.micrographs.segmentation import Segments, borders, find_droplets, highest, roundness

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
