"""Disks in LAMMPS under the plugin's fix overdamped, the same flow by plain loops."""

from typing import Any

import numpy as np

import jamlab
from jamlab.engine.installation import start_lammps

COLUMNS = (
    "time strain rate stress elastic viscous pressure normal_stress_difference dissipation energy work dissipated "
    "last_iterations step iterations contacts"
).split()


def commands(
    packing: jamlab.Packing, data: str, drag: str = "1 1", newton: str = "on", grid: str = "1 * 1"
) -> list[str]:
    """Up to where the fix comes in; `data` is a file of the packing."""
    sizes = np.unique(packing.diameters)
    pairs = [(a, b) for a in range(len(sizes)) for b in range(a, len(sizes))]
    contact = {(a, b): 0.5 * (sizes[a] + sizes[b]) for a, b in pairs}
    stiffness = {pair: packing.params["k"] if packing.units == "k" else packing.params["eps"] / s**2
                 for pair, s in contact.items()}  # fmt: skip
    return [
        *["units lj", "dimension 2", f"newton {newton}", "atom_modify map array sort 10 0.0", f"processors {grid}"],
        *["atom_style atomic", f"read_data {data} nocoeff", "change_box all triclinic", f"pair_style disk/drag {drag}"],
        *(f"pair_coeff {a + 1} {b + 1} {stiffness[a, b] / 2:.17g} {contact[a, b]:.17g}" for a, b in pairs),
        *["neighbor 0.1 bin", "neigh_modify every 1 delay 0 check yes", "thermo 1000000", "thermo_modify norm no"],
    ]


class Flow:
    """One LAMMPS with one packing; `folder` takes its files."""

    def __init__(self, folder: Any, packing: jamlab.Packing, fix: str, drag: str = "1 1", newton: str = "on") -> None:
        self.packing = packing
        self.lmp = start_lammps()
        jamlab.write_data(folder / "flow.data", packing)
        for line in self.lines(str(folder / "flow.data"), drag, newton):
            self.lmp.command(line)
        self.lmp.command(f"fix flow all overdamped {self.fix(fix, drag)}")

    def lines(self, data: str, drag: str, newton: str) -> list[str]:
        return commands(self.packing, data, drag, newton)

    def fix(self, settings: str, drag: str) -> str:
        return settings

    def __enter__(self) -> "Flow":
        return self

    def __exit__(self, *_: object) -> None:
        self.lmp.close()

    def run(self, steps: int = 10**9) -> dict[str, float]:
        """Go on, to the end of an interval by default: the numbers of the fix."""
        self.lmp.command(f"run {steps} post no")
        return {name: self.lmp.extract_fix("flow", 0, 1, k, 0) for k, name in enumerate(COLUMNS)}

    def state(self) -> jamlab.Packing:
        """The packing as it is now."""
        low, high, xy, *_ = self.lmp.extract_box()
        box = np.array([[high[0] - low[0], 0.0], [xy, high[1] - low[1]]])
        x = np.array(self.lmp.gather_atoms("x", 1, 3)).reshape(-1, 3)[:, :2]
        image = np.array(self.lmp.gather_atoms("image", 0, 3)).reshape(-1, 3)[:, :2]
        return self.packing.with_state(positions=x - low[:2] + image @ box, box=box)

    def forces(self) -> np.ndarray:
        return np.array(self.lmp.gather_atoms("f", 1, 3)).reshape(-1, 3)[:, :2]


def touching(x: np.ndarray, box: np.ndarray, diameters: np.ndarray) -> list[tuple[int, int, np.ndarray]]:
    """i, j and vector from i to j of every contact, over the images next to the box."""
    shifts = np.array([[a, b] for a in (-2, -1, 0, 1, 2) for b in (-1, 0, 1)]) @ box
    found = []
    for i in range(len(x)):
        r = x[:i, None] - x[i] + shifts
        reach = 0.5 * (diameters[i] + diameters[:i])
        found += [(i, j, r[j, m]) for j, m in np.argwhere(np.hypot(r[..., 0], r[..., 1]) < reach[:, None])]
    return found


