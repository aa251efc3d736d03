"""First-order minimisation by LAMMPS on several MPI ranks: plain `lmp` under mpiexec runs the deck. FIRE of disks,
which is what large packings take, has threads instead (`engine/disk_fire.py`).

A stage takes seconds to minutes, so a file each way costs nothing; positions keep all their digits.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import deck
from jamlab.errors import EngineError, InputError
from jamlab.packing.lammps_files import write_data
from jamlab.packing.packing import Packing
from jamlab.processes.child import child_environment
from jamlab.processes.dying_program import dying_line

_NOT_CONVERGED = 2  # exit code of a deck whose last state is not what was asked for
COMPONENT = 0.5  # of a force's norm: LAMMPS compares components, of which two make a norm of up to sqrt(2) times one
_FEW = 8  # ranks that any machine may run, if slowly


def check_ranks(ranks: int, model: str = "sp") -> None:
    """Refuse what is no number of threads or MPI ranks, and more than one for droplets, which one minimises faster.

    Raises:
        InputError: naming the value.
    """
    most = max(os.cpu_count() or 1, _FEW)
    if isinstance(ranks, bool) or not isinstance(ranks, int | np.integer) or not 1 <= ranks <= most:
        raise InputError(f"ranks = {ranks!r}: must be a whole number of processors of this machine, 1 to {most}")
    if ranks > 1 and model != "sp":
        raise InputError(f"ranks = {ranks}: polygons are minimised on one rank")


def minimize_on_ranks(
    packing: Packing, *, force: float, style: str, steps: int, ranks: int, stretch: int | None = None
) -> Array:
    """Positions after `minimize` at fixed box, by the deck in.sp.minimize.

    Args:
        packing: SP.
        force: tolerance on the largest norm of a force.
        style: "cg" or "fire".
        steps: iterations at most.
        stretch: iterations after which the minimiser starts anew, by default never.
        ranks: MPI ranks.

    Returns:
        (n, 2) unwrapped positions. Whether the tolerance was met is for the caller to see.

    Raises:
        EngineError: mpiexec or LAMMPS failed; the message holds the last line that LAMMPS wrote.
        InputError: for polygons, which one rank minimises faster.
    """
    check_ranks(ranks, packing.model)
    variables: dict[str, object] = {"minimizer": style, "force": f"{COMPONENT * force:.17g}"}
    variables |= {"steps": steps, "stretch": stretch or steps}  # the data file says law and sizes
    programs = Path(sys.executable).parent
    inputs = deck("in.sp.minimize")
    with tempfile.TemporaryDirectory() as folder:
        write_data(Path(folder) / "packing.data", packing)
        # ranks share one machine: inside a job of SLURM mpiexec would ask it to start them
        line: list[object] = [programs / "mpiexec", "-launcher", "fork", "-n", ranks]
        line += [programs / "lmp", "-in", inputs, "-log", "none", "-nocite"]
        for name, value in {"dir": inputs.parent, **variables}.items():
            line += ["-var", name, value]
        try:
            words, modules = dying_line([str(word) for word in line]), child_environment()
            done = subprocess.run(words, cwd=folder, env=modules, capture_output=True, text=True, check=False)
        except OSError as error:
            raise EngineError(f"no mpiexec and lmp in {programs} for ranks = {ranks}: run `jamlab doctor`") from error
        if done.returncode not in (0, _NOT_CONVERGED):
            last = [text for text in (done.stdout + done.stderr).splitlines() if text.strip()]
            errors = [text for text in last if "ERROR" in text or "REFUSED" in text] or last or ["no output"]
            raise EngineError(f"LAMMPS on {ranks} ranks stopped: {errors[-1]}")
        reached = "sp.unconverged.dump" if done.returncode else "sp.minimum.dump"
        rows = np.loadtxt(Path(folder) / reached, skiprows=9, ndmin=2)
    return np.ascontiguousarray(rows[:, 1:3])
