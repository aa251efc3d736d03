"""Droplets among bonded points: closed rings, made whole across the box, counter-clockwise."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError


@dataclass(frozen=True)
class Rings:
    """Order of points around polygons."""

    order: Indices  # (n_vertices,) every point once, ring after ring; rings go by their lowest point and begin there
    offsets: Indices  # (n + 1,) ring m is order[offsets[m]:offsets[m + 1]]

    def polygons(self, positions: Array, box: Array, *, wrapped: bool) -> tuple[Indices, Array]:
        """Polygons of one frame: points (n_vertices,) in the order of the vertices, counter-clockwise, and the vertices
        (n_vertices, 2). One that is wrapped may lie on both sides of the box; then no edge may be longer than half of
        it."""
        vertices = positions[self.order]
        if wrapped:
            vertices = self._whole(vertices, box)
        starts = np.repeat(self.offsets[:-1], np.diff(self.offsets))
        r = vertices - vertices[starts]
        s = r[self._following()]
        clockwise = np.add.reduceat(r[:, 0] * s[:, 1] - r[:, 1] * s[:, 0], self.offsets[:-1]) < 0
        place = np.arange(len(vertices))
        ends = np.repeat(self.offsets[1:], np.diff(self.offsets))
        turned = np.where(place == starts, place, starts + ends - place)  # the first vertex stays the first
        place = np.where(np.repeat(clockwise, np.diff(self.offsets)), turned, place)
        return self.order[place], vertices[place]

    def _following(self) -> Indices:
        following = np.arange(1, len(self.order) + 1)
        following[self.offsets[1:] - 1] = self.offsets[:-1]
        return following

    def _whole(self, vertices: Array, box: Array) -> Array:
        """Shift vertices by lattice vectors so that every edge is the shortest one; what is whole keeps its bits."""
        edges = vertices[self._following()] - vertices
        steps = np.rint(edges @ np.linalg.inv(box))
        winding = np.argwhere(np.add.reduceat(steps, self.offsets[:-1], axis=0))
        if len(winding):
            raise InputError(
                f"the bonds of polygon {winding[0, 0]} lead around the periodic box: every edge must be shorter than "
                "half of the box"
            )
        taken = np.cumsum(steps, axis=0) - steps
        taken -= np.repeat(taken[self.offsets[:-1]], np.diff(self.offsets), axis=0)
        return np.asarray(vertices - taken @ box)


def rings_of_bonds(bonds: Indices, count: int) -> Rings:
    """Rings that bonds (m, 2), of which one may occur twice, close between so many points."""
    ends = np.unique(np.sort(bonds, axis=1), axis=0)
    degree = np.bincount(ends.ravel(), minlength=count)
    odd = np.flatnonzero(degree != 2)
    if len(odd) or (ends[:, 0] == ends[:, 1]).any():
        k = odd[0] if len(odd) else ends[ends[:, 0] == ends[:, 1]][0, 0]
        raise InputError(
            f"point {k} has {degree[k]} bonds: droplets are closed rings in which every vertex has two; for disks "
            "leave the bonds out"
        )
    both = np.concatenate([ends, ends[:, ::-1]])
    neighbors = both[np.lexsort((both[:, 1], both[:, 0])), 1].reshape(-1, 2)
    order: list[int] = []
    offsets = [0]
    seen = np.zeros(count, dtype=bool)
    for start in range(count):
        before, here = int(neighbors[start, 1]), start
        while not seen[here]:
            seen[here] = True
            order.append(here)
            left, right = (int(k) for k in neighbors[here])
            before, here = here, right if left == before else left
        if len(order) > offsets[-1]:
            offsets.append(len(order))
    return Rings(np.array(order), np.array(offsets))


def rings_of_molecules(molecule: Indices) -> Rings | None:
    """Rings of points that follow each other within a molecule (n_vertices,); None if one has fewer than three
    points."""
    _, first, ring, sizes = np.unique(molecule, return_index=True, return_inverse=True, return_counts=True)
    if sizes.min() < 3:
        return None
    order = np.argsort(first[ring.reshape(-1)], kind="stable")
    return Rings(order, np.concatenate([[0], np.cumsum(sizes[np.argsort(first)])]))
