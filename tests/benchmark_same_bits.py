"""The same packings on several Pythons: hashes of forty, and which of them differ from those of another run.

    JAMLAB_RESULTS=build/bits pytest -m benchmark -s tests/benchmark_same_bits.py

in each environment; the last one tells in how many and how much the numbers differ.
"""

import json
import platform
from importlib.metadata import version

import numpy as np
import pytest

import jamlab

pytestmark = pytest.mark.benchmark
SEEDS = range(1, 9)


def of_packing(p):
    return np.concatenate([p.positions.ravel(), p.box.ravel()])


def of_sweep(seed):
    """Disks compressed from onset, five states."""
    onset = jamlab.jam(n=16, seed=seed)
    return np.concatenate([of_packing(p) for p in jamlab.compress(onset, to=onset.phi + 0.02, step=0.005)])


def of_spectrum(seed):
    s = jamlab.complex_modulus(jamlab.pack(n=64, pressure=1e-3, seed=seed), np.logspace(-4, 1, 6))
    return np.concatenate([s.storage, s.loss])


def of_flow(seed):
    r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=seed), rate=1e-2, strain=0.05)
    return np.concatenate([r.stress, of_packing(r.packing)])


MADE = {
    "jam, droplets": lambda seed: of_packing(jamlab.jam(n=8, model="dp", seed=seed)),
    "pack": lambda seed: of_packing(jamlab.pack(n=64, pressure=1e-3, seed=seed)),
    "jam and compress, disks": of_sweep,
    "G*": of_spectrum,
    "flow": of_flow,
}


@pytest.mark.filterwarnings("ignore")
def test_numbers_are_those_of_other_pythons(kept_folder):
    folder = kept_folder
    here = {f"{name} {seed}": make(seed).tolist() for name, make in MADE.items() for seed in SEEDS}
    label = f"Python {platform.python_version()}, numpy {version('numpy')}, scipy {version('scipy')}"
    (folder / f"{label}.json").write_text(json.dumps(here))
    for path in sorted(folder.glob("*.json")):
        there = json.loads(path.read_text())
        print(f"\n{label} beside {path.stem}")
        for name in MADE:
            pairs = [(np.array(here[f"{name} {k}"]), np.array(there[f"{name} {k}"])) for k in SEEDS]
            off = [np.abs(a - b).max() / np.abs(b).max() if a.shape == b.shape else np.inf for a, b in pairs]
            print(f"{name:26s} same bits {sum(x == 0 for x in off)} of {len(off)}, largest difference {max(off):.2g}")
        assert here.keys() == there.keys()
