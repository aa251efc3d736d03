"""Intervals over packings, errors of means of series, and the one confidence behind all of them."""

import inspect

import numpy as np
import pytest
from scipy import signal, stats

from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.confidence import CONFIDENCE, STANDARD_ERRORS, block_average, bootstrap, room


@pytest.mark.parametrize("packings", [5, 10, 20])  # those that figures of both papers use
def test_intervals_of_few_packings_hold_as_often_as_they_say(packings):
    """4000 ensembles at once, resampled alike; without the stretch the means of five are held 83 times in 100."""
    values = np.random.default_rng(packings).normal(size=(packings, 4000))
    found = bootstrap([values], lambda g: g[0].mean(axis=0))
    assert 0.93 <= np.mean((found.low <= 0) & (found.high >= 0)) <= 0.97


def test_the_smallest_group_says_how_far_an_interval_is_stretched():
    """Means of 4 packings beside 40 that are alike: the t interval of three degrees of freedom."""
    values = np.random.default_rng(1).normal(size=(4, 1000))
    found = bootstrap([values, np.zeros((40, 1000))], lambda g: g[0].mean(axis=0) + g[1].mean(axis=0))
    assert 0.91 <= np.mean((found.low <= 0) & (found.high >= 0)) <= 0.98


def test_too_few_packings_make_no_interval_where_more_are_asked_for():
    one = bootstrap([[3.0]], lambda g: g[0].mean())
    assert one.value == 3 and np.isnan(one.low) and np.isnan(one.high)
    four = np.arange(4.0)
    assert np.isfinite(bootstrap([four], lambda g: g[0].mean()).low)
    assert np.isnan(bootstrap([four], lambda g: g[0].mean(), least=5).low)
    assert np.isnan(bootstrap([four, np.arange(9.0)], lambda g: g[0].mean() + g[1].mean(), least=5).low)


def test_intervals_over_single_states_would_be_far_too_narrow():
    rng = np.random.default_rng(5)
    y = rng.normal(size=(24, 1)) + 0.1 * rng.normal(size=(24, 25))  # 25 states that differ little from each other
    over_packings = bootstrap([y], lambda g: g[0].mean())
    over_states = bootstrap([y.ravel()], lambda g: g[0].mean())
    assert over_states.value == pytest.approx(over_packings.value)
    # sqrt(25) = 5 times too narrow
    assert over_states.high - over_states.low < 0.3 * (over_packings.high - over_packings.low)


def test_the_interval_of_a_mean_is_two_standard_errors_wide_on_each_side():
    values = np.random.default_rng(2).normal(size=400)
    found = bootstrap([values], lambda g: g[0].mean(), resamples=2000)
    error = values.std(ddof=1) / 20
    assert found.value == values.mean()
    assert found.high - found.value == pytest.approx(1.96 * error, rel=0.1)
    assert found.value - found.low == pytest.approx(1.96 * error, rel=0.1)


def test_groups_are_drawn_apart_and_results_may_be_arrays():
    a, b = np.full(5, 1.0), np.full(9, 2.0)
    found = bootstrap([a, b], lambda g: [g[0].mean(), g[1].mean(), len(g[0])])
    assert found.value.tolist() == found.low.tolist() == found.high.tolist() == [1, 2, 5]
    assert found[1].value == 2


def test_ensembles_without_a_value_take_no_part_unless_they_are_most():
    def few(groups):
        if groups[0].max() < 4:  # the largest was not drawn
            raise ConvergenceError("no value")
        return groups[0].mean()

    found = bootstrap([np.arange(5.0)], few)
    assert found.low > 0.5 and np.isfinite(found.high)
    never = bootstrap([np.arange(9.0)], lambda g: g[0].mean() if len(np.unique(g[0])) == 9 else np.nan)
    assert never.value == 4 and np.isnan(never.low)
    with pytest.raises(ConvergenceError):  # of the ensemble itself
        bootstrap([np.zeros(5)], few)


@pytest.mark.parametrize(
    ("groups", "options"), [([], {}), ([[]], {}), ([[1.0]], {"resamples": 0}), ([[1.0]], {"level": 1})]
)
def test_impossible_samples_are_refused(groups, options):
    with pytest.raises(InputError):
        bootstrap(groups, lambda g: 0.0, **options)


