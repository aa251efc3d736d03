"""Areas and shape factors of single particles, and lengths of the flats along which droplets press."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.edge_rings import rim_width
from jamlab.geometry.vertex_contacts import named_pairs
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.neighbors import MOST_IMAGES, search_lattice
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE

# version, see jamlab.campaign.tasks; in 1 contact lengths were those of drawn arcs, off by up to 3e-4, in 2 areas of
# droplets, by up to 1e-6
SHAPE_DEFINITION = 3

_OUT = (INTEGERS, INTEGERS, INTEGERS, REALS, REALS)
_contact_lengths = kernel("contact_lengths", INTEGER, INTEGERS, REALS, REALS, REAL, REAL, INTEGER, *_OUT)


@checked
def particle_areas(packing: Packing) -> Array:
    """Return the area of each particle, (n,), with overlaps shared; the sum is the area of the union.

    SP: each disk is cut by its power cell. Two disks are divided by their common chord: each gets half of the overlap
    if they are equal, and about half if not (Boromand et al. fig 1). Zero for a disk inside others.
    DP: the polygon grown by its rim delta/2; where m particles overlap, each takes 1/m of the overlap.
    Flat walls cut particles at their planes.

    Args:
        packing: SP or DP; areas are in the square of its unit of length.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> bool(np.isclose(jamlab.particle_areas(p).sum() / p.area, jamlab.packing_fraction(p)))
        True
    """
    return packing.frame.pull_back(packing.kind.shares(packing.frame.images))


@checked
def shape_factors(packing: Packing, rim: bool = False) -> Array:
    """Return the shape factor perimeter^2/(4 pi area) of each particle, (n,); 1 for a circle, else larger.

    SP: outline of the disk cut by its power cell (Boromand et al. fig 1); nan for a disk inside others.
    DP: outline of the bare polygon, without rim. A regular polygon of nv vertices has (nv/pi) tan(pi/nv): 1.0235 for
    12 and 1.0115 for 17, so compare values with those at onset.

    Args:
        packing: SP or DP.
        rim: DP: outline of the polygon grown by its rim instead, for convex polygons of area a and perimeter p

                (p + pi delta)^2 / (4 pi (a + p delta/2 + pi delta^2/4)).

            Overlaps with neighbours are not cut away. SP has no rim.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> a = jamlab.shape_factors(p)
        >>> a.shape, bool((a >= 1).all())
        ((32,), True)
    """
    area, perimeter = (packing.frame.pull_back(values) for values in packing.kind.outline(packing.frame.images, rim))
    factors = np.full(packing.n, np.nan)
    np.divide(perimeter**2, 4 * np.pi * area, out=factors, where=area > 0)
    return factors


@checked
def relative_areas(packing: Packing) -> Array:
    """Return the area of each particle over its rest area, (n,); 1 minus this is the area deficit.

    SP: the disk cut by its power cell over the whole disk. DP: the bare polygon over its rest area a0; free droplets
        are below 1, because line tension compresses them (`jamlab.models.droplets.free_polygon_area`).

    Args:
        packing: SP or DP.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> ratio = jamlab.relative_areas(p)
        >>> free = np.pi / 4 * p.disk_diameters**2
        >>> bool((ratio <= 1).all()), bool(np.allclose(ratio, jamlab.particle_areas(p) / free))
        (True, True)
    """
    return packing.frame.pull_back(packing.kind.relative_areas(packing.frame.images), np.nan)


@dataclass(frozen=True)
class ContactLengths(Result):
    """Lengths of outline in contact.

    Attributes:
        pairs: (m, 2) int64, polygons i < j whose outlines come closer than delta.
        length: (m,) mean over both polygons of the length of outline nearer than delta to the other polygon, in units
            of length.
        unit: unit of length, for labels.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(8, "dp"), to=0.93, step=0.03)
        >>> bool(jamlab.contact_lengths(dense).length.mean() < dense.polygons.perimeters.mean() / 4)
        True
    """

    _rows = ("pairs", "length")

    pairs: NDArray[np.int64]
    length: NDArray[np.float64]
    unit: str = field(default="", repr=False)

    @drawn("Line2D", raises="there are no contacts, ")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the distribution of lengths, as the share that is shorter.

        >>> ax = jamlab.contact_lengths(jamlab.jam(8, "dp")).plot()
        """
        if not len(self.length):
            raise InputError("no two droplets touch: there are no lengths to draw")
        plain = {"color": BLUE, "label": f"{len(self.length)} contacts, mean {self.length.mean():.3g}"}
        axes.ecdf(self.length, **merged_line(plain, style))
        label_axes(axes, in_unit("contact length", self.unit), "share that is shorter")
        axes.legend(fontsize=LEGEND)


@checked
def contact_lengths(packing: Packing) -> ContactLengths:
    """Compute the contact length of each pair of droplets.

    The contact length is the part of a polygon's outline within delta of the other polygon (where the repulsion of
    Boromand et al. eq 8 acts), averaged over both polygons. Each periodic image counts as a pair.

    Args:
        packing: DP.

    Raises:
        InputError: for an SP packing; if outlines of two polygons cross.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(8, "dp"), to=0.93, step=0.03)
        >>> lengths = jamlab.contact_lengths(dense)
        >>> lengths.pairs.shape == (len(lengths.length), 2), bool((lengths.length > 0).all())
        (True, True)
    """
    contacts(packing)  # refuses outlines that cross
    delta = 2 * rim_width(packing)

    def fill(room: int, search: Array) -> tuple[int, tuple[Any, ...]]:
        i, j = np.empty((2, room), dtype=np.int64)
        shift, part = np.empty((room, 2), dtype=np.int64), np.empty(room)
        places = (packing.polygons.offsets, packing.positions, packing.box)
        found = (i, j, shift, part)
        return _contact_lengths(packing.n, *places, delta, MOST_IMAGES, room, *found, search), found

    i, j, shift, part = search_lattice(fill, 2 * len(packing.positions))
    pairs, pair, _ = named_pairs(i, j, shift)
    length = np.asarray(0.5 * np.bincount(pair, part, len(pairs)), dtype=np.float64)
    return ContactLengths(pairs[:, :2], length, packing.unit_names.length)
