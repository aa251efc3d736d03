"""Droplets from outlines: arrays of vertices, traced or computed elsewhere, become a packing with a force law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from jamlab.checks import checked, finite_array
from jamlab.errors import InputError
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import droplet_params
from jamlab.trajectories.sites import Rings


@checked
def from_outlines(
    outlines: Sequence[ArrayLike], box: ArrayLike, *, rest_areas: ArrayLike | None = None, **parameters: Any
) -> Packing:
    """Make droplets of outlines, in any unit of length; not relaxed.

    Args:
        outlines: n arrays (vertices, 2), clockwise or not, closed by an edge from the last vertex to the first; each
            whole or wrapped into the box, if its edges are shorter than half of it.
        box: (2, 2), rows are the lattice vectors; or two sides of a rectangle.
        rest_areas: (n,) in the square of that unit; default the areas of the outlines.
        parameters: of the force law, values that replace those of `dp.parameters`, in units of eps and l.

    Returns:
        DP packing of the same droplets in units "eps": lengths are divided by l, the mean root of the rest areas.

    Raises:
        InputError: what is no outline, outlines that cross, an unknown parameter.

    Example:
        >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
        >>> p = jamlab.from_outlines([square, square + 4.0], [8.0, 8.0], ka=100.0)
        >>> p.n, p.params["a0"].tolist(), p.box.tolist()
        (2, [1.0, 1.0], [[4.0, 0.0], [0.0, 4.0]])
    """
    shapes = [finite_array(f"outlines[{m}]", outline, (None, 2)) for m, outline in enumerate(outlines)]
    if not shapes or min(map(len, shapes)) < 3:
        raise InputError("outlines: give one or more, each of three vertices or more")
    sides = np.asarray(box, dtype=np.float64)
    lattice = finite_array("box", np.diag(sides) if sides.ndim == 1 else sides, (2, 2))
    counts = np.array([len(shape) for shape in shapes])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    _, vertices = Rings(np.arange(offsets[-1]), offsets).polygons(np.concatenate(shapes), lattice, wrapped=True)
    if rest_areas is None:
        rest_areas = shapely.area([shapely.Polygon(ring) for ring in np.split(vertices, offsets[1:-1])])
    areas = finite_array("rest_areas", rest_areas, counts.shape)
    if (areas <= 0).any():
        m = int(np.argmin(areas))
        raise InputError(f"rest_areas[{m}] is {areas[m]:.6g}: must be positive; an outline of no area needs one given")
    unit = float(np.sqrt(areas).mean())
    _, params = droplet_params(len(shapes), 0.5, np.sqrt(areas), vertices=counts, **parameters)
    return Packing("dp", lattice / unit, vertices / unit, params, offsets=offsets)
