"""Energy and forces of droplets whose rims repel and adhere, in plain numpy and for complex positions: a step along i
gives derivatives of forces to the last digit. All images by brute force."""

import itertools

import numpy as np


def rim_energy(d, eps, delta, pull, reach):
    """U and U' at distances d, `pull` and `reach` over delta; 0 beyond."""
    x = d / delta
    if x.real >= 1 + reach:
        return 0.0 * d, 0.0 * d
    if x.real <= 1 + pull:
        return eps / 2 * ((1 - x) ** 2 - pull * reach), -eps / delta * (1 - x)
    k = eps * pull / (reach - pull)
    return -k / 2 * (1 + reach - x) ** 2, k / delta * (1 + reach - x)


def meetings(packing, reach):
    """(vertex, tail, head, image) of all vertices within reach of an edge of another polygon or image; of form outline
    the closest edge of each outline."""
    x, box, particle = packing.positions, packing.box, packing.particle
    after = packing.polygons.successor
    span = np.ptp(x, axis=0).max() + reach
    most = [int(np.ceil(span / abs(np.linalg.det(box)) * np.hypot(*box[1 - k]))) + 1 for k in (0, 1)]
    found = []
    for image in itertools.product(*(range(-m, m + 1) for m in most)):
        shift = np.array(image) @ box
        tail, head = x + shift, x[after] + shift
        e = head - tail
        for v in range(len(x)):
            other = (particle != particle[v]) | (image != (0, 0))
            t = np.clip(np.einsum("ij,ij->i", x[v] - tail, e) / np.einsum("ij,ij->i", e, e), 0, 1)
            d = np.hypot(*(x[v] - tail - t[:, None] * e).T)
            near = np.flatnonzero(other & (d < reach))
            if packing.params["contact"] == "outline":
                near = [min(near[particle[near] == p], key=lambda k: d[k]) for p in np.unique(particle[near])]
            found += [(v, k, after[k], shift) for k in near]
    return found


def forces(packing, z, met=None):
    """Energy and (n, 2) forces at complex positions near those of the packing; `met`: its meetings, if known."""
    p = packing.params
    pull = p.get("adhesion", 0.0)
    reach = p.get("adhesion_range", 0.0) or 2 * pull
    f, energy = np.zeros_like(z), 0.0
    for v, tail, head, shift in met or meetings(packing, p["delta"] * (1 + reach)):
        e, r = z[head] - z[tail], z[v] - z[tail] - shift
        t = (r @ e) / (e @ e)
        t = t if 0 < t.real < 1 else t * 0 + (t.real >= 1)
        r = r - t * e
        d = np.sqrt(r @ r)
        u, slope = rim_energy(d, p["eps"], p["delta"], pull, reach)
        push = -slope * r / d
        energy += u
        f[v] += push
        f[tail] -= (1 - t) * push
        f[head] -= t * push
    for start, end, a0 in zip(packing.offsets[:-1], packing.offsets[1:], p["a0"], strict=True):
        ring = z[start:end]
        e = np.roll(ring, -1, axis=0) - ring
        length = np.sqrt(np.sum(e * e, axis=1) + p["eta"] ** 2)
        pulled = p["gamma"] * e / length[:, None]
        across = np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0)
        area = np.sum(ring[:, 0] * np.roll(ring[:, 1], -1) - ring[:, 1] * np.roll(ring[:, 0], -1)) / 2
        slope = 0.5 * np.column_stack([across[:, 1], -across[:, 0]])
        energy += p["gamma"] * length.sum() + p["ka"] / 2 * (area - a0) ** 2
        f[start:end] += pulled - np.roll(pulled, 1, axis=0) - p["ka"] * (area - a0) * slope
    return energy, f


def hessian(packing, step=1e-30):
    """(2 n, 2 n) by complex steps of the forces."""
    x, p = packing.positions.astype(complex), packing.params
    met = meetings(packing, p["delta"] * (1 + (p["adhesion_range"] or 2 * p["adhesion"])))
    rows = np.empty((x.size, x.size))
    for k in range(x.size):
        moved = x.copy()
        moved.flat[k] += 1j * step
        rows[k] = -forces(packing, moved, met)[1].ravel().imag / step
    return rows
