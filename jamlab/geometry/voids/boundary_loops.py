"""The boundary of the covered part of a packing: straight and circular pieces, chained into loops.

Every piece runs counter-clockwise around its particle, so that the void lies on its right. A piece ends where another
particle begins, and the loop continues along that particle. Loops live on a torus: each piece has a periodic image
relative to the first piece of its loop, and a loop may wind around the torus instead of closing.

The pieces of droplets come from `jamlab.geometry.droplet_cover`. Disks leave free arcs, each followed by the arc of the
disk that it meets.

A void with islands of particles has several loops. From the extreme point of an island in some direction a ray
continues in that direction, through the void, until it hits a loop of the same void. The extreme of what it hits lies
further on, so that from island to island the rays end at the loop around the void; where nothing encloses them they go
around the torus. A loop that winds around the torus casts its ray across the void, perpendicular to its winding.
"""

from dataclasses import dataclass, fields

import numpy as np

from jamlab.arrays import Array, Indices, Mask
from jamlab.errors import BoundaryError
from jamlab.geometry.boundary_pieces import Pieces
from jamlab.geometry.droplet_cover import Meeting, droplet_cover
from jamlab.geometry.power_cells import free_arcs
from jamlab.kernels.library import INTEGER, INTEGERS, kernel
from jamlab.packing.neighbors import periodic_neighbors
from jamlab.packing.packing import Packing

_chain = kernel("chain_loops", INTEGER, *[INTEGERS] * 6)


@dataclass(frozen=True)
class Rays:
    """Joints of boundaries, and rays through voids."""

    # ends of pieces this near, in radii, may be one corner: where circles graze, it errs by sqrt(rounding)
    joint: float = 1e-6
    rounding: float = 100 * np.finfo(np.float64).eps  # of coordinates, of ends: rims may be thinner than that
    same: float = 1e-5  # of that: ends of droplets, which both sides calculate alike, are nearer
    seam: float = 1e-7  # radians or half lengths beyond its ends that a piece stops a ray: none slips through a joint
    # cosine with the outward normal from which on a ray comes from inside; below, it may be rounding
    grazing: float = 1e-3
    graze: float = 1e-12  # how far beside a circle, in radii, a ray still meets it: rounding of its place
    # ray, in lengths of the cell; one that hits nothing in so many cells runs between all particles
    longest: float = 1e4


RAYS = Rays()


@dataclass(frozen=True)
class Boundary:
    """Pieces chained into loops."""

    pieces: Pieces  # the k pieces
    following: Indices  # (k,) int64, piece that comes next
    loop: Indices  # (k,) int64, loop that each piece belongs to
    image: Indices  # (k, 2) int64, lattice translation that puts each piece in line with the first of its loop
    winding: Indices  # (loops, 2) int64, lattice translation from the beginning of a loop to its end; zero if it closes
    origin: Indices  # (loops,) int64, piece with which each loop begins


def chain_pieces(pieces: Pieces, following: Indices, shift: Indices, box: Array, size: float) -> Boundary:
    """Chain k pieces into loops. `following`: (k,) piece that comes next, -1 where it is not known; `shift`: (k, 2)
    which periodic image of it; `size`: radius that `RAYS.joint` refers to."""
    _join_loose_ends(pieces, following, shift, box, RAYS.joint * size)
    count = len(following)
    (loop, origin), (image, winding) = np.empty((2, count), np.int64), np.empty((2, count, 2), np.int64)
    loops = _chain(count, following, shift, loop, image, winding, origin)
    assert loops >= 0, "every piece follows one other"
    return Boundary(pieces, following, loop, image, winding[:loops], origin[:loops])


