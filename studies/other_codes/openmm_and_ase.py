"""Disks in OpenMM, as spheres in one plane, and in ASE with matscipy's neighbour list."""

from typing import Any

import numpy as np

from jamlab.packing.packing import Packing
from studies.other_codes.freud_and_matscipy import HEIGHT, disks_in_ase
from studies.other_codes.peers import Descent, Peer, Point, mean_diameters

_LAW = "0.5*eps*step(s-r)*(1-stretch*r/s)^2; s=0.5*(d1+d2)"


class OpenMM(Peer):
    """Disks as spheres in one plane; numbers are read as nm and kJ/mol, which leaves them as they are."""

    name = "OpenMM Reference"
    package = "openmm"
    method = "LocalEnergyMinimizer (L-BFGS)"

    def evaluate(self, packing: Packing) -> Point:
        """Energy, forces and pressure, -(1/2A) dU/d(stretch) of all distances; OpenMM gives no stress tensor."""
        context = _context(packing)
        state = context.getState(energy=True, forces=True, parameterDerivatives=True)
        forces = np.array(state.getForces(asNumpy=True)._value)[:, :2]
        stretch = state.getEnergyParameterDerivatives()["stretch"]
        energy = float(state.getPotentialEnergy()._value)
        return Point(energy, forces, None, -0.5 * float(stretch) / packing.area)

    def descent(self, packing: Packing) -> Descent:
        import openmm

        context = _context(packing)

        def run(force: float, steps: int) -> np.ndarray:
            context.setPositions(_in_a_plane(packing))
            rms = force / np.sqrt(3 * packing.n)  # OpenMM compares the root mean square of all components
            openmm.LocalEnergyMinimizer.minimize(context, tolerance=rms, maxIterations=steps)
            return np.array(context.getState(positions=True).getPositions(asNumpy=True)._value)[:, :2]

        return run


def _context(packing: Packing) -> Any:
    import openmm

    _, s = mean_diameters(packing)
    assert packing.diameters is not None
    depth = 4.0 * float(s.max())
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors((packing.box[0, 0], 0, 0), (0, packing.box[1, 1], 0), (0, 0, depth))
    law = openmm.CustomNonbondedForce(_LAW)
    law.addGlobalParameter("eps", float(packing.params["eps"]))
    law.addGlobalParameter("stretch", 1.0)
    law.addEnergyParameterDerivative("stretch")
    law.addPerParticleParameter("d")
    law.setNonbondedMethod(law.CutoffPeriodic)
    law.setCutoffDistance(float(s.max()))
    for diameter in packing.diameters:
        system.addParticle(1.0)
        law.addParticle([float(diameter)])
    system.addForce(law)
    context = openmm.Context(system, openmm.VerletIntegrator(0.001), openmm.Platform.getPlatformByName("Reference"))
    context.setPositions(_in_a_plane(packing))
    return context


def _in_a_plane(packing: Packing) -> np.ndarray:
    return np.column_stack([packing.positions, np.zeros(packing.n)])


class ASE(Peer):
    """Disks in one plane of a periodic box, by matscipy's neighbour list."""

    name = "ASE, matscipy"
    package = "ase"
    method = "FIRE"

    def evaluate(self, packing: Packing) -> Point:
        atoms = disks_in_ase(packing)
        stress = -HEIGHT * atoms.get_stress(voigt=False)[:2, :2]  # ASE: positive in tension, per volume
        energy = float(atoms.get_potential_energy())
        return Point(energy, atoms.get_forces()[:, :2], stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing) -> Descent:
        """Prepare FIRE with steps bounded as in jamlab; every run sets up its own Atoms."""
        from ase.optimize import FIRE

        def run(force: float, steps: int) -> np.ndarray:
            atoms = disks_in_ase(packing)
            FIRE(atoms, logfile=None, dt=0.1, maxstep=0.1).run(fmax=force, steps=steps)
            return np.array(atoms.positions[:, :2])

        return run
