"""Where the files lie that are installed beside the Python code: the compiled plugin and kernels, and the decks."""

from functools import cache
from importlib import metadata
from pathlib import Path

from jamlab.errors import EngineError


@cache
def installed(folder: str) -> Path:
    """Folder "plugin" or "lammps_inputs" of jamlab. A checkout on `sys.path` has its own decks, which belong to its
    code; what is compiled is asked of the installed distribution."""
    beside = Path(__file__).parents[2] / folder
    if folder == "lammps_inputs" and beside.is_dir():
        return beside
    try:
        path = Path(str(metadata.distribution("jamlab").locate_file(f"jamlab/{folder}")))
    except metadata.PackageNotFoundError:
        raise EngineError("jamlab is not installed in this Python: run `pip install .` in its checkout") from None
    if not path.is_dir():
        raise EngineError(f"{path} is missing: reinstall jamlab with `pip install --force-reinstall .`")
    return path
