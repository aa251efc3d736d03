"""The same packings on several Pythons and states of the code: which numbers differ from those of another run.

    JAMLAB_RESULTS=build/bits JAMLAB_LABEL=before pytest -m benchmark -s tests/benchmark_same_bits.py

in each environment or checkout; the last one tells in how many and how much the numbers differ. Each kind is made from
eight seeds, or from JAMLAB_SEEDS of them.
"""

import json
import os
import platform
from importlib.metadata import version

import numpy as np
import pytest

import jamlab

pytestmark = pytest.mark.benchmark
SEEDS = range(1, 1 + int(os.environ.get("JAMLAB_SEEDS", "8")))


def of_packing(p):
    return np.concatenate([p.positions.ravel(), p.box.ravel()])


def of_sweep(seed):
    """Disks compressed from onset, five states."""
    onset = jamlab.jam(n=16, seed=seed)
    return np.concatenate([of_packing(p) for p in jamlab.compress(onset, to=onset.phi + 0.02, step=0.005)])


def of_spectrum(seed):
    s = jamlab.complex_modulus(jamlab.pack(n=64, pressure=1e-3, seed=seed), np.logspace(-4, 1, 6))
    return np.concatenate([s.storage, s.loss])


def of_droplet_sweep(seed):
    """Droplets compressed from onset, two states."""
    onset = jamlab.jam(n=8, model="dp", seed=seed)
    return np.concatenate([of_packing(p) for p in jamlab.compress(onset, to=onset.phi + 0.02, step=0.01)])


def of_droplet_spectrum(seed):
    s = jamlab.complex_modulus(jamlab.jam(n=8, model="dp", seed=seed), np.logspace(-4, 1, 3))
    return np.concatenate([s.storage, s.loss])


def of_flow(seed):
    r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=seed), rate=1e-2, strain=0.05)
    return np.concatenate([r.stress, of_packing(r.packing)])


def of_droplet_flow(seed):
    r = jamlab.shear(jamlab.jam(n=8, model="dp", seed=seed), rate=1e-2, strain=0.01, background_drag=0.1)
    return np.concatenate([r.stress, of_packing(r.packing)])


def of_walls(seed, flat):
    """Disks between walls, compressed, and their moduli."""
    p = jamlab.relax(jamlab.with_walls(jamlab.pack(n=64, pressure=1e-2, seed=seed), flat=flat))
    dense = list(jamlab.compress(p, to=p.phi + 0.004, step=0.002))[-1]
    return np.append(of_packing(dense), jamlab.bulk_modulus(dense))


MADE = {
    "jam, disks": lambda seed: of_packing(jamlab.jam(n=16, seed=seed)),
    "jam, droplets": lambda seed: of_packing(jamlab.jam(n=8, model="dp", seed=seed)),
    "jam, shear-stabilized": lambda seed: of_packing(jamlab.jam(n=16, seed=seed, ensemble="shear-stabilized")),
    "pack": lambda seed: of_packing(jamlab.pack(n=64, pressure=1e-3, seed=seed)),
    "pack, Hertz": lambda seed: of_packing(jamlab.pack(n=32, pressure=1e-3, seed=seed, law={"exponent": 2.5})),
    "pack, sticky": lambda seed: of_packing(jamlab.pack(n=32, pressure=1e-3, seed=seed, law={"stickiness": 0.04})),
    "pack, 80 sizes": lambda seed: of_packing(jamlab.pack(n=80, pressure=1e-2, seed=seed, sizes="lognormal:0.2")),
    "jam and compress, disks": of_sweep,
    "jam and compress, droplets": of_droplet_sweep,
    "rough walls": lambda seed: of_walls(seed, False),
    "flat walls": lambda seed: of_walls(seed, True),
    "G*, disks": of_spectrum,
    "G*, droplets": of_droplet_spectrum,
    "flow, disks": of_flow,
    "flow, droplets": of_droplet_flow,
}


def difference(a, b):
    """The largest one over the largest number; infinite where one of them has more numbers."""
    if a.shape != b.shape:
        return np.inf
    return float(np.abs(a - b).max() / np.abs(b).max()) if len(a) else 0.0


def made(make, seed):
    """Its numbers; of a seed that a protocol gives up, none."""
    try:
        return make(seed).tolist()
    except jamlab.ConvergenceError:
        return []


@pytest.mark.filterwarnings("ignore")
def test_numbers_are_those_of_other_pythons(kept_folder):
    folder = kept_folder
    here = {f"{name} {seed}": made(make, seed) for name, make in MADE.items() for seed in SEEDS}
    label = f"Python {platform.python_version()}, numpy {version('numpy')}, scipy {version('scipy')}"
    label += "".join(f", {word}" for word in filter(None, [os.environ.get("JAMLAB_LABEL")]))
    (folder / f"{label}.json").write_text(json.dumps(here))
    for path in sorted(folder.glob("*.json")):
        there = json.loads(path.read_text())
        print(f"\n{label} beside {path.stem}")
        for name in MADE:
            pairs = [(np.array(here[f"{name} {k}"]), np.array(there[f"{name} {k}"])) for k in SEEDS]
            off = [difference(a, b) for a, b in pairs]
            print(f"{name:26s} same bits {sum(x == 0 for x in off)} of {len(off)}, largest difference {max(off):.2g}")
        assert here.keys() == there.keys()
