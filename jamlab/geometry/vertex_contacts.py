"""Contacts between droplets: vertices and edges of different polygons that meet.

Every contact form comes down to a list of (vertex, edge) meetings, each with the energy of the law of rims, such as
(eps/2)(1 - d/delta)^2, at the distance d from the vertex to the closest point of the edge:

* "outline": every vertex meets every other polygon once, at the closest point of its outline.
* "segment" (Boromand et al. eq 8): every pair of edges of two polygons meets once, at their smallest distance, which is
  the smallest of four distances from an end of one edge to the other edge (0 where the edges cross).
* "segment/smooth": every pair of edges of two polygons has half the energy of each of those four distances. A vertex
  ends two edges, so this is every vertex against every edge of other polygons, once and with its full energy. Beside a
  corner a vertex meets both edges that end there: at the same distance d they add up to eps (1 - d/delta)^2.

A periodic image of a polygon is another polygon, also to itself: in a small box a polygon meets its own images.

Disks touch where r < (d_i + d_j)/2.
"""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices, Mask
from jamlab.errors import InputError
from jamlab.geometry.droplet_cover import Meeting, droplet_cover
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.derived import per_packing
from jamlab.packing.neighbors import MOST_IMAGES, Pairs, periodic_pairs, search_lattice
from jamlab.packing.packing import Packing


@per_packing
def touching_disks(packing: Packing) -> Pairs:
    """Find all pairs of disks within the cutoff of their law: the sum of their radii, or farther by its range. Returns
    pairs i <= j, sorted by i, j and image. A disk that reaches several periodic images of another, or its own image,
    touches each of them. A flat wall is met at the distance along y: r = (0, dy)."""
    reach = 0.5 * packing.disk_diameters + 0.5 * packing.law.range
    if packing.kind.sites != 1:
        raise InputError(
            f"{packing.kind.particles} (model {packing.model}) are no single disks: use a packing of disks"
        )
    near, flat = periodic_pairs(packing.positions, packing.box, reach), packing.frame.flat_sites
    if not packing.frame.is_flat:
        return near
    found: Pairs = _joined(near.select(~flat[near.i] & ~flat[near.j]), _near_walls(packing, reach))
    return found.select(np.lexsort([*found.shift.T[::-1], found.j, found.i]))  # i < j: flat walls are last


def _joined(one: Any, other: Any) -> Any:
    rows = (np.concatenate([getattr(each, f.name) for each in (one, other)]) for f in fields(one))
    return type(one)(*rows)


def _near_walls(packing: Packing, reach: Array) -> Pairs:
    """Sites i within the sum of reaches, (len(positions),), of a flat wall j, at the distance along y: r = (0, dy)."""
    flat, height = packing.frame.flat_sites, packing.box[1, 1]
    image, y = np.divmod(packing.positions[:, 1], height)
    walls = np.flatnonzero(flat)
    behind = ~flat & ((y <= y[walls].min()) | (y >= y[walls].max()))
    if behind.any():
        site = int(behind.argmax())
        raise InputError(
            f"particle {packing.particle[site]} at y = {y[site]:.6g} lies behind a flat wall: move it between the walls"
        )
    away = y[walls] - y[:, None]
    i, k = np.nonzero(~flat[:, None] & (np.abs(away) < reach[:, None] + reach[walls]))
    shift = np.column_stack([np.zeros_like(i), (image[i] - image[walls[k]]).astype(np.int64)])
    return Pairs(i, walls[k], np.column_stack([np.zeros(len(i)), away[i, k]]), shift)


_OUT = (INTEGERS, INTEGERS, REALS, REALS, REALS, INTEGERS, REALS)
_meetings = kernel("vertex_meetings", INTEGER, INTEGERS, REALS, REALS, REAL, INTEGER, REAL, INTEGER, *_OUT)
_OUTLINES_CROSS = -3
_named_pairs = kernel("named_pairs", INTEGER, INTEGERS, INTEGERS, INTEGERS, INTEGERS, INTEGERS, INTEGERS)


@dataclass(frozen=True)
class VertexContacts:
    """Meetings of a vertex with an edge of another polygon, or of an image of its own, closer than delta and the range
    of the law."""

    vertex: Indices  # (m,) index of the vertex
    tail: Indices  # (m,) index of the first vertex of the edge; the edge runs to `successor[tail]`
    place: Array  # (m,) t in [0, 1], the closest point is (1 - t) tail + t head
    separation: Array  # (m, 2) vector from the closest point to the vertex
    shift: Array  # (m, 2) lattice translation to add to the edge so that it lies beside the vertex

    def select(self, rows: NDArray[np.bool_] | Indices) -> "VertexContacts":
        """Keep some rows, by mask or by number."""
        return VertexContacts(
            self.vertex[rows], self.tail[rows], self.place[rows], self.separation[rows], self.shift[rows]
        )

    def among(self, held: Mask) -> "VertexContacts":
        """Those between vertices that are held, (n_vertices,), numbered as if there were no others."""
        number, kept = np.cumsum(held) - 1, held[self.vertex] & held[self.tail]
        found = self.select(kept)
        return replace(found, vertex=number[found.vertex], tail=number[found.tail])

    @property
    def distance(self) -> Array:
        """(m,) length of the separation."""
        return np.asarray(np.hypot(*self.separation.T))


