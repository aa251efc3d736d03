"""Random droplets, disks and walls in one box, their data file, and the law of their contacts in plain loops."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

FORMS = ("outline", "segment", "segment/smooth")
DISKS, WALLS = (5, 6), (3, 4)  # types; 1 and 2 are droplets
EPS = (1.0, 1.7, 0.8, 2.0, 1.3, 0.9)
WIDTHS = (0.25, 0.3, 0.2, 0.28, 0.5, 0.7)  # of a disk: its diameter
GIVEN = {(1, 5): (2.2, 0.45), (2, 3): (0.6, 0.31)}  # eps and width of pairs that are not mixed
MIXED = {(1, 2): "segment/smooth", (1, 3): "segment", (1, 5): "segment", (3, 5): "segment/smooth", (5, 6): "segment"}
IMAGES = [(a, b) for a in range(-2, 3) for b in range(-2, 3)]


@dataclass
class Outline:
    """Points of a droplet, wall or disk in order; a disk is one point."""

    type: int
    points: np.ndarray
    closed: bool
    tags: np.ndarray | None = None

    def edges(self):
        numbers = range(len(self.points))
        last = [(numbers[-1], 0)] if self.closed or len(numbers) == 1 else []
        return [*pairwise(numbers), *last]

    def line(self, points):
        if len(points) == 1:
            return shapely.Point(points)
        return (shapely.LinearRing if self.closed else shapely.LineString)(points)


def law_of(a, b, form):
    """eps, width and form of two types; form "mixed": outline, but for the pairs of MIXED."""
    a, b = min(a, b), max(a, b)
    mixed = math.sqrt(EPS[a - 1] * EPS[b - 1]), (WIDTHS[a - 1] + WIDTHS[b - 1]) / 2
    return *GIVEN.get((a, b), mixed), MIXED.get((a, b), "outline") if form == "mixed" else form


def pairs(outlines, box, first=0):
    """Every pair of outlines and of images of outlines once, where their boxes come near each other."""
    for m, one in enumerate(outlines[first:], start=first):
        for n, two in enumerate(outlines[: m + 1]):
            for image in IMAGES:
                moved = two.points + np.array(image) @ box
                gap = np.maximum(one.points.min(0) - moved.max(0), moved.min(0) - one.points.max(0)).max()
                if gap < 0.8 and (m != n or image > (0, 0)):
                    yield one, two, moved


def foot(point, tail, head):
    """Distance of a point to a segment, vector from the closest point of it, place of that between its ends."""
    edge = head - tail
    t = min(1.0, max(0.0, (point - tail) @ edge / (edge @ edge))) if edge @ edge > 0 else 0.0
    r = point - tail - t * edge
    return math.hypot(*r), r, t


def meetings(one, two, form):
    """Lists of (vertex, edge, whether the vertex is of `two`), from each of which the closest counts."""
    disks = one.type in DISKS, two.type in DISKS
    if form == "segment":
        for e in one.edges():
            for f in two.edges():
                yield [(e[0], f, False), (e[1], f, False), (f[0], e, True), (f[1], e, True)]
        return
    for points, other, of_two in ((one, two, False), (two, one, True)):
        if disks[1 - of_two] and (not disks[of_two] or of_two):
            continue  # the disk is the point; of two disks, one
        for k in range(len(points.points)):
            choices = [(k, edge, of_two) for edge in other.edges()]
            yield from [choices] if form == "outline" else [[choice] for choice in choices]


def evaluate(outlines, box, form):
    """Energy, forces by tag, pressure tensor, and what tells a contact: tags, types, force, energy; from the law."""
    forces = np.zeros((sum(len(o.points) for o in outlines), 2))
    contacts, virial = [], np.zeros((2, 2))
    for one, two, moved in pairs(outlines, box):
        eps, width, way = law_of(one.type, two.type, form)
        for choices in meetings(one, two, way):
            found = []
            for k, (tail, head), of_two in choices:
                (p, a), (q, b) = ((two, moved), (one, one.points)) if of_two else ((one, one.points), (two, moved))
                found.append((foot(a[k], b[tail], b[head]), p, q, k, tail, head))
            (d, r, t), p, q, k, tail, head = min(found, key=lambda f: f[0][0])
            if d >= width:
                continue
            push = eps / width * (1 - d / width) * r / d
            tags = p.tags[k], q.tags[tail], q.tags[head]
            for tag, share in zip(tags, (1.0, t - 1.0, -t), strict=True):
                forces[tag - 1] += share * push
            virial += np.outer(r, push)
            contacts.append((*tags, p.type, q.type, *push, *r, eps / 2 * (1 - d / width) ** 2))
    contacts = np.array(sorted(contacts))
    return contacts[:, -1].sum(), forces, virial / np.linalg.det(box), contacts


def coefficients(form):
    """pair_coeff lines: each type, then the pairs that are not mixed."""
    lines = [f"pair_coeff {k} {k} {eps} {width}" for k, (eps, width) in enumerate(zip(EPS, WIDTHS, strict=True), 1)]
    for pair in GIVEN.keys() | (MIXED if form == "mixed" else {}).keys():
        eps, width, way = law_of(*pair, form)
        lines.append(f"pair_coeff {pair[0]} {pair[1]} {eps!r} {width!r} {way}")
    return "\n".join(lines)


def fits(new, outlines, box):
    """No edge crosses another, and no distance is so small that finite differences lose digits."""
    one = new.line(new.points)
    for _, two, moved in pairs([*outlines, new], box, first=len(outlines)):
        if one.distance(two.line(moved)) < 0.4 * law_of(new.type, two.type, "outline")[1]:
            return False
    return True


def shape(rng, kind):
    """A random outline of a type, around the origin."""
    if kind in DISKS:
        return np.zeros((1, 2)), False
    if kind == 3:
        steps = rng.uniform(0.3, 0.7, rng.integers(1, 5))
        turns = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.uniform(-0.9, 0.9, len(steps)))
        line = np.cumsum(steps[:, None] * np.column_stack([np.cos(turns), np.sin(turns)]), axis=0)
        return np.vstack([[0, 0], line]), False
    count = rng.integers(4, 12)
    turns = 2 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count)) / count * rng.choice([-1, 1])
    return rng.uniform(0.25, 0.5, count)[:, None] * np.column_stack([np.cos(turns), np.sin(turns)]), True


def mixture(seed, tilt, kinds=(4, 3, 3, 3, 1, 2, 1, 2, 1, 6, 6, 5, 5, 5), width=3.1, height=3.1):
    """Outlines at random places of a box, some a little outside; their atom IDs mean nothing."""
    rng = np.random.default_rng(seed)
    box = np.array([[width, 0.0], [tilt * width, height]])
    outlines = []
    for kind in kinds:
        for _ in range(3000):
            points, closed = shape(rng, kind)
            new = Outline(kind, points + rng.uniform(-0.2, 1.2, 2) @ box, closed)
            if fits(new, outlines, box):
                outlines.append(new)
                break
    return number(outlines, rng), box


def number(outlines, rng):
    """Give the points atom IDs in any order."""
    tags = rng.permutation(sum(len(o.points) for o in outlines)) + 1
    for o, ends in zip(outlines, np.cumsum([len(o.points) for o in outlines]), strict=True):
        o.tags = tags[ends - len(o.points) : ends]
    return outlines


def seam():
    """A wall through the periodic boundary; a disk and a droplet lie where its end is next to its own image."""
    ring = 0.3 * np.column_stack([np.cos(np.arange(7)), np.sin(np.arange(7))])
    wall = np.column_stack([np.linspace(0.0, 1.9, 4), [0.5, 0.52, 0.47, 0.49]])
    outlines = [
        Outline(3, wall, False),
        Outline(6, np.array([[1.93, 0.75]]), False),
        Outline(1, ring - [0.02, 0.0], True),
    ]
    return number(outlines, np.random.default_rng(6)), np.array([[2.0, 0.0], [0.3, 2.5]])


def write(path, outlines, box):
    """Data file; half of the disks belong to no molecule."""
    atoms, bonds = [], []
    for m, o in enumerate(outlines, start=1):
        molecule = 0 if o.type == 5 else m
        atoms += [
            f"{tag} {molecule} {o.type} {x:.17g} {y:.17g} 0" for tag, (x, y) in zip(o.tags, o.points, strict=True)
        ]
        bonds += [(o.tags[a], o.tags[b]) for a, b in o.edges() if a != b]
    tilted = f"{box[1, 0]:.17g} 0 0 xy xz yz\n" if box[1, 0] else ""
    path.write_text(
        f"mixture\n\n{len(atoms)} atoms\n6 atom types\n{len(bonds)} bonds\n1 bond types\n2 extra bond per atom\n\n"
        f"0 {box[0, 0]:.17g} xlo xhi\n0 {box[1, 1]:.17g} ylo yhi\n-0.5 0.5 zlo zhi\n{tilted}\nAtoms # molecular\n\n"
        + "\n".join(atoms)
        + "\n\nBonds\n\n"
        + "\n".join(f"{k} 1 {a} {b}" for k, (a, b) in enumerate(bonds, start=1))
        + "\n"
    )
