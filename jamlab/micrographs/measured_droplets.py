"""What a picture shows: droplets one by one, what they have in common, and how far all of it can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.arguments.choices import Law, ModelName
from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.packing_of_picture import packing_of_picture
from jamlab.micrographs.picture_numbers import Number, PictureVoids
from jamlab.packing.result import Result
from jamlab.plotting.palette import BLUE, ORANGE, OTHER, OUTLINE, RATTLER, SIDE_COLOURS, side_names
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.formats import check_ending

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from jamlab.packing.packing import Packing


@dataclass(frozen=True)
class Overlay:
    """How numbers are drawn over a picture."""

    dpi: int = 150  # of an overlay
    inches: float = 9.0  # longer side of the picture in an overlay
    font: tuple[float, float] = (3.0, 11.0)  # points: smaller numbers of droplets are left out, none is larger


OVERLAY = Overlay()


@dataclass(frozen=True)
class Micrograph(Result):
    """Whole droplets of a picture; lengths are in units of `pixel`, or in pixels without it.

    Attributes:
        labels: (h, w) int64, droplet k is k + 1; 0 is the ground, -1 droplets cut by the edge of the picture.
        centres: (n, 2) centres of area, x to the right and y down.
        areas: (n,) including half of each film; for labels the labelled area.
        shape_factor: (n,) perimeter^2/(4 pi area) of the outlines as seen, rims included: `shape_factor_rim` of
            `jamlab.measure`.
        cells: (n,) areas of the cells; every pixel belongs to one.
        contacts: (n,) int64, number of contacts, cut droplets included, rattlers excluded.
        neighbours: (n,) int64, number of all contacts, rattlers and cut droplets included.
        rattlers: (n,) bool, fewer than three contacts, found recursively; cut droplets are never rattlers.
        doubtful: (n,) bool, objects that may be no droplet, several droplets or a part of one, or are poorly visible.
        voids: sides, areas and centres of the voids, and P_l.
        cut: number of droplets cut by the edge of the picture or by a label.
        contrast: "bright" or "dark" droplets, or "labels".
        blur: standard deviation of the blur, pixels.
        noise: standard deviation of the noise, over the contrast between droplets and ground.
        light: brightest over dimmest light.
        film: widest gap between droplets that counts as a contact, in the unit of length.
        numbers: count, area (mean), rho, z, shape_factor_rim, voids (count), each with `value`, standard `error` over
            the droplets, `bound` of the systematic error, 95 % `interval` of both, its own `quality` and
            `reasons`; the names are those of `jamlab.measure`.
        reasons: the reasons of all numbers; empty if every number is good.
        label_notes: changes to labels of another program (removed, filled, joined or split), and causes of wide
            intervals.
        pixel: size of a pixel; None leaves all lengths in pixels.
        unit: unit of lengths: "pixels", or the unit that a TIFF file states, such as "um"; "" if `pixel` was given.
        picture: (h, w) grey values, for drawing.
        outlines: n outlines, (k, 2) each, in pixels of the picture.
        cut_outlines: outlines of cut droplets.
        touching: (m, 2, 2) centres of droplets in contact, in pixels, for drawing.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(8, "dp"), to=0.93, step=0.03)
        >>> m = jamlab.micrograph(np.tile(jamlab.synthetic_micrograph(dense, 256), (2, 2)))  # four periods
        >>> low, high = m.numbers["z"].interval
        >>> low < m.z < high, m.quality
        (True, 'good')
    """

    _rows = ("centres", "areas", "cells", "rattlers", "doubtful")
    _apart = ("labels", "picture", "touching", "neighbours")

    labels: Indices
    centres: Array
    areas: Array
    shape_factor: Array
    cells: Array
    contacts: Indices
    neighbours: Indices
    rattlers: Mask
    doubtful: Mask
    voids: PictureVoids
    cut: int
    contrast: str
    blur: float
    noise: float
    light: float
    film: float
    numbers: dict[str, Number]
    reasons: tuple[str, ...]
    label_notes: tuple[str, ...]
    pixel: float | None
    unit: str
    picture: Array = field(repr=False)
    outlines: tuple[Array, ...] = field(repr=False)
    cut_outlines: tuple[Array, ...] = field(repr=False)
    touching: Array = field(repr=False)

    def __repr__(self) -> str:
        shown = (("rho", "rho", ".3f"), ("z", "z", ".2f"), ("𝒜", "shape_factor_rim", ".3f"))
        numbers = ", ".join(f"{name} = {self.numbers[key].text(form)}" for name, key, form in shown)
        return f"Micrograph({self.count} droplets, {self.cut} cut, {numbers}; {self.quality})"

    def __len__(self) -> int:
        return self.count

    @property
    def count(self) -> int:
        """Number of whole droplets."""
        return len(self.areas)

    @property
    def quality(self) -> str:
        """Reliability: "good" if all `numbers` are good, otherwise "doubtful"."""
        return "doubtful" if any(number.reasons for number in self.numbers.values()) else "good"

    @property
    def rho(self) -> float:
        """Packing fraction of the whole picture, films included."""
        return self.numbers["rho"].value

    @property
    def z(self) -> float:
        """Mean number of contacts of whole droplets that are not rattlers; nan if all are rattlers."""
        return self.numbers["z"].value

    @property
    def z_all(self) -> float:
        """Mean number of contacts of whole droplets, rattlers included: 2 N_c/N, without walls."""
        return float(self.neighbours.mean())

    def table(self) -> pd.DataFrame:
        """A row per droplet: its number in the overlay, place, area, shape, contacts, rattler, cell, and quality, which
        is its own verdict. `.attrs` has the unit of length."""
        import pandas as pd

        table = pd.DataFrame(
            {
                "droplet": np.arange(1, self.count + 1),
                "x": self.centres[:, 0],
                "y": self.centres[:, 1],
                "area": self.areas,
                "radius": np.sqrt(self.areas / np.pi),
                "shape_factor": self.shape_factor,
                "contacts": self.contacts,
                "rattler": self.rattlers,
                "cell": self.cells,
                "local_packing_fraction": self.areas / self.cells,
                "quality": np.where(self.doubtful, "doubtful", "good"),
            }
        )
        table.attrs = {"unit": self.unit, "quality": self.quality}
        return table

    def _columns(self) -> dict[str, Any]:
        table = self.table()
        return {str(name): table[name].to_numpy() for name in table}

    def packing(self, model: ModelName = "dp", seed: int = 1, law: Law | None = None) -> Packing:
        """Make a relaxed periodic packing of the droplets, at the packing fraction of the picture.

        Whole droplets with their centres and areas form a rectangular patch. Neighbours across its periodic boundary
        differ from the picture. Outlines are not kept; `jamlab.droplets_from_outlines` keeps them.

        Args:
            model: name of the model: droplets, or disks in units "k" with lengths in mean diameters.
            seed: of the orientations of polygons.
            law: of the droplets, as in `jamlab.droplets_from_disks`.

        Raises:
            InputError: fewer than eight whole droplets.
            ConvergenceError: the packing fraction was not met.

        Example:
            >>> *_, dense = jamlab.compress(jamlab.jam(8, "dp"), to=0.93, step=0.03)
            >>> m = jamlab.micrograph(np.tile(jamlab.synthetic_micrograph(dense, 256), (2, 2)))  # four periods
            >>> disks = m.packing("sp")
            >>> disks.n == m.count, abs(jamlab.packing_fraction(disks) - m.rho) < 1e-3
            (True, True)
        """
        upward = self.centres * np.array([1.0, -1.0])
        return packing_of_picture(upward, self.areas, self.cells, self.rho, model, seed, law)

    def draw(self, path: str | Path) -> None:
        """Write the picture with outlines, numbers, contacts and voids as a PNG file.

        Raises:
            StorageError: the file cannot be written.
        """
        from matplotlib.figure import Figure

        from jamlab.plotting.axes import show_whole

        check_ending(path, "png")
        check_target(path)
        figure = Figure(figsize=self._inches, layout="constrained", dpi=OVERLAY.dpi)
        self._draw(figure.subplots())
        show_whole(figure)
        with atomic_file(path) as temporary:
            figure.savefig(temporary, format="png", dpi=OVERLAY.dpi)

    @property
    def _inches(self) -> tuple[float, float]:
        height, width = self.picture.shape
        scale = OVERLAY.inches / max(height, width)
        return width * scale + 0.2, height * scale + 1.0

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the same on matplotlib Axes (default: a new figure); `style` is of the LineCollection of outlines."""
        from jamlab.plotting.axes import axes_for, fit_title

        with axes_for(ax, style, self._inches) as axes:
            self._draw(axes, **style)
            if ax is not None:
                fit_title(axes)
        return axes

    def _draw(self, axes: Any, **style: Any) -> None:
        from matplotlib.collections import LineCollection
        from matplotlib.lines import Line2D
        from matplotlib.patheffects import withStroke

        from jamlab.plotting.axes import legend_below, merged

        (height, width), pixel, sides = self.picture.shape, self.pixel or 1.0, self.voids.sides.tolist()
        radius = float(np.sqrt(np.median(self.areas) / np.pi)) / pixel
        room = axes.get_window_extent()
        points = 72 / axes.figure.dpi * radius * min(room.width / width, room.height / height)  # of a droplet as drawn
        extent = (-0.5, width - 0.5, height - 0.5, -0.5)
        axes.imshow(self.picture, cmap="gray", vmin=-0.15, extent=extent, alpha=0.85)
        for rings, colours, line in (
            (self.outlines, [RATTLER if loose else ORANGE for loose in self.rattlers], 1.4),
            (self.cut_outlines, OUTLINE, 1.0),
        ):
            closed = [np.vstack([ring, ring[:1]]) for ring in rings]
            plain = {"edgecolor": colours, "linewidth": min(line, 0.12 * points)}
            axes.add_collection(LineCollection(closed, **merged(LineCollection, plain, style)))
        axes.add_collection(LineCollection([*self.touching], colors=BLUE, linewidths=min(1.1, 0.1 * points), alpha=0.8))
        size = min(0.55 * points, OVERLAY.font[1])
        halo = [withStroke(linewidth=0.25 * size, foreground="white")]
        for number, (x, y) in enumerate(self.centres / pixel if size >= OVERLAY.font[0] else (), 1):
            axes.text(x, y, str(number), ha="center", va="center", fontsize=size, color="black", path_effects=halo)
        look: dict[str, Any] = {"edgecolors": "black", "linewidths": 0.4, "zorder": 3}
        look |= {"c": [SIDE_COLOURS.get(count, OTHER) for count in sides], "s": np.clip(0.3 * points, 1.5, 7.0) ** 2}
        axes.scatter(*self.voids.centroid.T / pixel, **look)
        axes.set(xlim=extent[:2], ylim=extent[2:], xticks=[], yticks=[])
        parts = (("ρ", "rho", ".3f"), ("z", "z", ".2f"), (r"$\mathcal{A}$", "shape_factor_rim", ".3f"))
        means = ", ".join(f"{sign} = {self.numbers[name].text(form)}" for sign, name, form in parts)
        why = f" ({len(self.reasons)} reason{'s'[: len(self.reasons) > 1]})" if self.reasons else ""
        axes.set_title(f"{self.count} droplets; quality: {self.quality}{why}\n{means}", fontsize=11)
        shown = {"droplet": ORANGE, "contact": BLUE} | ({"rattler": RATTLER} if self.rattlers.any() else {})
        shown |= {"cut, not counted": OUTLINE} if self.cut_outlines else {}
        handles = [Line2D([], [], color=colour, label=label) for label, colour in shown.items()]
        look = {"marker": "o", "linestyle": "none", "markeredgecolor": "black", "markersize": 6}
        for colour, name in side_names(sides).items():
            label = f"void, {name}{' sides' * name.isdigit()}"
            handles.append(Line2D([], [], color=colour, label=label, **look))
        legend_below(axes, handles, frameon=False)
