"""Run jax-md: soft spheres by automatic differentiation, FIRE compiled into one loop."""

from typing import Any

import numpy as np

from jamlab.benchmarks.other_codes.peer import MOST_STEPS, Descent, Peer, Point, mean_diameters
from jamlab.packing.packing import Packing


class JaxMD(Peer):
    """All pairs, double precision, on the CPU."""

    name = "jax-md"
    package = "jax-md"
    method = "fire_descent, jit"

    def evaluate(self, packing: Packing) -> Point:
        """Energy, and its derivatives by automatic differentiation."""
        jax = _double_precision()
        from jax_md import quantity

        energy, _ = _law(packing)
        x = jax.numpy.asarray(packing.positions)
        slope = jax.grad(energy)(x)
        stress = np.asarray(quantity.stress(energy, x, jax.numpy.asarray(packing.box)))
        return Point(float(energy(x)), -np.asarray(slope), stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing, force: float) -> Descent:
        """Prepare `fire_descent` as one compiled loop, with the time steps of jamlab's FIRE."""
        jax = _double_precision()
        from jax_md import minimize

        energy, shift = _law(packing)
        start, step = minimize.fire_descent(energy, shift, dt_start=0.1, dt_max=0.4)

        def descend(x: Any) -> Any:
            def goes_on(carry: Any) -> Any:
                state, taken = carry
                return (jax.numpy.linalg.norm(state.force, axis=1).max() > force) & (taken < MOST_STEPS)

            return jax.lax.while_loop(goes_on, lambda carry: (step(carry[0]), carry[1] + 1), (start(x), 0))[0].position

        x, compiled = jax.numpy.asarray(packing.positions), jax.jit(descend)
        return lambda: np.asarray(compiled(x).block_until_ready())


def _double_precision() -> Any:
    import jax

    jax.config.update("jax_enable_x64", True)
    return jax


def _law(packing: Packing) -> tuple[Any, Any]:
    from jax import numpy as jnp
    from jax_md import energy, space

    species, s = mean_diameters(packing)
    displacement, shift = space.periodic(jnp.asarray(np.diag(packing.box)))
    eps = float(packing.params["eps"])
    law = energy.soft_sphere_pair(displacement, jnp.asarray(species), sigma=jnp.asarray(s), epsilon=eps, alpha=2.0)
    return law, shift