def test_the_same_seed_is_used_everywhere_unless_another_is_given():
    values = np.random.default_rng(5).normal(size=12)
    first, again, other = (bootstrap([values], lambda g: g[0].mean(), **seed) for seed in ({}, {}, {"seed": 2}))
    assert (first.low, first.high) == (again.low, again.high) != (other.low, other.high)
    shifted = bootstrap([values + 5], lambda g: g[0].mean())
    assert shifted.low - first.low == pytest.approx(5) and shifted.high - first.high == pytest.approx(5)


def test_what_depends_on_a_single_packing_has_no_interval():
    """Of the difference of two means an interval would hold in half of the cases; the other mean keeps its own."""
    rng = np.random.default_rng(0)
    groups = [rng.normal(size=1), rng.normal(size=10)]
    found = bootstrap(groups, lambda g: [g[0].mean() - g[1].mean(), g[0].mean(), g[1].mean()])
    assert np.isnan(found.low[:2]).all() and np.isnan(found.high[:2]).all() and np.isfinite(found.value).all()
    assert found.low[2] < found.value[2] < found.high[2]


def test_the_error_of_a_series_that_swings_is_that_of_its_single_values():
    """Blocks of two and more have equal means: their spread, 0, would say that the mean is exact."""
    found = block_average(np.tile([1.0, 3.0], 32))
    assert found.error == pytest.approx(np.std(np.tile([1.0, 3.0], 32), ddof=1) / 8, rel=0.03)
    assert found.independent == 64


def test_the_error_of_a_slow_series_is_that_of_its_blocks():
    """Sixteen values alike in a row are one: the error is that of eight."""
    values = np.repeat([1.0, -1.0, 2.0, -2.0, -1.0, 1.0, -2.0, 2.0], 16)
    single = values[::16].std(ddof=1) / np.sqrt(8)
    student = stats.t.ppf(0.975, 7) / stats.norm.ppf(0.975)
    assert block_average(values).error >= student * single
    assert 1 < block_average(values).independent < 8


@pytest.mark.parametrize(
    ("rows", "correlation"),
    [(16, 3.0), (200, 20.0), (40, 0.1), *(pytest.param(n, 3.0, marks=pytest.mark.slow) for n in (40, 2000))],
)
def test_intervals_of_correlated_rows_hold_the_mean(rows, correlation):
    """Of autoregressive series whose mean is 0: 95 % intervals hold it in 92 to 99 %, few rows or many."""
    rng = np.random.default_rng(4)
    rho = np.exp(-1 / correlation)
    noise = rng.normal(size=(300, rows + 60 * int(np.ceil(correlation))))
    series = signal.lfilter([np.sqrt(1 - rho**2)], [1, -rho], noise, axis=1)[:, -rows:]
    found = [block_average(row) for row in series]
    held = np.mean([abs(mean.value) <= STANDARD_ERRORS * mean.error for mean in found])
    assert 0.92 <= held <= 0.995
    expected = rows * (1 - rho) / (1 + rho)
    assert np.median([mean.independent for mean in found]) == pytest.approx(expected, rel=0.5)


def test_the_drift_of_what_does_not_drift_is_one_standard_error():
    """Difference of two halves of independent values, over its own error: of many series, one in the root mean."""
    rng = np.random.default_rng(1)
    drifts = [block_average(rng.normal(size=512)).drift for _ in range(300)]
    assert 0.6 < np.sqrt(np.mean(np.square(drifts))) < 1.1
    steps = np.repeat([0.0, 1.0], 256) + rng.normal(size=512)
    assert block_average(steps).drift > 4 and not block_average(steps).steady
    assert block_average(-steps).drift == -block_average(steps).drift


def test_standard_errors_hold_a_normal_variable_so_often():
    assert stats.norm.cdf(STANDARD_ERRORS) - stats.norm.cdf(-STANDARD_ERRORS) == pytest.approx(CONFIDENCE)
    assert inspect.signature(bootstrap).parameters["level"].default == CONFIDENCE


def test_bias_and_scatter_fill_an_error():
    assert room(0.2, 0.12) == pytest.approx(0.16) and room(0.2, 0.0) == 0.2
    assert room(0.1, 0.4) == room(0.4, 0.4) == 0.2