def _dense(packing: jamlab.Packing, x: np.ndarray, box: np.ndarray, rate: float, beta: float) -> tuple:
    """Velocities and rotations (3n,) beside shear without mass, from dense B and F, and the (2, 2) tension of drag and
    overlaps times the area; units "k" with k = tau = 1."""
    n, d = packing.n, packing.diameters
    rows, push, affine = [], [], []
    for i, j, r in touching(x, box, d):
        distance = np.hypot(*r)
        for direction, drag in ((r / distance, 1.0), (np.array([-r[1], r[0]]) / distance, beta)):
            row = np.zeros(3 * n)
            row[2 * i : 2 * i + 2], row[2 * j : 2 * j + 2] = -direction, direction
            sliding = direction @ r < 1e-12
            if sliding:
                row[2 * n + i], row[2 * n + j] = -0.5 * d[i], -0.5 * d[j]
            rows.append(np.sqrt(drag) * row)
            affine.append(np.sqrt(drag) * np.outer(direction, r).ravel())
            push.append(0.0 if sliding else 0.5 * (d[i] + d[j]) - distance)
    # rows^T (rows u + affine) = rows^T push, the shortest u: the drag of approach has weight 1, as the force
    matrix, gradient = np.array(rows), np.array(affine)
    driven = np.array(push) - rate * gradient[:, 1]
    u = np.linalg.lstsq(matrix.T @ matrix, matrix.T @ driven, rcond=1e-10)[0]
    return u, (gradient.T @ (matrix @ u - driven)).reshape(2, 2)


def dense_velocities(packing: jamlab.Packing, x: np.ndarray, box: np.ndarray, rate: float, beta: float) -> np.ndarray:
    """Velocities (n, 2) in shear without mass."""
    u = _dense(packing, x, box, rate, beta)[0][: 2 * packing.n]
    return u.reshape(-1, 2) + rate * np.column_stack([x[:, 1], np.zeros(packing.n)])


def dense_tension(packing: jamlab.Packing, x: np.ndarray, box: np.ndarray, rate: float, beta: float) -> np.ndarray:
    """(2, 2) tension in shear without mass, drag included."""
    return _dense(packing, x, box, rate, beta)[1] / np.linalg.det(box)


def dense_path(packing: jamlab.Packing, rate: float, strain: float, steps: int, beta: float) -> np.ndarray:
    """Positions at the strain, by Runge and Kutta's steps of fourth order."""
    return _runge_kutta(packing, lambda x, box: rate, strain / rate, steps, beta)[0]


def dense_creep(packing: jamlab.Packing, stress: float, time: float, steps: int, beta: float) -> tuple:
    """Positions, box and rate after a time under a whole shear stress, which is linear in the rate."""

    def rate(x: np.ndarray, box: np.ndarray) -> float:
        still, moving = (dense_tension(packing, x, box, one, beta)[0, 1] for one in (0.0, 1.0))
        return float((stress - still) / (moving - still))

    x, box = _runge_kutta(packing, rate, time, steps, beta)
    return x, box, rate(x, box)


def _runge_kutta(packing: jamlab.Packing, rate: Any, time: float, steps: int, beta: float) -> tuple:
    """Positions and box; `rate` of positions and box."""
    dt = time / steps

    def box(strain: float) -> np.ndarray:
        return packing.box + np.array([[0.0, 0.0], [strain * packing.box[1, 1], 0.0]])

    def slope(x: np.ndarray, strain: float) -> tuple:
        now = rate(x, box(strain))
        return dense_velocities(packing, x, box(strain), now, beta), now

    x, strain = packing.positions.copy(), 0.0
    for _ in range(steps):
        first = slope(x, strain)
        second = slope(x + 0.5 * dt * first[0], strain + 0.5 * dt * first[1])
        third = slope(x + 0.5 * dt * second[0], strain + 0.5 * dt * second[1])
        last = slope(x + dt * third[0], strain + dt * third[1])
        x, strain = (at + dt / 6 * (a + 2 * b + 2 * c + d)
                     for at, a, b, c, d in zip((x, strain), first, second, third, last, strict=True))  # fmt: skip
    return x, box(strain)
