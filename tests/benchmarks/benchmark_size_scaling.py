"""Time and memory against N, with exponents, and what the page on large packings says of 10^6 disks and 10^5 droplets.

pytest -m benchmark -s tests/benchmarks/benchmark_size_scaling.py prints the tables of that page; some ten minutes.
JAMLAB_RESULTS=FILE also writes them as JSON. The stored exponents are in size_scaling.json beside this file;
JAMLAB_BASELINE=write stores new ones.
"""

import json
import os
from dataclasses import asdict
from pathlib import Path

import pytest

from jamlab.studies.cost.size_scaling import PARTS, bytes_at, cost, fit_time

STORED = Path(__file__).with_name("size_scaling.json")
SIZES = {"disks": (1024, 4096, 16384, 65536), "droplets": (128, 512, 1152)}
PACKED = (512, 2048, 8192)  # made from random starts, three each
WANTED = {"disks": 1_000_000, "droplets": 100_000}
FASTER_GROWTH = 0.35  # exponents of one code differ by less from run to run


def sizes(part):
    return PACKED if "packings" in part else SIZES[part.partition(":")[0]]


@pytest.mark.benchmark
def test_exponents_beside_the_stored_ones():
    found = {part: [cost(part, n) for n in sizes(part)] for part in PARTS}
    laws = {part: fit_time(costs) for part, costs in found.items()}
    print("\n| part | N: seconds, memory | time ~ N^ | wanted N | time there | memory there |")
    print("|---|---|---|---|---|---|")
    for part, costs in found.items():
        measured = "; ".join(f"{c.n}: {c.seconds:.3g} s, {c.bytes / 1e9:.2g} GB" for c in costs)
        law, n = laws[part], WANTED[part.partition(":")[0]]
        there = f"{law(n):.3g} s | {bytes_at(costs, n) / 1e9:.2g} GB"
        print(f"| {part} | {measured} | {law.exponent:.2f} | {n:.0e} | {there} |")
    exponents = {part: round(law.exponent, 3) for part, law in laws.items()}
    if path := os.environ.get("JAMLAB_RESULTS"):
        Path(path).write_text(json.dumps({part: list(map(asdict, costs)) for part, costs in found.items()}, indent=1))
    if os.environ.get("JAMLAB_BASELINE") == "write":
        STORED.write_text(json.dumps(exponents, indent=1) + "\n")
    stored = json.loads(STORED.read_text())
    assert set(stored) == set(exponents), "the stored exponents are of other parts: JAMLAB_BASELINE=write"
    assert all(exponents[part] < stored[part] + FASTER_GROWTH for part in stored)
