"""Logs of examples on 1 and 4 ranks, as LAMMPS has them: python plugin/recipes/lammps/example_logs.py FOLDER [LMP]

FOLDER: with files in.NAME, such as examples/PACKAGES/polygon of a tree. LMP: program that was built there for MPI,
default the installed one, whose plugin has the styles too. mpiexec is the first on the path.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

RANKS = (1, 4)


def write_logs(folder: Path, lmp: str = "lmp", ranks: tuple[int, ...] = RANKS) -> list[Path]:
    """Run every input of the folder there: log.DATE.NAME.g++.RANKS, without the lines of a plugin."""
    written = []
    for deck in sorted(folder.glob("in.*")):
        for count in ranks:
            several = [shutil.which("mpiexec") or "mpiexec", "-n", str(count)] if count > 1 else []
            line = [*several, lmp, "-in", deck.name, "-log", "log.lammps", "-screen", "none"]
            subprocess.run(
                line, cwd=folder, env=os.environ | {"OMP_NUM_THREADS": "1"}, stdin=subprocess.DEVNULL, check=True
            )
            text = (folder / "log.lammps").read_text()
            (folder / "log.lammps").unlink()
            found = re.search(r"^LAMMPS \((\d+ \w+ \d{4})", text, re.MULTILINE)
            if found is None:
                raise SystemExit(f"{deck}: the log has no version of LAMMPS")
            path = folder / f"log.{found[1].replace(' ', '')}.{deck.name.removeprefix('in.')}.g++.{count}"
            path.write_text(re.sub(r"^Load(?:ing|ed) .*plugin.*\n", "", text, flags=re.MULTILINE))
            written.append(path)
    return written


if __name__ == "__main__":
    program = sys.argv[2] if len(sys.argv) > 2 else "lmp"
    for path in write_logs(Path(sys.argv[1]).resolve(), program):
        print(path)
