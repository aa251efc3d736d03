"""Cyclic shear by plain numpy that shares nothing with the package: contacts by brute force over images, and how far
particles moved between two states of one lattice."""

import itertools

import numpy as np


def disk_contacts(p):
    """i, j and vectors (m, 2) of all pairs of disks that overlap, images counted."""
    found = []
    for i, j in itertools.combinations(range(p.n), 2):
        for a, b in itertools.product((-1, 0, 1), repeat=2):
            r = p.positions[j] + a * p.box[0] + b * p.box[1] - p.positions[i]
            if np.hypot(*r) < 0.5 * (p.disk_diameters[i] + p.disk_diameters[j]):
                found.append((i, j, *r))
    table = np.array(found).reshape(-1, 4)
    return table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2:]


def disk_energy_and_stress(p):
    """Energy over area, and shear stress conjugate to simple shear along x, of harmonic disks in units of k."""
    i, j, r = disk_contacts(p)
    length = np.hypot(*r.T)
    overlap = 0.5 * (p.disk_diameters[i] + p.disk_diameters[j]) - length
    force = p.params["k"] * overlap
    return 0.5 * p.params["k"] * (overlap**2).sum() / p.area, -(force / length * r[:, 0] * r[:, 1]).sum() / p.area


def rattlers(p):
    """Disks with fewer than three contacts, found recursively."""
    i, j, _ = disk_contacts(p)
    loose = np.zeros(p.n, bool)
    while True:
        kept = ~(loose[i] | loose[j])
        few = np.bincount(np.concatenate([i[kept], j[kept]]), minlength=p.n) < 3
        if (few == loose).all():
            return loose
        loose = few


def moved(before, after, free=None):
    """(n, 2) shortest displacements of disks between states of one lattice, without the mean of those that are no
    rattlers in both."""
    bearing = ~(rattlers(before) | rattlers(after))
    shift = after.positions - before.positions
    images = [a * after.box[0] + b * after.box[1] for a, b in itertools.product(range(-3, 4), repeat=2)]
    shift = np.array([min((s - image for image in images), key=lambda v: np.hypot(*v)) for s in shift])
    return shift - shift[bearing].mean(axis=0), bearing
