"""The second derivatives of energy and enthalpy of soft disks by plain numpy, written independently of jamlab."""

import itertools

import numpy as np


def own_second_derivatives(packing, strength, power, pressure=None):
    """(2 n, 2 n) of U = sum (k s^2/power) (1 - r/s)^power over pairs of disks that touch at s; with
    a pressure (2 n + 1, 2 n + 1) of U + p A, the last coordinate log(area) sqrt(area)."""
    x, box, radius = packing.positions, packing.box, 0.5 * packing.diameters
    n, area = len(x), box[0, 0] * box[1, 1]
    h = np.zeros((2 * n + 1, 2 * n + 1))
    for i, j in itertools.combinations(range(n), 2):
        for a, b in itertools.product(range(-2, 3), repeat=2):
            r = x[j] - x[i] + a * box[0] + b * box[1]
            length, reach = np.hypot(*r), radius[i] + radius[j]
            if length >= reach:
                continue
            delta, stiffness = reach - length, strength * reach ** (2 - power)
            slope, bend = -stiffness * delta ** (power - 1), stiffness * (power - 1) * delta ** (power - 2)
            along = r / length
            block = bend * np.outer(along, along) + slope / length * (np.eye(2) - np.outer(along, along))
            at = [2 * i, 2 * i + 1, 2 * j, 2 * j + 1]
            h[np.ix_(at, at)] += np.kron([[1, -1], [-1, 1]], block)
            side = bend * length / 2 * along  # of r -> exp(e/2) r
            h[at, -1] += np.concatenate([-side, side])
            h[-1, -1] += bend * length**2 / 4 + slope * length / 4
    if pressure is None:
        return h[:-1, :-1]
    h[-1, :] = h[:, -1] = np.append(h[:-1, -1] / np.sqrt(area), h[-1, -1] / area + pressure)
    return h


def own_changes(before, after):
    """Pairs of disks that overlap in one state alone: (lost, gained)."""
    pairs = [
        {
            (i, j)
            for i, j in itertools.combinations(range(state.n), 2)
            for a, b in itertools.product(range(-2, 3), repeat=2)
            if np.hypot(*(state.positions[j] - state.positions[i] + a * state.box[0] + b * state.box[1]))
            < 0.5 * (state.diameters[i] + state.diameters[j])
        }
        for state in (before, after)
    ]
    return pairs[0] - pairs[1], pairs[1] - pairs[0]
