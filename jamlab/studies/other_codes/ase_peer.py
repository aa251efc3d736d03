"""Run ASE: its FIRE over matscipy's calculator of polydisperse particles."""

import numpy as np

from jamlab.packing.packing import Packing
from jamlab.studies.other_codes.matscipy_peer import HEIGHT, disks_in_ase
from jamlab.studies.other_codes.peer import Descent, Peer, Point


class ASE(Peer):
    """Disks in one plane of a periodic box, by matscipy's neighbour list."""

    name = "ASE, matscipy"
    package = "ase"
    method = "FIRE"

    def evaluate(self, packing: Packing) -> Point:
        """Energy, forces and stress of the calculator."""
        atoms = disks_in_ase(packing)
        stress = -HEIGHT * atoms.get_stress(voigt=False)[:2, :2]  # ASE: positive in tension, per volume
        return Point(
            float(atoms.get_potential_energy()), atoms.get_forces()[:, :2], stress, 0.5 * float(np.trace(stress))
        )

    def descent(self, packing: Packing) -> Descent:
        """Prepare FIRE with steps bounded as in jamlab; every run sets up its own Atoms."""
        from ase.optimize import FIRE

        def run(force: float, steps: int) -> np.ndarray:
            atoms = disks_in_ase(packing)
            FIRE(atoms, logfile=None, dt=0.1, maxstep=0.1).run(fmax=force, steps=steps)
            return np.array(atoms.positions[:, :2])

        return run
