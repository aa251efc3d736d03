"""Disks in jax-md, in double precision, on the CPU."""

from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import EngineError
from jamlab.packing.packing import Packing
from studies.other_codes.peers import Descent, Peer, Point, mean_diameters

_SKIN = 0.3  # mean diameters beyond the cutoff of a neighbour list


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

        def run(force: float, steps: int) -> Array:
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
