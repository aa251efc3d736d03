"""The kernels of linear algebra, which decide the last digits of sums over the coordinates of a packing."""

from functools import cache

from threadpoolctl import threadpool_info


@cache
def blas_kernels() -> str:
    """Instruction sets that the BLAS libraries of numpy and scipy compute with, which are loaded if they are not, so
    that the answer does not depend on what a process did before."""
    import scipy.linalg  # noqa: F401

    libraries = [library for library in threadpool_info() if library["user_api"] == "blas"]
    return ", ".join(sorted({library.get("architecture", library["internal_api"]) for library in libraries}))
