"""Droplets from outlines that were traced or computed elsewhere: closed curves become polygons with rest areas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arguments.choices import Law
from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import checked, finite_array
from jamlab.errors import InputError, SelfCrossingError, warn
from jamlab.geometry.equal_edges import equal_edges
from jamlab.geometry.vertex_contacts import refuse_crossings, vertex_contacts
from jamlab.models.droplets import DROPLETS
from jamlab.packing.outlines import polygon_areas, self_crossings
from jamlab.packing.packing import Packing
from jamlab.protocols.law_arguments import law_given
from jamlab.protocols.random_start import droplet_params
from jamlab.protocols.rest_areas import length_scale, rest_areas_of
from jamlab.storage.verified_file import versions
from jamlab.trajectories.sites import Rings, plane_box


@dataclass(frozen=True)
class Outlines:
    """Which outlines make droplets."""

    near: float = 1e-3  # of l: corners that lie nearer after rims are taken off become one
    digits: int = 9  # of relative sizes from which numbers of vertices follow
    touching: float = 1e-9  # of the width of rims: outlines so near touch
    deep: float = 0.5  # of the width of rims; dense packings of soft rims have 0.6, others 0.9 and more


OUTLINES = Outlines()


@checked
def droplets_from_outlines(
    outlines: Sequence[Any],
    box: ArrayLike,
    *,
    free_areas: ArrayLike | None = None,
    rest_areas: ArrayLike | None = None,
    rims: bool = False,
    vertices: int | Sequence[int] | None = None,
    wrapped: bool = False,
    law: Law | None = None,
) -> Packing:
    """Make droplets of given closed outlines, not relaxed.

    Outlines may have any unit of length and either orientation. The packing has the unit l, the mean root of the rest
    areas a0. Line tension makes a free droplet smaller than a0, so pass either its free area or a0. Relax the packing
    with `jamlab.relax`.

    Args:
        outlines: n arrays (vertices, 2), or polygons of shapely. Repeated successive vertices count
            once, also the first vertex at the end.
        box: (2, 2), rows are the lattice vectors; or two sides of a rectangle.
        free_areas: (n,) area of each free droplet, in the square of the unit of the outlines; a0 follows from it and
            the force law. Default: the areas of the outlines.
        rest_areas: (n,) a0 of each droplet, instead of `free_areas`.
        rims: whether outlines and free areas include the rims, as in pictures. Outlines then shrink by half the width
            delta of the rims. Default: outlines are the polygons.
        vertices: number of vertices, one for all droplets or (n,): edges become equally long at the same area.
            Default: as given, and for `rims` as in `jamlab.droplets_from_disks`.
        wrapped: whether the box may cut outlines. Edges are then the shortest of their periodic images.
        law: parameters of the force law that replace the defaults, in units of eps and l, e.g. {"gamma": 0.3}.

    Returns:
        DP packing in units "eps".

    Warns:
        JamlabWarning: rims of neighbours overlap by more than half their width (possibly `rims` is missing).

    Raises:
        InputError: outlines of too few vertices or with holes, outlines that touch or cross, too few vertices for edges
            of equal length, areas that are not positive, or an unknown parameter.
        SelfCrossingError: an outline that crosses itself.

    Example:
        >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
        >>> p = jamlab.droplets_from_outlines([square, square + 4.0], [8, 8], rest_areas=[4.0, 4.0], law={"ka": 100})
        >>> p.n, p.params["a0"].tolist(), p.box.tolist()
        (2, [1.0, 1.0], [[4.0, 0.0], [0.0, 4.0]])
        >>> finer = jamlab.droplets_from_outlines([square, square + 4.0], [8.0, 8.0], vertices=12)
        >>> np.bincount(finer.particle).tolist()
        [12, 12]
    """
    parameters = law_given(law, DROPLETS.name)
    if free_areas is not None and rest_areas is not None:
        raise InputError("free_areas and rest_areas: give one of them, a0 follows from either")
    own = sorted({"nv_small", "nv_large"} & parameters.keys())
    if own and (vertices is not None or not rims):
        raise InputError(f"{own[0]} = {parameters[own[0]]!r}: outlines or `vertices` say how many; leave it out")
    lattice = plane_box("box", box)
    shapes = _polygons([_ring(m, outline) for m, outline in enumerate(outlines)], lattice, wrapped)
    given = np.array([polygon_areas(shape, np.array([0, len(shape)]))[0] for shape in shapes])
    areas = (
        _areas("rest_areas", rest_areas, given) if rest_areas is not None else _areas("free_areas", free_areas, given)
    )
    kept = vertices is None and not rims
    counts = [len(shape) for shape in shapes] if kept else vertices
    sizes = np.round(np.sqrt(areas / areas.mean()), OUTLINES.digits)  # equal ones have equal numbers of vertices
    nv, params = droplet_params(len(shapes), 0.5, sizes, vertices=counts, **parameters)
    unit, params["a0"] = _unit_and_rest_areas(nv, areas, params, free=rest_areas is None, rims=rims)
    shapes = [shape * unit for shape in shapes]
    if rims:
        shapes = [_drawn_in(m, shape, 0.5 * float(params["delta"])) for m, shape in enumerate(shapes)]
    if not kept:
        many = zip(shapes, nv.tolist(), strict=True)
        shapes = [equal_edges(shape, count, f"outlines[{m}]") for m, (shape, count) in enumerate(many)]
    made = Packing(DROPLETS.name, lattice * unit, np.concatenate(shapes), params, offsets=_offsets(shapes))
    _check_apart(made, rims, wrapped)
    return made.with_state(provenance={"protocol": "from outlines", **versions()})


def _ring(m: int, outline: Any) -> Array:
    """(vertices, 2) an outline without repeated vertices."""
    if getattr(outline, "geom_type", None) is not None:
        outline = _exterior(m, outline)
    if np.ma.is_masked(outline):
        raise InputError(f"outlines[{m}] has masked entries: fill them, or leave these vertices out")
    ring = finite_array(f"outlines[{m}]", outline, (None, 2))
    ring = ring[np.any(ring != np.roll(ring, -1, axis=0), axis=1)]
    if len(ring) < 3:
        raise InputError(f"outlines[{m}] has {len(ring)} vertices: a droplet needs 3 or more")
    return np.asarray(ring)


def _exterior(m: int, shape: Any) -> Array:
    import shapely

    if shape.geom_type not in ("Polygon", "LinearRing"):
        raise InputError(f"outlines[{m}] is a {shape.geom_type}: give polygons of one piece")
    if shape.geom_type == "Polygon" and len(shape.interiors):
        raise InputError(f"outlines[{m}] has a hole: fill it, shapely.Polygon(polygon.exterior), or leave it out")
    return np.asarray(shapely.get_coordinates(shape))


def _offsets(shapes: Sequence[Array]) -> Indices:
    return np.concatenate([[0], np.cumsum([len(shape) for shape in shapes])]).astype(np.int64)


def _polygons(rings: list[Array], box: Array, wrapped: bool) -> list[Array]:
    """Whole outlines, counter-clockwise, which do not cross themselves."""
    if not rings:
        raise InputError("outlines: give one or more")
    offsets = _offsets(rings)
    vertices = Rings(np.arange(offsets[-1]), offsets).polygons(np.concatenate(rings), box, wrapped)
    if len(crossed := self_crossings(vertices, offsets)):
        uncut = "" if wrapped else "; give wrapped=True if the box cuts it"
        raise SelfCrossingError(
            f"outlines[{crossed[0]}] crosses itself or folds back: put its vertices in order around it{uncut}"
        )
    return np.split(vertices, offsets[1:-1])


def _areas(name: str, values: ArrayLike | None, given: Array) -> Array:
    if values is None:
        name, areas = "outlines", given
    else:
        areas = finite_array(name, values, given.shape)
    if (areas <= 0).any():
        m = int(np.argmin(areas))
        raise InputError(
            f"{name}[{m}] has area {areas[m]:.6g}: must be positive; outlines without area need free_areas"
        )
    return areas


def _unit_and_rest_areas(
    nv: Indices, areas: Array, params: dict[str, Any], *, free: bool, rims: bool
) -> tuple[float, Array]:
    """Factor from the unit of the outlines to l, and (n,) rest areas in l^2."""
    if not free:
        unit = 1.0 / float(np.sqrt(areas).mean())
        return unit, areas * unit**2
    unit = length_scale(nv, areas, params, rims=rims)
    return unit, rest_areas_of(nv, areas * unit**2, params, rims=rims)


def _drawn_in(m: int, shape: Array, half: float) -> Array:
    """The polygon whose rim of width `half` ends at an outline."""
    import shapely
    from shapely.geometry.polygon import orient

    inner = shapely.simplify(shapely.buffer(shapely.Polygon(shape), -half, join_style="mitre"), OUTLINES.near)
    if inner.geom_type != "Polygon" or inner.is_empty:
        raise InputError(
            f"outlines[{m}] has no room for one polygon inside rims of width delta = {2 * half:g}: use a smaller "
            "delta, or rims=False"
        )
    return np.asarray(shapely.get_coordinates(orient(inner))[:-1])


def _check_apart(made: Packing, rims: bool, wrapped: bool) -> None:
    """Refuse outlines that cross or touch, which no contact form keeps apart, and warn of rims that overlap deeply."""
    hint = "" if rims else "; give rims=True if the outlines include the rims"
    try:
        refuse_crossings(made)
    except InputError as error:
        cut = "" if wrapped else ", wrapped=True if the box cuts outlines"
        raise InputError(f"{error}{hint or '; separate them'}{cut}") from error
    near, delta = vertex_contacts(made), float(made.params["delta"])
    if not len(near.distance) or (least := near.distance.min()) > OUTLINES.deep * delta:
        return
    k = int(np.argmin(near.distance))
    i, j = sorted((int(made.particle[near.vertex[k]]), int(made.particle[near.tail[k]])))
    if least <= OUTLINES.touching * delta:
        raise InputError(f"outlines of polygons {i} and {j} touch, where their rims have no direction to push{hint}")
    warn(
        f"outlines of polygons {i} and {j} come within {least:.3g} l, and each has a rim of width delta/2 = "
        f"{0.5 * delta:g} l: rims overlap by more than half{hint or ', which relaxes'}"
    )
