"""Flow of massless disks in plain numpy: dense matrices for velocities, LSODA of scipy for paths, no LAMMPS.

Units "k": stiffness 1, tau_1 = 1. The drag of a contact sets in over a thin layer of overlap; a pair that drag pushes
open, and that closes without it, rubs there.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

import jamlab


@dataclass
class PlainFlow:
    """Disks under shear; under Stokes drag `background` is 1, and contacts do not drag."""

    packing: jamlab.Packing
    beta: float = 1.0
    alpha: float = 1.0
    background: float = 1e-4
    contacts_drag: bool = True
    layer: float = 1e-5  # of overlap; errors of the stress are about as large, those of creep a hundred times

    def __post_init__(self):
        p = self.packing
        self.first, self.second = np.triu_indices(p.n, 1)
        self.reach = 0.5 * (p.diameters[self.first] + p.diameters[self.second])
        self.last = np.zeros(3 * p.n)  # from which power laws are solved

    def vectors(self, x, strain):
        """(pairs, 2) from first to second, nearest image."""
        (width, _), (lean, height) = self.packing.box
        r = x[self.second] - x[self.first]
        r = r - np.outer(np.round(r[:, 1] / height), [lean + strain * height, height])
        r[:, 0] -= width * np.round(r[:, 0] / width)
        return r

    def gaps(self, x, strain):
        return np.hypot(*self.vectors(x, strain).T) - self.reach

    def solve(self, x, strain, rate):
        """Velocities (n, 2), tension (2, 2) of overlaps and of drag, numbers of contacts and of those that rub."""
        p, n, gap, vectors = self.packing, self.packing.n, self.gaps(x, strain), self.vectors(x, strain)
        act = np.flatnonzero(gap < 0)
        r, s, a, b = vectors[act], self.reach[act], self.first[act], self.second[act]
        (nx, ny), k, exponent = r.T / np.hypot(*r.T), np.arange(len(act)), p.params.get("exponent", 2.0)
        push = s ** (2 - exponent) * (-gap[act]) ** (exponent - 1)
        drag = (
            (exponent - 1) * s ** (2 - exponent) * (-gap[act]) ** (exponent - 2) * np.minimum(1, -gap[act] / self.layer)
        )
        drag = drag * self.contacts_drag
        across, along = np.zeros((2, len(act), 3 * n))
        across[k, a], across[k, b], across[k, n + a], across[k, n + b] = -nx, nx, -ny, ny
        along[k, a], along[k, b], along[k, n + a], along[k, n + b] = ny, -ny, -nx, nx
        along[k, 2 * n + a], along[k, 2 * n + b] = -0.5 * p.diameters[a], -0.5 * p.diameters[b]
        hold = np.r_[np.full(2 * n, self.background if self.contacts_drag else 1.0), np.full(n, 1e-13)]  # spins rest
        u, change = self.last.copy(), 1.0
        for _ in range(300):
            vn, vt = across @ u + rate * r[:, 1] * nx, along @ u - rate * r[:, 1] * ny
            square = vn**2 + self.beta * vt**2 + 1e-60
            square = square + 1e-10 * square.mean()
            w = drag * square ** (0.5 * (self.alpha - 1))
            bend = w * (self.alpha - 1) / square * (change < 1e-5)  # Newton's steps, near the end where they converge
            residual = across.T @ (push - w * vn) - self.beta * along.T @ (w * vt) - hold * u
            mixed = across.T @ ((bend * self.beta * vn * vt)[:, None] * along)
            matrix = np.diag(hold) + across.T @ ((w + bend * vn**2)[:, None] * across) + mixed + mixed.T
            matrix += along.T @ ((w * self.beta + bend * (self.beta * vt) ** 2)[:, None] * along)
            step = np.linalg.solve(matrix, residual)
            u, change = u + step, np.abs(step[: 2 * n]).max() / (np.abs(u[: 2 * n]).max() + abs(rate) + 1e-30)
            if self.alpha == 1 or change < 1e-10:
                break
        else:
            raise ArithmeticError(f"velocities of the power law do not converge: {change}")
        self.last = u
        vn, vt = across @ u + rate * r[:, 1] * nx, along @ u - rate * r[:, 1] * ny
        slide = self.beta * w * vt
        pull = np.column_stack([w * vn * nx - slide * ny, w * vn * ny + slide * nx])
        elastic, viscous = -(push * np.array([nx, ny])) @ r / p.area, pull.T @ r / p.area
        flow = u[: 2 * n].reshape(2, n).T + rate * np.column_stack([x[:, 1], np.zeros(n)])
        return flow, elastic, viscous, (len(act), np.sum(gap[act] > -self.layer))

    def rows(self, rate, strain, count, tolerance=1e-7):
        """(5, count + 1) at equal strains from 0 on: stress, pressure, N1, contacts, and how many of them rub."""
        found = []
        for x, now in self._path(lambda x, now: rate, strain / rate * np.arange(count + 1) / count, tolerance):
            _, elastic, viscous, counts = self.solve(x, now, rate)
            (xx, xy), (_, yy) = elastic + viscous
            found.append([xy, -0.5 * (xx + yy), xx - yy, *counts])
        return np.array(found).T

    def creep(self, stress, times, tolerance=1e-7):
        """Strains at times from 0 on under a whole shear stress, which is linear in the rate."""

        def rate(x, strain):
            still, moving = (sum(self.solve(x, strain, one)[1:3])[0, 1] for one in (0.0, 1.0))
            return (stress - still) / (moving - still)

        return np.array([strain for _, strain in self._path(rate, times, tolerance)])

    def _path(self, rate, times, tolerance):
        """Positions and strain at times; `rate` of both."""
        shape = self.packing.positions.shape

        def slope(_, y):
            x, strain = y[:-1].reshape(shape), y[-1]
            now = rate(x, strain)
            return np.append(self.solve(x, strain, now)[0], now)

        start = np.append(self.packing.positions, 0.0)
        path = solve_ivp(slope, (0.0, times[-1]), start, "LSODA", times, rtol=tolerance, atol=tolerance)
        return [(y[:-1].reshape(shape), y[-1]) for y in path.y.T]
