"""jamlab: jammed 2D packings, from disks to deformable droplets, from onset to viscoelastic spectrum, on LAMMPS.

The public names are in `__init__.pyi`. They load when they are first used: LAMMPS itself imports this package at every
start to find the plugin.
"""

from typing import Any

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Load a public name; the version is that of the installed distribution."""
    if name == "__version__":
        from importlib.metadata import version

        return version("jamlab")
    return _load(name)
