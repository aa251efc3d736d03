"""CPU time to make one packing, in jamlab and in other codes: `python -m studies.other_codes.packing_generation`.

Every code runs on one core, in a process of its own that ends after a bound of CPU time. dpm is compiled and run as it
stands: `--dpm FOLDER` of a program made by `g++ -O3 --std=c++11 -I src
main/jam/bidisperseSinusoidalParticleJamming.cpp src/*.cpp`.
"""

import json
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

import jamlab
from jamlab.protocols.random_start import random_disks
from studies.other_codes.compare import PEERS
from studies.other_codes.jax_md_and_jaxdem import double_precision
from studies.other_codes.peers import Jamlab, mean_diameters, plain_point
from studies.tables import one_core

PHI, FORCE, STEPS = 0.88, 1e-12, 10_000_000
LIMIT = 120  # s of CPU of one run
BOTH = {peer.name: peer for peer in (Jamlab(), *PEERS)}
Row = dict[str, Any]


def minimum(code: str, n: int) -> Row:
    """Minimise one random start of disks at phi = 0.88, until no force is above 1e-12; twice, as some codes compile."""
    start, seconds = random_disks(n, 1, phi=PHI), []
    began = time.process_time()
    run = BOTH[code].descent(start)
    for _ in range(2):
        positions = run(FORCE, STEPS)
        seconds.append(time.process_time() - began)
        began = time.process_time()
    left = np.hypot(*plain_point(start.with_state(positions=positions)).forces.T).max()
    return {"first": seconds[0], "cpu": seconds[1], "reached": f"force {left:.0e}"}


def onsets(model: str, n: int, seeds: int = 1) -> Row:
    """Onsets of random starts by `jamlab.jam`, the mean of several seeds."""
    began = time.process_time()
    found = [jamlab.jam(model, n, seed) for seed in range(1, seeds + 1)]
    cpu = (time.process_time() - began) / seeds
    force = np.max([packing.max_force for packing in found])
    return {"first": np.nan, "cpu": cpu, "reached": f"{seeds} onset(s), force {force:.0e}"}


def onset_in_jaxdem(n: int) -> Row:
    """Onset of disks by the bisection of JaxDEM, with its defaults, from a random start at phi = 0.8."""
    jax = double_precision()
    import jaxdem

    start = random_disks(n, 1, phi=0.8)
    species, s = mean_diameters(start)
    began = time.process_time()
    state = jaxdem.State.create(
        pos=jax.numpy.asarray(start.positions),
        rad=jax.numpy.asarray(0.5 * np.diag(s)[species]),
        mass=jax.numpy.ones(n),
        volume=jax.numpy.asarray(np.pi * (0.5 * np.diag(s)[species]) ** 2),
    )
    kind = jaxdem.Material.create("elastic", young=1.0, poisson=0.5, density=1.0)
    system = jaxdem.System.create(
        state_shape=state.shape,
        dt=1e-2,
        minimizer=jaxdem.minimizers.fire,
        minimizer_kw={"dt": 1e-2},
        domain_type="periodic",
        domain_kw={"box_size": jax.numpy.asarray(np.diag(start.box))},
        force_model_type="spring",
        collider_type="naive",
        mat_table=jaxdem.MaterialTable.from_materials([kind], matcher=jaxdem.MaterialMatchmaker.create("harmonic")),
    )
    found = jaxdem.utils.jamming.bisection_jam(state, system, verbose=False)
    phi, energy = float(found.packing_fraction), float(found.potential_energy)
    return {"first": time.process_time() - began, "cpu": np.nan, "reached": f"phi {phi:.4f}, energy {energy:.0e}"}


def onset_in_dpm(program: str, limit: float) -> Row:
    """How far dpm comes with 64 of its particles, 12 and 17 vertices, in a given CPU time."""
    law = ["64", "12", "1.0", "1.0", "0.0", "0.0", "0.0", "1e-7", "1e-12", "1", "/dev/null"]
    output, ended = _bounded([program, *law], limit)
    steps = [int(step) for step in re.findall(r"fireit\s+= (\d+)", output)]
    falls = [k for k, step in enumerate(steps[1:], 1) if step < steps[k - 1]]
    taken = sum(steps[k - 1] for k in falls) + steps[-1] if steps else 0
    phi = re.findall(r"\* phi0\s+= ([\d.]+)", output)
    reached = "jammed" if ended else f"cut off, {len(phi)} packing fractions of its way relaxed"
    rate = f"{taken / limit:.0f} or a few more steps of FIRE a second" if not ended else ""
    return {"first": np.nan, "cpu": limit, "reached": f"{reached}; {rate}"}


def _bounded(command: list[str], seconds: float) -> tuple[str, bool]:
    """Standard output of a program that may take so much CPU time, and whether it ended by itself."""

    def bound() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(np.ceil(seconds)), int(np.ceil(seconds))))

    ran = subprocess.run(command, stdout=subprocess.PIPE, text=True, preexec_fn=bound, check=False)
    return ran.stdout, ran.returncode == 0


RUNS: dict[str, Callable[[], Row]] = {
    **{
        f"{code}, minimum of {n} disks": partial(minimum, code, n)
        for n in (64, 1024)
        for code in ("jamlab", "LAMMPS cg", "LAMMPS fire", "jax-md", "JaxDEM")
    },
    **{f"jamlab, onset of {n} disks": partial(onsets, "sp", n, 10) for n in (64, 256)},
    "JaxDEM, onset of 64 disks": partial(onset_in_jaxdem, 64),
    "jamlab, onset of 64 droplets": partial(onsets, "dp", 64, 10),
    "jamlab, onset of 256 droplets": partial(onsets, "dp", 256, 1),
}


def rows(names: list[str], dpm: str) -> Iterator[Row]:
    """One after the other; dpm has the time of ten onsets of jamlab."""
    for name in names:
        output, ended = _bounded([sys.executable, "-m", "studies.other_codes.packing_generation", "--run", name], LIMIT)
        found: Row = {"cpu": LIMIT, "reached": "cut off, or not installed"}
        if ended:
            found = json.loads(output.splitlines()[-1])
        yield {"run": name, **found}
        if dpm and name == "jamlab, onset of 64 droplets" and ended:
            yield {"run": "dpm, onset of 64 droplets", **onset_in_dpm(dpm, 10 * float(found["cpu"]))}


def main(
    run: Annotated[str, typer.Option(help="This one alone, in this process.")] = "",
    only: Annotated[list[str], typer.Option(help="A run; default: all.")] = list(RUNS),  # noqa: B006
    dpm: Annotated[str, typer.Option(help="Program of dpm.")] = "",
) -> None:
    """Print the table."""
    if run:
        with one_core():
            print(json.dumps(RUNS[run]()))
        return
    for row in rows(only, dpm):
        print(pd.DataFrame([row]).to_csv(index=False, header=False), end="", flush=True)


if __name__ == "__main__":
    typer.run(main)
