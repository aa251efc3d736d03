"""Run a deck in plain lmp, and read what it prints and writes."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

import jamlab
from jamlab.kernels.installed_files import installed

LMP = Path(sys.executable).parent / "lmp"


def run(deck, folder, code=0, inputs=None, ranks=1, words=(), **variables) -> str:
    """What a deck prints; it runs in `folder`, where none of its parts are, and must end with the exit code.

    `inputs`: folder of the deck, as installed by default; `words`: more arguments of lmp.
    """
    decks = inputs or installed("lammps_inputs")
    settings = [word for name, value in {"dir": decks, **variables}.items() for word in ("-var", name, str(value))]
    several = [str(LMP.parent / "mpiexec"), "-n", str(ranks)] if ranks > 1 else []
    command = [*several, str(LMP), "-in", str(decks / deck), *settings, "-log", "none", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == code, done.stdout[-2000:]
    assert (code == 0) == ("Total wall time" in done.stdout) or "-partition" in words  # which have screens of their own
    assert not list(folder.glob("*.parts")) + list(folder.glob("*.given")) + list(folder.glob("*.settings"))
    return done.stdout


def rows(text: str, columns: int) -> np.ndarray:
    """The lines of numbers of a table, after its last heading."""
    found = re.findall(rf"^ *((?:[-+.e\d]+ *){{{columns}}})$", text.rpartition("fmax\n")[2], re.MULTILINE)
    return np.array([line.split() for line in found], dtype=float)


def number(name: str, text: str) -> float:
    found = re.findall(rf"{name} ?=? (-?[\d.]+(?:e[-+]?\d+)?)", text)
    assert found, f"no {name} in the output"
    return float(found[-1])


def disks(path: Path, like: jamlab.Packing | None = None, units: str = "eps") -> jamlab.Packing:
    """The packing in a data file that LAMMPS wrote, with diameters of another one or of the two default sizes."""
    text = path.read_text()
    (x0, x1), (y0, y1) = (
        [float(word) for word in re.findall(rf"(\S+) (\S+) {side}lo {side}hi", text)[0]] for side in "xy"
    )
    tilt = float(re.findall(r"(\S+) \S+ \S+ xy xz yz", text)[0])
    atoms = text.split("Atoms # atomic")[1].split("Velocities")[0]
    rows = np.array([line.split() for line in atoms.splitlines() if line.strip()], dtype=float)
    rows = rows[np.argsort(rows[:, 0])]
    diameters = np.array([2 / 2.4, 2.8 / 2.4])[rows[:, 1].astype(int) - 1] if like is None else like.diameters
    box = [[x1 - x0, 0.0], [tilt, y1 - y0]]
    return jamlab.Packing("sp", box, rows[:, 2:4] - [x0, y0], {units: 1.0}, units, diameters)


def frame(path: Path) -> dict[str, list[float]]:
    """Columns of the first frame of a dump."""
    lines = path.read_text().splitlines()
    names = lines[8].removeprefix("ITEM: ATOMS ").split()
    values = np.array([line.split() for line in lines[9 : 9 + int(lines[3])]], dtype=float)
    return {name: list(values[:, k]) for k, name in enumerate(names)}
