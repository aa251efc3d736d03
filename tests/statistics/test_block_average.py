"""Errors of means of series: the largest of all lengths of blocks."""

import numpy as np
import pytest

from jamlab.statistics.block_average import block_average


def test_the_error_of_a_series_that_swings_is_that_of_its_single_values():
    """Blocks of two and more have equal means: their spread, 0, would say that the mean is exact."""
    found = block_average(np.tile([1.0, 3.0], 32))
    assert found.error == pytest.approx(np.std(np.tile([1.0, 3.0], 32), ddof=1) / 8)


def test_the_error_of_a_slow_series_is_that_of_its_blocks():
    """Sixteen values alike in a row are one: the error is that of eight."""
    values = np.repeat([1.0, -1.0, 2.0, -2.0, -1.0, 1.0, -2.0, 2.0], 16)
    assert block_average(values).error == pytest.approx(values[::16].std(ddof=1) / np.sqrt(8))
