"""Disks at a pressure and shear-stabilized packings: price of a FIRE step, cost against N, and beside older code.

pytest -m benchmark -s tests/protocols/benchmark_large_packings.py. JAMLAB_BEFORE names the Python of an environment
with an older jamlab: packings are then made by both in turn, and phi of both ensembles is compared. Single runs are
chaotic: five seeds each. `large_packings.json` holds the ratios once found; JAMLAB_BASELINE=write stores new ones.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ks_2samp

import jamlab
from jamlab.engine.deck_defaults import deck
from jamlab.engine.disk_fire import fire_disks
from jamlab.protocols.box_shear import shear_stress
from jamlab.protocols.random_start import random_disks

STORED = Path(__file__).with_name("large_packings.json")
SEEDS = range(1, 6)
WORSE = 0.6  # part of a stored ratio that a busy machine may leave
ANGLES = np.linspace(0, np.pi, 36, endpoint=False)

MAKE = """
import json, sys, time, jamlab
n, pressure, ensemble, seed = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3], int(sys.argv[4])
jamlab.pack(16, 1e-2, 1)
began = time.process_time()
p = jamlab.pack(n, pressure, seed, ensemble=ensemble)
print(json.dumps([time.process_time() - began, p.phi, p.converged]))
"""


def make(python, n, pressure, ensemble, seed):
    """CPU seconds and phi of a packing made in a process of its own."""
    words = [python, "-c", MAKE, str(n), str(pressure), ensemble, str(seed)]
    folder = None if python == sys.executable else str(STORED.parents[2].parent)  # a checkout shadows what is installed
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    if folder:
        environment.pop("PYTHONPATH", None)
    done = subprocess.run(words, capture_output=True, text=True, check=True, cwd=folder, env=environment)
    seconds, phi, converged = json.loads(done.stdout.splitlines()[-1])
    assert converged
    return seconds, phi


def compare(name, ratio):
    """Print a ratio beside the one stored, and hold it to that."""
    stored = json.loads(STORED.read_text())
    print(f"\n{name}: {ratio:.2f}, stored {stored.get(name, float('nan')):.2f}")
    if os.environ.get("JAMLAB_BASELINE") == "write":
        STORED.write_text(json.dumps({**stored, name: round(ratio, 2)}, indent=1) + "\n")
    else:
        assert ratio > WORSE * stored[name]


@pytest.mark.benchmark
@pytest.mark.parametrize("n", [1024, 32768])
def test_price_of_a_fire_step(n):
    """LAMMPS over the kernel, 400 steps in turn, from states half relaxed; CPU time of one core."""
    ratios = []
    for seed in SEEDS:
        start, _, _ = fire_disks(random_disks(n, seed, phi=0.86, units="k"), 1e-13, 300)
        with jamlab.Session(start) as session:
            session.command(f'include "{deck("minimize.fire")}"')
            session.command("thermo 0")
            began = time.process_time()
            session.command("minimize 0.0 1e-13 400 4000")
            lammps = time.process_time() - began
        began = time.process_time()
        fire_disks(start, 1e-13, 400)
        ratios.append(lammps / (time.process_time() - began))
    compare(f"FIRE step of LAMMPS over the kernel's, N = {n}", float(np.median(ratios)))


@pytest.mark.benchmark
@pytest.mark.parametrize("ensemble", ["fixed-box", "shear-stabilized"])
def test_cost_against_size(ensemble):
    """p = 1e-4: medians of five seeds, and the exponent; what a shear-stabilized packing has to meet."""
    sizes, seconds = (256, 512, 1024, 2048), []
    for n in sizes:
        spans = []
        for seed in SEEDS:
            began = time.process_time()
            p = jamlab.pack(n, 1e-4, seed, ensemble=ensemble)
            spans.append(time.process_time() - began)
            state = jamlab.evaluate(p)
            assert p.converged and state.pressure == pytest.approx(1e-4, rel=1e-9)
            if ensemble == "shear-stabilized":
                assert shear_stress(state) < 1e-11 * state.pressure
                assert jamlab.shear_modulus(p, angle=ANGLES).min() > 0
        seconds.append(float(np.median(spans)))
        print(f"\n{ensemble}, N = {n}: {seconds[-1]:.2f} s, {min(spans):.2f} to {max(spans):.2f}", end="")
    print(f"\nexponent {np.polyfit(np.log(sizes), np.log(seconds), 1)[0]:.2f}")


@pytest.mark.benchmark
@pytest.mark.skipif("JAMLAB_BEFORE" not in os.environ, reason="JAMLAB_BEFORE names no Python with an older jamlab")
@pytest.mark.parametrize("n, ensemble", [(512, "fixed-box"), (512, "shear-stabilized"), (4096, "fixed-box")])
def test_beside_older_code(n, ensemble):
    """p = 1e-4, both in turn: median ratio of CPU times, and the two-sample test of phi."""
    pairs = [
        [make(python, n, 1e-4, ensemble, seed) for python in (os.environ["JAMLAB_BEFORE"], sys.executable)]
        for seed in SEEDS
    ]
    (old, phi_old), (new, phi_new) = (np.array(rows).T for rows in zip(*pairs, strict=True))
    found = ks_2samp(phi_old, phi_new)
    print(
        f"\nphi {phi_old.mean():.6f} before, {phi_new.mean():.6f} now, Kolmogorov-Smirnov p = {found.pvalue:.2f}",
        end="",
    )
    compare(f"pack before over now, N = {n}, {ensemble}", float(np.median(old / new)))


@pytest.mark.benchmark
def test_large_packing_on_two_ranks():
    """N = 32 768, p = 1e-4 to max force 1e-12 on two cores."""
    began = time.perf_counter()
    p = jamlab.pack(32768, 1e-4, 1, ranks=2)
    print("\n" + json.dumps({"seconds": time.perf_counter() - began, **p.provenance}))
    assert p.converged
