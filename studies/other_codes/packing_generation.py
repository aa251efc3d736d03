"""CPU time of one jamming onset and of one minimum: `python -m studies.other_codes.packing_generation`.

`--dpm PROGRAM`: dpm is run as it stands, a program made by
`g++ -O3 --std=c++11 -I src main/jam/bidisperseSinusoidalParticleJamming.cpp src/*.cpp`.
"""

import re
import resource
import subprocess
import time
from functools import partial
from typing import Annotated

import numpy as np
import typer

import jamlab
from jamlab.arguments.choices import ModelName
from jamlab.packing.deformation import at_phi
from jamlab.protocols.relaxation import relax_session
from studies.tables import one_core

RUNS: dict[ModelName, dict[int, int]] = {
    "sp": {64: 10, 256: 10},
    "dp": {64: 10, 256: 1, 1024: 1},
}  # model -> number of particles -> seeds


def onset_in_dpm(program: str, limit: float) -> str:
    """How far dpm comes with 64 of its particles, 12 and 17 vertices, in a given CPU time."""
    law = ["64", "12", "1.0", "1.0", "0.0", "0.0", "0.0", "1e-7", "1e-12", "1", "/dev/null"]
    bound = partial(resource.setrlimit, resource.RLIMIT_CPU, 2 * (int(np.ceil(limit)),))
    ran = subprocess.run([program, *law], stdout=subprocess.PIPE, text=True, preexec_fn=bound, check=False)
    if ran.returncode == 0:
        return "jammed"
    steps = [int(step) for step in re.findall(r"fireit\s+= (\d+)", ran.stdout)]  # of each minimisation from 0 on
    taken = sum(step for step, after in zip(steps, [*steps[1:], 0], strict=True) if after < step)
    return f"cut off; {taken / limit:.0f} or a few more steps of FIRE a second"


def main(dpm: Annotated[str, typer.Option(help="Program of dpm, which has the time of ten onsets.")] = "") -> None:
    """Print the table, row by row."""
    with one_core():
        onset = jamlab.jam(64, "dp", 1)
        for style in ("jamlab", "cg", "fire"):  # of LAMMPS
            with jamlab.Session(at_phi(onset, onset.phi + 0.01)) as a:
                began = time.process_time()
                if style == "jamlab":
                    found = relax_session(a).evaluation
                else:
                    found = a.minimize(1e-10, minimizer="cg" if style == "cg" else "fire", steps=5_000)
            print(f"minimum, dp, N = 64, {style}: {time.process_time() - began:.2g} s, force {found.max_force:.0e}")
        for model, sizes in RUNS.items():
            for n, seeds in sizes.items():
                began = time.process_time()
                left = max(jamlab.jam(n, model, seed).max_force or 0.0 for seed in range(1, seeds + 1))
                seconds = (time.process_time() - began) / seeds
                print(f"jamlab, {model}, N = {n}: {seconds:.2g} s, force {left:.0e}", flush=True)
                if dpm and (model, n) == ("dp", 64):
                    print(f"dpm, the same: {onset_in_dpm(dpm, 10 * seconds)}", flush=True)


if __name__ == "__main__":
    typer.run(main)
