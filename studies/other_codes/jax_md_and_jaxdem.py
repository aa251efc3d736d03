"""Disks in jax-md and in JaxDEM, in double precision, on the CPU."""

from typing import Any

import numpy as np

from jamlab.errors import EngineError
from jamlab.packing.packing import Packing
from studies.other_codes.peers import Descent, Peer, Point, mean_diameters

_SKIN = 0.3  # mean diameters beyond the cutoff of a neighbour list
_STEP = 0.04  # its FIRE raises it tenfold, to the longest of jamlab's and of jax-md's


class JaxMD(Peer):
    """Double precision, on the CPU."""

    name = "jax-md"
    package = "jax-md"
    method = "fire_descent, jit"
    apart = True

    def evaluate(self, packing: Packing) -> Point:
        """Energy, and its derivatives by automatic differentiation; stress from the law over all pairs."""
        jax = double_precision()
        from jax_md import energy as laws
        from jax_md import quantity, space

        x = jax.numpy.asarray(packing.positions)
        near, energy, _ = _law(packing)
        neighbors = near.allocate(x)
        slope = jax.grad(energy)(x, neighbor=neighbors)
        displacement, _ = space.periodic(jax.numpy.asarray(np.diag(packing.box)))
        pairs = laws.soft_sphere_pair(displacement, **_parameters(packing))
        stress = np.asarray(quantity.stress(pairs, x, jax.numpy.asarray(packing.box)))
        return Point(float(energy(x, neighbor=neighbors)), -np.asarray(slope), stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing) -> Descent:
        """Prepare `fire_descent` as one compiled loop, with the time steps of jamlab's FIRE."""
        jax = double_precision()
        from jax_md import minimize

        jax.clear_caches()  # lists of different packings cannot be compared, as its cache of traces tries to
        near, energy, shift = _law(packing)
        start, step = minimize.fire_descent(energy, shift, dt_start=0.1, dt_max=0.4)

        def descend(x: Any, neighbors: Any, force: float, steps: int) -> Any:
            def goes_on(carry: Any) -> Any:
                state, _, taken = carry
                return (jax.numpy.linalg.norm(state.force, axis=1).max() > force) & (taken < steps)

            def go_on(carry: Any) -> Any:
                state, neighbors, taken = carry
                state = step(state, neighbor=neighbors)
                return state, neighbors.update(state.position), taken + 1

            state, neighbors, _ = jax.lax.while_loop(goes_on, go_on, (start(x, neighbor=neighbors), neighbors, 0))
            return state.position, neighbors.did_buffer_overflow

        x, compiled = jax.numpy.asarray(packing.positions), jax.jit(descend)
        room = near.allocate(x)

        def run(force: float, steps: int) -> np.ndarray:
            positions, overflow = compiled(x, room, force, steps)
            if overflow:
                raise EngineError("jax-md: its neighbour list is too short for this descent")
            return np.asarray(positions)

        return run


def double_precision() -> Any:
    """JAX with 64-bit numbers."""
    import jax

    jax.config.update("jax_enable_x64", True)
    return jax


def _law(packing: Packing) -> tuple[Any, Any, Any]:
    from jax import numpy as jnp
    from jax_md import energy, space

    box = jnp.asarray(np.diag(packing.box))
    displacement, shift = space.periodic(box)
    near, law = energy.soft_sphere_neighbor_list(displacement, box, dr_threshold=_SKIN, **_parameters(packing))
    return near, law, shift


def _parameters(packing: Packing) -> dict[str, Any]:
    from jax import numpy as jnp

    species, s = mean_diameters(packing)
    eps = float(packing.params["eps"])
    return {"species": jnp.asarray(species), "sigma": jnp.asarray(s), "epsilon": eps, "alpha": 2.0}


class JaxDEM(Peer):
    """Double precision, on the CPU. Its spring U = (k/2)(s_ij - r)^2 is the law with k = eps/s_ij^2 for each pair."""

    name = "JaxDEM"
    package = "JaxDEM"
    method = "minimize, fire"
    apart = True
    install = "see https://github.com/cdelv/JaxDEM"  # in no package index

    def evaluate(self, packing: Packing) -> Point:
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
