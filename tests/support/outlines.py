"""Polygons, walls and disks: LAMMPS data files in any numbering, and their energy and contacts in plain numpy."""

from dataclasses import dataclass, field

import numpy as np

RING, WALL, DISK = 1, 2, 3  # atom types
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
class Outline:
    """Vertices in order, of a ring, a chain or one disk; `a0`: rest area of a ring."""

    points: np.ndarray
    type: int = RING
    a0: float = 1.0

    @property
    def bonds(self):
        """Pairs of numbers in `points`."""
        k = np.arange(len(self.points))
        pairs = np.column_stack([k, np.roll(k, -1)])
        return pairs if self.type == RING else pairs[:-1]

    @property
    def area(self):
        """Of a ring, positive if it runs counter-clockwise."""
        r = self.points - self.points[0]
        following = np.roll(r, -1, axis=0)
        return np.sum(r[:, 0] * following[:, 1] - r[:, 1] * following[:, 0]) / 2


@dataclass
class Scene:
    """Outlines in an orthogonal periodic box; numbers of atoms count through `outlines`."""

    outlines: list
    box: np.ndarray
    starts: np.ndarray = field(init=False)

    def __post_init__(self):
        """Number of the first atom of each outline."""
        self.starts = np.cumsum([0, *(len(o.points) for o in self.outlines)])

    @property
    def points(self):
        """All of them."""
        return np.concatenate([o.points for o in self.outlines])

    def shifted(self, by):
        """The whole moved by a vector."""
        return Scene([Outline(o.points + by, o.type, o.a0) for o in self.outlines], self.box)


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
        pairs = ids[o.bonds + state.starts[m]] if len(o.points) > 1 else []
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


@dataclass
class Contact:
    """Atoms that meet, place on the edge, vector from it to the vertex, energy, force on the vertex."""

    vertex: int
    tail: int
    head: int
    t: float
    separation: np.ndarray
    energy: float
    force: np.ndarray


def _meet(state, m, k, shift, laws):
    """Contacts of the points of outline m with outline k, moved by `shift`."""
    one, two = state.outlines[m], state.outlines[k]
    eps, width = laws(one.type, two.type)
    low, high = two.points.min(axis=0) + shift - width, two.points.max(axis=0) + shift + width
    if np.any(one.points.max(axis=0) < low) or np.any(one.points.min(axis=0) > high):
        return
    pairs = two.bonds if len(two.points) > 1 else np.array([[0, 0]])
    tails, heads = two.points[pairs[:, 0]] + shift, two.points[pairs[:, 1]] + shift
    edge, r = heads - tails, one.points[:, None] - tails
    squares = np.maximum(np.sum(edge**2, axis=1), 1e-300)
    t = np.clip(np.sum(r * edge, axis=2) / squares, 0, 1)
    r = r - t[..., None] * edge
    distance = np.hypot(r[..., 0], r[..., 1])
    for v, e in enumerate(np.argmin(distance, axis=1)):
        d = distance[v, e]
        if d < width:
            ends = state.starts[k] + pairs[e]
            push = eps / width * (1 - d / width) * r[v, e] / d
            yield Contact(state.starts[m] + v, *ends, t[v, e], r[v, e], eps / 2 * (1 - d / width) ** 2, push)


def mixed(i, j):
    """Of two types that no pair_coeff names."""
    return np.sqrt(EPS[i] * EPS[j]), (WIDTH[i] + WIDTH[j]) / 2


def contacts(state, laws=mixed):
    """Every vertex meets every other outline once, at its closest point; a disk too; two disks once."""
    found = []
    for m, one in enumerate(state.outlines):
        for k, two in enumerate(state.outlines):
            if two.type == DISK and (one.type != DISK or k <= m):
                continue  # the disk has this contact, or the later of two disks
            for image in np.ndindex(3, 3):
                if m == k and image == (1, 1):
                    continue
                found += _meet(state, m, k, (np.array(image) - 1) * state.box, laws)
    return found


def lengths(outline):
    """Of the edges."""
    return np.hypot(*(outline.points[outline.bonds[:, 1]] - outline.points[outline.bonds[:, 0]]).T)


def energy(state, laws=mixed, gamma=GAMMA, ka=KA):
    """Contacts, line tension of rings and walls, area of rings."""
    total = sum(c.energy for c in contacts(state, laws))
    for o in state.outlines:
        total += gamma * np.sum(lengths(o)) if o.type != DISK else 0.0
        total += ka / 2 * (o.area - o.a0) ** 2 if o.type == RING else 0.0
    return total
