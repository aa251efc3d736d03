"""Measure fixed work of jamlab beside plain work, as a program: `python -P works.py [REPEATS]`.

It uses public functions of jamlab and numpy alone, so that the Python of any version of jamlab can run it. CPU times of
one process on one core; before and after every work stands a fixed piece of plain work, `plain`, and the ratio to the
mean of both is what counts: another machine, or another program beside, slows both. One line of JSON is printed.
"""

from __future__ import annotations

import json
import os
import platform
import resource
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

DATA = Path(__file__).parents[1] / "data"
LEAST = 0.06  # s that a work is repeated to fill, so that the clock and the plain work beside it resolve it
REPEATS = 4

Run = Callable[[], float]  # what is timed; it returns a number that tells whether the same state was found


def plain() -> float:
    """Do the work that all others are compared with: loops of Python, vectors in the cache, a sort, and indices."""
    total, numbers = 0.0, np.random.default_rng(1).random(20_000)
    for k in range(60_000):
        total += (k * 0.5) % 3.0
    for _ in range(30):
        order = np.argsort(numbers)
        numbers = np.sqrt(numbers[order] * 0.7 + 0.1) * numbers
        numbers = numbers - np.floor(numbers) + 1e-3
    return total + float(numbers.sum())


def works() -> dict[str, Callable[[], Run]]:
    """Prepare each work by name: what is prepared is not timed."""
    import jamlab

    def stored(name: str, find: Callable[[Any], float]) -> Callable[[], Run]:
        """A quantity of a stored state, anew each time: results are kept with a packing."""
        state = jamlab.read(DATA / name)
        return lambda: lambda: find(state.with_state(positions=state.positions.copy()))

    def sweep() -> Run:
        onset = jamlab.jam(16, "dp", 1, start="from-disks")
        return lambda: [p.phi for p in jamlab.compress(onset, 0.92, 0.01)][-1]

    def flow() -> Run:
        start = jamlab.pack(256, 1e-2, 1)
        return lambda: float(jamlab.shear(start, rate=1e-2, strain=0.005).stress[-1])

    def modulus() -> Run:
        packing, omega = jamlab.pack(1024, 1e-2, 1), np.geomspace(1e-6, 1e2, 100)
        return lambda: float(
            jamlab.complex_modulus(packing.with_state(positions=packing.positions.copy()), omega).storage[0]
        )

    disks, droplets = "packings_sp_64.h5", "packings_dp_64.h5"
    return {
        "onset of 64 disks": lambda: lambda: jamlab.jam(64, "sp", 2).phi,
        "onset of 64 droplets": lambda: lambda: jamlab.jam(64, "dp", 1, start="from-disks").phi,
        "1024 disks at p = 1e-3": lambda: lambda: jamlab.pack(1024, 1e-3, 1).phi,
        "sweep of 16 droplets to 0.92": sweep,
        "start-up of shear, 256 disks": flow,
        "G* of 1024 disks, 100 frequencies": modulus,
        "true packing fraction, 64 droplets": stored(droplets, jamlab.packing_fraction),
        "voids, 64 droplets": stored(droplets, lambda p: float(len(jamlab.voids(p).area))),
        "elastic tensor, 64 droplets": stored(droplets, lambda p: float(jamlab.elastic_tensor(p).relaxed[0, 1, 0, 1])),
        "tessellation, 64 droplets": stored(droplets, lambda p: float(np.max(jamlab.tessellation(p).area))),
        "measure, 64 droplets": stored(droplets, _z),
        "measure, 64 disks": stored(disks, _z),
    }


def _z(packing: Any) -> float:
    import jamlab

    return float(jamlab.measure(packing)["z"])


PROCESSES = {  # programs that begin anew
    "first call of a process: pack": "import jamlab; print(jamlab.pack(16, 1e-2, 1).phi)",
    "first call of a process: shear": (
        "import jamlab; print(jamlab.quasistatic_shear(jamlab.pack(16, 1e-2, 1), strain=1e-3).stress[-1])"
    ),
}


def process(program: str) -> float:
    """Run a program in a new process with this Python."""
    words = [sys.executable, "-P", "-W", "ignore", "-c", program]
    keeps_bytecode = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(words, capture_output=True, text=True, check=False, env=keeps_bytecode)
    if done.returncode:
        raise SystemExit(done.stderr)
    return float(done.stdout)


def cpu() -> float:
    """CPU time so far of this process and of its children that have ended, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def timed(run: Run, times: int = 1) -> tuple[float, float]:
    """Run so many times: CPU time of one, and its number."""
    began = cpu()
    for _ in range(times):
        found = run()
    return (cpu() - began) / times, found


def measure_work(run: Run, repeats: int) -> dict[str, Any]:
    """Measure by turns with the plain work: ratios, CPU times, s, and the number that it gives."""
    first, found = timed(run)  # loads what it needs
    again = timed(run)[0] if first < LEAST else first
    times = max(1, int(np.ceil(LEAST / max(again, 1e-6))))
    seconds, beside = [], [timed(plain)[0]]
    for _ in range(repeats):
        seconds.append(timed(run, times)[0])
        beside.append(timed(plain)[0])
    ratios = [2 * s / (a + b) for s, a, b in zip(seconds, beside, beside[1:], strict=False)]
    return {"ratios": ratios, "seconds": seconds, "plain": beside, "found": found}


def main(repeats: int = REPEATS, only: tuple[str, ...] = ()) -> dict[str, Any]:
    """Measure all works, or those that are named."""
    import jamlab

    known = works() | {name: partial(partial, process, program) for name, program in PROCESSES.items()}
    if unknown := {*only} - {*known}:
        raise SystemExit(f"no work is named {' or '.join(map(repr, sorted(unknown)))}; there are {[*known]}")
    rows = {name: measure_work(prepare(), repeats) for name, prepare in known.items() if not only or name in only}
    versions = {"python": platform.python_version(), "numpy": np.__version__}
    return {"jamlab": str(Path(jamlab.__file__).parent), **versions, "works": rows}


if __name__ == "__main__":
    print(json.dumps(main(int(sys.argv[1]) if len(sys.argv) > 1 else REPEATS, tuple(sys.argv[2:]))))
