"""First-order minimisation by LAMMPS on several MPI ranks: plain `lmp` under mpiexec runs the deck. FIRE of disks,
which is what large packings take, has threads instead (`engine/disk_fire.py`).

A stage takes seconds to minutes, so a file each way costs nothing; positions keep all their digits.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import deck
from jamlab.errors import EngineError, InputError
from jamlab.packing.lammps_files import MAX_TYPES, types, write_data
from jamlab.packing.packing import Packing
from jamlab.processes.child import child_environment
from jamlab.processes.dying_program import dying_line

NOT_CONVERGED = 2  # exit code of a deck whose last state is not what was asked for
COMPONENT = 0.5  # of a force's norm: LAMMPS compares components, of which two make a norm of up to sqrt(2) times one
_FEW = 8  # ranks that any machine may run, if slowly


def check_ranks(ranks: int, one: bool = False) -> None:
    """Refuse what is no number of threads or MPI ranks; `one`: more than one, for droplets, which one minimises faster.

    Raises:
        InputError: naming the value.
    """
    most = max(os.cpu_count() or 1, _FEW)
    if isinstance(ranks, bool) or not isinstance(ranks, int | np.integer) or not 1 <= ranks <= most:
        raise InputError(f"ranks = {ranks!r}: must be a whole number of processors of this machine, 1 to {most}")
    if ranks > 1 and one:
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
    check_ranks(ranks, packing.kind.deforms)
    variables = {"minimizer": style, "force": COMPONENT * force, "steps": steps, "stretch": stretch or steps}
    with tempfile.TemporaryDirectory() as folder:
        write_data(Path(folder) / "packing.data", packing)
        line = lammps_line(deck("in.sp.minimize"), variables | law_settings(packing), ranks, "-log", "none")
        try:
            done = subprocess.run(
                line, cwd=folder, env=child_environment(), capture_output=True, text=True, check=False
            )
        except OSError as error:
            raise EngineError(f"no mpiexec and lmp for ranks = {ranks}: run `jamlab doctor`") from error
        if done.returncode not in (0, NOT_CONVERGED):
            last = [text for text in (done.stdout + done.stderr).splitlines() if text.strip()]
            errors = [text for text in last if "ERROR" in text or "REFUSED" in text] or last or ["no output"]
            raise EngineError(f"LAMMPS on {ranks} ranks stopped: {errors[-1]}")
        rows = np.loadtxt(Path(folder) / "sp.minimum.dump", skiprows=9, ndmin=2)
    return np.ascontiguousarray(rows[:, 2:4])


def law_settings(packing: Packing) -> dict[str, object]:
    """Variables by which a deck knows the force law of a packing and, of disks, their diameters by type.

    Raises:
        InputError: more sizes than types, which decks take a size from.
    """
    found = packing.kind.lammps_variables(packing)
    if not packing.kind.sizes_by_atom:
        if (table := types(packing)).classes:
            raise InputError(f"more than {MAX_TYPES} sizes of disks: decks take a size from its type; use Python")
        found |= {f"d{k}": d for k, d in enumerate(table.values, start=1)}
    return found


def lammps_line(path: Path, variables: Mapping[str, object], ranks: int, *words: str) -> list[str]:
    """Command line of plain `lmp` for a deck, on some ranks of this machine; it ends with this process and needs
    `child_environment`. `words`: more of its arguments."""
    programs = Path(sys.executable).parent
    # inside a job of SLURM mpiexec would ask it to start the ranks
    line: list[object] = [programs / "mpiexec", "-launcher", "fork", "-n", ranks] if ranks > 1 else []
    line += [programs / "lmp", "-in", path, "-nocite", *words]
    for name, value in {"dir": path.parent, **variables}.items():
        line += ["-var", name, f"{value:.17g}" if isinstance(value, float) else value]
    return dying_line([str(word) for word in line])
