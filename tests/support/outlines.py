"""Droplets, walls and disks in one box: data files of LAMMPS in any numbering, and energy, forces and contacts by plain
loops over their laws.

`Scene` has one droplet type, one of walls and one of disks, in an orthogonal box.
"""

from dataclasses import dataclass, replace

import numpy as np

# contacts by plain loops ---------------------------------------------------------------------------------------------

FORMS = ("outline", "segment/smooth")
IMAGES = [(a, b) for a in range(-2, 3) for b in range(-2, 3)]
RING, WALL, DISK = 1, 2, 3  # atom types of a scene


@dataclass
class Outline:
    """Points in order, of a droplet, which is closed, of a wall, or of one disk; `a0`: rest area; `tags`: atom IDs."""

    points: np.ndarray
    type: int = RING
    a0: float = 1.0
    tags: np.ndarray | None = None

    @property
    def bonds(self):
        """Pairs of numbers in `points`."""
        k = np.arange(len(self.points))
        pairs = np.column_stack([k, np.roll(k, -1)])
        return pairs if self.type == RING else pairs[:-1]

    @property
    def edges(self):
        """The same; of a disk itself."""
        return self.bonds if len(self.points) > 1 else np.array([[0, 0]])

    @property
    def area(self):
        """Of a ring, positive if it runs counter-clockwise."""
        r = self.points - self.points[0]
        following = np.roll(r, -1, axis=0)
        return np.sum(r[:, 0] * following[:, 1] - r[:, 1] * following[:, 0]) / 2


@dataclass
class Contact:
    """Tags and types of what meets, place on the edge, vector from it to the vertex, force on the vertex, energy."""

    vertex: int
    tail: int
    head: int
    types: tuple
    t: float
    separation: np.ndarray
    force: np.ndarray
    energy: float


def near(outlines, box, reach=1.3):
    """Every pair of outlines and of images of outlines once, where their boxes come near each other."""
    for m, one in enumerate(outlines):
        for n, two in enumerate(outlines[: m + 1]):
            for image in IMAGES:
                moved = two.points + np.array(image) @ box
                gap = np.maximum(one.points.min(0) - moved.max(0), moved.min(0) - one.points.max(0)).max()
                if gap < reach and (m != n or image > (0, 0)):
                    yield one, two, moved


def feet(points, tails, heads):
    """Distances (m, n) of points to segments, vectors (m, n, 2) from their closest points, and the places of those."""
    edge, r = heads - tails, points[:, None] - tails
    t = np.clip(np.sum(r * edge, axis=2) / np.maximum(np.sum(edge**2, axis=1), 1e-300), 0, 1)
    r = r - t[..., None] * edge
    return np.hypot(r[..., 0], r[..., 1]), r, t


def meetings(one, two, form):
    """Lists of (side, vertex, edge), from each of which the closest counts; side 1: the vertex is of `two`."""
    for side, (points, other) in enumerate(((one, two), (two, one))):
        if len(other.points) == 1 and (len(points.points) > 1 or side):
            continue  # the disk is the point; of two disks, one
        for k in range(len(points.points)):
            choices = [(side, k, e) for e in range(len(other.edges))]
            yield from [choices] if form == "outline" else [[choice] for choice in choices]


def of_rims(d, eps, width, pull=0.0, reach=0.0):
    """Energy and force at a distance, `pull` and `reach` over the width."""
    x = 1 - d / width
    if x >= -pull:
        return eps / 2 * (x**2 - pull * reach), eps / width * x
    falls = pull / (reach - pull)
    return -eps / 2 * falls * (x + reach) ** 2, -eps / width * falls * (x + reach)


def all_contacts(outlines, box, law):
    """`law` gives eps, width and form of two types, and where they adhere the pull and its range over the width."""
    for one, two, moved in near(outlines, box):
        eps, width, form, *adhesion = law(one.type, two.type)
        sides = feet(one.points, *moved[two.edges.T]), feet(moved, *one.points[one.edges.T])
        for choices in meetings(one, two, form):
            side, k, e = min(choices, key=lambda c: sides[c[0]][0][c[1:]])
            d, r, t = (part[k, e] for part in sides[side])
            if d < width * (1 + (adhesion[1] if adhesion else 0)):
                p, q = (two, one) if side else (one, two)
                own, push = of_rims(d, eps, width, *adhesion)
                push = push * r / d
                tags = (p.tags[k], *q.tags[q.edges[e]])
                yield Contact(*tags, (p.type, q.type), t, r, push, own)


