"""Positions and forces of a running LAMMPS, in the order of the atom ids, and numbers of its fixes, without the cost of
its Python interface."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.installation import last_error
from jamlab.errors import EngineError
from jamlab.kernels.library import INTEGER, kernel

_POINTER = ctypes.c_void_p
_put_atoms, _take_atoms = (kernel(name, INTEGER, INTEGER, *5 * [_POINTER]) for name in ("put_atoms", "take_atoms"))


class AtomExchange:
    """Reads and writes the per-atom arrays of a LAMMPS that runs in this process, on one rank. LAMMPS moves its arrays
    when it rebuilds neighbour lists, so their addresses are asked for at every call."""

    def __init__(self, lmp: Any) -> None:
        self._lmp = lmp
        prototype = ctypes.CFUNCTYPE(_POINTER, _POINTER, ctypes.c_char_p)
        self._array = prototype(("lammps_extract_atom", lmp.lib))
        sizes = [lmp.extract_setting(name) for name in ("tagint", "imageint")]
        if sizes[0] != sizes[1]:
            raise EngineError(f"LAMMPS has {sizes[0]}-byte atom ids and {sizes[1]}-byte image flags: use another build")
        self._wide = sizes[0] == 8
        numbers = ctypes.CFUNCTYPE(ctypes.POINTER(ctypes.c_double), _POINTER, ctypes.c_char_p, *4 * [ctypes.c_int])
        self._of_fix = numbers(("lammps_extract_fix", lmp.lib))

    def positions(self, count: int, box: Array) -> Array:
        """(count, 2) unwrapped positions; `box` is that in which the image flags were counted."""
        positions = np.empty((count, 2))
        self._call(_take_atoms, b"x", positions, box)
        return positions

    def set_positions(self, positions: Array, box: Array) -> None:
        """Move every atom to an unwrapped position (n, 2)."""
        self._call(_put_atoms, b"x", positions, box)

    def put_inside(self, inside: Array, images: NDArray[np.int64]) -> None:
        """Put every atom at a position (n, 2) inside the box, with the image (n, 2) that it stands for."""
        self._call(_put_atoms, b"x", inside)
        bits, integer = (21, ctypes.c_int64) if self._wide else (10, ctypes.c_int32)
        zero, of_axis = 1 << (bits - 1), (1 << bits) - 1
        a, b = (images + zero & of_axis).T
        arrays = [(integer * len(images)).from_address(address) for address in self._arrays(b"id", b"image")]
        ids, flags = map(np.ctypeslib.as_array, arrays)
        flags[:] = (a | b << bits | zero << 2 * bits)[ids - 1]

    def forces(self, count: int) -> Array:
        """(count, 2) forces of the last evaluation."""
        forces = np.empty((count, 2))
        self._call(_take_atoms, b"f", forces)
        return forces

    def fix_vector(self, name: str, size: int) -> Array:
        """(size,) the global vector of a fix, by its id."""
        found, fix, lib = np.empty(size), name.encode(), self._lmp.lib
        for k in range(size):
            number = self._of_fix(self._lmp.lmp, fix, 0, 1, k, 0)  # global, vector
            if not number or lib.lammps_has_error(self._lmp.lmp):
                raise EngineError(f"LAMMPS has no number {k + 1} of fix {name}: {last_error(self._lmp)}")
            found[k] = number[0]
            lib.lammps_free(number)
        return found

    def _arrays(self, *names: bytes) -> list[int]:
        return [self._array(self._lmp.lmp, name) for name in names]

    def _call(self, function: Callable[..., int], name: bytes, values: Array, box: Array | None = None) -> None:
        count, of_ids = len(values), np.ascontiguousarray(values, dtype=np.float64)
        place = None if box is None else np.ascontiguousarray(box).ctypes.data
        # bare addresses: checks of every argument would take as long as the copy
        ids, images, rows = self._arrays(b"id", b"image", name)
        if function(count, self._wide, ids, images, place, of_ids.ctypes.data, rows) != count:
            raise EngineError(f"LAMMPS holds other atoms than the {count} of the packing")
