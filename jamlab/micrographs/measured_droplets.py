"""What a picture shows: droplets one by one, what they have in common, and how far all of it can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.errors import InputError
from jamlab.micrographs.droplet_mechanics import LEAST_RADIUS, LEAST_ROOM, ShapeForces, ShapePressures, shape_forces
from jamlab.micrographs.quality import LEAST_RING, Mean, Number, mean_of, share_of
from jamlab.micrographs.segmentation import borders
from jamlab.packing.short_repr import short_repr
from jamlab.protocols.packing_of_picture import packing_of_picture
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.file_endings import check_ending

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from jamlab.packing.packing import Packing

DPI = 150  # of an overlay
RING_NUMBERS = ("count", "area")  # of rings, that `quality` speaks of
LEAST_VOID = 3.0  # pixels of area: a corner between three walls has as much
LEAST_VOID_SHARE = 1e-3  # of a droplet


@dataclass(frozen=True)
class Micrograph:
    """Droplets that a picture shows whole; lengths in units of `pixel`, in pixels if that is None.

    Attributes:
        labels: (h, w) int64, droplet k is k + 1; 0 is the ground, -1 droplets cut by the edge of the picture.
        centres: (n, 2) centres of area, x to the right and y down.
        areas: (n,) with half of each film; of labels up to their edges, of rings up to the darkest line of their walls.
        interiors: (n,) areas without films; of rings that of the light inside their walls, as hands draw it.
        shape: (n,) shape factors perimeter^2/(4 pi area) of the outlines as seen, rims included: `shape_rim` of
            `jamlab.measure`.
        cells: (n,) areas of the cells; every pixel belongs to one.
        contacts: (n,) int64, droplets that each one touches, rattlers not counted, cut ones counted.
        neighbours: (n,) int64, all droplets that each one touches, rattlers and cut ones too.
        rattlers: (n,) bool, fewer than three contacts, found recursively; cut droplets and `rim` count as held.
        rim: (n,) bool, whole droplets beside open ground at the edge of the picture, where a wall that may hold them is
            not seen; z leaves them out.
        rho: packing fraction of all that the picture shows, films included.
        interior_fraction: share of the picture that interiors cover, cut ones with them.
        voids: sides, areas and centres of the voids, and P_l.
        sizes: mean, spread and kind of the sizes: monodisperse, bidisperse, polydisperse.
        cut: number of droplets cut by the edge of the picture or by a label.
        contrast: how droplets were told from the ground: "bright", "dark", "ring" or "labels".
        blur: standard deviation of the blur, pixels.
        noise: standard deviation of the noise, over the contrast between droplets and ground.
        light: brightest over dimmest light.
        film: widest gap between droplets that counts as a contact, in the unit of length.
        fringe: gap beyond a film that passes for a contact, in the unit of length.
        z_range: lowest and highest z if fringes from 0.7 to 1.4 times as wide pass for contacts, from 0.2 times between
            labels far apart; nan if all rattle.
        numbers: count, area (mean), interior_fraction, rho, z, shape_rim, voids (count), each with `value`, the
            `interval` that holds the true one of this picture, its own `quality` and `reasons`; of rings, count and
            area are those of the light inside `measurable` ones.
        reasons: all of them; empty if every number is good.
        label_notes: what was found in labels of another program, and set aside, filled, joined or parted.
        pixel: size of a pixel; None leaves all lengths in pixels.
        picture: (h, w) grey values, for drawing.
        outlines: n outlines, (k, 2) each, in pixels of the picture.
        cut_outlines: the same of droplets that are cut.
        touching: (m, 2, 2) centres of droplets in contact, in pixels, for drawing.
        beside: n arrays (k,): droplet that each point of an outline touches, cut ones after whole ones; -1 for none.

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
    interiors: Array
    shape: Array
    cells: Array
    contacts: Indices
    neighbours: Indices
    rattlers: Mask
    rim: Mask
    rho: float
    interior_fraction: float
    voids: PictureVoids
    sizes: SizeDistribution
    cut: int
    contrast: str
    blur: float
    noise: float
    light: float
    film: float
    fringe: float
    z_range: tuple[float, float]
    numbers: dict[str, Number]
    reasons: tuple[str, ...]
    label_notes: tuple[str, ...]
    pixel: float | None
    picture: Array = field(repr=False)
    outlines: tuple[Array, ...] = field(repr=False)
    cut_outlines: tuple[Array, ...] = field(repr=False)
    touching: Array = field(repr=False)
    beside: tuple[Indices, ...] = field(repr=False)

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
    def measurable(self) -> Mask:
        """(n,) droplets above the limit of detection: of rings, `interiors` as large as a disc of 4 pixels in radius.

        Smaller ones that are seen are kept, but others are missed: of nine real foams with hand-drawn interiors that
        the search was fitted to, the count is off by 3.4 % (median) in all, and by 0.0 % above the limit. Of other
        pictures all droplets count.
        """
        limit = LEAST_RING * (self.pixel or 1.0) if self.contrast == "ring" else 0.0
        return np.asarray(self.interiors >= np.pi * limit**2)

    @property
    def quality(self) -> str:
        """Result of checks that need no truth: "good" if all `numbers` are, of rings if count and area are.

        Otherwise "doubtful". Which numbers can be trusted is said by each of `numbers`.
        """
        counted = RING_NUMBERS if self.contrast == "ring" else tuple(self.numbers)
        return "doubtful" if any(self.numbers[name].reasons for name in counted) else "good"

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
        """Mean number of contacts of the droplets that do not rattle, off an open edge; nan if all rattle."""
        return self.means["z"].value

    @property
    def z_all(self) -> float:
        """Mean number of droplets that each whole one touches, rattlers too: 2 N_c/N, without walls."""
        return float(self.neighbours.mean())

    @property
    def means(self) -> dict[str, Mean]:
        """Means of rho, z, shape_rim and radius: `value`, standard `error` over the droplets, 95 % `interval`.

        Names are those of `jamlab.measure`, and `radius` that of a circle of the same area. The error is that of too
        few droplets alone, see `Mean`.
        """
        return {
            "rho": share_of(self.areas, self.cells, self.rho),
            "z": mean_of(self.contacts[~self.rattlers & ~self.rim].astype(np.float64)),
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
        """A row per droplet: its number in the overlay, place, area, shape, contacts, rattler, cell, quality."""
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

    @property
    def pressures(self) -> ShapePressures:
        """Pressures of whole droplets above that of the voids, by the curvature of their free walls (Laplace).

        In line tension over length, with standard errors learnt on rendered droplets.

        Raises:
            InputError: droplets or voids are too small, or droplets are known by labels or dark walls, for which no
                error was learnt.
        """
        return self._mechanics[0]

    @property
    def forces(self) -> ShapeForces:
        """Forces of contacts, in line tensions, by the length of flats; `residual` is what is left on each droplet.

        Raises:
            InputError: as for `pressures`.

        Example:
            >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.95, step=0.03)
            >>> m = jamlab.micrograph(jamlab.synthetic_micrograph(dense, 300), periodic=True)
            >>> bool((m.pressures.value > 0).all()), float(np.median(m.forces.residual)) < 0.2
            (True, True)
        """
        return self._mechanics[1]

    @cached_property
    def _mechanics(self) -> tuple[ShapePressures, ShapeForces]:
        scale = self.pixel or 1.0
        radius = float(np.sqrt(np.median(self.areas) / np.pi)) / scale
        if self.contrast not in ("bright", "dark"):
            raise InputError(f"no forces of droplets by {self.contrast}: errors were learnt on bright and dark ones")
        if radius < LEAST_RADIUS:
            raise InputError(f"droplets are {radius:.0f} pixels in radius: forces need {LEAST_RADIUS:.0f} or more")
        if radius * (1 - self.rho) < LEAST_ROOM:
            room = f"radius times 1 - rho is {radius * (1 - self.rho):.1f} pixels"
            raise InputError(f"voids are too small for forces: {room}, {LEAST_ROOM:g} or more are needed")
        gap = self.fringe / scale
        pressures, forces = shape_forces(self.outlines, self.beside, self.centres / scale, gap)
        value, error, length = pressures.value / scale, pressures.error / scale, forces.length * scale
        return ShapePressures(value, error), replace(forces, length=length)

    def packing(self, model: str = "dp", seed: int = 1, **parameters: Any) -> Packing:
        """Take the droplets as a periodic packing at the packing fraction of the picture, at a minimum.

        Whole droplets with their centres and areas make a rectangular patch; where its opposite sides meet, droplets
        relax into places that the picture does not show. Outlines are not kept.

        Args:
            model: "dp", droplets, or "sp", disks in units "k" with lengths in mean diameters.
            seed: of the orientations of polygons.
            parameters: of the droplets, as in `jamlab.to_polygons`.

        Raises:
            InputError: fewer than eight whole droplets.
            ConvergenceError: the packing fraction was not met.

        Example:
            >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.93, step=0.03)
            >>> m = jamlab.micrograph(jamlab.synthetic_micrograph(dense, 256), periodic=True)
            >>> disks = m.packing("sp")
            >>> disks.n == m.count, abs(jamlab.packing_fraction(disks) - m.rho) < 1e-3
            (True, True)
        """
        upward = self.centres * np.array([1.0, -1.0])
        return packing_of_picture(upward, self.areas, self.cells, self.rho, model, seed, **parameters)

    def draw(self, path: str | Path) -> None:
        """Write the picture with outlines, numbers, contacts and voids over it, as PNG.

        Raises:
            StorageError: the file cannot be written.
        """
        from matplotlib.figure import Figure

        from jamlab.micrographs.overlay import overlay_size

        check_ending(path, "png")
        check_target(path)
        figure, buffer = Figure(figsize=overlay_size(self), layout="constrained"), BytesIO()
        self.plot(figure.subplots())
        figure.savefig(buffer, format="png", dpi=DPI)
        with atomic_file(path) as temporary:
            temporary.write_bytes(buffer.getvalue())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the same on axes of matplotlib, by default those of a new figure."""
        from jamlab.micrographs.overlay import draw_overlay, overlay_size
        from jamlab.plotting.axes import axes_for

        with axes_for(ax, {}, overlay_size(self)) as axes:
            draw_overlay(axes, self)
        return axes


@dataclass(frozen=True)
class PictureVoids:
    """Voids that the picture shows whole, one entry each; names as in `jamlab.voids`."""

    sides: Indices  # (m,) int64, l, droplets around the void
    area: Array  # (m,) area, in the unit of length squared
    centroid: Array  # (m, 2) x to the right and y down

    __repr__ = short_repr

    @property
    def probability(self) -> dict[int, float]:
        """P_l: share of the voids with l sides (Boromand et al. fig 8)."""
        kinds, number = np.unique(self.sides, return_counts=True)
        return {int(kind): float(count / len(self.sides)) for kind, count in zip(kinds, number, strict=True)}


def find_voids(void: Indices, cells: Indices, darkness: Array, outside: Mask, radius: float) -> PictureVoids:
    """Measure voids, lengths in pixels. `void`: (h, w) void that a pixel belongs to, -1 in none; `cells`: (h, w)
    droplet that a pixel is nearest to; `darkness`: (h, w), 0 in droplets and 1 on the ground; `outside`: (h, w) pixels
    at and beyond the edge of what the picture shows: voids there are cut; `radius`: typical radius, pixels."""
    count = int(void.max()) + 1
    y, x = np.nonzero(void >= 0)
    label, weight = void[y, x], np.clip(darkness[y, x], 0, None)
    area = np.bincount(label, darkness[y, x], count)
    mass = np.maximum(np.bincount(label, weight, count), 1e-12)
    centre = np.column_stack([np.bincount(label, weight * p, count) / mass for p in (x, y)])
    near = (darkness[y, x] > 0.25) | ndimage.binary_dilation(borders(cells))[y, x]
    width = int(cells.max()) + 1
    rows = np.unique(label[near] * width + cells[y, x][near])
    sides = np.bincount(rows // width, minlength=count)
    cut = np.zeros(count, dtype=bool)
    cut[np.unique(void[outside & (void >= 0)])] = True
    kept = ~cut & (area > max(LEAST_VOID, LEAST_VOID_SHARE * np.pi * radius**2)) & (sides >= 2)
    return PictureVoids(sides[kept].astype(np.int64), area[kept].astype(np.float64), centre[kept])


ONE_SIZE = 0.07  # standard deviation of log radius up to which droplets have one size
TWO_SIZES = 0.86  # of the variance that two groups explain: an even distribution 0.75, a normal one 0.64
LEAST_GROUP = 0.05  # of the droplets in the smaller group
LEAST = 8  # droplets: fewer have no distribution


@dataclass(frozen=True)
class SizeDistribution:
    """Sizes of droplets."""

    kind: str  # "monodisperse", "bidisperse", "polydisperse" or "too few"
    mean: float  # mean radius, in the unit of length
    spread: float  # standard deviation over mean of the radii
    ratio: float  # bidisperse: mean radius of the large over that of the small; else nan
    large: float  # bidisperse: number share of the large ones; else nan
    explained: float  # share of the variance of log radius that the best two groups explain

    __repr__ = short_repr

    def __str__(self) -> str:
        if self.kind == "bidisperse":
            return f"bidisperse, ratio {self.ratio:.2f}, {self.large:.0%} large"
        return f"{self.kind}, spread {self.spread:.0%}" if self.kind != "too few" else "too few droplets"


def size_distribution(areas: Array) -> SizeDistribution:
    """Sort droplets by size. `areas`: (n,) of whole droplets."""
    radii = np.sort(np.sqrt(areas / np.pi))
    mean = float(radii.mean()) if len(radii) else float("nan")
    spread = float(radii.std() / mean) if len(radii) else float("nan")
    nan = float("nan")
    if len(radii) < LEAST:
        return SizeDistribution("too few", mean, spread, nan, nan, nan)
    log = np.log(radii)
    best, cut = 0.0, 1
    for k in range(1, len(log)):
        between = k * (len(log) - k) / len(log) ** 2 * (log[:k].mean() - log[k:].mean()) ** 2
        if between > best:
            best, cut = between, k
    explained = float(best / log.var()) if log.var() > 0 else nan
    if log.std() < ONE_SIZE:
        return SizeDistribution("monodisperse", mean, spread, nan, nan, explained)
    share = 1 - cut / len(log)
    if explained > TWO_SIZES and min(share, 1 - share) >= LEAST_GROUP:
        ratio = float(radii[cut:].mean() / radii[:cut].mean())
        return SizeDistribution("bidisperse", mean, spread, ratio, share, explained)
    return SizeDistribution("polydisperse", mean, spread, nan, nan, explained)
