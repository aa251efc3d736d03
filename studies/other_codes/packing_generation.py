"""What a packing costs here and in other codes: `python -m studies.other_codes.packing_generation`.

Every part is measured on one core, and its rows are added to the table `packing-generation` as it is done; a part that
the table holds is left out, so that a run goes on where it was stopped. `python -m studies draw packing-generation`
draws the table, `python -m studies.other_codes.page` writes a part of it into `docs/explanation/accuracy.md`.

`--dpm PROGRAM`: dpm as it stands, a program of its `bidisperseSinusoidalParticleJamming.cpp`. `--jaxdem PYTHON`: a
Python that has JaxDEM. Both get ten times or more of the CPU time that jamlab takes; JaxDEM's compiling is not counted.
"""

import json
import os
import re
import resource
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

import jamlab
from jamlab.arguments.choices import ModelName, Start
from jamlab.checks import check_choice
from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import relax_session
from studies.other_codes.compare import jolted_minimum
from studies.other_codes.peers import Jamlab, Lammps, installed
from studies.speed_history.record import processor
from studies.tables import DATA, Row, Task, forget, measure, shortest, write_table

NAME = "packing-generation"
START: Start = "from-disks"  # of droplets at onset, see `jam`; disks have no other
# number of particles -> seeds; a seed each second or so, and one where it takes longer
ONSETS: dict[ModelName, dict[int, int]] = {
    "sp": {64: 10, 256: 10, 1024: 3, 4096: 1},
    "dp": {16: 10, 64: 10, 256: 3, 1024: 1},
}
PACKED = {64: 10, 256: 10, 1024: 5, 4096: 2, 16384: 1}  # disks at a pressure
PRESSURE = 1e-3
MINIMA = {64: 0.01, 1024: 0.01, 8192: 0.001}  # disks -> mean diameters by which they are moved out of a minimum
# number of particles -> seeds, and times the CPU time of jamlab: its onsets of 64 disks take 7 to more than 10
IN_JAXDEM: dict[ModelName, dict[int, tuple[int, float]]] = {
    "sp": {64: (3, 30.0), 256: (1, 30.0), 1024: (1, 10.0)},
    "dp": {16: (1, 10.0), 64: (1, 10.0)},
}
STEP = 2e-3  # of its search, as jamlab's near onset
BELOW = 0.05  # of phi, where its droplets begin below jamlab's onset
LIMIT = 10.0  # times the CPU time of jamlab that dpm gets, and JaxDEM for a minimum
COMPILING = 120.0  # CPU s that JaxDEM may take before it begins
FORCES = {"sp": 1e-12, "dp": 1e-10}


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """CPU time of a function, s, and what it returns."""
    began = time.process_time()
    found = run()
    return time.process_time() - began, found


def row(work: str, code: str, model: ModelName, n: int, seconds: float, **more: Any) -> Row:
    """A row of the table; seconds: mean over `seeds`, of one onset, packing or minimum."""
    version = jamlab.__version__ if code == "jamlab" else installed("lammps") if code.startswith("LAMMPS") else ""
    said = {"seeds": 1, "force": float("nan"), "limit": float("nan"), "phi": float("nan"), "version": version}
    said |= {"date": datetime.now(UTC).date().isoformat(), "machine": processor()}
    return {"work": work, "code": code, "model": model, "n": n, "seconds": seconds, **said, "note": "", **more}


# jamlab ---------------------------------------------------------------------------------------------------------------


def onsets(model: ModelName, n: int, seeds: int) -> Iterator[Row]:
    """Onsets from phi = 0.2 by jamlab."""
    seconds, found = timed(lambda: [jamlab.jam(n, model, seed, start=START) for seed in range(1, seeds + 1)])
    left, phi = max(p.max_force or 0.0 for p in found), float(np.mean([p.phi for p in found]))
    yield row("onset", "jamlab", model, n, seconds / seeds, seeds=seeds, force=left, phi=phi)


def packed(n: int, seeds: int) -> Iterator[Row]:
    """Disks at a pressure by jamlab."""
    seconds, found = timed(lambda: [jamlab.pack(n, PRESSURE, seed) for seed in range(1, seeds + 1)])
    left, phi = max(p.max_force or 0.0 for p in found), float(np.mean([p.phi for p in found]))
    yield row("pressure", "jamlab", "sp", n, seconds / seeds, seeds=seeds, force=left, phi=phi)


# minima ---------------------------------------------------------------------------------------------------------------


