"""Energies of outlines by plain loops over vertices, which take complex positions."""

import numpy as np


def bending(ring, kappa, theta0=1.0):
    """(kappa/2) sum (theta - theta_0)^2/l of one ring (nv, 2)."""
    nv = len(ring)
    return sum(corner(ring[i - 1], ring[i], ring[(i + 1) % nv], kappa, theta0 * 2 * np.pi / nv) for i in range(nv))


def corner(before, here, after, kappa, turn):
    """(kappa/2) (theta - turn)^2/l of one vertex."""
    a, b = before - here, after - here
    return 0.5 * kappa * (np.pi - _arc_cosine_of(a, b) - turn) ** 2 / (0.5 * (size(a) + size(b)))


def perimeter(ring, a0, kp=0.0, kl=0.0, p0=3.5449077018110318):
    """(kp/2)(p - P)^2 + (kl nv/2) sum (l - P/nv)^2 of one ring."""
    lengths, rest, nv = [size(ring[i] - ring[i - 1]) for i in range(len(ring))], p0 * np.sqrt(a0), len(ring)
    return 0.5 * kp * (sum(lengths) - rest) ** 2 + 0.5 * kl * nv * sum((each - rest / nv) ** 2 for each in lengths)


def energy(packing, positions):
    """Of all droplets, by the parameters of the packing."""
    law, total = packing.params, 0
    for m, ring in enumerate(np.split(positions, packing.offsets[1:-1])):
        if len(ring) < 3:  # a flat wall
            continue
        total += bending(ring, law.get("kappa", 0.0), law.get("theta0", 1.0))
        total += perimeter(ring, law["a0"][m], **{name: law[name] for name in ("kp", "kl", "p0") if name in law})
    return total


def gradient(packing, positions):
    """(n_vertices, 2) by complex steps."""
    found = np.zeros(positions.shape)
    for m, (first, end) in enumerate(zip(packing.offsets[:-1], packing.offsets[1:], strict=True)):
        law = {**packing.params, "a0": packing.params["a0"][m : m + 1]}
        alone = _One(law, np.array([0, end - first]))
        for i in range(first, end):
            for d in range(2):
                moved = positions[first:end].astype(complex)
                moved[i - first, d] += 1e-30j
                found[i, d] = energy(alone, moved).imag / 1e-30
    return found


class _One:
    def __init__(self, params, offsets):
        self.params, self.offsets = params, offsets


def size(r):
    return np.sqrt(r[0] * r[0] + r[1] * r[1])


def _arc_cosine_of(a, b):
    """Angle from b to a, counter-clockwise, between 0 and 2 pi: the inner angle of a ring that runs so."""
    x, y = b[0] * a[0] + b[1] * a[1], b[0] * a[1] - b[1] * a[0]
    real = np.arctan2(y.real, x.real) % (2 * np.pi)
    return real + 1j * (y.imag * x.real - x.imag * y.real) / (x.real**2 + y.real**2) if np.iscomplexobj(x) else real
