"""Run ASE: its FIRE over a force field in numpy, the usual way to bring a new force law into ASE."""

from typing import Any

import numpy as np

from jamlab.benchmarks.other_codes.numpy_disks import all_pairs
from jamlab.benchmarks.other_codes.peer import MOST_STEPS, Descent, Peer, Point
from jamlab.packing.packing import Packing


class ASE(Peer):
    """Disks in one plane of a cell that is periodic along x and y."""

    name = "ASE"
    package = "ase"
    method = "FIRE"

    def evaluate(self, packing: Packing) -> Point:
        """Energy, forces and stress from an ASE calculator."""
        atoms = _atoms(packing)
        voigt = -atoms.get_stress() * atoms.get_volume() / packing.area  # ASE: positive in tension, per volume
        stress = np.array([[voigt[0], voigt[5]], [voigt[5], voigt[1]]])
        return Point(
            float(atoms.get_potential_energy()), atoms.get_forces()[:, :2], stress, 0.5 * float(np.trace(stress))
        )

    def descent(self, packing: Packing, force: float) -> Descent:
        """Prepare FIRE with steps bounded as in jamlab; every run sets up its own Atoms."""
        from ase.optimize import FIRE

        def run() -> np.ndarray:
            atoms = _atoms(packing)
            FIRE(atoms, logfile=None, dt=0.1, maxstep=0.1).run(fmax=force, steps=MOST_STEPS)
            return np.array(atoms.positions[:, :2])

        return run


def _atoms(packing: Packing) -> Any:
    import ase
    from ase.calculators.calculator import Calculator, all_changes

    law = all_pairs(packing)

    class Disks(Calculator):  # type: ignore[misc]
        """The numpy force field as an ASE calculator."""

        implemented_properties = ("energy", "forces", "stress")

        def calculate(
            self, atoms: Any = None, properties: Any = ("energy",), system_changes: Any = all_changes
        ) -> None:
            super().calculate(atoms, properties, system_changes)
            point = law(atoms.positions[:, :2])
            assert point.stress is not None
            (xx, xy), (_, yy) = point.stress
            self.results = {
                "energy": point.energy,
                "forces": np.column_stack([point.forces, np.zeros(packing.n)]),
                "stress": -np.array([xx, yy, 0.0, 0.0, 0.0, xy]),
            }

    cell = np.zeros((3, 3))
    cell[:2, :2], cell[2, 2] = packing.box, 1.0
    positions = np.column_stack([packing.positions, np.zeros(packing.n)])
    atoms = ase.Atoms(numbers=np.ones(packing.n), positions=positions, cell=cell, pbc=(True, True, False))
    atoms.calc = Disks()
    return atoms
