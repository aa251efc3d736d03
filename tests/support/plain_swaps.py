"""One sweep of swap Monte Carlo in plain numpy: all pairs in all images near enough, no lists; for what
`plugin/kernels/disk_swap.cpp` does."""

import itertools

import numpy as np


def energy(packing, positions, diameters):
    """Energy of disks by Packing's own numbers, over every image of every pair, with flat walls."""
    law, box = packing.law, packing.box
    disks = np.flatnonzero(diameters > 0)
    total = 0.0

    def of(contact, distance):
        x = max(0.0, 1.0 - distance / contact)
        unit = 1.0 if packing.units == "eps" else contact**2
        return law.strength * unit / law.exponent * x**law.exponent

    fractions = positions @ np.linalg.inv(box)
    wrapped = (fractions - np.floor(fractions)) @ box
    for i in disks:
        for j in disks[disks >= i]:
            for a, b in itertools.product(range(-4, 5), repeat=2):
                if i == j and not (a > 0 or (a == 0 and b > 0)):
                    continue
                r = np.hypot(*(wrapped[j] + a * box[0] + b * box[1] - wrapped[i]))
                total += of(0.5 * (diameters[i] + diameters[j]), r)
        for wall in np.flatnonzero(diameters == 0):
            low = positions[:, 1] % box[1, 1]
            total += of(0.5 * diameters[i], abs(low[wall] - low[i]))
    return total


def sweep(packing, random, temperature, move, swap_share):
    """Positions, diameters, and the numbers of moves and swaps that were accepted."""
    x, d = packing.positions.copy(), packing.disk_diameters.copy()
    free = np.flatnonzero(packing.frame.free)
    before, accepted = energy(packing, x, d), [0, 0]
    for _ in free:
        trial_x, trial_d = x.copy(), d.copy()
        swaps = random.random() < swap_share
        if swaps:
            i, j = free[int(random.random() * len(free))], free[int(random.random() * len(free))]
            if d[i] == d[j]:
                continue
            trial_d[[i, j]] = d[[j, i]]
        else:
            i = free[int(random.random() * len(free))]
            trial_x[i] += [move * (2 * random.random() - 1), move * (2 * random.random() - 1)]
        after = energy(packing, trial_x, trial_d)
        if after <= before or random.random() < np.exp((before - after) / temperature):
            x, d, before = trial_x, trial_d, after
            accepted[swaps] += 1
    return x, d, before, accepted
