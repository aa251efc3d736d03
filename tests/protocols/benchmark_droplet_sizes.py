"""Droplets against N: minima after kicks and sweeps, CPU times beside stored ones. pytest -m benchmark -s.

Times of one core over that of the yardstick of `benchmark_modules.py` in the same run; `droplet_sizes.json` holds the
medians over five seeds of these quotients. JAMLAB_BASELINE=write stores new ones. JAMLAB_LARGE=1 adds the sweeps of
256 droplets (minutes).
"""

import json
import os
import time
from pathlib import Path

import numpy as np
import pytest
from benchmark_modules import SLOWER, yardstick
from tiled_packings import tiled

import jamlab
from jamlab.benchmarks.cpu_time import one_core, shortest
from jamlab.packing.versions import versions
from jamlab.protocols.relaxation import relax

pytestmark = pytest.mark.benchmark

STORED = Path(__file__).with_name("droplet_sizes.json")
SEEDS = range(1, 6)
KICK = 0.01  # l: how far vertices are moved off a minimum
LARGE = bool(os.environ.get("JAMLAB_LARGE"))


def sweep(n, seed):
    """CPU seconds of the onset, and of 40 states from there to rho = 0.99; the last state."""
    began = time.process_time()
    onset = jamlab.jam("dp", n, seed)
    found = time.process_time()
    first = jamlab.packing_fraction(onset)
    states = list(jamlab.compress(onset, to=0.99, step=(0.99 - first) / 40))
    assert all(p.converged for p in states)
    return found - began, time.process_time() - found, states[-1]


def kicked(packing, seed):
    """Every vertex off its minimum, no outline crossed."""
    rng = np.random.default_rng(seed)
    while True:
        try:
            return packing.with_state(positions=packing.positions + rng.normal(0, KICK, packing.positions.shape))
        except jamlab.InputError:
            continue


def relaxed(packing, seed):
    """CPU seconds of a minimum from a kicked state."""
    with jamlab.Session(kicked(packing, seed)) as session:
        began = time.process_time()
        assert relax(session).converged
        return time.process_time() - began


def measured():
    """Case -> CPU seconds, one for each seed."""
    found = {}

    def add(case, seconds):
        found.setdefault(case, []).append(seconds)

    for seed in SEEDS:
        onset, states, dense = sweep(64, seed)
        add("onset, N = 64", onset)
        add("40 states, N = 64", states)
        for times in (1, 2, 4):
            add(f"relaxed, N = {64 * times**2}", relaxed(tiled(dense, times), seed))
        if LARGE:
            onset, states, _ = sweep(256, seed)
            add("onset, N = 256", onset)
            add("40 states, N = 256", states)
    return found


def test_times_beside_those_stored():
    with one_core():
        unit, _ = shortest(yardstick, runs=10, budget=3.0)
        found = measured()
    medians = {case: float(np.median(seconds)) / unit for case, seconds in found.items()}
    stored = json.loads(STORED.read_text())["over_yardstick"] if STORED.exists() else {}
    if os.environ.get("JAMLAB_BASELINE") == "write":
        stored |= medians
        content = {"yardstick_seconds": unit, "over_yardstick": stored, "versions": versions()}
        STORED.write_text(json.dumps(content, indent=1) + "\n")
    ratios = {case: value / stored[case] for case, value in medians.items()}
    for case, seconds in found.items():
        print(f"{case:22s} {np.median(seconds):8.2f} s  {min(seconds):.2f} .. {max(seconds):.2f}  {ratios[case]:5.2f}")
    times = [np.median(found[f"relaxed, N = {n}"]) for n in (64, 256, 1024)]
    exponent = float(np.polyfit(np.log([64, 256, 1024]), np.log(times), 1)[0])
    print(json.dumps({"yardstick_seconds": unit, "over_stored": ratios, "exponent": exponent}))
    assert max(ratios.values()) < SLOWER
    assert exponent < 1.5
