"""What processes gain: pytest -m benchmark -s tests/processes/benchmark_side_by_side.py.

Wall times of one process and of one per core, one after the other, five rounds each; the machine should be idle. Cold:
the first command after an installation, which compiles Python's modules and lists the fonts; its caches are folders
made for this run.
"""

import os
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest
from tiled_packings import tiled

import jamlab
from jamlab.processes.cores import available_cores
from studies.reference_data import example_file

ROUNDS = 5
FIGURES_WITHIN = 30.0  # s, with two cores


def seconds(run):
    began = time.perf_counter()
    run()
    return time.perf_counter() - began


@pytest.mark.benchmark
def test_a_sweep_is_measured_by_all_cores():
    if available_cores() < 2:
        pytest.skip("one core")
    few = jamlab.read_all(example_file("dp"))[:4]
    many = [tiled(state, 4) for state in few[1:]] * 20
    print(f"\n{'states':>8s}{'droplets':>10s}{'one, s':>10s}{'all, s':>10s}{'gain':>8s}")
    gains = {}
    for sweep in (few, many):
        pairs = [
            (seconds(partial(jamlab.measure_all, sweep, processes=1)), seconds(partial(jamlab.measure_all, sweep)))
            for _ in range(ROUNDS)
        ]
        one, every = np.median(pairs, axis=0)
        gains[len(sweep)] = float(np.median([a / b for a, b in pairs]))
        print(f"{len(sweep):8d}{sweep[0].n:10d}{one:10.3f}{every:10.3f}{gains[len(sweep)]:8.2f}")
    assert gains[len(few)] > 0.9 and gains[len(many)] > 0.6 * available_cores()


@pytest.mark.benchmark
def test_all_figures(tmp_path):
    """Seconds of `python -m studies draw papers`: cold, then warm."""
    line = [sys.executable, "-m", "jamlab.cli", "figure", "all", "--out", str(tmp_path / "out")]
    caches = {"PYTHONPYCACHEPREFIX": str(tmp_path / "python"), "MPLCONFIGDIR": str(tmp_path / "matplotlib")}

    def run():
        subprocess.run(line, env=os.environ | caches, check=True, capture_output=True, cwd=tmp_path)

    times = [seconds(run) for _ in range(ROUNDS + 1)]
    print(f"\ncold {times[0]:.1f} s, warm {np.median(times[1:]):.1f} s on {available_cores()} cores")
    assert available_cores() < 2 or np.median(times[1:]) < FIGURES_WITHIN