def own_contacts(one, near, law):
    """Of a vertex with the edges of its own outline: the range is `near` for each edge between, up to the width.

    Form outline takes the closest point of all edges with the full width, and each of the others. None adheres.
    """
    eps, width, form, *_ = law(one.type, one.type)
    n = len(one.points)
    d, r, t = feet(one.points, *one.points[one.edges.T])
    for k in range(n):
        ahead = (np.arange(n) - k) % n  # edges from the vertex to the tail
        between = np.minimum(ahead, n - 1 - ahead)
        ranges = np.minimum(width, near * between)
        touching = [e for e in range(n) if d[k, e] < ranges[e]]
        if form == "outline":
            rest = [e for e in touching if near * between[e] >= width]
            touching = [e for e in touching if e not in rest] + sorted(rest, key=lambda e: d[k, e])[:1]
        for e in touching:
            push = eps / ranges[e] * (1 - d[k, e] / ranges[e]) * r[k, e] / d[k, e]
            tags = (one.tags[k], *one.tags[one.edges[e]])
            yield Contact(*tags, (one.type, one.type), t[k, e], r[k, e], push, eps / 2 * (1 - d[k, e] / ranges[e]) ** 2)


# scenes --------------------------------------------------------------------------------------------------------------

EPS = {RING: 1.7, WALL: 0.9, DISK: 2.5}
WIDTH = {RING: 0.25, WALL: 0.3, DISK: 1.25}
GAMMA, KA = 0.13, 20.0

HEAD = """
clear
units lj
dimension 2
boundary p p p
newton {newton}
atom_modify map array sort 0 0.0
atom_style molecular
fix d_a0 all property/atom d_a0
"""
FORCE = f"""
neighbor 0.1 bin
neigh_modify every 1 delay 0 check yes
special_bonds lj/coul 1.0 1.0 1.0
bond_style line/tension
bond_coeff * {GAMMA}
pair_style circuloline {WIDTH[RING]} 1.2 walls {WALL} disks {DISK}
""" + "".join(f"pair_coeff {k} {k} {EPS[k]} {WIDTH[k]}\n" for k in EPS)
AREA = f"""
group rings type {RING}
fix area rings polygon/area {KA} d_a0
"""
THERMO = "thermo_modify norm no\n"
READ = "read_data {data} fix d_a0 NULL d_a0 extra/bond/per/atom 2 extra/special/per/atom 8\n"


def deck(data, newton="on"):
    """Commands up to the first run."""
    return HEAD.format(newton=newton) + READ.format(data=data) + FORCE + AREA + THERMO


def commands(lmp, text):
    """Line by line; `&` continues one."""
    for line in text.replace("&\n", "").splitlines():
        lmp.command(line)


def start(lmp, folder, state, more=""):
    """Read a state, set its laws, and go on with more commands."""
    (folder / "data").write_text(data(state))
    commands(lmp, deck("data") + more)


@dataclass
class Scene:
    """Outlines in an orthogonal periodic box; numbers of atoms count through `outlines`."""

    outlines: list
    box: np.ndarray
    near: float = 0.0  # `self` of pair style circuloline

    @property
    def starts(self):
        """Number of the first atom of each outline, and of all atoms."""
        return np.cumsum([0, *(len(o.points) for o in self.outlines)])

    @property
    def points(self):
        """All of them."""
        return np.concatenate([o.points for o in self.outlines])

    def shifted(self, by):
        """The whole moved by a vector."""
        return replace(self, outlines=[replace(o, points=o.points + by) for o in self.outlines])


def regular(corners, center, radius, a0=1.0):
    """A polygon."""
    turn = 2 * np.pi * np.arange(corners) / corners
    return Outline(np.add(center, radius * np.column_stack([np.cos(turn), np.sin(turn)])), a0=a0)


