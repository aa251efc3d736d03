"""Areas and shape factors of single particles."""

from __future__ import annotations

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.packing.packing import Packing

SHAPE_DEFINITION = 1  # version, see jamlab.campaign.versions


def disk_radii(packing: Packing) -> Array:
    """(n,) radii of the disks of an SP packing."""
    if packing.diameters is None:
        raise InputError(f"only disks (model sp) have radii; this packing has model {packing.model}")
    return 0.5 * packing.diameters


@checked
def particle_areas(packing: Packing) -> Array:
    """(n,) area of each particle, overlaps shared between those that overlap; the sum is the area they cover.

    SP: each disk is cut by its power cell. Of two disks each keeps its side of their common chord: half of the overlap
    if they are equal, and close to it if not (Boromand et al. fig 1). Zero for a disk inside others.
    DP: the polygon grown by its rim delta/2; where m particles overlap, each takes 1/m of the overlap.

    Args:
        packing: SP or DP; areas are in the square of its unit of length.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> bool(np.isclose(jamlab.particle_areas(p).sum() / p.area, jamlab.packing_fraction(p)))
        True
    """
    return packing.kind.shares(packing)


@checked
def shape_factors(packing: Packing, rim: bool = False) -> Array:
    """(n,) shape factor perimeter^2/(4 pi area) of each particle; 1 for a circle, more for any other shape.

    SP: outline of the disk cut by its power cell (Boromand et al. fig 1); nan for a disk inside others.
    DP: outline of the bare polygon, without rim. A regular polygon of nv vertices has (nv/pi) tan(pi/nv): 1.0235 for
    12 and 1.0115 for 17, so compare values with those at onset.

    Args:
        packing: SP or DP.
        rim: DP: outline of the polygon grown by its rim instead, for convex polygons of area a and perimeter p

                (p + pi delta)^2 / (4 pi (a + p delta/2 + pi delta^2/4)).

            Overlaps with neighbours are not cut away. SP has no rim: no difference.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> a = jamlab.shape_factors(p)
        >>> a.shape, bool((a >= 1).all())
        ((32,), True)
    """
    area, perimeter = packing.kind.outline(packing, rim)
    factors = np.full(packing.n, np.nan)
    np.divide(perimeter**2, 4 * np.pi * area, out=factors, where=area > 0)
    return factors


@checked
def area_ratios(packing: Packing) -> Array:
    """(n,) area of each particle over its area at rest; 1 minus this is the area deficit.

    SP: the disk cut by its power cell over the whole disk. DP: the bare polygon over its preferred area a0; a free
    droplet is below 1 already, because line tension compresses it (`jamlab.models.droplets.free_polygon_area`).

    Args:
        packing: SP or DP.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> ratio = jamlab.area_ratios(p)
        >>> bool((ratio <= 1).all()), bool(np.allclose(ratio, jamlab.particle_areas(p) / (np.pi / 4 * p.diameters**2)))
        (True, True)
    """
    return np.asarray(packing.kind.bare_areas(packing) / packing.kind.rest_areas(packing))


@checked
def edge_lengths(packing: Packing) -> Array:
    """(n_vertices,) length of every edge of a DP packing: its histogram is the edge-length spectrum.

    Edges have no length at rest: they grow in flat contacts and shrink to nothing at Plateau borders.

    Raises:
        InputError: for an SP packing.

    Example:
        >>> drops = jamlab.jam(model="dp", n=8, seed=1)
        >>> edges = jamlab.edge_lengths(drops)
        >>> len(edges) == len(drops.positions), bool(np.isclose(edges.sum(), drops.perimeters.sum()))
        (True, True)
    """
    return np.asarray(np.hypot(*packing.edges.T))
