"""Call functions of the compiled library with numpy arrays.

A kernel has the C interface `int64_t name(...)`: what it returns is a count, or a negative number that its caller turns
into an error. Lack of memory is a MemoryError. Arrays are passed as bare pointers, so the types declared here refuse
another dtype or memory layout.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from jamlab.installed_files import installed_file


class _Pointer:
    """To the first element of an array of one dtype in C order; `numpy.ctypeslib.ndpointer` takes ten times as long."""

    def __init__(self, dtype: Any) -> None:
        self._dtype = np.dtype(dtype)

    def from_param(self, array: Any) -> ctypes.c_void_p:
        """What ctypes passes on."""
        if not isinstance(array, np.ndarray) or array.dtype != self._dtype or not array.flags.c_contiguous:
            raise TypeError(f"a kernel takes an array of {self._dtype} in C order")
        return ctypes.c_void_p(array.__array_interface__["data"][0])


REALS: Any = _Pointer(np.float64)
INTEGERS: Any = _Pointer(np.int64)
INDICES: Any = _Pointer(np.int32)  # of sparse matrices
REAL = ctypes.c_double
INTEGER = ctypes.c_int64

_NO_MEMORY = -1000  # NO_MEMORY of plugin/kernels/kernel.h


@cache
def library() -> ctypes.CDLL:
    """The compiled kernels of this installation."""
    path = installed_file("plugin", "jamlabkernels.so")
    # glibc gives blocks larger than any that was freed before back to the system, and their pages are cleared when they
    # come again: a quarter of the time of some kernels. From one large block, never written, it learns to keep them.
    np.empty(2**25 - 2**16, dtype=np.uint8)  # bytes; glibc learns from less than 32 MB alone
    return ctypes.CDLL(str(path))


def kernel(name: str, *arguments: Any) -> Callable[..., int]:
    """A function of the library, loaded at its first call.

    Args:
        name: of the C function.
        arguments: types of its arguments, of those above.
    """

    @cache
    def function() -> Any:
        loaded = library()[name]  # an object of its own: two callers may declare other types
        loaded.argtypes, loaded.restype = list(arguments), INTEGER
        return loaded

    def call(*values: Any) -> int:
        found = int(function()(*values))
        if found == _NO_MEMORY:
            raise MemoryError(f"{name}: there is not enough memory for this packing")
        return found

    return call
