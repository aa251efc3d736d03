"""Minimisation of disks against N; other codes: benchmark_comparison.py. pytest -m benchmark -s."""

import json
import time

import numpy as np
import pytest

import jamlab

FORCE = 1e-12


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
            assert p.max_force < FORCE
        seconds.append(float(np.median(spans)))
        print(f"\nN = {n}: {seconds[-1]:.2f} s", end="")
    exponent = float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])
    print("\n" + json.dumps({"sizes": sizes, "seconds": seconds, "exponent": exponent}))
