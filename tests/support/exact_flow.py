"""Flow of massless disks with every opening and closing of a contact located: plain numpy, dense matrices, no LAMMPS.

B u = F - rate b with a set of contacts that is held over a step, so that the right side is smooth; steps of Dormand and
Prince (order 5) end where a gap becomes zero. Where drag would push a contact open that closes without it, the two
disks rub: the gap stays zero, and a part theta of the drag acts, so much that they neither part nor meet.
Units "k": stiffness 1, tau_1 = 1. Of exponents above 2 drag sets in from nothing: no state is held, and LSODA of scipy
takes the steps.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

import jamlab

LAWS = {  # as ExactFlow and jamlab take them
    "contact": ({}, jamlab.ContactDamping()),
    "stokes": ({"stokes": True}, jamlab.StokesDrag(eta_f=0.0)),
    "power law": ({"alpha": 0.5}, jamlab.ContactDamping(alpha=0.5)),
}
STAGES = [
    [],
    [1 / 5],
    [3 / 40, 9 / 40],
    [44 / 45, -56 / 15, 32 / 9],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
]
NODES = [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1]
ERROR = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
TOUCH = 1e-11  # gap at which a contact has closed or opened
LEAST_STEP = 1e-9
STUCK = 1e-9  # strain
INSIDE = 2e-9  # of theta, by which a pair that begins to rub is off 0 and 1


@dataclass
class ExactFlow:
    """Disks of a packing in units "k" under shear; `background` of Stokes drag is 1, and its contacts do not drag."""

    packing: jamlab.Packing
    rate: float
    beta: float = 1.0
    alpha: float = 1.0
    background: float = 1e-4
    stokes: bool = False
    tolerance: float = 1e-10
    closed: set[int] = field(default_factory=set)
    rubbing: set[int] = field(default_factory=set)  # neither part nor meet
    ties: list[float] = field(default_factory=list)  # strains at which no set of states fits, or several do
    events: list[tuple[float, str]] = field(default_factory=list)
    located: list[float] = field(default_factory=list)  # strains at which a state no longer fitted
    rubbed: float = 0.0  # time with a rubbing contact

    def __post_init__(self) -> None:
        p = self.packing
        self.n, self.drag = p.n, 1.0 if self.stokes else self.background
        self.first, self.second = np.triu_indices(p.n, 1)
        self.reach = 0.5 * (p.diameters[self.first] + p.diameters[self.second])
        self.last = np.zeros(3 * p.n)

    def vectors(self, x: np.ndarray, strain: float) -> np.ndarray:
        """(m, 2) from first to second, nearest image."""
        (width, _), (lean, height) = self.packing.box
        r = x[self.second] - x[self.first]
        up = np.round(r[:, 1] / height)
        r = r - np.outer(up, [lean + strain * height, height])
        r[:, 0] -= width * np.round(r[:, 0] / width)
        return r

    def gaps(self, x: np.ndarray, strain: float) -> np.ndarray:
        return np.hypot(*self.vectors(x, strain).T) - self.reach

    def solve(self, x: np.ndarray, strain: float, parts: dict[int, float] | None = None) -> dict:
        """Velocities beside the affine flow, stresses, theta of rubbing contacts, rates of gaps of all pairs.

        `parts`: of the drag of closed contacts that act, where not all of it does.
        """
        n, rub = self.n, sorted(self.rubbing)
        r = self.vectors(x, strain)
        length = np.hypot(*r.T)
        act = np.array(sorted(self.closed) + rub, dtype=int)
        m, count = len(act), len(act) - len(rub)
        normal = r / length[:, None]
        exponent, s = self.packing.params.get("exponent", 2.0), self.reach[act]
        overlap = np.where(np.arange(m) < count, s - length[act], 0.0)
        push = s ** (2 - exponent) * overlap ** (exponent - 1)
        stiffness = (exponent - 1) * s ** (2 - exponent) * overlap ** (exponent - 2)
        a, b, (nx, ny) = self.first[act], self.second[act], normal[act].T
        across, along, k = np.zeros((m, 3 * n)), np.zeros((m, 3 * n)), np.arange(m)
        across[k, a], across[k, b], across[k, n + a], across[k, n + b] = -nx, nx, -ny, ny
        along[k, a], along[k, b], along[k, n + a], along[k, n + b] = ny, -ny, -nx, nx
        along[k, 2 * n + a], along[k, 2 * n + b] = -0.5 * self.packing.diameters[a], -0.5 * self.packing.diameters[b]
        affine_n, affine_t = self.rate * r[act, 1] * nx, -self.rate * r[act, 1] * ny
        force = across.T @ push
        hold = np.r_[np.full(2 * n, self.drag), np.full(n, 1e-13)]  # spins that nothing resists stay zero
        drags = (np.arange(m) < (0 if self.stokes else count)).astype(float)
        for c, part in (parts or {}).items():
            drags[np.flatnonzero(act == c)] *= part
        u, held, near = self.last.copy(), np.zeros(len(rub)), False
        for _ in range(300):
            vn, vt = across @ u + affine_n, along @ u + affine_t
            square = vn**2 + self.beta * vt**2
            slow = 1e-10 * square.mean() + 1e-60 if m else 0.0
            whole = (square + slow) ** (0.5 * (self.alpha - 1)) if self.alpha != 1 else np.ones(m)
            w = whole * drags * stiffness
            # weights held, and Newton's steps at the end, where they converge
            bend = w * (self.alpha - 1) / (square + slow) if near else np.zeros(m)
            residual = force - hold * u - across.T @ (w * vn) - along.T @ (self.beta * w * vt) - along[count:].T @ held
            mixed = across.T @ ((bend * self.beta * vn * vt)[:, None] * along)
            matrix = (
                np.diag(hold)
                + across.T @ ((w + bend * vn**2)[:, None] * across)
                + along.T @ ((w * self.beta + bend * (self.beta * vt) ** 2)[:, None] * along)
                + mixed
                + mixed.T
            )
            if rub:
                matrix = np.block([[matrix, along[count:].T], [across[count:], np.zeros((len(rub), len(rub)))]])
                residual = np.r_[residual, -vn[count:]]
            step = np.linalg.solve(matrix, residual)
            u, held = u + step[: 3 * n], held + step[3 * n :]
            change = np.abs(step[: 2 * n]).max() / (np.abs(u[: 2 * n]).max() + self.rate)
            if self.alpha == 1 or change < 3e-11:  # rounding leaves up to 1e-11 at slow rates
                break
            near = change < (1e-4 if near else 1e-6)
        else:
            raise ArithmeticError(f"velocities of the power law do not converge: {change}")
        self.last = u
        vn, vt = across @ u + affine_n, along @ u + affine_t
        slide = np.where(np.arange(m) < count, self.beta * w * vt, np.r_[np.zeros(count), held])
        viscous = ((w * vn * nx - slide * ny) * ny * length[act]).sum() / self.packing.area
        elastic = -(push * nx * ny * length[act]).sum() / self.packing.area
        fx, fy = (w * vn - push) * nx - slide * ny, (w * vn - push) * ny + slide * nx  # tensions
        xx, yy = ((f * d * length[act]).sum() / self.packing.area for f, d in ((fx, nx), (fy, ny)))
        speed = np.column_stack([u[:n], u[n : 2 * n]])
        relative = speed[self.second] - speed[self.first]
        relative[:, 0] += self.rate * r[:, 1]
        return {
            "flow": speed + self.rate * np.column_stack([x[:, 1], np.zeros(n)]),
            "elastic": elastic,
            "viscous": viscous,
            "pressure": -0.5 * (xx + yy),
            "n1": xx - yy,
            "theta": dict(zip(rub, held / (self.beta * whole[count:] * vt[count:]), strict=True)),
            "parting": (relative * normal).sum(axis=1),
            "speed": speed,
        }

    def step(self, x: np.ndarray, time: float, h: float, first: dict) -> tuple[np.ndarray, dict, float]:
        """Positions and solution at the end of a step, and its error."""
        slopes, found = [first["flow"]], first
        for row, node in zip(STAGES[1:], NODES[1:], strict=True):
            moved = x + h * np.tensordot(row, slopes, 1)
            found = self.solve(moved, self.rate * (time + node * h))
            slopes.append(found["flow"])
        return moved, found, h * np.abs(np.tensordot(ERROR, slopes, 1)).max()

    def changes(self, x: np.ndarray, time: float, found: dict) -> dict[int, float]:
        """Pairs whose state no longer fits, by how far it is off."""
        gap = self.gaps(x, self.rate * time)
        state = np.zeros(len(gap), dtype=bool)
        state[list(self.closed)] = True
        off = np.where(state, gap, -gap) - TOUCH
        off[list(self.rubbing)] = -1.0
        wrong = {int(c): float(off[c]) for c in np.flatnonzero(off > 0)}
        for c, theta in found["theta"].items():
            if not 0.0 <= theta <= 1.0:
                wrong[c] = -theta if theta < 0 else theta - 1.0
        return wrong

    def value(self, c: int, x: np.ndarray, time: float, found: dict) -> float:
        if c in self.rubbing:
            theta = found["theta"][c]
            return max(-theta, theta - 1.0)
        gap = self.gaps(x, self.rate * time)[c]
        return (gap if c in self.closed else -gap) - TOUCH

    def settle(self, x: np.ndarray, time: float) -> dict:
        """States of all pairs whose gap is zero: open ones part, closed ones meet, others rub with theta in 0 to 1."""
        gap = self.gaps(x, self.rate * time)
        self.located.append(self.rate * time)
        edge = sorted({*map(int, np.flatnonzero(np.abs(gap) < 3 * TOUCH)), *self.rubbing})
        before = [self.state(c) for c in edge]
        kinds = ("open", "closed") if self.stokes or self.beta == 0 else ("open", "closed", "rubbing")
        fitting = []
        for states in itertools.product(kinds, repeat=len(edge)):
            try:
                found = self.solve_as(edge, states, x, time)
            except ArithmeticError:  # of a power law: the two cannot rub here
                continue
            misfit = max(self.misfit(c, state, found) for c, state in zip(edge, states, strict=True))
            fitting.append((misfit, sum(a != b for a, b in zip(states, before, strict=True)), states))
        good = [entry[1:] for entry in fitting if entry[0] <= 1e-9]
        if len(good) == 1:
            states = good[0][1]
        else:
            self.solve_as(edge, before, x, time)
            states = self.relaxed_states(edge, before, x, time)
        if states not in [entry[1] for entry in good]:
            self.ties.append(self.rate * time)
            states = min(good)[1] if good else min(fitting)[2]
        self.events += [(self.rate * time, b) for a, b in zip(before, states, strict=True) if a != b]
        return self.solve_as(edge, states, x, time)

    def relaxed_states(self, edge: list[int], before: list[str], x: np.ndarray, time: float) -> tuple[str, ...]:
        """Where several states fit: those that drag comes to which sets in over a thin layer, theta' = -parting."""
        acted = {c: float(c in self.closed) for c in edge} | self.solve(x, self.rate * time)["theta"]
        theta = np.clip([acted[c] for c in edge], 0.0, 1.0)
        self.rubbing -= set(edge)
        self.closed |= set(edge)

        def parting(theta: np.ndarray) -> np.ndarray:
            found = self.solve(x, self.rate * time, dict(zip(edge, theta, strict=True)))
            return found["parting"][edge] / self.rate

        now, step = parting(theta), 1.0
        for _ in range(20000):  # Heun's steps
            first = np.clip(theta - step * now, 0.0, 1.0)
            mean = np.clip(theta - 0.5 * step * (now + parting(first)), 0.0, 1.0)
            if np.abs(first - theta).max() > 0.05 or np.abs(mean - first).max() > 1e-3:
                step *= 0.5
                continue
            if np.abs(mean - theta).max() < 1e-7 * step:
                break
            theta, now, step = mean, parting(mean), 1.5 * step
        return tuple("open" if t == 0 else "closed" if t == 1 else "rubbing" for t in theta)

    def state(self, c: int) -> str:
        return "closed" if c in self.closed else "rubbing" if c in self.rubbing else "open"

    def solve_as(self, edge: list[int], states: tuple[str, ...], x: np.ndarray, time: float) -> dict:
        for c, state in zip(edge, states, strict=True):
            self.closed.discard(c)
            self.rubbing.discard(c)
            if state != "open":
                (self.closed if state == "closed" else self.rubbing).add(c)
        return self.solve(x, self.rate * time)

    def misfit(self, c: int, state: str, found: dict) -> float:
        if state == "rubbing":  # at 0 or 1 it has just ended
            return max(INSIDE - found["theta"][c], found["theta"][c] - 1.0 + INSIDE)
        parting = found["parting"][c] / self.rate
        return float(parting if state == "closed" else -parting)

    def rows(self, strain: float, count: int) -> np.ndarray:
        """(count + 1, 5) at equal strains from 0 on: elastic, viscous stress, contacts, pressure, N1.

        Fewer where a hundred changes fall into one instant: a contact grazes, and rounding says how the flow goes on.
        """
        x, time = self.packing.positions.copy(), 0.0
        self.closed = {int(c) for c in np.flatnonzero(self.gaps(x, 0.0) < 0)}
        found, h, out = self.solve(x, 0.0), 0.01, []
        ends = strain / self.rate * np.arange(count + 1) / count
        for end in ends:
            while time < end * (1 - 1e-13):
                x, time, found, h = self.advance(x, time, found, h, end)
                if self.located[-100:-99] and self.located[-1] - self.located[-100] < STUCK:
                    return np.array(out)
            out.append(
                [
                    found["elastic"],
                    found["viscous"],
                    len(self.closed) + len(self.rubbing),
                    found["pressure"],
                    found["n1"],
                ]
            )
        return np.array(out)

    def smooth_rows(self, strain: float, count: int) -> np.ndarray:
        """As `rows`, of exponents above 2."""
        shape = self.packing.positions.shape

        def solve(time: float, x: np.ndarray) -> dict:
            self.closed = {int(c) for c in np.flatnonzero(self.gaps(x.reshape(shape), self.rate * time) < 0)}
            return self.solve(x.reshape(shape), self.rate * time)

        times, start = strain / self.rate * np.arange(count + 1) / count, self.packing.positions.ravel()
        path = solve_ivp(
            *(lambda time, x: solve(time, x)["flow"].ravel(), (0.0, times[-1]), start, "LSODA", times),
            rtol=self.tolerance,
            atol=self.tolerance,
        )
        found = [solve(time, x) for time, x in zip(times, path.y.T, strict=True)]
        return np.array([[f[name] for name in ("elastic", "viscous", "pressure", "n1")] for f in found])

    def advance(self, x: np.ndarray, time: float, found: dict, h: float, end: float) -> tuple:
        """One step, to the first change of a contact at most: positions, time, solution, step to try next."""
        whole = min(h, end - time)
        new, last, error = self.step(x, time, whole, found)
        allowed = self.tolerance * max(self.rate * whole, 1e-3 * self.rate)
        if error > allowed and whole > LEAST_STEP:
            return x, time, found, whole * max(0.2, 0.9 * (allowed / error) ** 0.2)
        wrong = self.changes(new, time + whole, last)
        nexth = max(h if whole < h else 0.0, whole * min(3.0, 0.9 * (allowed / max(error, 1e-30)) ** 0.2))
        if not wrong:
            self.rubbed += whole if self.rubbing else 0.0
            return new, time + whole, last, nexth
        high, new, last = self.first_change(x, time, found, whole, wrong, (new, last))
        self.rubbed += high if self.rubbing else 0.0
        return new, time + high, self.settle(new, time + high), max(nexth - high, 1e-3 * nexth)

    def first_change(
        self, x: np.ndarray, time: float, found: dict, whole: float, wrong: dict[int, float], at: tuple
    ) -> tuple[float, np.ndarray, dict]:
        """Part of a step up to where only the first change has happened, by no more than rounding."""
        low, high, halve = 0.0, whole, False
        starts = {c: self.value(c, x, time, found) for c in wrong}
        while high - low > 1e-13 * (time + 1):
            c = max(wrong, key=lambda k: wrong[k] / max(wrong[k] - starts[k], 1e-300))
            below, above = starts[c], wrong[c]
            if len(wrong) == 1 and above < 1e-12:
                break
            weight = 0.5 if halve or below >= 0 else max(below, -99 * above) / (max(below, -99 * above) - above)
            halve = not halve
            part = low + (high - low) * min(max(weight, 1e-3), 1 - 1e-3)
            new, last, _ = self.step(x, time, part, found)
            if now := self.changes(new, time + part, last):
                high, wrong, at = part, now, (new, last)
                starts = {k: starts.get(k, self.value(k, x, time, found)) for k in wrong}
            else:
                low = part
                starts = {k: self.value(k, new, time + part, last) for k in wrong}
        return high, *at