def minimum_of_droplets(n: int = 64) -> Iterator[Row]:
    """One minimum 0.01 above onset by jamlab and by minimisers of LAMMPS, with jamlab's styles."""
    onset = jamlab.jam(n, "dp", 1, start=START)
    for style, code in (("jamlab", "jamlab"), ("cg", "LAMMPS cg"), ("fire", "LAMMPS fire")):
        with Session(at_phi(onset, onset.phi + 0.01)) as session:
            if style == "jamlab":
                seconds, found = timed(lambda: relax_session(session).evaluation)
            else:
                how: dict[str, Any] = {"minimizer": style, "steps": 5_000}
                seconds, found = timed(partial(session.minimize, FORCES["dp"], **how))
        note = "" if found.max_force <= FORCES["dp"] else "not met in 5000 steps"
        yield row("minimum", code, "dp", n, seconds, force=found.max_force, note=note)


def minimum_of_disks(n: int, jaxdem: str) -> Iterator[Row]:
    """One minimum from disks that were moved out of it: the shortest of several runs, when all is compiled."""
    start, _ = jolted_minimum(n, 1, 0.88, MINIMA[n])
    for code, peer in (("jamlab", Jamlab()), ("LAMMPS cg", Lammps("cg"))):
        run = peer.descent(start)
        seconds, positions = shortest(partial(run, FORCES["sp"], 100_000), runs=5)
        force = jamlab.evaluate(start.with_state(positions=positions)).max_force
        yield row("minimum", code, "sp", n, seconds, force=force)
        limit = LIMIT * max(seconds, 1.0)
    if jaxdem:
        yield in_jaxdem(jaxdem, "minimum", start, limit, force=FORCES["sp"])


# others ---------------------------------------------------------------------------------------------------------------


def ours_of(model: ModelName, n: int) -> float:
    """CPU time of an onset by jamlab right before the run of another code, s: the mean of up to three seeds."""
    seeds = min(3, ONSETS[model][n])
    return float(next(onsets(model, n, seeds))["seconds"])


def onsets_in_jaxdem(python: str, model: ModelName, n: int, seeds: int, times: float) -> Iterator[Row]:
    """Onsets by JaxDEM from the same random starts; of its own droplets, from jamlab's that are taken apart again."""
    ours = ours_of(model, n)
    yield row("onset beside JaxDEM", "jamlab", model, n, ours, seeds=min(3, ONSETS[model][n]))
    for seed in range(1, seeds + 1):
        if model == "sp":
            start = random_disks(n, seed, phi=0.2)
        else:
            jammed = jamlab.jam(n, "dp", seed, start=START)
            start = at_phi(jammed, jammed.phi - BELOW)
        yield in_jaxdem(python, "onset", start, times * ours, step=STEP)


def in_jaxdem(python: str, task: str, start: Packing, limit: float, **numbers: float) -> Row:
    """One onset or minimum by JaxDEM, in at most so many CPU seconds beyond compiling."""
    given: dict[str, Any] = {"positions": start.positions, "side": start.box[0, 0], "limit": limit, **numbers}
    given |= {"diameters": start.diameters} if start.offsets is None else {"offsets": start.offsets}
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder) / "start.npz", **given)
        program = Path(__file__).with_name("jaxdem_program.py")
        words = [python, "-P", str(program), task, str(Path(folder) / "start.npz")]
        done = bounded(words, limit + COMPILING)
    said: dict[str, Any] = {}
    for line in done.stdout.splitlines():
        said |= json.loads(line) if line.startswith("{") else {}
    if "version" not in said:
        raise EngineError(
            f"{python} cannot run {program.name}: {(done.stderr.strip().splitlines() or ['no word'])[-1]}"
        )
    more: dict[str, Any] = {"version": f"0.1 of 2026-06-29, jax {said['version']}", "limit": limit}
    compiling = f"compiling {said['compiling']:.0f} s more" if "compiling" in said else "cut off while compiling"
    if "seconds" not in said:
        reached = re.findall(r"phi=([\d.]+)", done.stdout)
        note = f"cut off at φ = {float(reached[-1]):.4f}; {compiling}" if reached else compiling
        return row(task, "JaxDEM", start.model, start.n, float("nan"), **more, note=note)
    more["note"] = f"its neighbour list overflowed; {compiling}" if said.get("overflow") else compiling
    found = {name: said[name] for name in ("force", "phi") if name in said}
    return row(task, "JaxDEM", start.model, start.n, said["seconds"], **more, **found)


