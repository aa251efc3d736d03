"""Energy, forces and stress of a packing from plain loops; of jamlab it uses nothing but Packing attributes."""

import math
from dataclasses import dataclass

import numpy as np

IMAGES = [(a, b) for a in range(-2, 3) for b in range(-2, 3)]


@dataclass
class Reference:
    """Sums over all terms; `contact_energy` is the part between different particles."""

    energy: float
    contact_energy: float
    forces: np.ndarray
    stress: np.ndarray


def evaluate(packing):
    """Reference values of any packing whose particles lie within about one box length of the box."""
    return _disks(packing) if packing.model == "sp" else _polygons(packing)


def _disks(p):
    x, d, box = p.positions, p.diameters, p.box
    energy, forces, moment = 0.0, np.zeros_like(x), np.zeros((2, 2))
    for i in range(len(x)):
        for j in range(i + 1):
            s = (d[i] + d[j]) / 2
            for a, b in IMAGES:
                if j == i and (a, b) <= (0, 0):  # its own images: one of two opposite ones, not itself
                    continue
                r = x[i] - x[j] + a * box[0] + b * box[1]
                distance = math.hypot(r[0], r[1])
                if distance >= s:
                    continue
                if p.units == "eps":
                    energy += p.params["eps"] / 2 * (1 - distance / s) ** 2
                    push = p.params["eps"] * (1 - distance / s) / s
                else:
                    energy += p.params["k"] / 2 * (s - distance) ** 2
                    push = p.params["k"] * (s - distance)
                force = push * r / distance
                forces[i] += force
                forces[j] -= force
                moment += np.outer(force, r)
    return Reference(energy, energy, forces, moment / _area(box))


def _polygons(p):
    rings = [np.arange(p.offsets[m], p.offsets[m + 1]) for m in range(len(p.offsets) - 1)]
    forces, moment = np.zeros_like(p.positions), np.zeros((2, 2))
    energy = sum(_bare(p, ring, a0, forces, moment) for ring, a0 in zip(rings, p.params["a0"], strict=True))
    contact = 0.0
    for m, ring in enumerate(rings):
        for other in rings[: m + 1]:
            for a, b in IMAGES:
                if other is ring and (a, b) <= (0, 0):  # its own images: one of two opposite ones, not itself
                    continue
                shift = a * p.box[0] + b * p.box[1]
                if not _far(p.positions[ring], p.positions[other] + shift, p.params["delta"]):
                    contact += _meet(p, ring, other, shift, forces, moment)
    return Reference(energy + contact, contact, forces, moment / _area(p.box))


def _bare(p, ring, a0, forces, moment):
    """Line tension and area elasticity of one polygon."""
    x = p.positions[ring]
    count, gamma, ka, eta = len(ring), p.params["gamma"], p.params["ka"], p.params["eta"]
    own = np.zeros_like(x)
    energy = area = 0.0
    for k in range(count):
        after = (k + 1) % count
        edge = x[after] - x[k]
        length = math.sqrt(edge[0] ** 2 + edge[1] ** 2 + eta**2)
        energy += gamma * length
        if length > 0:
            own[k] += gamma * edge / length
            own[after] -= gamma * edge / length
        area += (x[k, 0] * x[after, 1] - x[after, 0] * x[k, 1]) / 2
    energy += ka / 2 * (area - a0) ** 2
    for k in range(count):
        chord = x[(k + 1) % count] - x[k - 1]
        own[k] -= ka * (area - a0) / 2 * np.array([chord[1], -chord[0]])
    forces[ring] += own
    moment += own.T @ (x - x[0])
    return energy


def _meet(p, ring, other, shift, forces, moment):
    """Contact energy of two polygons, the second in one periodic image."""
    one = [(int(i), tuple(p.positions[i])) for i in ring]
    two = [(int(i), tuple(p.positions[i] + shift)) for i in other]
    energy = 0.0
    if p.params["contact"] == "outline":
        for vertices, outline in ((one, two), (two, one)):
            for vertex in vertices:
                energy += _contact(p, min(_foot(vertex, edge) for edge in _sides(outline)), forces, moment)
        return energy
    for e in _sides(one):
        for f in _sides(two):
            feet = _foot(e[0], f), _foot(e[1], f), _foot(f[0], e), _foot(f[1], e)
            if p.params["contact"] == "segment":
                energy += _contact(p, min(feet), forces, moment)
            else:
                energy += sum(_contact(p, foot, forces, moment, weight=0.5) for foot in feet)
    return energy


def _contact(p, foot, forces, moment, weight=1.0):
    distance, i, x, tail, head, t, nearest = foot
    delta, eps = p.params["delta"], weight * p.params["eps"]
    if distance >= delta:
        return 0.0
    r = np.subtract(x, nearest)
    force = eps / delta * (1 - distance / delta) * r / distance
    forces[i] += force
    forces[tail] -= (1 - t) * force
    forces[head] -= t * force
    moment += np.outer(force, r)
    return eps / 2 * (1 - distance / delta) ** 2


def _foot(vertex, edge):
    """Distance from a vertex to an edge, then who takes part and where; tuples compare by distance."""
    (i, (x, y)), ((tail, (ax, ay)), (head, (bx, by))) = vertex, edge
    square = (bx - ax) ** 2 + (by - ay) ** 2
    t = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / square if square > 0 else 0.0
    t = max(0.0, min(1.0, t))
    nearest = (ax + t * (bx - ax), ay + t * (by - ay))
    return math.hypot(x - nearest[0], y - nearest[1]), i, (x, y), tail, head, t, nearest


def _sides(outline):
    return [(outline[k], outline[(k + 1) % len(outline)]) for k in range(len(outline))]


def _far(one, two, delta):
    """Whether a gap wider than delta lies between the bounding boxes."""
    gap = np.maximum(one.min(axis=0) - two.max(axis=0), two.min(axis=0) - one.max(axis=0))
    return gap.max() >= delta


def _area(box):
    return box[0, 0] * box[1, 1] - box[0, 1] * box[1, 0]
