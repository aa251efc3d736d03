"""What `plugin/kernels/disk_swap.cpp` does in plain numpy: no lists, all pairs in all images that are near enough."""

import itertools

import numpy as np

IMAGES = np.array(list(itertools.product(range(-4, 5), repeat=2)))


def energy(packing, positions, diameters):
    """Energy of disks over every image of every pair, with flat walls, which none may pass."""
    box, disks, height = packing.box, diameters > 0, packing.box[1, 1]
    d, fractions = diameters[disks], positions @ np.linalg.inv(box)
    x = ((fractions - np.floor(fractions)) @ box)[disks]
    apart = x[None, :, None] - x[:, None, None] + IMAGES @ box
    other = np.arange(len(d))[:, None, None] != np.arange(len(d))[None, :, None]
    other = other | (IMAGES != 0).any(axis=1)  # a disk is no neighbor of itself, but its images are
    reach = np.broadcast_to(0.5 * (d[:, None] + d)[..., None], other.shape)
    total = 0.5 * of(packing, reach[other], np.hypot(*apart[other].T)).sum()  # every pair is seen twice
    walls = np.sort(positions[~disks, 1] % height)
    if len(walls):
        y = x[:, 1] % height
        if not ((walls[0] < y) & (y < walls[1])).all():
            return np.inf
        total += sum(of(packing, 0.5 * d, np.abs(wall - y)).sum() for wall in walls)
    return total


def of(packing, reach, distance):
    """Energies of pairs."""
    exponent = packing.params.get("exponent", 2.0)
    overlap = np.maximum(0.0, 1 - distance / reach)
    unit = 1.0 if packing.units == "eps" else reach**2
    return packing.params[packing.units] * unit / exponent * overlap**exponent


def sweep(packing, random, temperature, move, swap_share):
    """Positions, diameters and energy after one sweep."""
    x, d = packing.positions.copy(), packing.disk_diameters.copy()
    free = np.flatnonzero(packing.frame.free)
    before = energy(packing, x, d)
    for _ in free:
        trial_x, trial_d = x.copy(), d.copy()
        if random.random() < swap_share:
            i, j = (free[int(random.random() * len(free))] for _ in range(2))
            if d[i] == d[j]:
                continue
            trial_d[[i, j]] = d[[j, i]]
        else:
            i = free[int(random.random() * len(free))]
            trial_x[i] += [move * (2 * random.random() - 1) for _ in range(2)]
        after = energy(packing, trial_x, trial_d)
        if after <= before or random.random() < np.exp((before - after) / temperature):
            x, d, before = trial_x, trial_d, after
    return x, d, before


def distances_of_two(packing, temperature, edges, points=150):
    """Probabilities that two disks, anywhere in the cell, lie at distances between edges: those of Boltzmann."""
    places = np.stack(np.meshgrid(*2 * [(np.arange(points) + 0.5) / points]), axis=-1).reshape(-1, 2) @ packing.box
    reach, vectors = 0.5 * packing.disk_diameters.sum(), IMAGES @ packing.box
    vectors = vectors[np.hypot(*vectors.T) < np.hypot(*places.T).max() + max(reach, edges[-1])]  # others are too far
    apart = np.hypot(*np.moveaxis(places[:, None] + vectors, -1, 0))
    reach = np.full(apart.shape, reach)
    weight = np.exp(-of(packing, reach, apart).sum(axis=1) / temperature)
    found, _ = np.histogram(apart.min(axis=1), edges, weights=weight)
    return found / weight.sum()


def shortest(packing, positions):
    """Distance of two disks, the shortest of all images."""
    apart = (positions[1] - positions[0]) @ np.linalg.inv(packing.box)  # disks that move may be many cells apart
    return np.hypot(*((apart - np.round(apart) + IMAGES) @ packing.box).T).min()


def chi_square(counts, probabilities):
    """Chi square per degree of freedom of counts in bins that hold ten or more."""
    expected = probabilities * counts.sum()
    kept = expected >= 10
    return float(((counts - expected)[kept] ** 2 / expected[kept]).sum() / (kept.sum() - 1))
