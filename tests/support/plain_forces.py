"""Energies, forces and virials of droplets, walls, disks and flat walls in plain numpy, over all periodic images, and
paths by velocity Verlet: what a run of LAMMPS must give whatever its options are.

Atoms are those of a data file of `outlines`: numbered along each outline, one molecule an outline. A wall of one atom
is a flat one.
"""

from dataclasses import dataclass, replace

import numpy as np
import outlines
import plain_outline_laws
from outlines import RING, WALL

FAR = 1e4  # edge of a box without images


@dataclass(frozen=True)
class Law:
    """Of all forces; `pairs` are (type, type, eps, width, form) that are not mixed."""

    eps: tuple = tuple(outlines.EPS.values())
    width: tuple = tuple(outlines.WIDTH.values())
    pairs: tuple = ()
    form: str = "outline"
    near: float = 0.0  # `self` of pair style circuloline
    gamma: float = outlines.GAMMA
    eta: float = 0.0
    ka: float = outlines.KA
    bonds: tuple = ()  # (atom ID, atom ID) beside the edges of outlines
    apart: tuple = ((), ())  # molecules of two sets that do not meet each other
    soft: tuple = ()  # strength and cutoff of pair style soft between all atoms
    push: tuple = (0.0, 0.0)  # on all atoms
    held: tuple = ()  # molecules whose forces are set to zero
    closed: bool = False  # no images
    adhesion: tuple = ()  # of each type the pull and its range, over the width
    bend: tuple = ()  # kappa, theta0
    perimeter: tuple = ()  # kp, kl, p0

    def of(self, i, j):
        """Eps, width and form of two types; pull and range where types adhere."""
        for one, two, *given in self.pairs:
            if {one, two} == {i, j}:
                return given
        own = np.sqrt(self.eps[i - 1] * self.eps[j - 1]), (self.width[i - 1] + self.width[j - 1]) / 2, self.form
        if not self.adhesion:
            return own
        pull = np.sqrt(self.adhesion[i - 1][0] * self.adhesion[j - 1][0])
        return *own, pull, (self.adhesion[i - 1][1] + self.adhesion[j - 1][1]) / 2 * (pull > 0)


@dataclass
class State:
    """Of all atoms in order of their IDs, with positions as unwrapped as LAMMPS has them."""

    points: np.ndarray
    molecules: np.ndarray
    types: np.ndarray
    a0: np.ndarray
    box: np.ndarray  # rows are edges
    low: np.ndarray

    def outlines(self):
        """By molecule, moved by whole boxes so that their middles are in the box, and the numbers of their atoms."""
        found, numbers = [], []
        for molecule in np.unique(self.molecules):
            own = np.flatnonzero(self.molecules == molecule)
            points = self.points[own] - self.low
            points = points - np.floor(points.mean(axis=0) @ np.linalg.inv(self.box)) @ self.box
            found.append(outlines.Outline(points, int(self.types[own[0]]), self.a0[own[0]], own))
            numbers.append(molecule)
        return found, numbers


@dataclass
class Found:
    """Energies and virials (xx, yy, xy) of contacts (`pair`), bonds and areas; forces of all atoms."""

    energy: dict
    virial: dict
    forces: np.ndarray

    def add(self, kind, energy, atoms, forces, r):
        """Forces on atoms, and where they act from any point that does not depend on the atom, if they add up to 0."""
        self.energy[kind] += energy
        np.add.at(self.forces, atoms, forces)
        self.virial[kind] += np.sum(np.asarray(r)[..., [0, 1, 0]] * np.asarray(forces)[..., [0, 1, 1]], axis=0)


KINDS = ("pair", "bond", "area", "outline")


def evaluate(state, law):
    """All of it."""
    found = Found(dict.fromkeys(KINDS, 0.0), {kind: np.zeros(3) for kind in KINDS}, np.zeros_like(state.points))
    all_outlines, molecules = state.outlines()
    add_contacts(found, all_outlines, molecules, state.box, law)
    for one in all_outlines:
        add_tension(found, one.tags[one.bonds], np.diff(one.points[one.bonds], axis=1)[:, 0], law)
        if one.type == RING:
            energy, push = outlines.area_force(one.points, law.ka, one.a0)
            found.add("area", energy, one.tags, push, one.points - one.points.mean(axis=0))
            if law.bend or law.perimeter:
                add_outline_laws(found, one, law)
    for pair in np.array(law.bonds, dtype=int).reshape(-1, 2) - 1:
        add_tension(found, pair[None], nearest(np.subtract(*state.points[pair[::-1]]), state.box)[None], law)
    if law.soft:
        add_soft(found, state, *law.soft)
    found.forces += law.push
    found.forces[np.isin(state.molecules, law.held)] = 0.0
    return found


def nearest(r, box):
    """Images of vectors, in boxes that lean by at most half their width."""
    for k in (1, 0):
        r = r - np.round(r[..., k] / box[k, k])[..., None] * box[k]
    return r


