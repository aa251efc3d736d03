"""Droplets that are labelled already, by a segmentation or by another program, made ready to be measured.

A label image holds a whole number for every pixel: 0 is no droplet, equal numbers are one droplet. Cellpose, StarDist,
ilastik, ImageJ and hands write such images. What is labelled is droplet, and its edge is where the label ends.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
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
from jamlab.micrographs.segmentation import Segments, borders, highest

ROUGH = 0.5  # pixels by which walls between whole pixels wander into the largest discs
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

    @cached_property
    def nearest(self) -> tuple[Array, Indices]:
        """(h, w) distance to the nearest droplet, 0 in one, and (2, h, w) row and column of its pixel there."""
        away, place = ndimage.distance_transform_edt(self.labels == 0, return_indices=True)
        return np.asarray(away), np.asarray(place)


def read_labels(source: str | Path | ArrayLike | Mask, shape: tuple[int, ...] | None) -> Labelled:
    """Read labels: an image of whole numbers, or outlines. `source`: (h, w) whole numbers, or a file: TIFF, PNG or BMP
    of 8, 16 or 32 bit, NPY, or outlines as JSON or as ImageJ's ROI or ZIP. Black and white, with two values, is a mask:
    its separate pieces are the droplets; `shape`: of the picture; None if there is none."""
    values = _numbers(source, shape)
    if shape is not None and values.shape != shape:
        raise InputError(f"labels are {values.shape}, the picture is {shape}: give labels of this picture, uncropped")
    if not np.isfinite(values.astype(np.float64)).all() or (values != np.rint(values)).any():
        raise InputError("labels must be whole numbers: these are grey values, or a probability map")
    if values.min() < 0:
        raise InputError(f"the lowest label is {values.min()}: must be 0 (ground) or more")
    kinds = np.unique(values)
    if len(kinds) == 1:
        raise InputError(f"every pixel has the label {kinds[0]:g}: there is no ground, or no droplet")
    if len(kinds) == 2 and kinds[0] == 0:
        found, count = ndimage.label(values > 0)
        around = set.intersection(*(set(side[side > 0]) for side in (found[0], found[-1], found[:, 0], found[:, -1])))
        if around and ndimage.label(values == 0)[1] > count:
            raise InputError("what is not 0 in the mask lies around what is 0: give it inverted")
        return labelled(found)
    return labelled(values)


def _numbers(source: str | Path | ArrayLike | Mask, shape: tuple[int, ...] | None) -> NDArray[Any]:
    """(h, w) numbers of a file or an array."""
    values = _read(Path(source), shape) if isinstance(source, str | Path) else np.asarray(source)
    if values.ndim == 3:
        if 1 < values.shape[2] < LIKELY_COLOURS or (values[..., :3] != values[..., :1]).any():
            raise InputError(f"labels are colours, {values.shape}: save the label image itself, one number a pixel")
        values = values[..., 0]
    if values.ndim != 2 or not values.size or values.dtype.kind not in "buif":
        raise InputError(f"labels must be (h, w) whole numbers, got {values.shape} of {values.dtype}")
    check_pixels(values.shape)
    return values


def _read(path: Path, shape: tuple[int, ...] | None) -> NDArray[Any]:
    """Numbers of a file, by its ending."""
    ending = path.suffix.lower()
    try:
        if ending == ".npy":
            return np.asarray(np.load(path, allow_pickle=False))
        if ending == ".json":
            return _fill_outlines(json.loads(path.read_text(encoding="utf-8")), shape)
        if ending in (".zip", ".roi"):
            return _fill_outlines(_read_rois(path), shape)
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


def _fill_outlines(content: Any, shape: tuple[int, ...] | None) -> Indices:
    """Labels of outlines: a list of rings of (x, y) in pixels, or GeoJSON polygons."""
    if shape is None:
        raise InputError("outlines need their picture beside them, which says how large it is")
    if isinstance(content, dict):
        shapes = [part.get("geometry", part) for part in content["features"]]
        content = [part["coordinates"][0] for part in shapes]
    labels = np.zeros(shape, dtype=np.int64)
    for number, ring in enumerate(content, 1):
        x, y = np.asarray(ring, dtype=np.float64).T[:2]
        labels[scikit_image().draw.polygon(y, x, shape)] = number
    return labels


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
    pieces = 0
    for number, box in enumerate(ndimage.find_objects(middle), 1):
        if box is not None:
            pieces += ndimage.label(middle[box] == number, np.ones((3, 3)))[1] > 1
    if light is None:
        return Labelled(middle, areas, coverage, int(pieces), areas, float(coverage.mean()), kept)
    inside = np.bincount(light.ravel(), minlength=int(kept[-1]) + 1 if len(kept) else 1)[kept] / finer**2
    return Labelled(middle, areas, coverage, int(pieces), inside, float((light > 0).mean()), kept)


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
