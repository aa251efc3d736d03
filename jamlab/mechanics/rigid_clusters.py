"""Rigid clusters of disks, from the (2, 3) pebble game: Jacobs & Thorpe, Phys. Rev. E 53, 3682 (1996).

A plane network of n points is rigid when 2 n - 3 of its bonds are independent, and bonds are independent when no part
of n' points has more than 2 n' - 3. Every point has two pebbles; an independent bond holds one of an end, and is found
independent when four pebbles can be gathered at its ends. The game counts: it takes places as generic, knows neither
forces nor gaps, and rounding moves nothing in it. A cluster that closes on itself through the periodic box counts as in
the open plane, with three motions of the whole instead of two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result


@dataclass(frozen=True)
class RigidClusters(Result):
    """Rigid clusters of a packing of disks, largest first. Two clusters may share a particle (a hinge).

    Attributes:
        bonds: (m,) int64, cluster of each contact, rows as in `Contacts.pairs`.
        sizes: (k,) int64, particles of each cluster, descending.
        redundant: number of contacts that are not needed for the rigidity of the clusters, taken as in the open plane.
            The periodic box holds a cluster that closes on itself through it from turning, which one of these contacts
            does: a single such cluster has one state of self-stress less.

    Example:
        >>> c = jamlab.rigid_clusters(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> c.sizes.tolist()
        [31]
    """

    _rows = ("sizes",)
    _apart = ("bonds",)

    bonds: NDArray[np.int64]
    sizes: NDArray[np.int64]
    redundant: int


@checked
def rigid_clusters(packing: Packing) -> RigidClusters:
    """Decompose the contact network into rigid clusters.

    Args:
        packing: SP, at rest or not; all contacts count as bonds, as in sticky disks.

    Raises:
        InputError: droplets or flat walls, whose contacts are not bonds between points.

    Example:
        >>> p = jamlab.pack(64, phi=0.6, seed=1, law={"stickiness": 0.1})
        >>> c = jamlab.rigid_clusters(p)
        >>> bool(c.sizes[0] < p.n), len(c.bonds) == len(jamlab.contacts(p).pairs)
        (True, True)
    """
    if packing.kind.motions != 2:
        what = f"{packing.kind.particles} (model {packing.model})"
        raise InputError(f"rigid clusters of {what}: contacts are no bonds between points, as of disks; use disks")
    if packing.frame.is_flat:
        raise InputError("flat walls: a contact with a line is no bond between points; use rough walls")
    pairs = contacts(packing).pairs
    game = _Game(len(packing.disk_diameters))  # refuses droplets
    redundant = 0
    for i, j in pairs.tolist():
        redundant += not game.add(i, j)
    bonds = _clusters(game, pairs)
    sizes = [len(np.unique(pairs[bonds == k])) for k in range(bonds.max(initial=-1) + 1)]
    order = np.argsort(sizes, kind="stable")[::-1].astype(np.int64)
    return RigidClusters(np.argsort(order)[bonds], np.array(sizes, dtype=np.int64)[order], redundant)


def _clusters(game: _Game, pairs: Indices) -> NDArray[np.int64]:
    """Cluster of each bond. With three pebbles at the ends of a bond, whoever can free a fourth moves against it."""
    bonds = np.full(len(pairs), -1, dtype=np.int64)
    count = 0
    for k, (i, j) in enumerate(pairs.tolist()):
        if bonds[k] >= 0:
            continue
        rigid = game.rigid_with(i, j)
        bonds[(bonds < 0) & rigid[pairs].all(axis=1)] = count
        count += 1
    return bonds


class _Game:
    """Pebbles of n points: two each, `free` ones, and those that hold a bond to the points in `held`."""

    def __init__(self, n: int) -> None:
        self.free = [2] * n
        self.held: list[list[int]] = [[] for _ in range(n)]

    def add(self, i: int, j: int) -> bool:
        """Hold a bond if it is independent of those held."""
        if i == j or not self._gather(i, j, 4):
            return False
        self.free[i] -= 1
        self.held[i].append(j)
        return True

    def rigid_with(self, i: int, j: int) -> NDArray[np.bool_]:
        """(n,) points that move with the bond of i and j, from which all free pebbles are taken but three: those to
        which no other can come."""
        self._gather(i, j, 3)
        rigid = np.array([not free or point in (i, j) for point, free in enumerate(self.free)])
        holders: list[list[int]] = [[] for _ in self.free]
        for point, others in enumerate(self.held):
            for other in others:
                holders[other].append(point)
        todo = np.flatnonzero(~rigid).tolist()
        while todo:
            for point in holders[todo.pop()]:
                if rigid[point] and point not in (i, j):
                    rigid[point] = False
                    todo.append(point)
        return rigid

    def _gather(self, i: int, j: int, wanted: int) -> bool:
        """Move free pebbles to i and j until there are as many as wanted; False if there are none to be had."""
        while self.free[i] + self.free[j] < wanted:
            if not (self._fetch(i, j) or self._fetch(j, i)):
                return False
        return True

    def _fetch(self, to: int, pinned: int) -> bool:
        """Bring a free pebble to a point that has room, along bonds that are turned round on the way."""
        if self.free[to] == 2:
            return False
        came: dict[int, int] = {to: -1, pinned: -1}
        todo = [to]
        while todo:
            point = todo.pop()
            for other in self.held[point]:
                if other in came:
                    continue
                came[other] = point
                if self.free[other]:
                    self.free[other] -= 1
                    while came[other] >= 0:  # the bond from `before` is held by `other` from now on
                        before = came[other]
                        self.held[before].remove(other)
                        self.held[other].append(before)
                        other = before
                    self.free[to] += 1
                    return True
                todo.append(other)
        return False