def add_tension(found, atoms, r, law):
    length = np.sqrt(np.sum(r**2, axis=1) + law.eta**2)
    pull = law.gamma * r / length[:, None]
    found.add("bond", law.gamma * np.sum(length), atoms[:, 0], pull, 0 * r)
    found.add("bond", 0.0, atoms[:, 1], -pull, r)


def add_outline_laws(found, one, law):
    """Bending of a ring, and elasticity of its perimeter and edges: forces by complex steps, counter-clockwise."""

    def energy(points):
        ring = points if one.area > 0 else points[::-1]
        own = plain_outline_laws.bending(ring, *law.bend) if law.bend else 0.0
        return own + (plain_outline_laws.perimeter(ring, one.a0, *law.perimeter) if law.perimeter else 0.0)

    points, push = one.points - one.points.mean(axis=0), np.zeros_like(one.points)
    for k in np.ndindex(*points.shape):
        moved = points.astype(complex)
        moved[k] += 1e-30j
        push[k] = -energy(moved).imag / 1e-30
    found.add("outline", energy(points), one.tags, push, points)


def add_contacts(found, all_outlines, molecules, box, law):
    lines = [one for one in all_outlines if one.type == WALL and len(one.points) == 1]
    rest = [one for one in all_outlines if not (one.type == WALL and len(one.points) == 1)]
    met = list(outlines.all_contacts(rest, FAR * np.eye(2) if law.closed else box, law.of))
    if law.near:
        met += [c for one in rest if one.type == RING for c in outlines.own_contacts(one, law.near, law.of)]
    whose = {tag: molecule for one, molecule in zip(all_outlines, molecules, strict=True) for tag in one.tags}
    for c in met:
        one, two = whose[c.vertex], whose[c.tail]
        if any(a in law.apart[0] and b in law.apart[1] for a, b in ((one, two), (two, one))):
            continue
        found.add("pair", c.energy, [c.vertex], c.force[None], c.separation[None])
        for end, share in ((c.tail, c.t - 1), (c.head, -c.t)):
            found.forces[end] += share * c.force
    for line in lines:
        eps, width, _, pull, reach = [*law.of(RING, WALL), 0.0, 0.0][:5]
        for one in rest:
            if one.type != RING:
                continue
            y = one.points[:, 1] - line.points[0, 1]
            y -= np.round(y / box[1, 1]) * box[1, 1]
            near = np.flatnonzero(np.abs(y) < width * (1 + reach))
            r = np.column_stack([0 * y, y])[near]
            each = np.array([outlines.of_rims(d, eps, width, pull, reach) for d in np.abs(y[near])]).reshape(-1, 2)
            push = each[:, 1:] * np.sign(r) * [0, 1]
            found.add("pair", each[:, 0].sum(), one.tags[near], push, r)
            found.forces[line.tags[0]] -= push.sum(axis=0)


def add_soft(found, state, strength, cutoff):
    """Pair style soft, of all atoms."""
    first, second = np.triu_indices(len(state.points), 1)
    r = nearest(state.points[first] - state.points[second], state.box)
    d = np.hypot(*r.T)
    near = d < cutoff
    first, second, r, d = first[near], second[near], r[near], d[near]
    turn = np.pi * d / cutoff
    push = (strength * np.pi / cutoff * np.sin(turn) / d)[:, None] * r
    found.add("pair", np.sum(strength * (1 + np.cos(turn))), first, push, r)
    np.subtract.at(found.forces, second, push)


def verlet(state, velocities, law, step, steps):
    """Places after steps of atoms of mass 1."""
    x, v, f = state.points.copy(), velocities.copy(), evaluate(state, law).forces
    for _ in range(steps):
        v += f * step / 2
        x += v * step
        f = evaluate(replace(state, points=x), law).forces
        v += f * step / 2
    return x


# files of LAMMPS -----------------------------------------------------------------------------------------------------


def read_dump(path):
    """State and forces of a dump with the columns id mol type xu yu fx fy d_a0."""
    lines = path.read_text().splitlines()
    leans = "xy" in lines[4]
    bounds = np.array([row.split() for row in lines[5:8]], dtype=float)
    lean = bounds[0, 2] if leans else 0.0
    low = np.array([bounds[0, 0] - min(0.0, lean), bounds[1, 0]])
    width = bounds[0, 1] - max(0.0, lean) - low[0]
    box = np.array([[width, 0.0], [lean, bounds[1, 1] - low[1]]])
    rows = np.array([row.split() for row in lines[9:]], dtype=float)
    rows = rows[np.argsort(rows[:, 0])]
    _, molecules, types = rows[:, :3].astype(int).T
    return State(rows[:, 3:5], molecules, types, rows[:, 7], box, low), rows[:, 5:7]


def state_of(scene):
    """A scene of `outlines` as the state that its data file gives."""
    owner = np.repeat(np.arange(len(scene.outlines)), np.diff(scene.starts))
    of = lambda name: np.array([getattr(one, name) for one in scene.outlines])[owner]  # noqa: E731
    return State(scene.points.copy(), owner + 1, of("type"), of("a0"), np.diag(scene.box), np.zeros(2))
