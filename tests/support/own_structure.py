"""g(r), S(k) and chi_V(k) by plain numpy: every image and every wavevector in turn, without the code of jamlab."""

from itertools import pairwise

import numpy as np
from scipy.special import j1


def images(box, reach):
    """(m, 2) all lattice vectors no longer than reach, and some more."""
    heights = abs(np.linalg.det(box)) / np.hypot(*box[::-1].T)
    a, b = (int(np.ceil(reach / height)) + 1 for height in heights)
    return np.array([i * box[0] + j * box[1] for i in range(-a, a + 1) for j in range(-b, b + 1)])


def wavevectors(box, k_max):
    """(m, 2) half of the reciprocal lattice within k_max, by k_x, then k_y."""
    (lx, _), (tilt, ly) = box
    found = []
    for h in range(int(k_max * lx / (2 * np.pi) + 1e-9) + 1):
        shift = h * tilt / lx
        most = int(k_max * ly / (2 * np.pi)) + 2
        for number in range(int(np.floor(shift)) - most, int(np.ceil(shift)) + most + 1):
            k = 2 * np.pi * np.array([h / lx, (number - shift) / ly])
            if np.hypot(*k) <= k_max * (1 + 1e-12) and (h > 0 or k[1] > 1e-9):
                found.append(k)
    return np.array(sorted(found, key=lambda k: (round(k[0], 7), k[1])))


def wrapped(points, box):
    """In the box, where rounding of phases is least."""
    return points - np.floor(points @ np.linalg.inv(box)) @ box


def structure_factor(centres, box, k_max):
    k = wavevectors(box, k_max)
    return np.abs(np.exp(-1j * k @ wrapped(centres, box).T).sum(axis=1)) ** 2 / len(centres)


def spectrum_of_disks(packing, k_max):
    """chi_V of undeformed disks, what two share counted twice."""
    k = wavevectors(packing.box, k_max)
    size, radius = np.hypot(*k.T)[:, None], 0.5 * packing.diameters
    terms = 2 * np.pi * radius * j1(size * radius) / size * np.exp(-1j * k @ wrapped(packing.positions, packing.box).T)
    return np.abs(terms.sum(axis=1)) ** 2 / packing.area


def _arc(k, centre, radius, begin, angle):
    """Integral of exp(-i k.x) k.n over an arc, n outwards."""
    node, weight = np.polynomial.legendre.leggauss(80)
    turn = begin + 0.5 * angle * (1 + node)
    normal = np.array([np.cos(turn), np.sin(turn)])
    waves = np.exp(-1j * (k @ centre)[:, None] - 1j * radius * k @ normal)
    return (waves * (k @ normal)) @ weight * 0.5 * angle * radius


def _uncovered(covered):
    """What is left of a circle without arcs (middle, half angle): (begin, angle) of each part."""
    ends = sorted(((middle - half) % (2 * np.pi), 2 * half) for middle, half in covered)
    if not ends:
        return [(0.0, 2 * np.pi)]
    left, reach = [], max(begin + length - 2 * np.pi for begin, length in ends)  # those that go once around
    for begin, length in ends:
        if begin > reach:
            left.append((max(reach, 0.0), begin - max(reach, 0.0)))
        reach = max(reach, begin + length)
    if reach < 2 * np.pi:
        left.append((max(reach, 0.0), 2 * np.pi - max(reach, 0.0)))
    return left


def spectrum_of_union(packing, k_max):
    """chi_V of the union of disks none of which lies inside another."""
    k, radius = wavevectors(packing.box, k_max), 0.5 * packing.diameters
    centres, flux = wrapped(packing.positions, packing.box), 0.0
    moves = images(packing.box, 2 * radius.max() + np.abs(packing.box).sum())
    for i, centre in enumerate(centres):
        apart = (centres + moves[:, None] - centre).reshape(-1, 2)
        r, other = np.hypot(*apart.T), np.tile(radius, len(moves))
        (x, y), r, other = (values[..., (0 < r) & (r < radius[i] + other)] for values in (apart.T, r, other))
        height = (r**2 + radius[i] ** 2 - other**2) / (2 * r)
        covered = list(zip(np.arctan2(y, x), np.arccos(height / radius[i]), strict=True))
        for begin, angle in _uncovered(covered):
            flux = flux + _arc(k, centre, radius[i], begin, angle)
    return np.abs(flux / np.sum(k**2, axis=1)) ** 2 / packing.area


def spectrum_of_convex_droplets(packing, k_max):
    """chi_V of convex polygons with their rims that are apart."""
    k, w, flux = wavevectors(packing.box, k_max), 0.5 * packing.params["delta"], 0.0
    for ring in np.split(packing.positions, packing.offsets[1:-1]):
        edges = np.roll(ring, -1, axis=0) - ring
        normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.hypot(*edges.T)[:, None]
        for corner, edge, normal, before in zip(ring, edges, normals, np.roll(normals, 1, axis=0), strict=True):
            middle = corner + 0.5 * edge + w * normal
            phase = np.sinc(k @ edge / (2 * np.pi)) * np.exp(-1j * k @ middle)
            flux = flux + (k @ normal) * phase * np.hypot(*edge)
            angle = np.arctan2(before[0] * normal[1] - before[1] * normal[0], before @ normal)
            assert angle > 0
            flux = flux + _arc(k, corner, w, np.arctan2(before[1], before[0]), angle)
    return np.abs(flux / np.sum(k**2, axis=1)) ** 2 / packing.area


def pair_counts(centres, box, edges, first, second):
    """(m,) ordered pairs of a point of the first kind and an image of one of the second, by distance."""
    box, centres = np.asarray(box), wrapped(centres, box)
    moves = images(box, edges[-1] + np.abs(box).sum())
    apart = centres[second][:, None] + moves - centres[first][:, None, None]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    same = np.flatnonzero(first)[:, None] == np.flatnonzero(second)
    distance[same[:, :, None] & (moves == 0).all(axis=1)] = -1.0
    return np.array([np.sum((a <= distance) & (distance < b)) for a, b in pairwise(edges)])


def pair_correlation(centres, box, edges, first, second):
    gas = first.sum() * second.sum() * np.pi * np.diff(np.square(edges)) / abs(np.linalg.det(box))
    return pair_counts(centres, box, edges, first, second) / gas
