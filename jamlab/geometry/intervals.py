"""Unions of intervals, many groups of them at a time."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def sweep_intervals(group: Indices, start: Array, end: Array) -> tuple[Indices, Indices]:
    """Sort intervals and find how far those up to each one reach; a gap follows where the next one starts beyond.

    Args:
        group: (k,) intervals of different groups do not see each other.
        start, end: (k,) from where to where.

    Returns:
        (k,) rows sorted by group, then start; and (k,) rows of the interval of the same group that ends last among
        those up to here, of equal ends the latest in that order.
    """
    order = np.lexsort((start, group))
    by_end = np.lexsort((end[order], group[order]))
    rank = np.empty(len(order), dtype=np.int64)
    rank[by_end] = np.arange(len(order))
    return order, order[by_end[np.maximum.accumulate(rank)]]
