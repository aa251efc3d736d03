"""The size of a pixel that a TIFF file states, by OME, by ImageJ, or by the tags of its resolution."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from jamlab.errors import InputError


@dataclass(frozen=True)
class Resolution:
    """Resolutions of files that are those of pictures."""

    unlike: float = 1e-3  # relative difference of width and height, up to which pixels are square
    # pixels to an inch: up to here a resolution is that of screens and printers, not of a picture
    screen: float = 1200.0


RESOLUTION = Resolution()

UNITS = {  # as files write them; "" is no length
    "\u00b5m": "um", "\u03bcm": "um", "\\u00b5m": "um", "micron": "um", "microns": "um", "micrometer": "um",
    "pixel": "", "pixels": "", "inch": "in", "inches": "in", "meter": "m",
}  # fmt: skip
METRES = {"pm": 1e-12, "nm": 1e-9, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}


@dataclass(frozen=True)
class PixelSize:
    """Width and height of a pixel, and their unit of length; without one the unit is empty."""

    width: float
    height: float
    unit: str

    @property
    def square(self) -> bool:
        """Whether pixels are as wide as high."""
        return abs(self.width - self.height) <= RESOLUTION.unlike * max(self.width, self.height)

    def text(self) -> str:
        """The size in words."""
        return f"{self.width:.6g} by {self.height:.6g} {self.unit}".strip()


def stated_size(path: Path | None) -> PixelSize | None:
    """The size of a pixel that a file states; None if it states none that is a length."""
    if path is None or path.suffix.lower() not in (".tif", ".tiff"):
        return None
    try:
        import tifffile  # comes with scikit-image
    except ImportError:
        return None
    try:
        with tifffile.TiffFile(path) as file:
            found = _of_ome(file.ome_metadata) if file.is_ome else None
            return found or _of_tags(file.pages.first.tags, (file.imagej_metadata or {}) if file.is_imagej else None)
    except Exception:  # whatever damaged tags make a library raise: a size of pixels is optional
        return None


def common_size(picture: Path | None, labels: Path | None) -> PixelSize | None:
    """The size of a pixel that a picture, its labels or both state.

    Raises:
        InputError: pixels are not square, or the files differ.
    """
    found = {path.name: size for path in (picture, labels) if path is not None and (size := stated_size(path))}
    for name, size in found.items():
        if not size.square:
            remedy = "resample it to square pixels, or give pixel= or --pixel if the file is wrong"
            raise InputError(f"{name} states pixels of {size.text()}, which are not square: {remedy}")
    known = {name: size for name, size in found.items() if size.unit}
    if len(known) == 2:
        (one, first), (other, second) = known.items()
        ratio = first.width * METRES.get(first.unit, 1.0) / (second.width * METRES.get(second.unit, 1.0))
        if abs(ratio - 1) > RESOLUTION.unlike:
            states = f"{one} states pixels of {first.text()}, {other} of {second.text()}"
            raise InputError(f"{states}: give pixel= or --pixel")
    return next(iter(known.values()), None)


def _of_ome(text: str | None) -> PixelSize | None:
    """The size in the description of OME, whose unit is micrometres where none is named."""
    pixels = next((each for each in ElementTree.fromstring(text or "").iter() if each.tag.endswith("}Pixels")), None)
    if pixels is None or "PhysicalSizeX" not in pixels.attrib:
        return None
    width, height = (float(pixels.attrib.get(f"PhysicalSize{axis}", pixels.attrib["PhysicalSizeX"])) for axis in "XY")
    unit, other = (_unit(pixels.attrib.get(f"PhysicalSize{axis}Unit", "um")) for axis in "XY")
    if unit != other:
        height *= METRES[other] / METRES[unit]
    return _checked(width, height, unit)


def _of_tags(tags: Any, imagej: dict[str, Any] | None) -> PixelSize | None:
    """The size by the tags of resolution, in the unit of ImageJ or of the tags."""
    if "XResolution" not in tags or "YResolution" not in tags:
        return None
    width, height = (float(1 / Fraction(*tags[name].value)) for name in ("XResolution", "YResolution"))
    code = int(tags["ResolutionUnit"].value) if "ResolutionUnit" in tags else 2
    named = {2: "in", 3: "cm"}.get(code, "")
    unit = _unit(str(imagej["unit"])) if imagej is not None and imagej.get("unit") else named
    if unit == "in" and imagej is None and 1 / width <= RESOLUTION.screen:
        unit = ""
    return _checked(width, height, unit)


def _checked(width: float, height: float, unit: str) -> PixelSize | None:
    return PixelSize(width, height, unit) if 0 < width < 1e100 and 0 < height < 1e100 else None


def _unit(text: str) -> str:
    text = text.strip().strip("\x00")
    return UNITS.get(text.lower(), text)
