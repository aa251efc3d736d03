"""Run OpenMM: a custom force on its Reference platform, the one in double precision, and its L-BFGS."""

from typing import Any

import numpy as np

from jamlab.packing.packing import Packing
from jamlab.studies.other_codes.peer import Descent, Peer, Point, mean_diameters

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
        """Prepare `LocalEnergyMinimizer`."""
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
