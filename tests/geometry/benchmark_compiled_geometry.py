"""Times of compiled geometry at three sizes, five packings each, beside stored ones, and their exponents against N.

Run with: pytest -m benchmark -s tests/geometry/benchmark_compiled_geometry.py. CPU times of one core, the shortest of
several runs, over that of the yardstick of `benchmark_modules.py` in the same run: `compiled_geometry.json` holds the
medians over packings of these quotients. JAMLAB_BASELINE=write stores new ones.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from benchmark_modules import SLOWER, yardstick
from tiled_packings import tiled

import jamlab
from jamlab.benchmarks.cpu_time import one_core, shortest
from jamlab.geometry.contact_network import find_meetings
from jamlab.packing.versions import versions

pytestmark = pytest.mark.benchmark

STORED = Path(__file__).with_name("compiled_geometry.json")
SEEDS = range(1, 6)
WORK = {
    "rho": jamlab.packing_fraction,
    "shapes": jamlab.shape_factors,
    "voids": jamlab.voids,
    "meetings": find_meetings,
    "contacts": jamlab.contacts,
    "new packing": lambda packing: packing.with_state(positions=packing.positions),
}


def droplets(n, seed):
    *_, packing = jamlab.compress(jamlab.jam(model="dp", n=n, seed=seed), to=0.93, step=0.03)
    return packing


def disks(seed):
    return jamlab.pack(n=1024, pressure=1e-3, seed=seed)


def states(seed):
    """Name and packing, one after another."""
    yield "droplets", droplets(64, seed)
    few = droplets(12, seed)
    for times in (9, 52):
        yield "droplets", tiled(few, times)
    many = disks(seed)
    for times in (1, 4, 16):
        yield "disks", tiled(many, times)


def measured(unit):
    """(what, N, work) -> quotients, one for each seed."""
    found = {}
    for seed in SEEDS:
        for name, packing in states(seed):
            for work, function in WORK.items():
                function(packing)  # what is fetched and allocated once
                seconds, _ = shortest(lambda f=function, p=packing: f(p), runs=20, budget=1.0)
                found.setdefault((name, packing.n, work), []).append(seconds / unit)
    return found


def exponent(medians, name, work):
    sizes = sorted(n for what, n, job in medians if (what, job) == (name, work))[1:]  # overhead rules the smallest
    times = [medians[name, n, work] for n in sizes]
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def test_times_beside_those_stored():
    with one_core():
        unit, _ = shortest(yardstick, runs=10, budget=3.0)
        found = measured(unit)
    medians = {key: float(np.median(values)) for key, values in found.items()}
    named = {f"{what} {n} {work}": value for (what, n, work), value in medians.items()}
    if os.environ.get("JAMLAB_BASELINE") == "write":
        content = {"yardstick_seconds": unit, "over_yardstick": named, "versions": versions()}
        STORED.write_text(json.dumps(content, indent=1) + "\n")
    stored = json.loads(STORED.read_text())["over_yardstick"]
    assert set(stored) == set(named), "other cases are stored: JAMLAB_BASELINE=write"
    print(f"\n{'case':36s}{'ms':>10s}{'spread':>8s}{'over stored':>13s}")
    for (key, values), (name, value) in zip(found.items(), named.items(), strict=True):
        spread = (max(values) - min(values)) / medians[key]
        print(f"{name:36s}{1e3 * unit * value:10.3f}{spread:8.2f}{value / stored[name]:13.2f}")
    exponents = {f"{what} {work}": exponent(medians, what, work) for what in ("droplets", "disks") for work in WORK}
    ratios = {name: value / stored[name] for name, value in named.items()}
    print(json.dumps({"yardstick_seconds": unit, "over_stored": ratios, "exponents": exponents}))
    assert max(ratios.values()) < SLOWER
    assert max(exponents.values()) < 1.3  # 1 but for the caches of the machine
