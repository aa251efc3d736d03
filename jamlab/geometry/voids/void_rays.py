"""Rays through voids, which find the loop around the void that an island of particles floats in.

A void with islands has several boundary loops. From the extreme point of an island in some direction a ray continues in
that direction, through the void, until it hits a loop of the same void. The extreme of what it hits lies further on, so
that from island to island the rays end at the loop around the void; where nothing encloses them they go around the
torus.
A loop that winds around the torus casts its ray across the void, perpendicular to its winding.

"""

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.errors import BoundaryError
from jamlab.geometry.voids.boundary_loops import Boundary, Pieces
from jamlab.packing.neighbors import periodic_neighbors


def follow_rays(loops: int, casting: Indices, hit: Indices, shift: Indices) -> tuple[Indices, Indices]:
    """Follow rays from loop to loop to their end.

    Args:
        loops: number of loops.
        casting, hit, shift: of `find_first_hits`.

    Returns:
        (loops,) int64, loop at which the rays from each one end, and (loops, 2) int64, in which image relative to it
        each one lies. Where rays go around the torus without end, one of the loops on their way stands for all.
    """
    ahead, image = np.arange(loops), np.zeros((loops, 2), dtype=np.int64)
    ahead[casting], image[casting] = hit, -shift
    lowest, far = np.arange(loops), ahead
    for _ in range(loops.bit_length()):  # each loop looks twice as far ahead every time
        lowest, far = np.minimum(lowest, lowest[far]), far[far]
    end = far[lowest[far] == far]  # of rays that end, and the lowest of those that go around
    ahead[end], image[end] = end, 0
    while not np.array_equal(further := ahead[ahead], ahead):
        image, ahead = image + image[ahead], further
    return ahead, image


Flags = NDArray[np.bool_]

JOINT = 1e-7  # radians or half lengths beyond its ends that a piece stops a ray: none slips through a joint
GRAZING = 1e-3  # cosine with the outward normal from which on a ray comes from inside; below, it may be rounding
GRAZE = 1e-12  # how far beside a circle, in radii, a ray still meets it: rounding of its place
LONGEST = 1e4  # ray, in lengths of the cell; one that hits nothing in so many cells runs between all particles


def find_first_hits(
    boundary: Boundary, box: Array, casting: Indices, ignored: NDArray[np.bool_]
) -> tuple[Indices, Indices]:
    """Find the loop that the ray of each loop hits first.

    Args:
        boundary: loops.
        box: (2, 2).
        casting: (c,) int64, loops that cast a ray.
        ignored: (loops,) bool, loops that stop no ray.

    Returns:
        (c,) int64, loop that is hit, and (c, 2) int64, in which image relative to the loop that cast the ray.
    """
    hit, shift = np.zeros(len(casting), dtype=np.int64), np.zeros((len(casting), 2), dtype=np.int64)
    if not len(casting):
        return hit, shift
    direction = _choose_directions(boundary, box, casting)
    source, origin = _find_extremes(boundary, box, casting, direction)
    stopping = np.flatnonzero(~ignored[boundary.loop])
    pieces = boundary.pieces
    straight = stopping[pieces.radius[stopping] == 0]
    half = 0.5 * np.hypot(*(pieces.end[straight] - pieces.start[straight]).T)
    reach = max(float(pieces.radius[stopping].max()), float(half.max(initial=0.0)))
    area_per_particle = abs(box[0, 0] * box[1, 1]) / (pieces.particle.max() + 1)
    open_rays, length = np.arange(len(casting)), 2 * np.sqrt(area_per_particle)
    while len(open_rays):
        if length > LONGEST * np.abs(box).sum():
            raise BoundaryError(
                f"no boundary within {length:.3g} of {origin[open_rays[0]].tolist()}: is the box empty?"
            )
        d = direction[open_rays]
        middle = origin[open_rays] + 0.5 * length * d
        near = periodic_neighbors(middle, pieces.centre[stopping], box, 0.5 * length + 1.001 * reach)
        piece = stopping[near.j]
        ray = open_rays[near.i]
        loop, image = boundary.loop[piece], near.shift + boundary.image[source[ray]] - boundary.image[piece]
        other = ~_is_same_curve(boundary, casting[ray], loop, image)
        i, piece, loop, image = near.i[other], piece[other], loop[other], image[other]
        centre = near.r[other] + 0.5 * length * d[i]
        distance, away, behind = _meet_pieces(pieces, piece, centre, d[i])
        nearest = np.full(len(open_rays), np.inf)
        np.minimum.at(nearest, i, distance)
        seen = np.flatnonzero((distance <= length) & (distance <= nearest[i] + JOINT * reach))
        order = seen[np.lexsort((distance[seen], away[seen], i[seen]))]
        first = order[np.unique(i[order], return_index=True)[1]]
        inner = first[behind[first]]
        if len(inner):
            a, b = pieces.particle[source[open_rays[i[inner[0]]]]], pieces.particle[piece[inner[0]]]
            raise BoundaryError(f"particle {a} lies inside particle {b}: move or remove it")
        hit[open_rays[i[first]]], shift[open_rays[i[first]]] = loop[first], image[first]
        open_rays = np.delete(open_rays, i[first])
        length *= 2
    return hit, shift


