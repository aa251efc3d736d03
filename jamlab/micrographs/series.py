"""Series of pictures or of labels: what they may be given as, and the frames in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jamlab.errors import InputError
from jamlab.micrographs.labels import looks_labelled
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.picture_files import read_pages
from jamlab.micrographs.pixel_size import PixelSize, common_size


@dataclass(frozen=True)
class SeriesFrame:
    """One frame of a series, as `micrograph` takes it."""

    picture: Any = None
    labels: Any = None
    size: PixelSize | None = None  # of a pixel, as the file of all frames states it

    @property
    def pixel(self) -> float | None:
        """Size of a pixel that the file of all frames states."""
        return self.size.width if self.size else None

    def named(self, found: Micrograph) -> Micrograph:
        """What was found, with the unit of the file."""
        return replace(found, unit=self.size.unit) if self.size and found.pixel == self.size.width else found


def read_series(source: Any, labels: Any, how: dict[str, Any]) -> list[SeriesFrame]:
    """Frames of a series; pictures that are labels are taken as such, all or none. Arguments as of
    `track_droplets`."""
    if source is None and labels is None:
        raise InputError("give pictures, labels, or both")
    files = [Path(each) if isinstance(each, str | Path) else None for each in (source, labels)]
    size = common_size(*files) if "pixel" not in how else None
    pictures, names = _frames("source", source, False), _frames("labels", labels, True)
    for what, frames in (("source", pictures), ("labels", names)):
        if frames is not None and len(frames) < 2:
            stack = what == "source" and len(frames) == 1 and isinstance(source, str | Path)
            remedy = ". If the file is a stack of labels, give labels=" if stack else ""
            counted = f"{len(frames)} frame{'s' * (len(frames) != 1)}"
            raise InputError(f"{what} has {counted}: tracking needs two or more{remedy}")
    if pictures is not None and any(isinstance(each, Micrograph) for each in pictures):
        return _measured_already(pictures, labels, how)
    if pictures is not None and names is not None and len(pictures) != len(names):
        raise InputError(f"there are {len(pictures)} pictures and {len(names)} labels: give one for each")
    if pictures is not None and names is None and how.get("contrast", "auto") == "auto" and _labelled(pictures):
        pictures, names = None, _frames("source", source, True)
    count = len(pictures if pictures is not None else names or ())
    none = [None] * count
    return [SeriesFrame(a, b, size) for a, b in zip(pictures or none, names or none, strict=True)]


def _frames(what: str, source: Any, numbers: bool) -> list[Any] | None:
    """Frames of a source: each an array, a path or a Micrograph."""
    if source is None:
        return None
    if isinstance(source, str | Path):
        return [*read_pages(Path(source), numbers)]
    if isinstance(source, np.ndarray) and (source.ndim < 3 or (source.ndim == 3 and source.shape[2] in (3, 4))):
        raise InputError(f"{what} is one array {source.shape}: give frames, (t, h, w), or a sequence of pictures")
    if not isinstance(source, np.ndarray | Sequence):
        raise InputError(f"{what} must be a sequence of frames, an array (t, h, w) or a path")
    return [*source]


def _measured_already(frames: list[Any], labels: Any, how: dict[str, Any]) -> list[SeriesFrame]:
    given = [*how, *(("labels",) if labels is not None else ())]
    if given:
        raise InputError(
            f"{', '.join(given)}: frames are Micrographs, which are measured already; give it to micrograph"
        )
    for number, each in enumerate(frames):
        if not isinstance(each, Micrograph):
            raise InputError(f"frame {number} is a {type(each).__name__}, others are Micrographs: give one kind")
    return [SeriesFrame(each) for each in frames]


def _labelled(frames: list[Any]) -> bool:
    """Whether most of the frames that hold anything look like labels or masks."""
    seen = []
    for number, each in enumerate(frames):
        try:
            values = read_pages(Path(each))[0] if isinstance(each, str | Path) else np.asarray(each)
        except (InputError, ValueError) as error:
            raise InputError(f"frame {number}: {error}") from None
        if values.dtype.kind in "buif" and values.ndim in (2, 3) and values.size and np.ptp(values * 1.0) > 0:
            seen.append(looks_labelled(values))
    return bool(seen) and 2 * sum(seen) >= len(seen)
