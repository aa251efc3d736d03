"""Where the files lie that are installed beside the Python code: the compiled plugin and kernels, and the decks."""

from functools import cache
from importlib import metadata
from pathlib import Path

from jamlab.errors import EngineError


@cache
def installed(folder: str) -> Path:
    """Folder of the installed jamlab package: "plugin" or "lammps_inputs". Asks the installed distribution, not this
    file's place: a checkout on `sys.path` has no compiled plugin."""
    try:
        path = Path(str(metadata.distribution("jamlab").locate_file(f"jamlab/{folder}")))
    except metadata.PackageNotFoundError:
        raise EngineError("jamlab is not installed in this Python: run `pip install .` in its checkout") from None
    if not path.is_dir():
        raise EngineError(f"{path} is missing: reinstall jamlab with `pip install --force-reinstall .`")
    return path