def _join_loose_ends(pieces: Pieces, following: Indices, shift: Indices, box: Array, tolerance: float) -> None:
    """Fill in, in place, the pieces that come next where neighbours along the boundary are not known. Where three
    boundaries meet in one point, rounding may end a piece at one particle and begin the next at another: ends are
    matched with starts at the same place, one to one, with the least total distance."""
    known, taken = following >= 0, np.zeros(len(following), dtype=bool)
    taken[following[known]] = True
    loose, free, k = np.flatnonzero(~known), np.flatnonzero(~taken), int((~known).sum())
    if not k:
        return
    rounding = RAYS.rounding * float(np.abs(pieces.end).max() + np.abs(box).max())
    tolerance = max(tolerance, rounding)
    # both ends of a short overlap may lie within the tolerance
    for reach in (max(RAYS.same * tolerance, rounding), tolerance):
        near = periodic_neighbors(pieces.end[loose], pieces.start[free], box, reach)
        if len(near.i) == k and (np.bincount(near.i, minlength=k) * np.bincount(near.j, minlength=k) == 1).all():
            following[loose], shift[loose] = free[near.j], near.shift
            return
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    weight = np.hypot(*near.r.T) + 1e-3 * tolerance  # any positive constant will do: a sparse matrix would lose zeros
    try:
        end, start = min_weight_full_bipartite_matching(csr_array((weight, (near.i, near.j)), shape=(k, k)))
    except ValueError:
        lone = pieces.end[loose[np.bincount(near.i, minlength=k).argmin()]]
        raise BoundaryError(
            f"the boundary of the particles does not close near {lone.tolist()}: too many "
            "boundaries meet in one point; move a particle there by 1e-6 of its size"
        ) from None
    key = near.i * k + near.j
    order = np.argsort(key, kind="stable")
    chosen = order[np.searchsorted(key[order], end * k + start)]
    following[loose[end]], shift[loose[end]] = free[start], near.shift[chosen]


def trace(packing: Packing) -> Boundary:
    """Trace the boundary of what particles cover, flat walls with all behind their planes. Where it would continue with
    a mirror image it continues along the plane, to the next piece that comes from one."""
    whole: Boundary = packing.kind.boundary(packing.frame.images)
    if not packing.frame.is_flat:
        return whole
    (low, high), width, n = packing.frame.planes, float(packing.box[0, 0]), packing.n - 2
    kept, after, comes = whole.pieces.particle < n, whole.following, np.zeros(len(whole.following), dtype=bool)
    comes[after] = ~kept
    parts = [Pieces(*(getattr(whole.pieces, f.name)[kept] for f in fields(Pieces)))]
    for points in (parts[0].start, parts[0].end, parts[0].centre):
        points[:, 1] += low
    order = [np.where(kept[after], (np.cumsum(kept) - 1)[after], -1)[kept]]
    walls = np.argsort(packing.centroids[n:, 1] % packing.box[1, 1])
    for wall, plane, way in zip(n + walls, (low, high), (-1, 1), strict=True):
        ends, starts = (
            np.flatnonzero(loose & (np.abs(points[:, 1] - plane) < 0.5 * (high - low)))
            for loose, points in ((order[0] < 0, parts[0].end), (comes[kept], parts[0].start))
        )
        begin, goal = np.array([[0.0, plane]]), np.array([[way * width, plane]])  # nothing touches the plane
        if len(ends):
            begin, x = parts[0].end[ends], parts[0].start[starts, 0]
            starts = starts[np.mod(way * (x - begin[:, :1]), width).argmin(axis=1)]
            goal = parts[0].start[starts]
            goal[:, 0] += np.ceil(way * (begin - goal)[:, 0] / width) * way * width
        count, flat = sum(map(len, order)), np.zeros(len(begin))
        made = np.arange(count, count + len(begin))
        order[0][ends] = made[: len(ends)]
        order.append(starts if len(ends) else made)
        parts.append(Pieces(np.full(len(made), wall), begin, goal, 0.5 * (begin + goal), flat, flat, flat))
    pieces = Pieces(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Pieces)))
    following = np.concatenate(order)
    step = np.round((pieces.end - pieces.start[following])[:, 0] / width).astype(np.int64)
    return chain_pieces(pieces, following, np.column_stack([step, 0 * step]), packing.box, 0.0)  # all are known


