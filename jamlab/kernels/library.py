"""Call functions of the compiled library with numpy arrays.

A kernel has the C interface `int64_t name(...)`: what it returns is a count, or a negative number that its caller turns
into an error. Arrays are passed as bare pointers, so the types declared here refuse another dtype or memory layout.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.ctypeslib import ndpointer

from jamlab.errors import EngineError
from jamlab.kernels.installed_files import installed

REALS: Any = ndpointer(np.float64, flags="C_CONTIGUOUS")
INTEGERS: Any = ndpointer(np.int64, flags="C_CONTIGUOUS")
SHORT_INTEGERS: Any = ndpointer(np.int32, flags="C_CONTIGUOUS")
FLAGS: Any = ndpointer(np.bool_, flags="C_CONTIGUOUS")
REAL = ctypes.c_double
INTEGER = ctypes.c_int64

_LESSON = 2**25 - 2**16  # bytes; glibc learns from less than 32 MB alone


@cache
def library() -> ctypes.CDLL:
    """The compiled kernels of this installation."""
    path = installed("plugin") / "jamlabkernels.so"
    if not path.is_file():
        raise EngineError(f"the compiled kernels {path} are missing: run `pip install --force-reinstall .`")
    # glibc gives blocks larger than any that was freed before back to the system, and their pages are cleared when they
    # come again: a quarter of the time of some kernels. From one large block, never written, it learns to keep them.
    np.empty(_LESSON, dtype=np.uint8)
    return ctypes.CDLL(str(path))


def kernel(name: str, *arguments: Any) -> Callable[..., int]:
    """A function of the library, loaded at its first call. `name`: of the C function; `arguments`: types of its
    arguments, of those above."""

    @cache
    def function() -> Any:
        loaded = getattr(library(), name)
        loaded.argtypes, loaded.restype = list(arguments), INTEGER
        return loaded

    def call(*values: Any) -> int:
        return int(function()(*values))

    return call
