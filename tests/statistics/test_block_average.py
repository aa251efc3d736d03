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


def test_the_drift_of_what_does_not_drift_is_one_standard_error():
    """Difference of two halves of independent values, over its own error: of many series, one in the root mean."""
    rng = np.random.default_rng(1)
    drifts = [block_average(rng.normal(size=512)).drift for _ in range(300)]
    assert 0.6 < np.sqrt(np.mean(np.square(drifts))) < 1.1
    steps = np.repeat([0.0, 1.0], 256) + rng.normal(size=512)
    assert block_average(steps).drift > 4 and not block_average(steps).steady
    assert block_average(-steps).drift == -block_average(steps).drift


def test_values_that_fill_no_block_are_those_of_the_start():
    """What is left over stands nearest to start-up: an outlier there widens single values only."""
    calm = np.repeat([1.0, -1.0, 2.0, -2.0, -1.0, 1.0, -2.0, 2.0], 16)
    blocks = block_average(calm).error
    assert block_average(np.concatenate([[4.0], calm])).error == pytest.approx(blocks)
    assert block_average(np.concatenate([calm, [4.0]])).error != pytest.approx(blocks, rel=1e-3)