def _choose_directions(boundary: Boundary, box: Array, casting: Indices) -> Array:
    """(c, 2) unit vectors: to the right of a loop that winds, else across the windings of others, else along x."""
    winding = boundary.winding @ box
    right = np.column_stack([winding[:, 1], -winding[:, 0]])
    winds = (boundary.winding != 0).any(axis=1)
    default = right[winds][0] if winds.any() else np.array([1.0, 0.0])
    chosen = np.where(winds[casting][:, None], right[casting], default)
    return np.asarray(chosen / np.hypot(*chosen.T)[:, None])


def _find_extremes(boundary: Boundary, box: Array, casting: Indices, direction: Array) -> tuple[Indices, Array]:
    """(c,) piece of each loop that reaches furthest in its direction, and (c, 2) the point that it reaches."""
    rank = np.full(len(boundary.winding), -1)
    rank[casting] = np.arange(len(casting))
    k = np.flatnonzero(rank[boundary.loop] >= 0)
    ray, pieces = rank[boundary.loop[k]], boundary.pieces
    d = direction[ray]
    start, end = np.einsum("ij,ij->i", pieces.start[k], d), np.einsum("ij,ij->i", pieces.end[k], d)
    point = np.where((start > end)[:, None], pieces.start[k], pieces.end[k])
    bulging = np.mod(np.arctan2(d[:, 1], d[:, 0]) - pieces.begin[k], 2 * np.pi) <= pieces.angle[k]
    bulging &= pieces.radius[k] > 0
    point[bulging] = (pieces.centre[k] + pieces.radius[k][:, None] * d)[bulging]
    height = np.einsum("ij,ij->i", point + boundary.image[k] @ box, d)
    order = np.lexsort((-height, ray))
    first = order[np.unique(ray[order], return_index=True)[1]]
    return k[first], point[first]


def _is_same_curve(boundary: Boundary, loop: Indices, other: Indices, image: Indices) -> NDArray[np.bool_]:
    """Whether a loop and the image of another are one curve, which a ray from its extreme point cannot meet again."""
    w = boundary.winding[loop]
    along = np.where(w.any(axis=1), w[:, 0] * image[:, 1] == w[:, 1] * image[:, 0], ~image.any(axis=1))
    return np.asarray((loop == other) & along)


def _meet_pieces(pieces: Pieces, piece: Indices, centre: Array, d: Array) -> tuple[Array, Array, Flags]:
    """Where rays from the origin along unit vectors d meet pieces, moved to `centre`. Returns (m,) distance, inf for a
    miss, and (m,) how much the piece leads away from the origin of the ray: -1 where the ray meets its inside, else the
    component along d of its direction from the end that the ray meets. Of the voids on both sides of a point where two
    disks touch this tells the one that the ray comes through. (m,) bool, whether the ray comes from inside the
    particle."""
    distance, away = np.full(len(piece), np.inf), np.full(len(piece), -1.0)
    behind = np.zeros(len(piece), dtype=bool)
    ahead = np.einsum("ij,ij->i", centre, d)
    aside = d[:, 0] * centre[:, 1] - d[:, 1] * centre[:, 0]
    radius, angle = pieces.radius[piece], pieces.angle[piece]
    half = np.sqrt(np.maximum((radius - aside) * (radius + aside), 0.0))
    for t in (ahead + half, ahead - half):
        x, y = (t[:, None] * d - centre).T
        turn = np.mod(np.arctan2(y, x) - pieces.begin[piece] + JOINT, 2 * np.pi) - JOINT
        meets = (radius > 0) & (np.abs(aside) <= (1 + GRAZE) * radius) & (turn <= angle + JOINT) & (t > -JOINT * radius)
        forward = (x * d[:, 1] - y * d[:, 0]) / np.where(radius > 0, radius, 1.0)
        distance[meets] = t[meets]
        behind[meets] = (x * d[:, 0] + y * d[:, 1] > GRAZING * radius)[meets]
        away[meets] = np.where(turn < JOINT, forward, np.where(turn > angle - JOINT, -forward, -1.0))[meets]
    e = 0.5 * (pieces.end - pieces.start)[piece]
    sine = d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]
    crosses = (radius == 0) & (sine != 0)
    t = np.divide(centre[:, 0] * e[:, 1] - centre[:, 1] * e[:, 0], sine, out=np.full_like(sine, np.inf), where=crosses)
    u = np.divide(-aside, sine, out=np.full_like(sine, np.inf), where=crosses)
    meets = crosses & (np.abs(u) <= 1 + JOINT) & (t > -JOINT)
    forward = np.einsum("ij,ij->i", e, d) / np.where(sine != 0, np.hypot(*e.T), 1.0)
    distance[meets] = t[meets]
    behind[meets] = (sine > GRAZING * np.hypot(*e.T))[meets]
    away[meets] = np.where(u < JOINT - 1, forward, np.where(u > 1 - JOINT, -forward, -1.0))[meets]
    return distance, away, behind
