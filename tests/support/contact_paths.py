"""How smooth a contact form is: jumps of energy and force along paths of two polygons, found by bisection."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import jamlab

SAMPLES = 240  # steps along a path, before bisection
STEEPEST = 12  # of them are bisected
HALVINGS = 36  # 1e-11 of a step: what is left is a jump
JUMP = 1e-5  # of the largest value along the path; rounding leaves 1e-9


@dataclass
class Smoothness:
    """Largest jumps along a path, as fractions of the largest energy and force on it."""

    energy_jump: float
    force_jump: float

    @property
    def name(self):
        """What is continuous: nothing, the energy (C0), or the force too (C1)."""
        return "jumps" if self.energy_jump > JUMP else "C0" if self.force_jump > JUMP else "C1"


def sided(sides, per_side, depth=0.0):
    """Regular polygon of unit radius with vertices along its sides; their middles pushed in by `depth`."""
    turn = 2 * np.pi / sides * (np.arange(sides) + 0.5) - np.pi / 2  # a side at the bottom
    corner = np.column_stack([np.cos(turn), np.sin(turn)])
    t = np.arange(per_side)[:, None] / per_side
    ring = np.concatenate([(1 - t) * corner[k] + t * corner[(k + 1) % sides] for k in range(sides)])
    dent = np.tile(1 - depth * np.sin(np.pi * t), (sides, 1))
    return ring * dent


def _turned(ring, angle):
    c, s = np.cos(angle), np.sin(angle)
    return ring @ np.array([[c, s], [-s, c]])


# shape of both polygons, and how the second one is turned against the first where it slides
SHAPES = {"convex": (sided(6, 3), 0.0), "dented": (sided(4, 4, depth=0.25), np.pi / 4 + 0.004)}


def sliding(ring, turn, s):
    """The lowest vertex of one along the top of the other, rims in each other: side on side, or a tip through a dent.

    It rocks a little on the way, as droplets do, so that sides pass through parallel.
    """
    other = _turned(ring, turn + 0.02 * (s - 0.47))
    lowest = other[np.argmin(_turned(ring, turn + 0.02)[:, 1])]  # always the same vertex
    top = ring[ring[:, 1] > 0.7 * ring[:, 1].max()]
    top = top[np.argsort(top[:, 0])]
    x = 0.6 * top[0, 0] + 0.6 * s * (top[-1, 0] - top[0, 0])
    return np.vstack([ring, other - lowest + [x, np.interp(x, *top.T) + 0.13]])


def rolling(ring, turn, s):
    """A polygon on a fixed one: it turns as it goes round, rims in each other."""
    angle = 2.0 * (s - 0.5)
    other = _turned(ring, turn + 2 * angle)
    direction = np.array([np.sin(angle), np.cos(angle)])
    gap = (other @ direction).min() - (ring @ direction).max()
    return np.vstack([ring, other + (0.11 - gap) * direction])


PATHS = {"sliding": sliding, "rolling": rolling}


def smoothness(form, shape, path):
    """Jumps of LAMMPS energy and forces of the contacts along one path."""
    ring, turn = SHAPES[shape]
    law = {"gamma": 0.0, "ka": 1e-9, "eps": 1.0, "delta": 0.25, "eta": 0.0, "contact": form, "a0": [1.0, 1.0]}
    start = PATHS[path](ring, turn, 0.0)
    packing = jamlab.Packing("dp", 12 * np.eye(2), start + 6.0, law, offsets=np.array([0, 1, 2]) * len(ring))
    with jamlab.Session(packing) as session:

        def at(s):
            energy, force = session.forces_at(PATHS[path](ring, turn, s) + 6.0)
            return s, energy, force

        states = [at(s) for s in np.linspace(0, 1, SAMPLES)]
        jumps = []
        for size in (lambda a, b: abs(a[1] - b[1]), lambda a, b: np.abs(a[2] - b[2]).max()):
            pairs = sorted(pairwise(states), key=lambda pair: -size(*pair))
            rests = []
            for low, high in pairs[:STEEPEST]:
                for _ in range(HALVINGS):
                    middle = at(0.5 * (low[0] + high[0]))
                    low, high = max([(low, middle), (middle, high)], key=lambda pair: size(*pair))
                rests.append(size(low, high))
            jumps.append(max(rests))
    largest = max(s[1] for s in states), max(np.abs(s[2]).max() for s in states)
    assert largest[0] > 0.01, "no contact along the path"
    return Smoothness(jumps[0] / largest[0], jumps[1] / largest[1])


def table(forms):
    """Rows (form, shape, path, Smoothness) for all paths."""
    return [(form, shape, path, smoothness(form, shape, path)) for form in forms for shape in SHAPES for path in PATHS]