def bounded(words: list[str], seconds: float) -> "subprocess.CompletedProcess[str]":
    """Run a program on one core for at most so many CPU seconds."""
    bound = partial(resource.setrlimit, resource.RLIMIT_CPU, 2 * (int(np.ceil(seconds)),))
    return subprocess.run(
        words, capture_output=True, text=True, preexec_fn=bound, check=False, env=os.environ | {"OMP_NUM_THREADS": "1"}
    )


def onset_in_dpm(program: str, n: int = 64) -> Iterator[Row]:
    """How far dpm comes with its own particles of 12 and 17 vertices, its law and its protocol from phi = 0.5."""
    ours = ours_of("dp", n)
    yield row("onset beside dpm", "jamlab", "dp", n, ours, seeds=3)
    law = [str(n), "12", "1.0", "1.0", "0.0", "0.0", "0.0", "1e-7", "1e-12", "1", "/dev/null"]
    seconds, ran = timed_child(partial(bounded, [program, *law], LIMIT * ours))
    more: dict[str, Any] = {"limit": LIMIT * ours, "version": "November 2023"}
    if ran.returncode == 0:
        yield row("onset", "dpm", "dp", n, seconds, **more)
        return
    steps = [int(step) for step in re.findall(r"fireit\s+= (\d+)", ran.stdout)]  # of each minimisation from 0 on
    taken = sum(step for step, after in zip(steps, [*steps[1:], 0], strict=True) if after < step)
    yield row(
        "onset", "dpm", "dp", n, float("nan"), **more, note=f"cut off; {taken / seconds:.0f} steps of FIRE a second"
    )


def timed_child(run: Callable[[], Any]) -> tuple[float, Any]:
    """CPU time of the children that end in a function, s, and what it returns."""
    before = os.times()
    found = run()
    after = os.times()
    return sum(after[2:4]) - sum(before[2:4]), found


# the command ----------------------------------------------------------------------------------------------------------


def parts(dpm: str, jaxdem: str) -> dict[str, dict[str, Task]]:
    """Tasks by part: the quick ones first."""
    ways: dict[str, dict[str, Task]] = {"disks": {}, "droplets": {}, "minima": {}, "dpm": {}, "jaxdem": {}, "large": {}}
    for model, sizes in ONSETS.items():
        for n, seeds in sizes.items():
            part = "large" if (model, n) in LARGE else "disks" if model == "sp" else "droplets"
            ways[part][f"onset, {model}, {n}"] = partial(onsets, model, n, seeds)
    for n, seeds in PACKED.items():
        ways["large" if ("pack", n) in LARGE else "disks"][f"pack, {n}"] = partial(packed, n, seeds)
    ways["minima"] = {f"minimum, sp, {n}": partial(minimum_of_disks, n, jaxdem) for n in MINIMA}
    ways["minima"]["minimum, dp, 64"] = minimum_of_droplets
    if dpm:
        ways["dpm"] = {"dpm": partial(onset_in_dpm, dpm)}
    if jaxdem:
        runs = [(model, n, how) for model, sizes in IN_JAXDEM.items() for n, how in sizes.items()]
        ways["jaxdem"] = {f"JaxDEM, {m}, {n}": partial(onsets_in_jaxdem, jaxdem, m, n, *how) for m, n, how in runs}
    return ways


LARGE: tuple[tuple[str, int], ...] = (("dp", 1024), ("sp", 4096), ("pack", 16384))


def drop(folder: Path, tasks: Iterable[str]) -> None:
    """Drop the rows of tasks from a table, so that they are measured anew."""
    path = folder / f"{NAME}.csv"
    if path.exists():
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
        left = table[~table["task"].isin([*tasks])]
        forget(folder, NAME)
        if len(left):
            write_table(folder, NAME, left)


def main(
    part: Annotated[list[str] | None, typer.Option(help="disks, droplets, minima, dpm, jaxdem, large; all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the table; run again to go on.")] = DATA,
    dpm: Annotated[str, typer.Option(help="Program of dpm.")] = "",
    jaxdem: Annotated[str, typer.Option(help="Python that has JaxDEM.")] = "",
    anew: Annotated[bool, typer.Option(help="Measure again what the table holds.")] = False,
) -> None:
    """Measure what a packing costs here and in other codes."""
    ways = parts(dpm, jaxdem)
    for name in part or ():
        check_choice("part", name, list(ways))
    tasks = {task: run for name, each in ways.items() if not part or name in part for task, run in each.items()}
    if anew:
        drop(out, tasks)
    began = time.perf_counter()
    measure(out, NAME, tasks, lambda share, text: print(f"{time.perf_counter() - began:6.1f} s  {text}", flush=True))


if __name__ == "__main__":
    typer.run(main)
