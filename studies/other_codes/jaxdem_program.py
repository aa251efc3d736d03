"""One measurement in JaxDEM, as a program for the Python that has it: `python -P jaxdem_program.py TASK FILE.npz`.

TASK: "onset" or "minimum". FILE holds positions, `offsets` of droplets, `diameters` of disks, `side` of the box, the
`step` of a search or the `force` of a minimum, and the CPU time, s, after which the run is cut off (`limit`); compiling
is not counted. A line of JSON tells what is done as it is done, and JaxDEM prints the steps of its search, so that what
is cut off is known too. Double precision on one thread of the CPU.
"""

import json
import os
import resource
import sys
import time
from typing import Any

os.environ |= {"JAX_PLATFORMS": "cpu", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}

import jax
import jax.numpy as jnp
import jaxdem
import numpy as np
from jaxdem.domains.periodic import PeriodicDomain
from jaxdem.utils.jamming import bisection_jam

jax.config.update("jax_enable_x64", True)

# Its forces take the inverse of the sides of the box, which a change of the box does not renew (commit 5d9c13ad of
# 2026-06-29): no disk then touches another at any packing fraction. The distance that divides by the sides replaces it.
PeriodicDomain._displacement = staticmethod(PeriodicDomain.displacement)

Given = dict[str, Any]  # arrays by name

STEP = 0.04  # its FIRE raises it tenfold, to the longest of jamlab's
SKIN = 0.3  # mean diameters beyond the cutoff of its neighbour list


def tell(**said: Any) -> None:
    """Print what is known so far."""
    print(json.dumps(said), flush=True)


def system_of(state: Any, side: Any, stiffness: Any, cutoff: float, **more: Any) -> Any:
    """A periodic square of springs, whose stiffness is given for each pair of kinds."""
    kinds = [jaxdem.Material.create("elastic", young=1.0, poisson=0.5, density=1.0) for _ in stiffness]
    table = jaxdem.MaterialTable.from_materials(kinds, matcher=jaxdem.MaterialMatchmaker.create("harmonic"))
    table.pair["young_eff"] = jnp.asarray(stiffness)
    return jaxdem.System.create(
        state=state,
        minimizer=jaxdem.minimizers.fire,
        minimizer_kw={"dt": STEP},
        domain_type="periodic",
        domain_kw={"box_size": jnp.full(2, float(side))},
        force_model_type="spring",
        collider_type="NeighborList",
        collider_kw={"cutoff": float(cutoff), "skin": SKIN * float(cutoff)},
        mat_table=table,
        **more,
    )


def disks(given: Given) -> tuple[Any, Any]:
    """The disks of jamlab: springs of stiffness eps/s_ij^2 for each pair of sizes, the same law."""
    sizes, kinds = np.unique(given["diameters"], return_inverse=True)
    s = 0.5 * (sizes[:, None] + sizes)
    state = jaxdem.State.create(
        pos=jnp.asarray(np.mod(given["positions"], given["side"])),
        rad=jnp.asarray(0.5 * given["diameters"]),
        mass=jnp.ones(len(kinds)),
        mat_id=jnp.asarray(kinds),
        volume=jnp.asarray(0.25 * np.pi * given["diameters"] ** 2),
    )
    return state, system_of(state, given["side"], 1.0 / s**2, sizes.max())


def droplets(given: Given) -> tuple[Any, Any]:
    """Its deformable particles, polygons at rest, whose edges and areas are springs of stiffness 1. Their vertices are
    disks as wide as edges are long, its own law of contact. Without line tension: `bisection_jam` asks for an energy of
    zero below onset, which a tension never gives."""
    offsets, positions = given["offsets"], given["positions"]
    sizes = np.diff(offsets)
    of = np.repeat(np.arange(len(sizes)), sizes)
    after = np.arange(len(of)) + 1
    after[offsets[1:] - 1] = offsets[:-1]
    bonds = np.full((len(of), sizes.max()), -1)
    for k, size in enumerate(sizes):
        bonds[offsets[k] : offsets[k + 1], :size] = np.arange(offsets[k], offsets[k + 1])
    bonds[bonds == np.arange(len(of))[:, None]] = -1
    edges = np.linalg.norm(positions[after] - positions, axis=1)
    x, y = positions.T
    areas = np.bincount(of, 0.5 * (x * y[after] - x[after] * y))
    width = (np.bincount(of, edges) / sizes)[of]
    model = jaxdem.BondedForceModel.create(
        "DeformableParticleModel",
        vertices=jnp.asarray(positions),
        elements=jnp.asarray(np.column_stack([np.arange(len(of)), after])),
        elements_id=jnp.asarray(of),
        em=jnp.ones(len(of)),
        ec=jnp.ones(len(sizes)),
    )
    state = jaxdem.State.create(
        pos=jnp.asarray(positions),
        rad=jnp.asarray(0.5 * width),
        mass=jnp.ones(len(of)),
        bond_id=jnp.asarray(bonds),
        volume=jnp.asarray((areas / sizes)[of]),
    )
    return state, system_of(state, given["side"], np.ones((1, 1)), width.max(), bonded_force_model=model)


def begin(began: float, limit: float) -> float:
    """Say what compiling took; from here on the CPU time counts."""
    now = time.process_time()
    tell(compiling=now - began)
    resource.setrlimit(resource.RLIMIT_CPU, 2 * (int(np.ceil(now + limit)),))
    return time.process_time()


def find_onset(state: Any, system: Any, step: float, limit: float) -> None:
    """Its `bisection_jam` at its own tolerances: energy 1e-16 a disk or vertex, packing fraction to 1e-10."""
    began = time.process_time()
    search = bisection_jam.lower(state, system, packing_fraction_increment=step, verbose=True).compile()
    began = begin(began, limit)
    found = search(state, system, packing_fraction_increment=step)
    jammed, end = jax.block_until_ready((found.jammed_state, found.jammed_system))
    seconds = time.process_time() - began
    jammed, end = end.collider.compute_force(jammed, end)
    jammed, _ = end.force_manager.apply(jammed, end)
    tell(seconds=seconds, phi=float(found.packing_fraction), energy=float(found.potential_energy), **left(jammed))


def find_minimum(state: Any, system: Any, force: float, limit: float) -> None:
    """Its `minimize`, which is told to end by the largest component of a force alone."""
    how = {"pe_tol": -1.0, "pe_diff_tol": -1.0, "force_tol": force / np.sqrt(2)}
    began = time.process_time()
    descend = jaxdem.minimizers.minimize.lower(state, system, max_steps=1_000_000, **how).compile()
    began = begin(began, limit)
    end, after, steps, _ = jax.block_until_ready(descend(state, system, **how))
    seconds = time.process_time() - began
    tell(seconds=seconds, steps=int(steps), overflow=bool(after.collider.overflow), **left(end))


def left(state: Any) -> dict[str, float]:
    """The largest force that is left."""
    return {"force": float(jnp.linalg.norm(state.force, axis=1).max())}


if __name__ == "__main__":
    task, file = sys.argv[1:]
    given = dict(np.load(file))
    made = droplets(given) if "offsets" in given else disks(given)
    tell(version=jax.__version__)
    if task == "onset":
        find_onset(*made, float(given["step"]), float(given["limit"]))
    else:
        find_minimum(*made, float(given["force"]), float(given["limit"]))
