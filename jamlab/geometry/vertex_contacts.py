"""Contacts between droplets: vertices and edges of different polygons that meet.

Every contact form comes down to a list of (vertex, edge) meetings, each with the energy (eps/2)(1 - d/delta)^2 of the
distance d from the vertex to the closest point of the edge:

* "outline": every vertex meets every other polygon once, at the closest point of its outline.
* "segment" (Boromand et al. eq 8): every pair of edges of two polygons meets once, at their smallest distance, which is
  the smallest of four distances from an end of one edge to the other edge (0 where the edges cross).
* "segment/smooth": every pair of edges of two polygons has half the energy of each of those four distances. A vertex
  ends two edges, so this is every vertex against every edge of other polygons, once and with its full energy. Beside a
  corner a vertex meets both edges that end there: at the same distance d they add up to eps (1 - d/delta)^2.

A periodic image of a polygon is another polygon, also to itself: in a small box a polygon meets its own images.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import InputError
from jamlab.geometry.cross_product import cross
from jamlab.packing.neighbors import Pairs, periodic_neighbors, positive_image
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class VertexContacts:
    """Meetings of a vertex with an edge of another polygon, or of an image of its own, closer than delta.

    Attributes:
        vertex: (m,) index of the vertex.
        tail: (m,) index of the first vertex of the edge; the edge runs to `successor[tail]`.
        place: (m,) t in [0, 1], the closest point is (1 - t) tail + t head.
        separation: (m, 2) vector from the closest point to the vertex.
        shift: (m, 2) lattice translation to add to the edge so that it lies beside the vertex.
    """

    vertex: Indices
    tail: Indices
    place: Array
    separation: Array
    shift: Array

    def select(self, rows: NDArray[np.bool_] | Indices) -> "VertexContacts":
        """Keep some rows, by mask or by number."""
        return VertexContacts(
            self.vertex[rows], self.tail[rows], self.place[rows], self.separation[rows], self.shift[rows]
        )

    @property
    def distance(self) -> Array:
        """(m,) length of the separation."""
        return np.asarray(np.hypot(*self.separation.T))


def vertex_contacts(packing: Packing) -> VertexContacts:
    """Find the contacts of a DP packing in its own contact form.

    Raises:
        InputError: if edges of two polygons cross. Eq 8 has no force there, and the other forms would pull a vertex
            that has come inside further in.
    """
    delta, form = packing.params["delta"], packing.params["contact"]
    if form == "segment":
        return _find_segment_contacts(packing, delta)
    found = _find_meetings(packing, delta)
    _refuse_crossing(packing, found.vertex, found)
    if form == "outline":
        particle = packing.particle
        image = np.round(found.shift @ np.linalg.inv(packing.box)).astype(np.int64)
        return _keep_closest(found, (found.vertex, particle[found.tail], image[:, 0], image[:, 1]))
    return found


def pair_polygons(packing: Packing, contacts: VertexContacts) -> Pairs:
    """List pairs of polygons i <= j in contact, each once however many vertices meet; r joins their centroids.

    A polygon that meets two periodic images of another, as in very small boxes, has two contacts with it. i == j is a
    polygon that meets its own image; the two opposite images are one contact.
    """
    rows = np.unique(name_pairs(packing, contacts)[0], axis=0)
    i, j, shift = rows[:, 0], rows[:, 1], rows[:, 2:]
    centre = packing.centroids
    return Pairs(i, j, centre[j] - centre[i] + shift @ packing.box, shift)


def name_pairs(packing: Packing, contacts: VertexContacts) -> tuple[Indices, NDArray[np.bool_]]:
    """Name the pair of polygons that each meeting belongs to, alike from both sides.

    Returns:
        (m, 4) int64: i <= j and the image of j; sorted rows without repeats are those of `pair_polygons`. (m,) bool:
        the vertex is one of j, not of i.
    """
    particle = packing.particle
    i, j = particle[contacts.vertex], particle[contacts.tail]
    image = np.round(contacts.shift @ np.linalg.inv(packing.box)).astype(np.int64)
    swapped = (i > j) | ((i == j) & ~positive_image(image))
    image = np.where(swapped[:, None], -image, image)
    return np.column_stack([np.minimum(i, j), np.maximum(i, j), image]), swapped


def _find_meetings(packing: Packing, reach: float) -> VertexContacts:
    """All (vertex, edge) pairs of different polygons, images of one polygon included, closer than `reach`."""
    x, edges = packing.positions, packing.edges
    middle = x + 0.5 * edges
    length = np.hypot(*edges.T)
    near = periodic_neighbors(x, middle, packing.box, reach + 0.5 * length.max())
    vertex, tail, to_middle, image = near.i, near.j, near.r, near.shift
    other = (packing.particle[vertex] != packing.particle[tail]) | image.any(axis=1)
    vertex, tail, to_middle, image = vertex[other], tail[other], to_middle[other], image[other]

    e = edges[tail]
    r = 0.5 * e - to_middle  # from the tail (in its image) to the vertex
    square = np.einsum("ij,ij->i", e, e)
    along = np.einsum("ij,ij->i", r, e)
    place = np.clip(np.divide(along, square, out=np.zeros_like(along), where=square > 0), 0.0, 1.0)
    separation = r - place[:, None] * e
    close = np.einsum("ij,ij->i", separation, separation) < reach**2
    shift = image[close] @ packing.box
    return VertexContacts(vertex[close], tail[close], place[close], separation[close], shift)


def _keep_closest(found: VertexContacts, keys: tuple[Indices, ...]) -> VertexContacts:
    """The one closest meeting of every group of equal keys; of equals the one with the lowest tail."""
    order = np.lexsort((found.tail, found.distance, *keys[::-1]))
    sorted_keys = np.column_stack([key[order] for key in keys])
    first = np.ones(len(order), dtype=bool)
    first[1:] = np.any(sorted_keys[1:] != sorted_keys[:-1], axis=1)
    return found.select(order[first])


def _find_segment_contacts(packing: Packing, delta: float) -> VertexContacts:
    """Every meeting belongs to two edge pairs: that of either edge that starts or ends in the vertex."""
    found = _find_meetings(packing, delta)
    predecessor = np.empty(len(packing.positions), dtype=np.int64)
    predecessor[packing.successor] = np.arange(len(packing.positions))
    both = VertexContacts(*(np.concatenate([a, a]) for a in vars(found).values()))
    own = np.concatenate([found.vertex, predecessor[found.vertex]])
    # one name for an edge pair from both sides: the lower edge first, the image seen from it
    image = np.round(both.shift @ np.linalg.inv(packing.box)).astype(np.int64)
    lower = (own < both.tail) | ((own == both.tail) & positive_image(image))
    sign = np.where(lower, 1, -1)
    keys = (np.minimum(own, both.tail), np.maximum(own, both.tail), sign * image[:, 0], sign * image[:, 1])
    contacts = _keep_closest(both, keys)
    _refuse_crossing(packing, own, both)
    return contacts


def _refuse_crossing(packing: Packing, own: Indices, meetings: VertexContacts) -> None:
    x, edges = packing.positions, packing.edges
    a = x[own]
    b = a + edges[own]
    c = x[meetings.tail] + meetings.shift
    d = c + edges[meetings.tail]

    crossed = np.flatnonzero(
        (cross(b - a, c - a) * cross(b - a, d - a) < 0) & (cross(d - c, a - c) * cross(d - c, b - c) < 0)
    )
    if len(crossed):
        m, n = packing.particle[own[crossed[0]]], packing.particle[meetings.tail[crossed[0]]]
        raise InputError(f"outlines of polygons {m} and {n} cross: no contact form keeps them apart from there")
