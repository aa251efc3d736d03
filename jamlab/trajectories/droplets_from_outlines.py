"""Droplets from outlines: arrays of vertices, traced or computed elsewhere, become a packing with a force law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.checks import checked, finite_array
from jamlab.errors import InputError
from jamlab.models.models import law_names
from jamlab.packing.outlines import refuse_crossings
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import droplet_params
from jamlab.trajectories.sites import Rings, plane_box


@checked
def from_outlines(
    outlines: Sequence[ArrayLike],
    box: ArrayLike,
    *,
    rest_areas: ArrayLike | None = None,
    wrapped: bool | None = None,
    **parameters: Any,
) -> Packing:
    """Make droplets of outlines, in any unit of length; not relaxed.

    Args:
        outlines: n arrays (vertices, 2), clockwise or not, closed by an edge from the last vertex to the first, which
            may be repeated at the end.
        box: (2, 2), rows are the lattice vectors; or two sides of a rectangle.
        rest_areas: (n,) in the square of that unit; default the areas of the outlines.
        wrapped: True: the box may cut every outline, and its edges are the shortest of their periodic images. False:
            every outline is whole. By default an outline is whole, unless it has room in one cell, the shortest images
            of its edges close, and only with these it does not cross itself or has an area within 20 % of its rest
            area; if that decides nothing, unless an edge of some outline is three times as long as its shortest image.
        parameters: of the force law, values that replace those of `dp.parameters`, in units of eps and l.

    Returns:
        DP packing of the same droplets in units "eps": lengths are divided by l, the mean root of the rest areas.

    Raises:
        InputError: what is no outline, outlines that cross, an unknown parameter.
        SelfCrossingError: an outline that crosses itself.

    Example:
        >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
        >>> p = jamlab.from_outlines([square, square + 4.0], [8.0, 8.0], ka=100.0)
        >>> p.n, p.params["a0"].tolist(), p.box.tolist()
        (2, [1.0, 1.0], [[4.0, 0.0], [0.0, 4.0]])
    """
    shapes = [finite_array(f"outlines[{m}]", outline, (None, 2)) for m, outline in enumerate(outlines)]
    shapes = [shape[:-1] if len(shape) > 3 and (shape[0] == shape[-1]).all() else shape for shape in shapes]
    if not shapes or min(map(len, shapes)) < 3:
        raise InputError("outlines: give one or more, each of three vertices or more")
    names = law_names("dp", "eps")
    if unknown := sorted(parameters.keys() - set(names)):
        raise InputError(f"model dp has no parameter {unknown[0]!r}: use {', '.join(names)}; rest_areas for the sizes")
    lattice = plane_box("box", box)
    counts = np.array([len(shape) for shape in shapes])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    known = None if rest_areas is None else _positive_areas(rest_areas, counts.shape)
    rings, points = Rings(np.arange(offsets[-1]), offsets), np.concatenate(shapes)
    _, vertices = rings.polygons(points, lattice, wrapped, known)
    if known is None:
        known = _positive_areas(
            shapely.area([shapely.Polygon(ring) for ring in np.split(vertices, offsets[1:-1])]), counts.shape
        )
    unit = float(np.sqrt(known).mean())
    _, params = droplet_params(len(shapes), 0.5, np.sqrt(known), vertices=counts, **parameters)
    made = Packing("dp", lattice / unit, vertices / unit, params, offsets=offsets)
    try:
        refuse_crossings(made)
    except InputError as error:
        hint = "" if wrapped else "; give wrapped=True if the box cuts outlines"
        raise InputError(f"{error}{hint}") from error
    return made


def _positive_areas(values: ArrayLike, shape: tuple[int, ...]) -> Array:
    areas = finite_array("rest_areas", values, shape)
    if (areas <= 0).any():
        m = int(np.argmin(areas))
        raise InputError(f"rest_areas[{m}] is {areas[m]:.6g}: must be positive; an outline of no area needs one given")
    return areas