@per_packing
def vertex_contacts(packing: Packing) -> VertexContacts:
    """Find the contacts of a DP packing in its own contact form."""
    _check_apart(packing)
    reach, form = packing.params["delta"] + packing.law.range, packing.params["contact"]
    offsets = np.asarray(packing.offsets)
    crossing = np.zeros(2, dtype=np.int64)

    def fill(room: int, search: Array) -> tuple[int, tuple[Any, ...]]:
        vertex, tail, place = np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room)
        separation, shift = np.empty((room, 2)), np.empty((room, 2))
        count = _meetings(
            packing.n, offsets, packing.positions, packing.box, reach, form == "outline", MOST_IMAGES, room,
            vertex, tail, place, separation, shift, crossing, search,
        )  # fmt: skip
        if count == _OUTLINES_CROSS:
            raise crossing_error(*crossing)
        return count, (vertex, tail, place, separation, shift)

    found = VertexContacts(*search_lattice(fill, 2 * len(packing.positions)))
    if packing.frame.is_flat:
        flat = packing.frame.flat_sites
        near = _near_walls(packing, np.full(len(flat), 0.5 * reach))
        met = VertexContacts(near.i, near.j, np.zeros(len(near.i)), -near.r, near.shift @ packing.box)
        found = _joined(found.select(~flat[found.vertex] & ~flat[found.tail]), met)
    return found.select(_closest_of_edges(packing, found)) if form == "segment" else found


def _closest_of_edges(packing: Packing, found: VertexContacts) -> Indices:
    """(k,) row of the closest meeting of each pair of edges. A meeting belongs to both edges that end in its vertex."""
    refuse_crossings(packing)
    before, image = np.argsort(packing.polygons.successor), _images(packing, found)
    own = np.concatenate([found.vertex, before[found.vertex]])
    _, pair, _ = named_pairs(own, np.tile(found.tail, 2), np.tile(image, (2, 1)))
    order = np.lexsort([np.tile(found.tail, 2), np.tile(found.distance, 2), pair])
    return np.asarray(order[np.unique(pair[order], return_index=True)[1]] % len(found.vertex))


def _check_apart(packing: Packing) -> None:
    """Refuse outlines that cross farther than delta from every vertex, and polygons in the middle of others. The search
    for vertices near edges sees neither. They need edges longer than 2 delta, or a polygon that holds another and a
    strip of width delta around it, of area (sqrt(a) + sqrt(pi) delta)^2 at least (Brunn and Minkowski)."""
    delta, areas = packing.params["delta"], packing.polygons.areas[~packing.flat_walls]
    long_edges = bool(np.hypot(*packing.polygons.edges.T).max() > 2 * delta)
    if long_edges or areas.max() > (np.sqrt(areas.min()) + np.sqrt(np.pi) * delta) ** 2:
        refuse_crossings(packing)


def refuse_crossings(packing: Packing) -> None:
    """Refuse droplets whose outlines cross, and one in the middle of another: no contact form keeps them apart from
    there. Those that touch each other within rounding are judged by shapely."""
    found = droplet_cover(packing)
    if found.meeting is Meeting.DOUBTFUL:
        _refuse_overlaps(packing)
    elif found.meeting is not Meeting.APART:
        raise crossing_error(*found.met)


def _refuse_overlaps(packing: Packing) -> None:
    import shapely

    starts, shapes = np.asarray(packing.offsets)[:-1], packing.polygons.shapes()
    low, high = (bound.reduceat(packing.positions, starts, axis=0) for bound in (np.minimum, np.maximum))
    middle, size = 0.5 * (low + high), high - low
    near = periodic_pairs(middle, packing.box, 0.5 * np.hypot(*size.T))
    suspect = np.all(np.abs(near.r) <= 0.5 * (size[near.i] + size[near.j]), axis=1)
    i, j = near.i[suspect], near.j[suspect]
    shift = np.repeat(near.r[suspect] - (middle[j] - middle[i]), shapely.get_num_coordinates(shapes[j]), axis=0)
    others = shapely.transform(shapes[j], lambda x: x + shift)
    meet = np.flatnonzero(shapely.intersects(shapes[i], others))
    crossed = meet[~shapely.touches(shapes[i[meet]], others[meet])]
    if len(crossed):
        raise crossing_error(int(i[crossed[0]]), int(j[crossed[0]]))


def crossing_error(m: int, n: int) -> InputError:
    """What is said of two polygons whose outlines cross."""
    return InputError(f"outlines of polygons {m} and {n} cross: no contact form keeps them apart from there")


PairNames = tuple[Indices, Indices, NDArray[np.bool_]]


@per_packing
def name_pairs(packing: Packing) -> PairNames:
    """Name the pairs of polygons that meet, alike from both sides. Returns (k, 4) int64, sorted: i <= j and the image
    of j; (m,) which of them each meeting belongs to; (m,) bool: the vertex is one of j, not of i."""
    particle, found = packing.particle, vertex_contacts(packing)
    return named_pairs(particle[found.vertex], particle[found.tail], _images(packing, found))


def _images(packing: Packing, found: VertexContacts) -> NDArray[np.int64]:
    second = found.shift[:, 1] / packing.box[1, 1]
    first = (found.shift[:, 0] - second * packing.box[1, 0]) / packing.box[0, 0]
    return np.round(np.column_stack([first, second])).astype(np.int64)


def named_pairs(i: Indices, j: Indices, image: NDArray[np.int64]) -> PairNames:
    """Seen from both sides a pair has one name: the lower number first, and the image counted from it."""
    names, (row, swapped) = np.empty((len(i), 4), dtype=np.int64), np.empty((2, len(i)), dtype=np.int64)
    given = (np.ascontiguousarray(numbers, dtype=np.int64) for numbers in (i, j, image))
    count = _named_pairs(len(i), *given, names, row, swapped)
    return names[:count], row, swapped.astype(bool)
