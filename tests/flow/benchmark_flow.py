"""Cost of flow on two ranks: the ratio counts, not seconds. pytest -m benchmark -s."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

import jamlab
from jamlab.kernels.installed_files import installed

RATE = 1e-2


@pytest.mark.benchmark
def test_two_ranks(tmp_path):
    """Plain lmp and the deck in.sp.startup; wall time of the run, LAMMPS' own."""
    jamlab.write_data(tmp_path / "p.data", jamlab.pack(n=4096, pressure=1e-2, seed=1))
    programs, decks = Path(sys.executable).parent, installed("lammps_inputs")
    seconds = {}
    for ranks in (1, 2):
        line = [programs / "mpiexec", "-n", ranks, programs / "lmp", "-in", decks / "in.sp.startup", "-log", "none"]
        settings = {"data": "p.data", "law": "k", "ratio": 1.4, "dir": decks}
        settings |= {"rate": RATE, "strain": 0.5, "background": 1e-2, "rows": 1}
        line += [word for name, value in settings.items() for word in ("-var", name, value)]
        clock = time.perf_counter()
        done = subprocess.run(list(map(str, line)), cwd=tmp_path, capture_output=True, text=True, check=False)
        seconds[ranks] = time.perf_counter() - clock
        assert done.returncode == 0, done.stdout[-2000:]
    print(f"\nN = 4096: {seconds[1]:.1f} s on one rank, {seconds[2]:.1f} s on two: {seconds[1] / seconds[2]:.2f} times")
    assert seconds[1] > 1.5 * seconds[2]
