"""CPU time to make one packing, in jamlab and in other codes: `python -m studies.other_codes.packing_generation`.

Every row is measured on one core, in a process of its own. dpm is compiled and run as it stands: `--dpm FOLDER` of a
program made by `g++ -O3 --std=c++11 -I src main/jam/bidisperseSinusoidalParticleJamming.cpp src/*.cpp`.
"""

import re
import resource
import subprocess
import time
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import numpy as np
import typer

import jamlab
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.protocols.random_start import random_disks
from studies.other_codes.compare import PEERS
from studies.other_codes.peers import Jamlab, plain_point
from studies.tables import one_core

PHI, FORCE, STEPS = 0.88, 1e-12, 10_000_000
Row = dict[str, Any]


def minimum(code: str, n: int) -> Row:
    """Minimise one random start of disks at phi = 0.88, until no force is above 1e-12; twice, as some codes compile."""
    (peer,) = (peer for peer in (Jamlab(), *PEERS) if peer.name == code)
    if peer.version is None:
        return {"reached": f"not installed: {peer.install}"}
    start = random_disks(n, 1, phi=PHI)
    run = peer.descent(start)
    for _ in range(2):
        began = time.process_time()
        positions = run(FORCE, STEPS)
    seconds = time.process_time() - began
    left = np.hypot(*plain_point(start.with_state(positions=positions)).forces.T).max()
    return {"cpu": seconds, "reached": f"force {left:.0e}"}


def onsets(model: str, n: int, seeds: int = 10) -> Row:
    """Onsets of random starts by `jamlab.jam`, the mean of several seeds."""
    began = time.process_time()
    found = [jamlab.jam(model, n, seed) for seed in range(1, seeds + 1)]
    cpu = (time.process_time() - began) / seeds
    return {"cpu": cpu, "reached": f"{seeds} onset(s), force {np.max([p.max_force for p in found]):.0e}"}


def onset_in_dpm(program: str, limit: float) -> Row:
    """How far dpm comes with 64 of its particles, 12 and 17 vertices, in a given CPU time."""
    law = ["64", "12", "1.0", "1.0", "0.0", "0.0", "0.0", "1e-7", "1e-12", "1", "/dev/null"]
    seconds = int(np.ceil(limit))
    bound = partial(resource.setrlimit, resource.RLIMIT_CPU, (seconds, seconds))
    ran = subprocess.run([program, *law], stdout=subprocess.PIPE, text=True, preexec_fn=bound, check=False)
    if ran.returncode == 0:
        return {"cpu": limit, "reached": "jammed"}
    steps = [int(step) for step in re.findall(r"fireit\s+= (\d+)", ran.stdout)]  # of each minimisation from 0 on
    taken = sum(step for step, after in zip(steps, [*steps[1:], 0], strict=True) if after < step)
    return {"cpu": limit, "reached": f"cut off; {taken / limit:.0f} or a few more steps of FIRE a second"}


RUNS: dict[str, Callable[[], Row]] = {
    **{
        f"{code}, minimum of {n} disks": partial(minimum, code, n)
        for n in (64, 1024)
        for code in ("jamlab", "LAMMPS cg", "LAMMPS fire", "jax-md")
    },
    **{f"jamlab, onset of {n} disks": partial(onsets, "sp", n) for n in (64, 256)},
    "jamlab, onset of 64 droplets": partial(onsets, "dp", 64),
    "jamlab, onset of 256 droplets": partial(onsets, "dp", 256, 1),
}


def _measure(run: str, _: Any) -> Row:
    with one_core():
        return RUNS[run]()


def main(
    dpm: Annotated[str, typer.Option(help="Program of dpm, which has the time of ten onsets of jamlab.")] = "",
) -> None:
    """Print the table, row by row."""
    for run in RUNS:
        (row,) = run_side_by_side(_measure, [run], 1)
        print(run, *row.values(), sep=",", flush=True)
        if dpm and run == "jamlab, onset of 64 droplets":
            print("dpm, the same", *onset_in_dpm(dpm, 10 * row["cpu"]).values(), sep=",", flush=True)


if __name__ == "__main__":
    typer.run(main)
