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
        jamlab.write(folder / "flow.data", packing)
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
