"""Packings as other groups publish them.

Leiden (github.com/vanheckelab/jambashbulk) writes one block a state, `N = , L = , L1= { , } , L2= { , }` and rows
`x , y , R ,` in braces, of disks with energy (k/2)(R_i + R_j - r)^2, k = 1, in boxes sheared until stable. Goodrich and
Liu (2d_*.nc, which is HDF5) have one row a packing: `pos` in units of the box, `rad` and `box`, whose lattice vectors
are columns, with energy (eps/2)(1 - r/s)^2, eps = 1.
"""

import re
from pathlib import Path

import h5py
import numpy as np

from jamlab.packing.packing import Packing

BLOCK = re.compile(r"L1\s*=\s*\{([^}]*)\}\s*,\s*L2\s*=\s*\{([^}]*)\}[^\n]*\n\{\n(.*?)\n\}", re.DOTALL)


def read_leiden(path: Path) -> list[Packing]:
    """The states of a text file, in units of `k` and of its own length."""
    found = []
    for first, second, rows in BLOCK.findall(path.read_text()):
        box = np.array([np.array(text.split(","), dtype=np.float64) for text in (first, second)])
        x, y, radius = np.array([row.split(",")[:3] for row in rows.splitlines()], dtype=np.float64).T
        places = np.column_stack([x, y])
        found.append(Packing("sp", box, places, {"k": 1.0}, "k", 2 * radius, ensemble="shear-stabilized"))
    return found


def read_goodrich(path: Path) -> list[Packing]:
    """The packings of a netCDF file, in units of `eps`."""
    with h5py.File(path) as file:
        arrays = [file[name][()] for name in ("pos", "rad", "box")]
    packings = []
    for pos, rad, cell in zip(*arrays, strict=True):
        box = cell.reshape(2, 2).T
        packings.append(Packing("sp", box, pos.reshape(-1, 2) @ box, {"eps": 1.0}, "eps", 2 * rad))
    return packings
