"""Positions and forces of a running LAMMPS, in the order of the atom ids, without the cost of its Python interface."""

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import EngineError
from jamlab.kernels.library import INTEGER, INTEGERS, REALS, kernel

_POINTER = ctypes.c_void_p
_ENDINGS = {4: "", 8: "_wide"}  # of kernels, by the bytes of LAMMPS' ids and image flags


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
        end = _ENDINGS[sizes[0]]
        self._put_positions = kernel(f"put_positions{end}", INTEGER, _POINTER, _POINTER, _POINTER, _POINTER, _POINTER)
        self._take_positions = kernel(f"take_positions{end}", INTEGER, _POINTER, _POINTER, REALS, _POINTER, REALS)
        self._take_forces = kernel(f"take_forces{end}", INTEGER, _POINTER, _POINTER, _POINTER)
        self._place_atoms = kernel(f"place_atoms{end}", INTEGER, _POINTER, REALS, INTEGERS, _POINTER, _POINTER)

    def positions(self, count: int, box: Array) -> Array:
        """(count, 2) unwrapped positions; `box` is that in which the image flags were counted."""
        positions = np.empty((count, 2))
        _check(self._take_positions(count, *self._arrays(b"id", b"image"), box, *self._arrays(b"x"), positions), count)
        return positions

    def set_positions(self, positions: Array, box: Array) -> None:
        """Move every atom to an unwrapped position (n, 2)."""
        count = len(positions)
        x, box = np.ascontiguousarray(positions, dtype=np.float64), np.ascontiguousarray(box)
        # bare addresses: checks of every argument would take as long as the copy
        arrays = (*self._arrays(b"id", b"image"), box.ctypes.data, x.ctypes.data, *self._arrays(b"x"))
        _check(self._put_positions(count, *arrays), count)

    def place(self, inside: Array, images: NDArray[np.int64]) -> None:
        """Put every atom at a position (n, 2) inside the box, with the image (n, 2) that it stands for."""
        count = len(inside)
        _check(self._place_atoms(count, *self._arrays(b"id"), inside, images, *self._arrays(b"x", b"image")), count)

    def forces(self, count: int) -> Array:
        """(count, 2) forces of the last evaluation."""
        forces = np.empty((count, 2))
        _check(self._take_forces(count, *self._arrays(b"id", b"f"), forces.ctypes.data), count)
        return forces

    def _arrays(self, *names: bytes) -> list[int]:
        return [self._array(self._lmp.lmp, name) for name in names]


def _check(moved: int, count: int) -> None:
    if moved != count:
        raise EngineError(f"LAMMPS holds other atoms than the {count} of the packing")
