"""One time for each module, beside a stored baseline. pytest -m benchmark -s tests/benchmark_modules.py.

CPU times are divided by that of a fixed piece of numpy and Python work on the same core in the same run, so that
machines compare; `baseline.json` holds these quotients. Prints one JSON object. JAMLAB_BASELINE=write stores a new
baseline.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.benchmarks.cpu_time import one_core, shortest
from jamlab.packing.versions import versions
from jamlab.protocols.relaxation import relax

BASELINE = Path(__file__).with_name("baseline.json")
SLOWER = 3.0  # quotients of one machine differ by less from run to run, even a busy one
OMEGA = np.geomspace(1e-6, 1e2, 21)


def yardstick():
    """Some tenths of a second of sorting, products and plain Python."""
    values = np.random.default_rng(0).random((300, 300))
    for _ in range(30):
        values = np.sort(values @ values.T, axis=1) % 1.0
    return sum(k * k for k in range(300_000)) + float(values.sum())


def operations(folder):
    """Module name -> what is timed."""
    disks = jamlab.pack(n=256, pressure=1e-3, seed=1)
    onset = jamlab.jam("sp", 32, 1)
    *_, dense = jamlab.compress(onset, 0.88, 0.02)
    droplets = jamlab.to_polygons(dense)
    rng = np.random.default_rng(1)
    jolted = disks.with_state(positions=disks.positions + 0.01 * rng.standard_normal(disks.positions.shape))

    def relaxed():
        with jamlab.Session(jolted) as session:
            return relax(session)

    def stored():
        jamlab.write(folder / "p.h5", [disks])
        return jamlab.read(folder / "p.h5")

    return {
        "engine": lambda: jamlab.evaluate(disks),
        "relaxation": relaxed,
        "onset": lambda: jamlab.jam("sp", 32, 1),
        "compression": lambda: list(jamlab.compress(onset, 0.88, 0.02)),
        "pressure": lambda: jamlab.pack(n=64, pressure=1e-3, seed=1),
        "polygons_from_disks": lambda: jamlab.to_polygons(dense),
        "contacts": lambda: jamlab.contacts(droplets),
        "packing_fraction": lambda: jamlab.packing_fraction(disks),
        "shape": lambda: jamlab.shape_factors(disks),
        "voids": lambda: jamlab.voids(droplets),
        "tessellation": lambda: jamlab.tessellation(disks),
        "hessian": lambda: jamlab.hessian(droplets),
        "moduli": lambda: jamlab.shear_modulus(droplets),
        "rheology": lambda: jamlab.complex_modulus(disks, OMEGA),
        "vibrations": lambda: jamlab.lowest_modes(disks, 6),
        "storage": stored,
    }


@pytest.mark.benchmark
def test_times_beside_the_baseline(tmp_path):
    with one_core():
        unit, _ = shortest(yardstick, runs=10, budget=3.0)
        seconds = {name: shortest(run, runs=20, budget=2.0)[0] for name, run in operations(tmp_path).items()}
    quotients = {name: value / unit for name, value in seconds.items()}
    if os.environ.get("JAMLAB_BASELINE") == "write":
        content = {"yardstick_seconds": unit, "over_yardstick": quotients, "versions": versions()}
        BASELINE.write_text(json.dumps(content, indent=1) + "\n")
    stored = json.loads(BASELINE.read_text())["over_yardstick"]
    ratios = {name: quotients[name] / stored[name] for name in quotients}
    print(f"\n{'module':22s}{'ms':>10s}{'over baseline':>15s}")
    for name, value in seconds.items():
        print(f"{name:22s}{1e3 * value:10.2f}{ratios[name]:15.2f}")
    print(json.dumps({"yardstick_seconds": unit, "seconds": seconds, "over_baseline": ratios}))
    assert set(stored) == set(quotients), "the baseline is of other modules: JAMLAB_BASELINE=write"
    assert max(ratios.values()) < SLOWER
