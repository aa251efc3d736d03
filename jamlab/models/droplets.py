"""Deformable droplets: the model "dp", polygons of line tension and area elasticity that repel by their rims.

A droplet that nothing touches is a regular polygon: Boromand et al. eq 7 without neighbours, E(a) = gamma p(a) + (ka/2)
(a - a0)^2, and among polygons of nv vertices the regular one has the least perimeter, p = sqrt(4 c a) with c = nv
tan(pi/nv).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, ArrayLike, Indices, Mask
from jamlab.checks import check_positive, finite_array
from jamlab.errors import EngineError, InputError, SelfCrossingError, typed
from jamlab.geometry.contact_network import ContactForces, per_length
from jamlab.geometry.droplet_cover import droplet_cover, shared_areas
from jamlab.geometry.packing_fraction import cover_by_droplets
from jamlab.geometry.vertex_contacts import name_pairs, refuse_crossings, vertex_contacts
from jamlab.geometry.voids.boundary_loops import Boundary, trace_polygons
from jamlab.installed_files import installed_file
from jamlab.laws.laws import declared, law_class
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.parameter import WIDEST, Parameter
from jamlab.laws.rim import CONTACT_FORMS, WIDEST_RIM
from jamlab.outline_laws.outline_law import PolygonRings, laws_that_act, outline_parameters, require_fixes, rest_shape
from jamlab.packing.derived import per_packing
from jamlab.packing.magnitudes import check_magnitudes
from jamlab.packing.model import Model, UnitNames
from jamlab.packing.neighbors import Pairs, shortest_images
from jamlab.packing.outlines import cross, polygon_areas, self_crossings
from jamlab.packing.packing import Packing
from jamlab.packing.terms import (
    ContactJacobian,
    SparseRows,
    Terms,
    area_terms,
    central_terms,
    edge_contact_terms,
    tension_terms,
)


@dataclass(frozen=True)
class DropletRounding:
    """What differs by rounding alone."""

    same: float = 1e-7  # directions and levers of one contact, seen from both sides, in mean sizes
    # relative: an edge as long as its way to another image of its end, but for rounding, is refused too
    at_half: float = 1e-9


ROUNDING = DropletRounding()

_BODY = {
    "gamma": Parameter(energy=1, length=-1, may_vanish=True, made=(1 / WIDEST, WIDEST), meaning="line tension"),
    "ka": Parameter(energy=1, length=-4, made=(1 / WIDEST, WIDEST), meaning="stiffness of areas"),
}
_SHAPE = {
    "eta": Parameter(
        length=1,
        may_vanish=True,
        made=(1 / WIDEST, WIDEST_RIM),
        meaning="length below which the energy of an edge is rounded",
    ),
    "contact": Parameter(choices=CONTACT_FORMS, meaning="what touches: outlines, or edges one by one"),
    "a0": Parameter(length=2, each=True, meaning="rest areas"),
}


class Droplets(Model[Packing]):
    """See `Model`."""

    name: ClassVar[Literal["dp"]] = "dp"
    particles = "droplets"
    words = ("droplets", "polygons")
    sites = None
    has_outlines = True
    meets_flat_walls = True
    needs_prestress = True
    law_columns = ("gamma", "ka", "delta", "eps", "nv_small")
    carrier = "outlines"
    size_name = "rest area"
    size_label = "√a₀"
    unit_names: ClassVar[Mapping[str, UnitNames]] = {"eps": UnitNames("l", "ε/l", "ε/l²")}
    atom_style = "molecular"
    size_column = "a0"
    sizes_by_atom = True
    unit_meanings: ClassVar[Mapping[str, str]] = {"eps": "ε: energy of a contact, l: mean of √a₀ over the two sizes"}
    corrects_flow = True
    points = staticmethod(vertex_contacts)
    fraction_methods: ClassVar[Mapping[str, Callable[[Packing], float]]] = {
        "exact": cover_by_droplets,
        "nominal": lambda packing: packing.phi,
    }

    # state ------------------------------------------------------------------------------------------------------------

    def parameters(self, units: str | None, params: Mapping[str, Any]) -> Mapping[str, Parameter]:
        return {**_BODY, **declared(params, between="rims"), **_SHAPE, **outline_parameters()}

    def checked(self, packing: Packing) -> dict[str, Any]:
        if packing.diameters is not None:
            raise InputError("diameters belong to model sp, not to dp")
        offsets = np.asarray(packing.offsets if packing.offsets is not None else [])
        if offsets.size and not np.issubdtype(offsets.dtype, np.integer):
            raise InputError(f"offsets must be whole numbers, one per polygon and one more; got {packing.offsets!r}")
        offsets, sites = offsets.astype(np.int64), len(packing.positions)
        if offsets.ndim != 1 or len(offsets) < 2 or offsets[0] != 0 or offsets[-1] != sites:
            raise InputError(f"offsets must run from 0 to the number of vertices, {sites}; got {offsets}")
        vertices = np.diff(offsets)
        a0 = finite_array("params['a0']", packing.params["a0"], (len(vertices),))
        flat = a0 == 0  # walls
        check_positive("params['a0']", np.where(flat, 1.0, a0))
        if vertices[~flat].min(initial=3) < 3:
            few = int(np.argmax(~flat & (vertices < 3)))
            raise InputError(f"polygon {few} has {vertices[few]} vertices, needs at least 3")
        check_magnitudes(packing.box, packing.positions, np.append(np.sqrt(a0[~flat]), packing.params["delta"]))
        law_class(packing.params, "rims").of(packing.params, packing.units)
        _check_outlines(packing.positions, offsets, polygon_areas(packing.positions, offsets), flat)
        return {"offsets": offsets, "params": {**packing.params, "a0": a0}}

    def check_moved(self, packing: Packing) -> None:
        polygons = packing.polygons
        _check_outlines(polygons.positions, polygons.offsets, polygons.areas, packing.flat_walls)

    def centroids(self, packing: Packing) -> Array:
        first = packing.positions[packing.polygons.offsets[:-1]]
        r = packing.positions - first[packing.particle]
        s = r[packing.polygons.successor]
        moment = np.add.reduceat((r + s) * cross(r, s)[:, None], packing.polygons.offsets[:-1])
        return np.asarray(first + moment / np.where(packing.flat_walls, 1.0, 6.0 * packing.polygons.areas)[:, None])

    def centroid_displacements(self, packing: Packing, u: NDArray[Any]) -> NDArray[Any]:
        """Reynolds' theorem: a dc = integral of (u.n)(x - c) over the outline, n outwards; u and x are linear along
        every edge."""
        polygons, following = packing.polygons, packing.polygons.successor
        arm = packing.positions - packing.centroids[packing.particle]
        outwards = np.column_stack([polygons.edges[:, 1], -polygons.edges[:, 0]])  # times the length of the edge
        flux, flux_ahead = (np.sum(each * outwards, axis=1)[:, None] for each in (u, u[following]))
        ahead = arm[following]
        moment = (flux * (2 * arm + ahead) + flux_ahead * (arm + 2 * ahead)) / 6.0
        moved = np.add.reduceat(moment, polygons.offsets[:-1])
        return np.asarray(moved / np.where(packing.flat_walls, 1.0, polygons.areas)[:, None])

    def law(self, packing: Packing) -> PairLaw:
        return law_class(packing.params, "rims").of(packing.params, packing.units)

    def sizes(self, packing: Packing) -> Array:
        return np.asarray(np.sqrt(packing.params["a0"]))

    def type_sizes(self, packing: Packing) -> Array:
        return np.asarray(packing.params["a0"])

    def free_area(self, packing: Packing) -> float:
        round_ = ~packing.flat_walls
        params = {**packing.params, "a0": packing.params["a0"][round_]}
        return float(np.sum(free_area(vertex_counts(packing)[round_], params)))

    def grown(self, packing: Packing, growth: float) -> Packing | None:
        delta = packing.params["delta"] + growth
        return packing.with_state(params={**packing.params, "delta": delta}) if delta > 0 else None

    # contacts ---------------------------------------------------------------------------------------------------------

    def check_apart(self, packing: Packing) -> None:
        if packing.frame.is_flat:
            self.points(packing)
        else:
            refuse_crossings(packing)

    def pairs(self, packing: Packing) -> Pairs:
        """Each once, however many vertices meet; of two periodic images of one, as in very small boxes, either. r joins
        centroids."""
        (i, j, *_), shift = (pairs := name_pairs(packing)[0]).T, pairs[:, 2:]
        r = packing.centroids[j] - packing.centroids[i] + shift @ packing.box
        r[packing.flat_walls[j], 0] = 0.0
        return Pairs(i, j, r, shift)

    def contact_forces(self, packing: Packing) -> ContactForces:
        (pairs, row, on_vertex_of_j), found = name_pairs(packing), vertex_contacts(packing)
        distance, delta = found.distance, packing.params["delta"]
        push = -_law_of_meetings(packing)[1]
        force = np.where(on_vertex_of_j, 1.0, -1.0)[:, None] * per_length(push, distance)[:, None] * found.separation
        vectors = np.zeros((len(pairs), 2))
        np.add.at(vectors, row, force)
        closest = np.full(len(pairs), np.inf)
        np.minimum.at(closest, row, distance)
        return ContactForces(vectors, closest - delta)

    def loads(self, packing: Packing) -> Array:
        load, found = np.zeros(packing.n), vertex_contacts(packing)
        push = np.abs(_law_of_meetings(packing)[1])
        for site in (found.vertex, found.tail):
            np.maximum.at(load, packing.particle[site], push)
        return load

    def terms(self, packing: Packing, prestress: bool) -> list[Terms]:
        if not prestress:
            raise InputError(
                f"{typed('prestress = False', '--no-prestress')}: "
                "line tension holds droplets together and is a pre-stress; "
                "leave it out"
            )
        return [*_contacts(packing), *self.shape_terms(packing)]

    def shape_terms(self, packing: Packing) -> list[Terms]:
        return [_tension(packing), *_areas(packing), *_outline_terms(packing)]

    def jacobian(self, packing: Packing, lever_arms: str, generator: Array) -> ContactJacobian:
        """Vertex against the point (1 - t) tail + t head of the edge; the rims meet half way between them."""
        found = vertex_contacts(packing)
        distance, t = found.distance, found.place
        if not np.all(distance > 0):
            raise InputError("a vertex lies on an edge of another polygon: their contact has no direction to damp")
        sites = np.column_stack([found.vertex, found.tail, packing.polygons.successor[found.tail]])
        turning = _outline_rotation(packing, generator)
        half = 0.5 * distance[:, None] * np.column_stack([np.ones_like(t), 1.0 - t, t])
        return ContactJacobian(
            normal=found.separation / distance[:, None],
            flow=found.separation @ generator.T,
            stiffness=packing.law.drag_stiffness(np.full(len(t), packing.params["delta"]), distance),
            sites=sites,
            weights=np.column_stack([np.ones_like(t), t - 1.0, -t]),
            rolling=SparseRows(half, sites, turning.size, turning),
        )

    def rigidity(self, packing: Packing) -> Array:
        """(contacts, 3 n) change of every gap with positions and angles of droplets, in mean sizes; two vertices that
        meet are one contact."""
        size = float(np.mean(np.sqrt(packing.params["a0"])))
        meetings, (names, pair, swapped) = vertex_contacts(packing), name_pairs(packing)
        sign = np.where(swapped, 1.0, -1.0)[:, None]  # the normal points from the first of a pair to the second
        normal = sign * meetings.separation / meetings.distance[:, None]
        vertex, centre = packing.positions[meetings.vertex], packing.centroids
        of_vertex, of_edge = packing.particle[meetings.vertex], packing.particle[meetings.tail]
        on_vertex = cross(vertex - centre[of_vertex], normal) / size
        on_edge = cross(vertex - meetings.separation - meetings.shift - centre[of_edge], normal) / size
        lever_i, lever_j = np.where(swapped, (on_edge, on_vertex), (on_vertex, on_edge))
        marks = np.round(np.column_stack([normal, lever_i]) / ROUNDING.same).astype(np.int64)
        first = np.unique(np.column_stack([pair, marks]), axis=0, return_index=True)[1]
        i, j = names[pair[first], :2].T
        rows = np.zeros((len(first), packing.n, 3))
        each = np.arange(len(first))
        np.add.at(rows, (each, j), np.column_stack([normal[first], lever_j[first]]))
        np.add.at(rows, (each, i), -np.column_stack([normal[first], lever_i[first]]))
        return rows.reshape(len(first), -1)

    # shape ------------------------------------------------------------------------------------------------------------

    def shares(self, packing: Packing) -> Array:
        return shared_areas(packing)

    def outline(self, packing: Packing, rim: bool) -> tuple[Array, Array]:
        if not rim:
            return packing.polygons.areas, packing.polygons.perimeters
        found = droplet_cover(packing)
        return found.area, found.perimeter

    def relative_areas(self, packing: Packing) -> Array:
        return np.asarray(packing.polygons.areas / packing.params["a0"])

    def boundary(self, packing: Packing) -> Boundary:
        return trace_polygons(packing)

    def power_points(self, packing: Packing, spacing: float) -> tuple[Indices, Array, Array]:
        owner, points = _sample_outlines(packing, spacing * np.sqrt(packing.area / packing.n))
        return owner, points, np.zeros(len(points))

    def rings(self, packing: Packing) -> tuple[list[Array], list[Array]]:
        import shapely

        from jamlab.packing.packing_plot import QUARTER_ARC

        shapes = packing.polygons.shapes()
        grown = shapely.buffer(shapes, 0.5 * packing.params["delta"], quad_segs=QUARTER_ARC)
        fills, edges = (
            [shapely.get_coordinates(shapely.get_exterior_ring(shape)) for shape in part] for part in (grown, shapes)
        )
        return fills, edges

    # LAMMPS -----------------------------------------------------------------------------------------------------------

    @property
    def part(self) -> Path:
        return installed_file("lammps_inputs", "parts/dp")

    def check_for_lammps(self, packing: Packing) -> None:
        """An edge that is longer than its way to another image of its end: LAMMPS takes the nearest one."""
        if packing.params["contact"] == "segment":
            raise InputError(
                "contact form 'segment' has no minima, since its forces jump where edges are parallel: `evaluate` "
                "takes it; give contact='outline' to all else"
            )
        edges = packing.polygons.edges
        if (wrong := np.flatnonzero(shortest_images((1 + ROUNDING.at_half) * edges, packing.box).any(axis=1))).size:
            raise EngineError(
                f"the edge between vertices {wrong[0]} and {packing.polygons.successor[wrong[0]]} is "
                f"{np.hypot(*edges[wrong[0]]):.6g} long, more than half the box in its direction, so that LAMMPS takes "
                "another image of its end: use a larger box, such as two copies of it, or more vertices per polygon"
            )

    def lammps_variables(self, packing: Packing) -> dict[str, object]:
        packing.law.require("deck", "LAMMPS")
        require_fixes(packing.params)
        values = self.values(packing)
        shared = [name for name, each in packing.parameters.items() if name != "law" and not each.each]
        found = {"units": "eps"} | {name: values[name] for name in shared}
        if packing.frame.is_flat:  # the smallest size is the first type; these words end the line of pair_style
            found["contact"] += " flat 1"
        return found

    def dump_columns(self, packing: Packing) -> dict[str, Array]:
        return {"radius": np.full(packing.n, 0.5 * packing.params["delta"]), "a0": packing.params["a0"]}

    def bonds(self, packing: Packing) -> Indices:
        i = np.arange(len(packing.positions))
        ring = np.column_stack([i, packing.polygons.successor])
        return np.asarray(ring[packing.polygons.successor != i])  # a flat wall is one site

    def longest_edge(self, packing: Packing) -> float:
        return float(np.hypot(*packing.polygons.edges.T).max())


DROPLETS = Droplets()  # as entry points name it


def _sample_outlines(packing: Packing, spacing: float) -> tuple[Indices, Array]:
    """Sample the polygons at the middle of equal parts of every edge."""
    edges = packing.polygons.edges
    parts = np.maximum(np.ceil(np.hypot(*edges.T) / spacing), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(edges)), parts)
    place = (np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / parts[edge]
    return packing.particle[edge], packing.positions[edge] + place[:, None] * edges[edge]


def vertex_counts(packing: Packing) -> Indices:
    """(n,) vertices of each droplet."""
    return np.diff(packing.polygons.offsets)


# a free droplet -------------------------------------------------------------------------------------------------------


def free_polygon_area(nv: ArrayLike, params: Mapping[str, Any]) -> Array:
    """(n,) area without rim at which line tension and area elasticity balance: ka (a - a0) + gamma dp/da = 0. `nv`:
    (n,) vertices of each droplet; `params`: `gamma`, `ka`, and `a0` of shape (n,)."""
    nv = np.asarray(nv)
    c = nv * np.tan(np.pi / nv)
    gamma, ka, a0 = params["gamma"], params["ka"], np.asarray(params["a0"], dtype=np.float64)
    # the force on the area is least at a = (gamma sqrt(c)/(2 ka))^(2/3); it must be inwards there
    largest = np.min(2 * (a0 / 3) ** 1.5 / np.sqrt(c))
    if gamma > ka * largest:
        raise InputError(
            f"gamma = {gamma:g} at ka = {ka:g}: line tension shrinks a free droplet to a point; use a "
            f"smaller gamma or a larger ka, with gamma/ka of at most {largest:.4g}"
        )
    # the largest root of the cubic s^3 - a0 s + gamma sqrt(c)/ka = 0 of s = sqrt(a), by Vieta's cosine
    angle = np.arccos(np.maximum(-1.0, -1.5 * gamma * np.sqrt(3 * c / a0) / (ka * a0))) / 3  # -1 at the largest gamma
    area = np.asarray(4 / 3 * a0 * np.cos(angle) ** 2)
    return rest_shape(nv, params, area)[0] if laws_that_act(params) else area


def free_perimeter(nv: ArrayLike, params: Mapping[str, Any]) -> Array:
    """(n,) perimeter without rim of the free droplet; arguments as in `free_polygon_area`."""
    nv = np.asarray(nv)
    a = free_polygon_area(nv, params)
    return rest_shape(nv, params, a)[1] if laws_that_act(params) else np.sqrt(4 * nv * np.tan(np.pi / nv) * a)


def free_tension(nv: ArrayLike, params: Mapping[str, Any]) -> float:
    """Least line tension, with what laws of outlines add, that holds free droplets round; 0: one of them buckles.
    Arguments as in `free_polygon_area`."""
    if not laws_that_act(params):
        return float(params["gamma"])
    return float(np.min(rest_shape(np.asarray(nv), params, free_polygon_area(nv, params))[2]))


def free_area(nv: ArrayLike, params: Mapping[str, Any]) -> Array:
    """(n,) area of the free droplet with its rim of width delta/2: a + p delta/2 + pi delta^2/4."""
    nv = np.asarray(nv)
    a = free_polygon_area(nv, params)
    half = 0.5 * float(params["delta"])
    grown: Array = a + free_perimeter(nv, params) * half + np.pi * half**2
    return grown


def regular_polygon(nv: int, area: float, angle: float = 0.0) -> Array:
    """(nv, 2) vertices of a regular polygon around the origin, counter-clockwise, first vertex at `angle`."""
    radius = np.sqrt(2 * area / (nv * np.sin(2 * np.pi / nv)))
    turn = angle + 2 * np.pi * np.arange(nv) / nv
    return np.asarray(radius * np.column_stack([np.cos(turn), np.sin(turn)]))


def _check_outlines(positions: Array, offsets: Indices, areas: Array, flat: Mask) -> None:
    """Refuse polygons that cross themselves or run clockwise; `flat`: (n,) walls, which have no area."""
    crossed = self_crossings(positions, offsets)
    if len(crossed):
        raise SelfCrossingError(f"edges of polygon {crossed[0]} cross each other: its outline must be simple")
    if len(negative := np.flatnonzero((areas <= 0) & ~flat)):
        m = negative[0]
        raise InputError(f"polygon {m} has area {areas[m]:.6g}: order its vertices counter-clockwise")


# energy terms ---------------------------------------------------------------------------------------------------------


def _tension(packing: Packing) -> Terms:
    """gamma sqrt(l^2 + eta^2) for every edge, Boromand et al. eq 7, first term."""
    edge = packing.polygons.edges
    pairs = np.column_stack([np.arange(len(edge)), packing.polygons.successor])
    if packing.frame.is_flat:
        bound = ~packing.frame.flat_sites
        pairs, edge = pairs[bound], edge[bound]
    return tension_terms("tension", pairs, edge, packing.params["gamma"], packing.params["eta"])


def _areas(packing: Packing) -> list[Terms]:
    """(ka/2)(a - a0)^2 for every polygon, Boromand et al. eq 7, second term; one group for each number of vertices."""
    ka, a0, sizes = packing.params["ka"], packing.params["a0"], vertex_counts(packing)
    starts, groups = np.asarray(packing.offsets)[:-1], []
    for nv in np.unique(sizes):
        members = np.flatnonzero(sizes == nv)
        excess = packing.polygons.areas[members] - a0[members]
        groups.append(area_terms("area", packing.positions, starts[members], int(nv), ka, excess))
    return groups


def _outline_terms(packing: Packing) -> list[Terms]:
    """Of the laws of outlines that act; one group for each number of vertices."""
    if not (laws := laws_that_act(packing.params)):
        return []
    a0, sizes = packing.params["a0"], vertex_counts(packing)
    groups: list[Terms] = []
    starts, droplets = np.asarray(packing.offsets)[:-1], ~packing.flat_walls
    for nv in np.unique(sizes[droplets]):
        members = np.flatnonzero((sizes == nv) & droplets)
        sites = starts[members, None] + np.arange(nv)
        rings = PolygonRings(packing.positions[sites], sites, a0[members])
        groups.extend(law.terms(rings, packing.params) for law in laws)
    return groups


@per_packing
def _law_of_meetings(packing: Packing) -> tuple[Array, ...]:
    """Energy, and its first and second derivative by the distance, of every meeting of a vertex with an edge."""
    distance = vertex_contacts(packing).distance
    return tuple(packing.law(np.full(len(distance), packing.params["delta"]), distance))


def _contacts(packing: Packing) -> list[Terms]:
    """`RimLaw` for every meeting of a vertex with an edge at a distance d: at an end of the edge that of two points."""
    found, law = vertex_contacts(packing), _law_of_meetings(packing)
    distance = found.distance
    if not (kept := distance > 0).all():
        found, distance, law = found.select(kept), distance[kept], tuple(each[kept] for each in law)
    place, separation, vertex, tail = found.place, found.separation, found.vertex, found.tail
    energy, slope, stiffness = law

    ends = (place == 0.0) | (place == 1.0)
    corner = np.where(place == 1.0, packing.polygons.successor[tail], tail)[ends]
    n = separation[ends] / distance[ends, None]
    flat = packing.frame.flat_sites[tail[ends]]
    across = np.where(flat, 0.0, slope[ends] / distance[ends])  # as of disks
    pairs = np.column_stack([corner, vertex[ends]])
    points = central_terms("contact", pairs, separation[ends], n, energy[ends], slope[ends], stiffness[ends], across)

    inner = ~ends
    tail = tail[inner]
    sites = np.column_stack([vertex[inner], tail, packing.polygons.successor[tail]])
    edges = edge_contact_terms(
        "contact", sites, place[inner], separation[inner], packing.polygons.edges[tail],
        energy[inner], slope[inner], stiffness[inner],
    )  # fmt: skip
    return [points, edges]


def _outline_rotation(packing: Packing, generator: Array) -> SparseRows:
    """(n_vertices, size) angular velocity of the outline at every vertex, from all rates. The rotation w that fits the
    velocities of the two edges e at a vertex best, sum over both of |de' - w x e|^2 least: w = sum e x e'/sum e^2. One
    edge alone would spin the faster the shorter it is, and edges shrink at Plateau borders."""
    edges, head = packing.polygons.edges, packing.polygons.successor
    tail, size = np.arange(len(head)), 2 * len(head) + 1
    square = np.einsum("ij,ij->i", edges, edges)
    around = square.copy()  # of both edges at a vertex
    around[head] += square
    around[packing.frame.flat_sites] = 1.0  # they do not turn
    if not np.all(around > 0):
        raise InputError(f"vertex {np.argmin(around)} coincides with both its neighbours; move it")
    columns = np.column_stack([2 * tail, 2 * tail + 1, 2 * head, 2 * head + 1, np.full_like(tail, size - 1)])
    (x, y), (flow_x, flow_y) = edges.T, generator @ edges.T
    turn = np.column_stack([y, -x, -y, x, x * flow_y - y * flow_x])  # e x e', with e' = u_head - u_tail + gamma' M e
    before = np.argsort(head)  # every edge turns its tail and its head
    return SparseRows(np.hstack([turn, turn[before]]) / around[:, None], np.hstack([columns, columns[before]]), size)
