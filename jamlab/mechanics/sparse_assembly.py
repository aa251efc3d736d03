"""Sum small blocks into a sparse symmetric matrix, in compiled code."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.errors import InputError
from jamlab.kernels.library import INTEGER, INTEGERS, REALS, SHORT_INTEGERS, kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_joined_sites = kernel(
    "joined_sites", INTEGER, INTEGER, INTEGERS, INTEGERS, INTEGERS, INTEGER, INTEGERS, SHORT_INTEGERS
)
_add_blocks = kernel("add_blocks", INTEGER, INTEGER, INTEGERS, REALS, INTEGERS, SHORT_INTEGERS, REALS)
_coordinate_pattern = kernel("coordinate_pattern", INTEGER, INTEGERS, SHORT_INTEGERS, SHORT_INTEGERS, SHORT_INTEGERS)

MOST_ELEMENTS = 2**31 - 1  # of a sparse matrix: its factorisations count with 32 bits


def assemble(sites: Sequence[Indices], blocks: Sequence[Array], size: int) -> sparse.csc_array:
    """Sum blocks over groups of terms.

    Args:
        sites: for each group (k, m) int64, the m sites of each of its k terms.
        blocks: for each group (k, m, 2, m, 2) float64, each symmetric.
        size: number of sites.

    Returns:
        (2 size, 2 size) CSC with sorted indices; every pair of sites that shares a term has its 2 x 2 elements, zeros
        as well, so that terms between the same sites have one pattern.

    Raises:
        InputError: more elements than a sparse matrix holds.
    """
    width = np.concatenate([np.full(len(group), group.shape[1], dtype=np.int64) for group in sites])
    flat = np.concatenate([group.ravel() for group in sites])
    start, columns = np.empty(size + 1, dtype=np.int64), np.empty(int((width**2).sum()), dtype=np.int32)
    count = _joined_sites(size, len(width), width, np.cumsum(width) - width, flat, len(columns), start, columns)
    if 4 * count > MOST_ELEMENTS:
        raise InputError(f"a matrix of {size} sites has {4 * count} elements: at most {MOST_ELEMENTS}")
    data = np.zeros(4 * count)
    for group, block in zip(sites, blocks, strict=True):
        _add_blocks(*group.shape, np.ascontiguousarray(group), np.ascontiguousarray(block), start, columns, data)
    indptr, indices = np.empty(2 * size + 1, dtype=np.int32), np.empty(4 * count, dtype=np.int32)
    _coordinate_pattern(size, start, columns, indptr, indices)
    matrix = sparse.csc_array((data, indices, indptr), shape=(2 * size, 2 * size))
    matrix.has_sorted_indices = matrix.has_canonical_format = True
    return matrix
