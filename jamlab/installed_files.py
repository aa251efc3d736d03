"""Where the files that are installed beside the code lie: decks of LAMMPS, and what was compiled."""

from functools import cache
from importlib import metadata
from pathlib import Path

from jamlab.errors import EngineError


@cache
def installed(folder: str) -> Path:
    """Folder "plugin" or "lammps_inputs" of jamlab. A checkout on `sys.path` has its own decks, which belong to its
    code; what is compiled is asked of the installed distribution."""
    beside = Path(__file__).parents[1] / folder
    if folder == "lammps_inputs" and beside.is_dir():
        return beside
    try:
        path = Path(str(metadata.distribution("jamlab").locate_file(f"jamlab/{folder}")))
    except metadata.PackageNotFoundError:
        raise EngineError("jamlab is not installed in this Python: run `pip install .` in its checkout") from None
    if not path.is_dir():
        raise EngineError(f"{path} is missing: reinstall jamlab with `pip install --force-reinstall .`")
    return path


def installed_file(folder: str, name: str) -> Path:
    """A file in one of these folders."""
    path = installed(folder) / name
    if not path.is_file():
        raise EngineError(f"{path} is missing: reinstall jamlab with `pip install --force-reinstall .`")
    return path
