"""Positions and forces of a running LAMMPS, in the order of the atom ids, without the cost of its Python interface."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import EngineError
from jamlab.kernels.library import INTEGER, INTEGERS, REALS, kernel

_POINTER = ctypes.c_void_p
_put_positions = kernel("put_positions", INTEGER, INTEGER, _POINTER, _POINTER, _POINTER, _POINTER, _POINTER)
_take_positions = kernel("take_positions", INTEGER, INTEGER, _POINTER, _POINTER, REALS, _POINTER, REALS)
_take_forces = kernel("take_forces", INTEGER, INTEGER, _POINTER, _POINTER, _POINTER)
_place_atoms = kernel("place_atoms", INTEGER, INTEGER, _POINTER, REALS, INTEGERS, _POINTER, _POINTER)


class AtomExchange:
    """Reads and writes the per-atom arrays of a LAMMPS that runs in this process, on one rank.

    LAMMPS moves its arrays when it rebuilds neighbour lists, so their addresses are asked for at every call.

    Args:
        lmp: instance of `lammps.lammps`.
    """

    def __init__(self, lmp: Any) -> None:
        self._lmp = lmp
        prototype = ctypes.CFUNCTYPE(_POINTER, _POINTER, ctypes.c_char_p)
        self._array = prototype(("lammps_extract_atom", lmp.lib))
        sizes = [lmp.extract_setting(name) for name in ("tagint", "imageint")]
        if sizes[0] != sizes[1]:
            raise EngineError(f"LAMMPS has atom ids of {sizes[0]} bytes and image flags of {sizes[1]}")
        self._wide = sizes[0] == 8

    def positions(self, count: int, box: Array) -> Array:
        """(count, 2) unwrapped positions; `box` is that in which the image flags were counted."""
        positions = np.empty((count, 2))
        self._call(_take_positions, count, *self._arrays(b"id", b"image"), box, *self._arrays(b"x"), positions)
        return positions

    def set_positions(self, positions: Array, box: Array) -> None:
        """Move every atom to an unwrapped position (n, 2)."""
        count = len(positions)
        x, box = np.ascontiguousarray(positions, dtype=np.float64), np.ascontiguousarray(box)
        # bare addresses: checks of every argument would take as long as the copy
        arrays = (*self._arrays(b"id", b"image"), box.ctypes.data, x.ctypes.data, *self._arrays(b"x"))
        self._call(_put_positions, count, *arrays)

    def place(self, inside: Array, images: NDArray[np.int64]) -> None:
        """Put every atom at a position (n, 2) inside the box, with the image (n, 2) that it stands for."""
        count = len(inside)
        self._call(_place_atoms, count, *self._arrays(b"id"), inside, images, *self._arrays(b"x", b"image"))

    def forces(self, count: int) -> Array:
        """(count, 2) forces of the last evaluation."""
        forces = np.empty((count, 2))
        self._call(_take_forces, count, *self._arrays(b"id", b"f"), forces.ctypes.data)
        return forces

    def _arrays(self, *names: bytes) -> list[int]:
        return [self._array(self._lmp.lmp, name) for name in names]

    def _call(self, function: Callable[..., int], count: int, *arrays: Any) -> None:
        if function(count, self._wide, *arrays) != count:
            raise EngineError(f"LAMMPS holds other atoms than the {count} of the packing")