def trace_disks(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the disks of an SP packing."""
    (chords, arcs), radius = free_arcs(packing), 0.5 * packing.disk_diameters
    m, w, centre = len(arcs.i), radius[arcs.i], packing.positions[arcs.i]
    begin, end = (
        centre + w[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        for angle in (arcs.start, arcs.start + arcs.angle)
    )
    pieces = Pieces(arcs.i, begin, end, centre, w, arcs.start, arcs.angle)
    whole = arcs.end < 0
    begins_at = np.full(len(chords.i) + 1, -1)
    begins_at[arcs.begin[~whole]] = np.flatnonzero(~whole)
    following = np.where(whole, np.arange(m), begins_at[np.append(chords.pair, -1)[arcs.end]])
    shift = np.where(whole[:, None], 0, np.append(chords.shift, [[0, 0]], axis=0)[arcs.end])
    return chain_pieces(pieces, following, shift, packing.box, float(radius.max()))


def trace_polygons(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the polygons of a DP packing, each grown by its rim delta/2."""
    found = droplet_cover(packing)
    i, j = found.met
    if found.meeting is Meeting.CROSSING:
        raise BoundaryError(f"outlines of polygons {i} and {j} cross: separate them; only their rims may overlap")
    if found.meeting is Meeting.INSIDE:
        raise BoundaryError(f"of polygons {i} and {j} one lies inside the other: move or remove it")
    shift = np.zeros((len(found.following), 2), dtype=np.int64)
    return chain_pieces(found.pieces, found.following.copy(), shift, packing.box, 0.5 * packing.params["delta"])


# rays through voids -------------------------------------------------------------------------------------------------


def follow_rays(loops: int, casting: Indices, hit: Indices, shift: Indices) -> tuple[Indices, Indices]:
    """Follow rays, of `find_first_hits`, from loop to loop: (loops,) at which they end, (loops, 2) in which image
    relative to it each lies. Where rays go around the torus without end, one of the loops on their way stands for
    all."""
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


def find_first_hits(boundary: Boundary, box: Array, casting: Indices, ignored: Mask) -> tuple[Indices, Indices]:
    """Find the loop that the ray of each casting loop, (c,), hits first, and in which image relative to that loop,
    (c, 2). `ignored`: (loops,) those that stop no ray."""
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
        if length > RAYS.longest * np.abs(box).sum():
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
        seen = np.flatnonzero((distance <= length) & (distance <= nearest[i] + RAYS.seam * reach))
        # at the tip of a thin rim a ray meets both sides at once, and that from outside counts
        order = seen[np.lexsort((distance[seen], away[seen], behind[seen], i[seen]))]
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


def _is_same_curve(boundary: Boundary, loop: Indices, other: Indices, image: Indices) -> Mask:
    """Whether a loop and the image of another are one curve, which a ray from its extreme point cannot meet again."""
    w = boundary.winding[loop]
    along = np.where(w.any(axis=1), w[:, 0] * image[:, 1] == w[:, 1] * image[:, 0], ~image.any(axis=1))
    return np.asarray((loop == other) & along)


def _meet_pieces(pieces: Pieces, piece: Indices, centre: Array, d: Array) -> tuple[Array, Array, Mask]:
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
        turn = np.mod(np.arctan2(y, x) - pieces.begin[piece] + RAYS.seam, 2 * np.pi) - RAYS.seam
        meets = (
            (radius > 0)
            & (np.abs(aside) <= (1 + RAYS.graze) * radius)
            & (turn <= angle + RAYS.seam)
            & (t > -RAYS.seam * radius)
        )
        forward = (x * d[:, 1] - y * d[:, 0]) / np.where(radius > 0, radius, 1.0)
        distance[meets] = t[meets]
        behind[meets] = (x * d[:, 0] + y * d[:, 1] > RAYS.grazing * radius)[meets]
        away[meets] = np.where(turn < RAYS.seam, forward, np.where(turn > angle - RAYS.seam, -forward, -1.0))[meets]
    e = 0.5 * (pieces.end - pieces.start)[piece]
    sine = d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]
    crosses = (radius == 0) & (sine != 0)
    t = np.divide(centre[:, 0] * e[:, 1] - centre[:, 1] * e[:, 0], sine, out=np.full_like(sine, np.inf), where=crosses)
    u = np.divide(-aside, sine, out=np.full_like(sine, np.inf), where=crosses)
    meets = crosses & (np.abs(u) <= 1 + RAYS.seam) & (t > -RAYS.seam)
    forward = np.einsum("ij,ij->i", e, d) / np.where(sine != 0, np.hypot(*e.T), 1.0)
    distance[meets] = t[meets]
    behind[meets] = (sine > RAYS.grazing * np.hypot(*e.T))[meets]
    away[meets] = np.where(u < RAYS.seam - 1, forward, np.where(u > 1 - RAYS.seam, -forward, -1.0))[meets]
    return distance, away, behind
