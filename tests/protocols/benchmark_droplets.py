"""Droplets: cost of a minimum against FIRE and against N, and the start of the onset search. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many seeds (40), JAMLAB_RESULTS a folder where each result is kept as it comes, so that a run can
go on where it was stopped. Times are CPU times of one core, taken in one run; ratios are what counts.
"""

import json
import os
import time

import numpy as np
import pytest
from kept_results import kept_rows
from scipy.stats import ks_2samp

import jamlab
from jamlab.packing.deformation import at_phi
from jamlab.protocols.relaxation import force_tolerance, relax

SEEDS = int(os.environ.get("JAMLAB_SEEDS", "40"))
FIRE_STEPS = 400_000
KICK = 0.01  # l: how far vertices are moved off a minimum

pytestmark = pytest.mark.benchmark


def timed(run):
    began = time.process_time()
    result = run()
    return time.process_time() - began, result


def tiled(packing, copies, seed):
    """copies x copies of a packing in one box, every vertex moved at random."""
    shifts = np.array([(a, b) for a in range(copies) for b in range(copies)]) @ packing.box
    positions = (packing.positions + shifts[:, None]).reshape(-1, 2)
    nv = np.tile(np.diff(packing.offsets), copies**2)
    law = packing.params | {"a0": np.tile(packing.params["a0"], copies**2)}
    kick = np.random.default_rng(seed).normal(0, KICK, positions.shape)
    offsets = np.concatenate([[0], np.cumsum(nv)])
    return jamlab.Packing("dp", copies * packing.box, positions + kick, law, offsets=offsets)


def test_a_minimum_costs_less_than_a_twentieth_of_fire_alone():
    """From the same states, compressed by 0.01, to a largest force of 1e-10."""
    onset = jamlab.jam("dp", 16, 2)
    ratios = []
    for rho, packing in zip((0.86, 0.90, 0.94, 0.98), jamlab.compress(onset, to=0.98, step=0.04), strict=False):
        start = at_phi(packing, packing.phi + 0.01)
        with jamlab.Session(start) as session:
            ours, found = timed(lambda session=session: relax(session))
            session.load(start)
            fire, state = timed(
                lambda session=session: session.minimize(0.7 * force_tolerance("dp"), style="fire", steps=FIRE_STEPS)
            )
        assert found.converged
        reached = state.max_force <= force_tolerance("dp")
        ratios.append(fire / ours)
        how = "" if reached else "more than "
        print(f"rho {rho:.2f}: jamlab {ours:.3f} s, FIRE {how}{fire:.1f} s to {state.max_force:.1e}")
    print(json.dumps({"fire over jamlab": ratios}))
    assert np.median(ratios) > 20


def test_cost_against_n():
    """CPU time of a minimum from vertices kicked by 0.01, N = 16 to 256 by tiling, and its exponent."""
    onset = jamlab.jam("dp", 16, 2)
    *_, dense = jamlab.compress(onset, to=0.92, step=0.03)
    sizes, times = [], []
    for copies in (1, 2, 4):
        spans = []
        for seed in range(3):
            start = tiled(dense, copies, seed)
            with jamlab.Session(start) as session:
                seconds, found = timed(lambda session=session: relax(session))
            assert found.converged
            spans.append(seconds)
        sizes.append(start.n)
        times.append(np.median(spans))
        print(f"N = {sizes[-1]}: {times[-1]:.2f} s")
    exponent = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    print(json.dumps({"n": sizes, "seconds": times, "exponent": exponent}))
    assert exponent < 2.5


def test_starts_lead_to_one_distribution_of_onsets(kept_folder):
    """Droplets carried by disks against droplets compressed from phi = 0.20: Kolmogorov-Smirnov, and time."""
    found = {}
    for start in ("carried", "scratch"):

        def onset(seed, start=start):
            seconds, p = timed(lambda: jamlab.jam("dp", 16, seed, start=start))
            return {"rho": p.onset, "z": jamlab.contacts(p).z, "seconds": seconds}

        keys = [(seed,) for seed in range(1, SEEDS + 1)]
        rows = kept_rows(kept_folder / f"starts-{start}.jsonl", ("seed",), keys, onset)
        found[start] = {name: np.array([row[name] for row in rows]) for name in ("rho", "z", "seconds")}
    p_value = ks_2samp(found["carried"]["rho"], found["scratch"]["rho"]).pvalue
    for start, row in found.items():
        print(f"{start}: rho_J {row['rho'].mean():.4f} +- {row['rho'].std():.4f}, {np.median(row['seconds']):.2f} s")
    print(json.dumps({"p value": p_value}))
    assert p_value > 0.05
