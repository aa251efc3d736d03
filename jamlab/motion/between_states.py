"""Two states of the same particles: the strain of the box between them, neighbours, and how particles moved.

Boxes of one lattice are many, and particles may have been wrapped: the box strain is the smallest one that takes the
first lattice to the second, or the nearest to the strain that states of a run carry; motion beyond it is taken at its
shortest image.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from jamlab.arrays import Array, Mask
from jamlab.errors import InputError, named
from jamlab.geometry.tessellation import tessellation
from jamlab.packing.neighbors import Pairs, periodic_pairs, shortest_images
from jamlab.packing.packing import Packing


@runtime_checkable
class Run(Protocol):
    """What holds packings one after the other, such as the result of a flow."""

    @property
    def frames(self) -> tuple[Packing, ...]:
        """The packings, in the order of time."""
        ...


@dataclass(frozen=True)
class Between:
    """What happened between two states."""

    gradient: Array  # (2, 2) deformation gradient F of the box
    displacements: Array  # (n, 2) of the particles beyond F, without the motion of the whole

    def of_pairs(self, pairs: Pairs, before: Packing, after: Packing) -> Array:
        """(m, 2) change of the vectors of pairs beyond F."""
        i, j = pairs.i, pairs.j
        moved = after.centroids[j] - after.centroids[i] - pairs.r @ self.gradient.T
        return np.asarray(moved - shortest_images(moved, after.box) @ after.box)


def states_of(source: Run | Iterable[Packing], name: str, least: int = 2) -> list[Packing]:
    """The packings of a run or a sequence, all of the same particles."""
    packings = list(source.frames if isinstance(source, Run) else source)
    if len(packings) < least:
        kept = "; store more packings of a flow with snapshot_every=..." if isinstance(source, Run) else ""
        raise InputError(f"{name} has {len(packings)} packing(s): give {least} or more{kept}")
    foreign: list[object] = [each for each in packings if not isinstance(each, Packing)]
    if foreign:
        tables = "; use trackpy for a table of tracks" if isinstance(foreign[0], str) else ""
        kind = type(foreign[0]).__name__
        raise InputError(f"{name} has a {kind}: give a run, or packings one after the other{tables}")
    for number, each in enumerate(packings[1:], start=1):
        check_same_particles(packings[0], each, f"state {number} of {name}")
    return packings


def check_same_particles(before: Packing, after: Packing, name: str) -> None:
    """Refuse a state that cannot be one of the same particles in the same unit."""
    for what, own, other in (
        ("particles", before.n, after.n),
        ("model", before.model, after.model),
        ("units", before.units, after.units),
        ("walls", before.walls, after.walls),
        ("flat walls", int(before.flat_walls.sum()), int(after.flat_walls.sum())),
    ):
        if own != other:
            raise InputError(f"{name} has {what} = {other}, the first state {own}: give states of the same particles")


def between_states(before: Packing, after: Packing) -> Between:
    """Box strain and displacements between two states of the same particles."""
    gradient = box_gradient(before, after)
    moved = after.centroids - before.centroids @ gradient.T
    if before.frame.all_free:  # the whole may have moved: first to where most of it is
        phases = np.exp(2j * np.pi * moved @ np.linalg.inv(after.box))
        moved = moved - np.angle(phases.mean(axis=0)) / (2 * np.pi) @ after.box
    moved = moved - shortest_images(moved, after.box) @ after.box
    return Between(gradient, np.asarray(moved - before.frame.drift(moved)))


def flow_strain(packing: Packing, otherwise: float = np.nan) -> float:
    """Strain of the flow that a state of a run carries."""
    return float(packing.provenance.get("flow_strain", otherwise))


def flow_between(before: Packing, after: Packing) -> tuple[float, float]:
    """Strain and time of the flow from one state to another; 0 where they carry none.

    Both count from the start of a run. Where the box tells that the second state is of a run that the first one began,
    such as the last state of a run before, its own strain and time are taken."""
    (strain, _), of_one = _carried(before, after)
    own, earlier = (float(each.provenance.get("flow_time", 0.0)) for each in (after, before))
    return strain, own - earlier if of_one and own >= earlier else own


_STRETCH = 0.05  # over the strain: of the width of the box, or in what its lattice says, from which it was another


def box_gradient(before: Packing, after: Packing) -> Array:
    """(2, 2) deformation gradient F of the box, rows of boxes go from b to F b, over all boxes of the second lattice.

    F is nearest to 1; between states of runs that were sheared along x, nearest to the strain of the flow from one to
    the other, if the lattices agree with it. A state without strain is the start of the run."""
    return _carried(before, after)[0][1]


def _carried(before: Packing, after: Packing) -> tuple[tuple[float, Array], bool]:
    """Strain of the flow from one state to another, with the gradient of the box; and whether both are of one run."""
    own, earlier = flow_strain(after, 0.0), flow_strain(before, 0.0)
    size = np.sqrt(before.area / after.area)
    stretch = after.box[0, 0] / before.box[0, 0] * size  # 1 in simple shear along x
    most = _STRETCH * max(abs(own - earlier), abs(own))
    agreed = []
    for strain, of_one in ((own - earlier, True), (own, False)):
        gradient = _nearest(before, after, strain)
        off = abs(float(gradient[0, 1] * size) - strain)
        if max(abs(stretch - 1), off) <= most:
            agreed.append((off, abs(strain), (strain, gradient), of_one))
    if not agreed:
        return (own - earlier, _nearest(before, after, 0.0)), True
    nearest = min(each[0] for each in agreed)
    return min((each for each in agreed if each[0] <= nearest + _SAME), key=lambda each: each[1])[2:]


_SAME = 1e-3  # strains that lattices do not tell apart: then the smaller one is taken


def _nearest(before: Packing, after: Packing, strain: float) -> Array:
    """(2, 2) gradient of the box nearest to a simple shear along x, but for its size."""
    expected = np.array([[1.0, strain], [0.0, 1.0]])
    size = np.sqrt(before.area / after.area)
    start = np.linalg.inv(before.box)
    wanted = np.rint(before.box @ expected.T @ np.linalg.inv(after.box * size)).astype(np.int64)
    best, found = np.inf, np.eye(2)
    for change in itertools.product((0, -1, 1), repeat=4):
        whole = wanted + np.reshape(change, (2, 2))
        if whole[0, 0] * whole[1, 1] - whole[0, 1] * whole[1, 0] != 1:
            continue
        gradient = (start @ (whole @ after.box)).T
        off = float(((gradient * size - expected) ** 2).sum())
        if off < best - 1e-12:
            best, found = off, gradient
    return found


def neighbors_of(packing: Packing, cutoff: float | None, counted: Mask) -> Pairs:
    """Neighbours of each particle that counts, from both ends: within a distance of centres, or by cells that share a
    wall. Flat walls are no neighbours, and nothing is a neighbour across them."""
    if cutoff is not None and not (np.isfinite(cutoff) and cutoff > 0):
        raise InputError(f"{named('cutoff', cutoff)}: must be a finite distance above 0, or None for cells")
    x, box = packing.centroids, packing.box
    if cutoff is None:
        cells = tessellation(packing)
        i, j, shift = cells.wall_i, cells.wall_j, cells.wall_shift
        once = Pairs(i, j, x[j] - x[i] + shift @ box, shift)
    else:
        once = periodic_pairs(x, box, cutoff)
    if packing.frame.is_flat and cutoff is not None:
        inside = np.floor(x[:, 1] / box[1, 1])
        once = once.select(inside[once.j] - inside[once.i] == -once.shift[:, 1])
    once = once.select(counted[once.i] & counted[once.j])
    return Pairs(
        np.concatenate([once.i, once.j]),
        np.concatenate([once.j, once.i]),
        np.concatenate([once.r, -once.r]),
        np.concatenate([once.shift, -once.shift]),
    )


def at_rest(states: Iterable[Packing]) -> bool:
    """Whether all states are energy minima."""
    return all(each.converged for each in states)
