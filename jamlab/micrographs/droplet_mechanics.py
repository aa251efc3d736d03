"""Pressures and contact forces of droplets, from the curvature of free walls and the length of flats.

A droplet with line tension gamma and pressure p above that of the voids has a free wall of curvature kappa = p/gamma
(Laplace). Where it touches a neighbour, its wall carries p - gamma kappa_c, with the curvature kappa_c there. Summed
along the flat, of length L and with an end-to-end turn theta of the wall, the force of the contact is

    F/gamma = kappa L - theta,

in the direction across the flat. Walls come as outlines; a turn along an arc is that of its tangent, and kappa is the
turn of all free arcs over their length. Nothing but the tension is unknown, so pressures are in tension over length and
forces in tensions.

Walls pass for touching up to a gap g: two circles of curvature kappa are nearer than g over sqrt(g/kappa) beside either
end of a flat, which F/gamma leaves out. How far that is right was learnt on rendered droplets, whose forces are known.

Source: K. W. Desmond, P. J. Young, D. Chen & E. R. Weeks, Soft Matter 9, 3424 (2013), who fit forces to shapes of
quasi-two-dimensional droplets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Indices

LEAST_FREE = 0.08  # of an outline that must face voids: a pressure from less is noise
LEAST_RADIUS = 30.0  # pixels, of a typical droplet: below, forces are too small by up to 0.4
LEAST_ROOM = 2.0  # pixels, radius times 1 - rho: below, voids are too small to read a pressure off their walls
FRINGE = 1.0  # times sqrt(g/kappa), left out at either end of a flat
STEEPER = 1.15  # raw forces over true ones of rendered droplets, whose rims yield: flats are longer than of stiff walls
# standard errors, learnt on 2 x 3 packings of 36 droplets at rho 0.84 to 0.95, 34 to 73 pixels in radius
FORCE_ERROR = (0.05, 0.2)  # in tensions, and of the force
PRESSURE_ERROR = 3.0  # of the pressure, times pixels of radius


@dataclass(frozen=True)
class ShapePressures:
    """Pressures of droplets above that of the voids, read off their free walls."""

    value: Array  # (n,) in line tension over length; nan where hardly any wall is free
    error: Array  # (n,) standard error


@dataclass(frozen=True)
class ShapeForces:
    """Contact forces read off the shapes of droplets."""

    pairs: Indices  # (m, 2) int64, droplets in contact, numbers of rows; the second is -1 where the edge cuts it
    size: Array  # (m,) force over line tension, positive where they press; nan where a pressure is unknown
    error: Array  # (m,) standard error of the size
    direction: Array  # (m, 2) unit vector from the first to the second, across the flat
    length: Array  # (m,) length of the flat
    residual: Array  # (n,) net force on each droplet over the sum of the sizes on it, 0 in balance; nan without forces


def shape_forces(
    rings: Sequence[Array], beside: Sequence[Indices], centres: Array, gap: float
) -> tuple[ShapePressures, ShapeForces]:
    """Read pressures and forces off outlines. `rings`: n outlines (k, 2), evenly spaced along, of droplets that are
    whole; `beside`: n arrays (k,): at each point of the outline the droplet it touches, n or more for one that is cut,
    -1 where it faces a void; `centres`: (n, 2); `gap`: beyond a film, up to which walls pass for touching; all lengths
    in pixels."""
    n, pressures = len(rings), np.full(len(rings), np.nan)
    sides = []  # of contacts: both droplets, force, direction and length, by the wall of one of them
    for k, (ring, names) in enumerate(zip(rings, beside, strict=True)):
        step = np.roll(ring, -1, axis=0) - ring
        length = np.hypot(*step.T)
        angle = np.arctan2(step[:, 1], step[:, 0])
        turn = np.mod(angle - np.roll(angle, 1) + np.pi, 2 * np.pi) - np.pi
        turn *= np.sign(turn.sum()) or 1.0
        along = 0.5 * (length + np.roll(length, 1))
        free = names < 0
        if along[free].sum() < LEAST_FREE * along.sum():
            continue
        pressures[k] = turn[free].sum() / along[free].sum()
        for other in np.unique(names[~free]):
            on = names == other
            flat = along[on].sum()
            fringe = 2 * FRINGE * np.sqrt(gap * max(pressures[k], 0.0))
            size = (pressures[k] * flat - turn[on].sum() - fringe) / STEEPER
            across = (ring[on] - centres[k]).mean(axis=0) * (1 if k < other else -1)
            sides.append((min(k, other), max(k, other), size, *across, flat))
    table = np.array(sides).reshape(-1, 6)
    pairs, pair, count = np.unique(table[:, :2].astype(np.int64), axis=0, return_inverse=True, return_counts=True)
    size, x, y, length = (np.bincount(pair, column) / count for column in table[:, 2:].T)
    direction = np.column_stack([x, y]) / np.maximum(np.hypot(x, y), 1e-12)[:, None]
    net, total = np.zeros((n + 1, 2)), np.zeros(n + 1)  # the last row is of all that are cut
    for end, sign in zip(np.minimum(pairs, n).T, (1.0, -1.0), strict=True):
        np.add.at(net, end, sign * size[:, None] * direction)
        np.add.at(total, end, np.abs(size))
    residual = np.divide(np.hypot(*net[:n].T), total[:n], out=np.full(n, np.nan), where=total[:n] > 0)
    radii = np.array([np.hypot(*(ring - ring.mean(axis=0)).T).mean() for ring in rings])  # about the middle
    error = FORCE_ERROR[0] + FORCE_ERROR[1] * np.abs(size)
    forces = ShapeForces(np.where(pairs < n, pairs, -1), size, error, direction, length, residual)
    return ShapePressures(pressures, PRESSURE_ERROR / radii * np.abs(pressures)), forces
