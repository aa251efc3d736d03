"""What a picture shows: droplets one by one, and what they have in common, with a verdict on all of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jamlab.micrographs.picture_voids import PictureVoids
from jamlab.micrographs.size_distribution import SizeDistribution
from jamlab.micrographs.standard_errors import Mean, mean_of, share_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Micrograph:
    """Droplets that a picture shows whole; lengths in units of `pixel`, in pixels if that is None.

    Attributes:
        labels: (h, w) int64, droplet k is k + 1; 0 is the ground, -1 droplets cut by the edge of the picture.
        centres: (n, 2) centres of area, x to the right and y down.
        areas: (n,) with half of each film.
        shape: (n,) shape factors perimeter^2/(4 pi area) of the outlines as seen, rims included: `shape_rim` of
            `jamlab.measure`.
        cells: (n,) areas of the cells; every pixel belongs to one.
        contacts: (n,) int64, droplets that each one touches, rattlers not counted, cut ones counted.
        rattlers: (n,) bool, fewer than three contacts, found recursively; cut droplets count as held.
        rho: packing fraction of all that the picture shows, films included.
        voids: sides, areas and centres of the voids, and P_l.
        sizes: sizes with a verdict: monodisperse, bidisperse, polydisperse.
        cut: number of droplets cut by the edge of the picture or by a label.
        bright: droplets are brighter than the ground.
        blur: standard deviation of the blur, pixels.
        noise: standard deviation of the noise, over the contrast between droplets and ground.
        light: brightest over dimmest light.
        film: widest gap between droplets that counts as a contact, in the unit of length.
        reasons: why the numbers may be wrong; empty if the picture is good.
        pixel: size of a pixel; None leaves all lengths in pixels.
        picture: (h, w) grey values, for drawing.
        outlines: n outlines, (k, 2) each, in pixels of the picture.
        cut_outlines: the same of droplets that are cut.
        touching: (m, 2, 2) centres of droplets in contact, in pixels, for drawing.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.93, step=0.03)
        >>> m = jamlab.micrograph(jamlab.synthetic_micrograph(dense, 256), periodic=True)
        >>> m.unit, m.centres.shape == (m.count, 2)
        ('pixels', True)
        >>> low, high = m.means["z"].interval
        >>> low < m.z < high, m.quality  # eight droplets say little of others
        (True, 'doubtful')
    """

    labels: Indices
    centres: Array
    areas: Array
    shape: Array
    cells: Array
    contacts: Indices
    rattlers: Mask
    rho: float
    voids: PictureVoids
    sizes: SizeDistribution
    cut: int
    bright: bool
    blur: float
    noise: float
    light: float
    film: float
    reasons: tuple[str, ...]
    pixel: float | None
    picture: Array = field(repr=False)
    outlines: tuple[Array, ...] = field(repr=False)
    cut_outlines: tuple[Array, ...] = field(repr=False)
    touching: Array = field(repr=False)

    def __repr__(self) -> str:
        means = self.means
        shown = (("rho", "rho", ".3f"), ("z", "z", ".2f"), ("A", "shape_rim", ".3f"), ("radius", "radius", ".4g"))
        numbers = ", ".join(f"{name} = {means[key].text(form)}" for name, key, form in shown)
        return f"Micrograph({self.count} droplets, {self.cut} cut, {numbers}; {self.sizes}; {self.quality})"

    @property
    def count(self) -> int:
        """Number of droplets that the picture shows whole."""
        return len(self.areas)

    @property
    def quality(self) -> str:
        """Verdict of checks that need no truth, of the picture and of how many droplets it shows; see `reasons`.

        "good", or "doubtful".
        """
        return "doubtful" if self.reasons else "good"

    @property
    def unit(self) -> str:
        """What lengths are measured in: "pixels", or "" for the unit that `pixel` was given in."""
        return "pixels" if self.pixel is None else ""

    @property
    def local_packing_fraction(self) -> Array:
        """(n,) area of each droplet over that of its cell."""
        return np.asarray(self.areas / self.cells)

    @property
    def z(self) -> float:
        """Mean number of contacts of the droplets that do not rattle; nan if all rattle."""
        return self.means["z"].value

    @property
    def means(self) -> dict[str, Mean]:
        """Means of rho, z, shape_rim and radius: `value`, standard `error` over the droplets, 95 % `interval`.

        Names are those of `jamlab.measure`, and `radius` that of a circle of the same area. The error is that of too
        few droplets alone, see `jamlab.micrographs.standard_errors`.
        """
        return {
            "rho": share_of(self.areas, self.cells, self.rho),
            "z": mean_of(self.contacts[~self.rattlers].astype(np.float64)),
            "shape_rim": mean_of(self.shape),
            "radius": mean_of(np.sqrt(self.areas / np.pi)),
        }

    def measure(self) -> dict[str, float]:
        """What a picture shows of the columns of `jamlab.measure`: rho, z, rattlers, shape_rim."""
        return {
            "rho": self.rho,
            "z": self.z,
            "rattlers": float(self.rattlers.sum()),
            "shape_rim": float(self.shape.mean()),
        }

    def table(self) -> pd.DataFrame:
        """A row per droplet: its number in the overlay, place, area, shape, contacts, rattler, cell, verdict."""
        import pandas as pd

        return pd.DataFrame(
            {
                "droplet": np.arange(1, self.count + 1),
                "x": self.centres[:, 0],
                "y": self.centres[:, 1],
                "area": self.areas,
                "radius": np.sqrt(self.areas / np.pi),
                "shape": self.shape,
                "contacts": self.contacts,
                "rattler": self.rattlers,
                "cell": self.cells,
                "local_packing_fraction": self.local_packing_fraction,
                "quality": self.quality,
            }
        )

    def draw(self, path: str | Path) -> None:
        """Write the picture with outlines, numbers, contacts and voids over it, as PNG.

        Raises:
            StorageError: the file cannot be written.
        """
        from jamlab.micrographs.overlay import write_overlay

        write_overlay(self, path)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the same on axes of matplotlib."""
        from jamlab.micrographs.overlay import draw_overlay

        axes: Axes = draw_overlay(self, ax)
        return axes
