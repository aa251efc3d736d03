"""jamlab: jammed 2D packings, from disks to deformable droplets, from onset to viscoelastic spectrum, on LAMMPS.

The public names are in `__init__.pyi`. They load when they are first used: LAMMPS itself imports this package at every
start to find the plugin.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
