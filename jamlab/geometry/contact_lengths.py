"""Contact lengths: the flats along which droplets press on each other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.rims import moved
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE

_QUARTER_SEGMENTS = 32  # of a right angle in arcs around corners: the radius is short by 3e-4 of delta at most


@dataclass(frozen=True)
class ContactLengths:
    """Lengths of outline in contact.

    Attributes:
        pairs: (m, 2) int64, polygons i < j whose outlines come closer than delta.
        length: (m,) mean over both polygons of the length of outline nearer than delta to the other polygon, in units
            of length.
        unit: of length, for labels.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.93, step=0.03)
        >>> bool(jamlab.contact_lengths(dense).length.mean() < dense.perimeters.mean() / 4)
        True
    """

    pairs: NDArray[np.int64]
    length: NDArray[np.float64]
    unit: str = field(default="", repr=False)

    __repr__ = short_repr

    @drawn("Line2D", raises="there are no contacts, ")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the distribution of lengths, as the share that is shorter.

        >>> ax = jamlab.contact_lengths(jamlab.jam(model="dp", n=8, seed=1)).plot()
        """
        if not len(self.length):
            raise InputError("no two droplets touch: there are no lengths to draw")
        plain = {"color": BLUE, "label": f"{len(self.length)} contacts, mean {self.length.mean():.3g}"}
        axes.ecdf(self.length, **merged_line(plain, style))
        label_axes(axes, in_unit("contact length", self.unit), "share that is shorter")
        axes.legend(fontsize=LEGEND)


@checked
def contact_lengths(packing: Packing) -> ContactLengths:
    """Length of outline that each pair of polygons shares.

    The part of a polygon's outline that lies inside the other polygon grown by delta (where the repulsion of Boromand
    et al. eq 8 acts), mean of both sides. Contacts with several periodic images of one polygon are one pair each.

    Args:
        packing: DP.

    Raises:
        InputError: for an SP packing; if outlines of two polygons cross.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.93, step=0.03)
        >>> lengths = jamlab.contact_lengths(dense)
        >>> lengths.pairs.shape == (len(lengths.length), 2), bool((lengths.length > 0).all())
        (True, True)
    """
    outlines, network = packing.outlines(), contacts(packing)
    grown = shapely.buffer(outlines, packing.params["delta"], quad_segs=_QUARTER_SEGMENTS)
    rings, (i, j), move = shapely.get_exterior_ring(outlines), network.pairs.T, network.shift @ packing.box
    sides = [
        shapely.length(shapely.intersection(rings[one], moved(grown[other], step)))
        for one, other, step in ((i, j, move), (j, i, -move))
    ]
    length = 0.5 * (sides[0] + sides[1])
    touching = length > 0
    return ContactLengths(network.pairs[touching], length[touching], packing.unit_names.length)
