"""Run JaxDEM: its linear spring over its neighbour list, FIRE compiled into one loop."""

from typing import Any

import numpy as np

from jamlab.errors import EngineError
from jamlab.packing.packing import Packing
from jamlab.studies.other_codes.jax_md_peer import double_precision
from jamlab.studies.other_codes.peer import Descent, Peer, Point, mean_diameters

_SKIN = 0.3  # mean diameters beyond the cutoff of its neighbour list, as for jax-md
_STEP = 0.04  # its FIRE raises it tenfold, to the longest of jamlab's and of jax-md's


class JaxDEM(Peer):
    """Double precision, on the CPU. Its spring U = (k/2)(s_ij - r)^2 is the law with k = eps/s_ij^2 for each pair."""

    name = "JaxDEM"
    package = "JaxDEM"
    method = "minimize, fire"
    apart = True
    install = "see https://github.com/cdelv/JaxDEM"  # in no package index

    def evaluate(self, packing: Packing) -> Point:
        """Energy, forces and stress of its contacts."""
        state, system = _disks(packing)
        from jaxdem.utils import compute_contact_stress_tensor

        state, system = system.collider.compute_force(state, system)
        energy = float(system.collider.compute_potential_energy(state, system)[-1])
        forces = np.array(state.force)
        stress = np.asarray(compute_contact_stress_tensor(state, system)[-1])
        return Point(energy, forces, stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing) -> Descent:
        """Prepare its `minimize`, which ends by the force alone."""
        jax = double_precision()
        from jaxdem.minimizers import minimize

        state, system = _disks(packing)
        compiled = jax.jit(minimize.__wrapped__)  # itself it compiles anew for every number of steps

        def run(force: float, steps: int) -> np.ndarray:
            component = force / np.sqrt(2)  # it compares the largest component
            end, after, *_ = compiled(state, system, steps, pe_tol=-1.0, pe_diff_tol=-1.0, force_tol=component)
            if bool(after.collider.overflow):
                raise EngineError("JaxDEM: its neighbour list is too short for this descent")
            return np.asarray(end.pos)

        return run


def _disks(packing: Packing) -> tuple[Any, Any]:
    """Its state and its system."""
    jax = double_precision()
    import jaxdem

    species, s = mean_diameters(packing)
    sides = jax.numpy.asarray(np.diag(packing.box))
    kinds = [jaxdem.Material.create("elastic", young=1.0, poisson=0.5, density=1.0) for _ in s]
    table = jaxdem.MaterialTable.from_materials(kinds, matcher=jaxdem.MaterialMatchmaker.create("harmonic"))
    table.pair["young_eff"] = jax.numpy.asarray(float(packing.params["eps"]) / s**2)
    state = jaxdem.State.create(
        pos=jax.numpy.asarray(np.mod(packing.positions, np.diag(packing.box))),
        rad=jax.numpy.asarray(0.5 * np.diag(s)[species]),
        mass=jax.numpy.ones(packing.n),
        mat_id=jax.numpy.asarray(species),
    )
    system = jaxdem.System.create(
        state=state,
        minimizer=jaxdem.minimizers.fire,
        minimizer_kw={"dt": _STEP},
        domain_type="periodic",
        domain_kw={"box_size": sides},
        force_model_type="spring",
        collider_type="NeighborList",
        collider_kw={"cutoff": float(s.max()), "skin": _SKIN},
        mat_table=table,
    )
    return state, system
