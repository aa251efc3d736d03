"""Motion between states by plain numpy, written independently of jamlab: neighbours by every image, one by one."""

import numpy as np


def moved(before, gradient, size, seed):
    """The state after x -> F x of box and particles, turned so that the box stays along x, and random displacements of
    each particle as a whole."""
    box = before.box @ gradient.T
    along = box[0] / np.hypot(*box[0])
    turn = np.array([[along[0], along[1]], [-along[1], along[0]]])
    shift = np.random.default_rng(seed).normal(0, size, (before.n, 2))[before.particle]
    box = box @ turn.T
    box[0, 1] = 0.0
    return before.with_state(box=box, positions=before.positions @ (turn @ gradient).T + shift)


def disguised(state, times, seed):
    """The same state with particles in other images, and another second vector of the lattice."""
    move = (np.random.default_rng(seed).integers(-2, 3, (state.n, 2)) @ state.box)[state.particle]
    box = state.box.copy()
    box[1] += times * box[0]
    return state.with_state(box=box, positions=state.positions + move)


def own_local_strain(before, after, cutoff, bonds=None):
    """D2min (n,), strain (n, 2, 2) and number of neighbours of a state that is not disguised, from the definition."""
    x, y, n = before.centroids, after.centroids, before.n
    to_fraction = np.linalg.inv(before.box)
    if bonds is None:
        reach = range(-9, 10)
        shifts = np.array([(a, b) for a in reach for b in reach])
        bonds = []
        for i in range(n):
            for j in range(n):
                r = x[j] - x[i] + shifts @ before.box
                length = np.hypot(*r.T)
                bonds += [(i, each) for each in r[(length < cutoff) & (length > 1e-9)]]
    d2min, strain, count = np.full(n, np.nan), np.full((n, 2, 2), np.nan), np.zeros(n, dtype=int)
    for i in range(n):
        first = np.array([r for k, r in bonds if k == i]).reshape(-1, 2)
        count[i] = len(first)
        if len(first) < 3 or np.linalg.matrix_rank(first, 1e-4) < 2:
            continue
        second = []
        for r in first:  # which particle, and which image of it, stands at its end
            fraction = (x[i] + r - x) @ to_fraction
            j = int(np.abs(fraction - np.rint(fraction)).sum(axis=1).argmin())
            second.append(y[j] - y[i] + np.rint(fraction[j]) @ after.box)
        second = np.array(second)
        best = np.linalg.lstsq(first, second, rcond=None)[0].T
        d2min[i] = ((second - first @ best.T) ** 2).sum()
        strain[i] = best - np.eye(2)
    return d2min, strain, count
