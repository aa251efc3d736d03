"""The libraries of linear algebra that decide the last digits of a packing: how they are loaded, and their kernels."""

import os
import sys
from functools import cache
from typing import Any

from threadpoolctl import threadpool_info


@cache
def load_cholmod() -> tuple[Any, Any, Any]:
    """CHOLMOD with the BLAS that it was built for, and cvxopt's dense and sparse matrices. liblammps offers the symbols
    of a plain BLAS to every library loaded after it. Bound to these, CHOLMOD factorises three times slower, and last
    digits would depend on what a process has loaded first."""
    flags = sys.getdlopenflags()
    sys.setdlopenflags(flags | getattr(os, "RTLD_DEEPBIND", 0))
    try:
        from cvxopt import cholmod, matrix, spmatrix
    finally:
        sys.setdlopenflags(flags)
    return cholmod, matrix, spmatrix


@cache
def blas_kernels() -> str:
    """Instruction sets that the BLAS libraries of numpy, scipy and CHOLMOD compute with, which are loaded if they are
    not, so that the answer does not depend on what a process did before."""
    import scipy.linalg  # noqa: F401

    load_cholmod()
    libraries = [library for library in threadpool_info() if library["user_api"] == "blas"]
    return ", ".join(sorted({library.get("architecture", library["internal_api"]) for library in libraries}))