def scene(seed=0, foreign=True):
    """Sixteen cells with a jagged polygon each, or fourteen with two disks that touch, and a wall between two rows.

    Rims overlap, outlines do not cross; some leave the box.
    """
    rng = np.random.default_rng(seed)
    outlines, cell, shift = [], 1.3, rng.uniform(-1, 1, 2)
    for k in range(16):
        x, y = (k % 4 + 0.5) * cell, (k // 4 + 0.5) * cell + 0.3 * (k // 4 == 3)
        if foreign and k in (5, 6):
            outlines.append(Outline(np.array([[x + (0.07 if k == 5 else -0.07), y]]), DISK))
            continue
        n = int(rng.integers(7, 13))
        one = regular(n, (x, y), 0.62)
        one.points += rng.uniform(-0.02, 0.02, (n, 2))
        one.a0 = one.area * rng.uniform(0.9, 1.1)
        outlines.append(one)
    if foreign:
        x = np.arange(0.2, 4.0, 0.4)
        outlines.append(Outline(np.column_stack([x, 4.05 + rng.uniform(-0.03, 0.03, len(x))]), WALL))
    for one in outlines:
        one.points += shift
    return Scene(outlines, np.array([4 * cell, 4 * cell + 0.3]))


def data(state, ids=None, molecules=None, rows=None, clockwise=False):
    """Data file; `ids` of the atoms, `molecules` of the outlines, `rows`: order of the atoms in the file.

    Atoms are in the box, with image flags; `clockwise` turns the bonds of every other outline around.
    """
    n = len(state.points)
    ids = np.arange(1, n + 1) if ids is None else np.asarray(ids)
    molecules = np.arange(1, len(state.outlines) + 1) if molecules is None else molecules
    owner = np.repeat(np.arange(len(state.outlines)), np.diff(state.starts))
    image = np.floor(state.points / state.box).astype(int)
    place = state.points - image * state.box
    bonds = []
    for m, o in enumerate(state.outlines):
        pairs = ids[o.bonds + state.starts[m]]
        bonds += [pair[::-1] if clockwise and m % 2 else pair for pair in pairs]
    lines = ["outlines", "", f"{n} atoms", f"{len(bonds)} bonds", "3 atom types", "1 bond types"]
    lines += [f"0 {edge:.17g} {axis}lo {axis}hi" for edge, axis in zip(state.box, "xy", strict=True)]
    lines += ["-0.5 0.5 zlo zhi", "", "Masses", "", "1 1", "2 1", "3 1", "", "Atoms", ""]
    for k in range(n) if rows is None else rows:
        o, (x, y), (a, b) = state.outlines[owner[k]], place[k], image[k]
        lines.append(f"{ids[k]} {molecules[owner[k]]} {o.type} {x:.17g} {y:.17g} 0 {a} {b} 0")
    lines += ["", "Bonds", "", *(f"{k} 1 {a} {b}" for k, (a, b) in enumerate(bonds, start=1))]
    lines += ["", "d_a0", "", *(f"{ids[k]} {state.outlines[owner[k]].a0:.17g}" for k in range(n))]
    return "\n".join(lines) + "\n"


def mixed(i, j):
    """Eps and width of two types that no pair_coeff names."""
    return np.sqrt(EPS[i] * EPS[j]), (WIDTH[i] + WIDTH[j]) / 2


def contacts(state, laws=mixed, form="outline"):
    """Of form outline every vertex meets every other outline once, at its closest point; a disk too; two disks once.
    Those of outlines with themselves come last."""
    numbered = [
        replace(o, tags=np.arange(start, start + len(o.points)))
        for o, start in zip(state.outlines, state.starts[:-1], strict=True)
    ]
    law = lambda i, j: (*laws(i, j)[:2], form, *laws(i, j)[2:])  # noqa: E731
    of_rings = [c for o in numbered if state.near and o.type == RING for c in own_contacts(o, state.near, law)]
    return [*all_contacts(numbered, np.diag(state.box), law), *of_rings]


def area_force(points, ka, a0):
    """Energy of the area of a ring, whichever way it runs, and forces on its vertices."""
    chord, area = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0), Outline(points).area
    push = -ka / 2 * (abs(area) - a0) * np.sign(area)
    return ka / 2 * (abs(area) - a0) ** 2, push * np.column_stack([chord[:, 1], -chord[:, 0]])


def lengths(outline):
    """Of the edges."""
    return np.hypot(*(outline.points[outline.bonds[:, 1]] - outline.points[outline.bonds[:, 0]]).T)


def energy(state, laws=mixed, form="outline"):
    """Contacts, line tension of rings and walls, area of rings."""
    total = sum(c.energy for c in contacts(state, laws, form))
    for o in state.outlines:
        total += GAMMA * np.sum(lengths(o)) + (KA / 2 * (o.area - o.a0) ** 2 if o.type == RING else 0.0)
    return total


def forces(state, form, laws=mixed):
    """(atoms, 2) of all of them, in order of the atom numbers."""
    found = np.zeros_like(state.points)
    for c in contacts(state, laws, form):
        for number, share in ((c.vertex, 1.0), (c.tail, c.t - 1.0), (c.head, -c.t)):
            found[number] += share * c.force
    for start, o in zip(state.starts, state.outlines, strict=False):
        own = found[start : start + len(o.points)]
        if o.type == RING:
            own += area_force(o.points, KA, o.a0)[1]
        if o.type != DISK:
            a, b = o.bonds.T
            pull = GAMMA * (o.points[b] - o.points[a]) / lengths(o)[:, None]
            np.add.at(own, a, pull)
            np.subtract.at(own, b, pull)
    return found
