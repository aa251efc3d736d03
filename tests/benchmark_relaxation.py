"""Minimisation of disks against other codes, and against N. pytest -m benchmark -s.

Other codes take part if they are installed: pip install jax-md ase. One thread, one run; ratios are what counts.
"""

import json
import time

import numpy as np
import pytest

import jamlab
from jamlab.relaxation import relax
from jamlab.start import random_disks

N, PHI, FORCE, STEPS = 64, 0.88, 1e-12, 200_000


def median(run, times):
    spans = []
    for _ in range(times):
        began = time.perf_counter()
        run()
        spans.append(time.perf_counter() - began)
    return float(np.median(spans))


def by_jamlab(start):
    with jamlab.Session(start) as session:

        def run():
            session.load(start)
            return relax(session)

        run()
        found = run()
        return median(run, 20), found.evaluation.energy, found.evaluation.max_force


def pair_forces(start):
    """Energy and forces of all pairs in numpy, eps = 1: what a calculator for ASE would be."""
    s = 0.5 * (start.diameters[:, None] + start.diameters)
    side = start.box[0, 0]

    def evaluate(x):
        r = x[:, None] - x
        r -= side * np.round(r / side)
        distance = np.hypot(r[..., 0], r[..., 1])
        np.fill_diagonal(distance, np.inf)
        overlap = np.maximum(1 - distance / s, 0.0)
        forces = ((overlap / (s * distance))[..., None] * r).sum(axis=1)
        return 0.25 * (overlap**2).sum(), forces

    return evaluate


def by_ase(start):
    ase = pytest.importorskip("ase")
    from ase.calculators.calculator import Calculator, all_changes
    from ase.optimize import FIRE

    evaluate = pair_forces(start)

    class Disks(Calculator):
        implemented_properties = ("energy", "forces")

        def calculate(self, atoms=None, properties=("energy",), system_changes=all_changes):
            super().calculate(atoms, properties, system_changes)
            energy, forces = evaluate(atoms.positions[:, :2])
            self.results = {"energy": energy, "forces": np.column_stack([forces, np.zeros(len(forces))])}

    def run():
        atoms = ase.Atoms(numbers=np.ones(start.n), positions=np.column_stack([start.positions, np.zeros(start.n)]))
        atoms.calc = Disks()
        FIRE(atoms, logfile=None, dt=0.1, maxstep=0.1).run(fmax=FORCE, steps=STEPS)
        run.end = evaluate(atoms.positions[:, :2])

    seconds = median(run, 3)
    return seconds, run.end[0], float(np.hypot(*run.end[1].T).max())


def by_jax_md(start):
    jax = pytest.importorskip("jax")
    pytest.importorskip("jax_md")
    jax.config.update("jax_enable_x64", True)
    from jax import numpy as jnp
    from jax_md import minimize, space

    displacement, shift = space.periodic(start.box[0, 0])
    s = jnp.asarray(0.5 * (start.diameters[:, None] + start.diameters))
    all_pairs = space.map_product(displacement)

    def energy(x):
        r = all_pairs(x, x)
        square = (r**2).sum(axis=-1) + 4 * jnp.eye(start.n) * s.max() ** 2
        overlap = jnp.maximum(1 - jnp.sqrt(square) / s, 0.0)
        return 0.25 * (overlap**2).sum()

    init, apply = minimize.fire_descent(energy, shift, dt_start=0.1, dt_max=0.4)

    @jax.jit
    def descend(x):
        def go_on(carry):
            state, step = carry
            return (jnp.abs(state.force).max() > FORCE) & (step < STEPS)

        return jax.lax.while_loop(go_on, lambda carry: (apply(carry[0]), carry[1] + 1), (init(x), 0))[0]

    def run():
        run.end = descend(jnp.asarray(start.positions)).position.block_until_ready()

    run()  # compile
    seconds = median(run, 10)
    total, forces = pair_forces(start)(np.asarray(run.end))
    return seconds, total, float(np.hypot(*forces.T).max())


@pytest.mark.benchmark
@pytest.mark.filterwarnings("ignore")
def test_minimisation_against_other_codes():
    """One fixed start, N = 64, to 1e-12; random starts end in different basins, so the start is a jolted minimum."""
    rng = np.random.default_rng(1)
    with jamlab.Session(random_disks(N, 1, phi=PHI)) as session:
        relax(session)
        minimum = session.packing()
    start = minimum.with_state(positions=minimum.positions + 0.02 * rng.standard_normal((N, 2)))
    rows = {}
    for name, run in (("jamlab", by_jamlab), ("jax-md", by_jax_md), ("ASE", by_ase)):
        try:
            seconds, energy, force = run(start)
        except pytest.skip.Exception:
            print(f"\n{name}: not installed", end="")
            continue
        rows[name] = {"seconds": seconds, "energy": float(energy), "max_force": float(force)}
        print(f"\n{name:8s} {1e3 * seconds:9.2f} ms   E = {energy:.12g}   max force {force:.2g}", end="")
    ratios = {name: row["seconds"] / rows["jamlab"]["seconds"] for name, row in rows.items()}
    print("\n" + json.dumps({"rows": rows, "time_over_jamlab": ratios}))
    assert rows["jamlab"]["max_force"] < FORCE


@pytest.mark.benchmark
def test_cost_against_size():
    """pack(n, 1e-3), whole search to max force 1e-12."""
    sizes, seconds = (256, 512, 1024, 2048, 4096), []
    for n in sizes:
        spans = []
        for seed in (1, 2, 3):
            began = time.perf_counter()
            p = jamlab.pack(n, 1e-3, seed)
            spans.append(time.perf_counter() - began)
            assert p.provenance["max_force"] < FORCE
        seconds.append(float(np.median(spans)))
        print(f"\nN = {n}: {seconds[-1]:.2f} s", end="")
    exponent = float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])
    print("\n" + json.dumps({"sizes": sizes, "seconds": seconds, "exponent": exponent}))


@pytest.mark.benchmark
def test_large_packing_on_two_ranks():
    """N = 32 768, p = 1e-4 to max force 1e-12, beside 120 s."""
    began = time.perf_counter()
    p = jamlab.pack(32768, 1e-4, 1, ranks=2)
    print("\n" + json.dumps({"seconds": time.perf_counter() - began, **p.provenance}))
    assert p.provenance["converged"]
