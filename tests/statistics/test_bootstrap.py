"""Intervals over packings: do they hold the truth as often as they say, and would single states do."""

import numpy as np
import pytest

from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.bootstrap import SEED, bootstrap
from jamlab.statistics.power_laws import power_law

X = np.geomspace(1e-3, 0.1, 12)


def ensemble(seed, packings=24):
    """(packings, states) of y = 3 x^0.5: every packing has its own exponent, so its states err together."""
    rng = np.random.default_rng(seed)
    own = 0.1 * rng.normal(size=(packings, 1))
    return 3 * X ** (0.5 + own) * np.exp(0.02 * rng.normal(size=(packings, len(X))))


def exponent(groups):
    return power_law(X, np.exp(np.log(groups[0]).mean(axis=0))).exponents[0]


@pytest.mark.slow
def test_intervals_over_packings_hold_the_exponent_as_often_as_they_say():
    held = 0
    trials = 100
    for trial in range(trials):
        found = bootstrap([ensemble(trial)], exponent, resamples=120, seed=trial)
        held += found.low <= 0.5 <= found.high
    assert 0.88 * trials <= held  # 0.95 less three standard errors of 100 trials


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


def test_packings_that_shift_together_shift_the_interval():
    values = np.random.default_rng(4).normal(size=30)
    a = bootstrap([values], lambda g: g[0].mean())
    b = bootstrap([values + 5], lambda g: g[0].mean())
    assert b.low - a.low == pytest.approx(5) and b.high - a.high == pytest.approx(5)


def test_one_packing_has_no_interval():
    found = bootstrap([[3.0]], lambda g: g[0].mean())
    assert found.value == 3 and np.isnan(found.low) and np.isnan(found.high)


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
    ("groups", "options", "message"),
    [
        ([], {}, "empty"),
        ([[]], {}, "empty"),
        ([[1.0]], {"resamples": 0}, "resamples"),
        ([[1.0]], {"level": 1}, "level"),
    ],
)
def test_impossible_samples_are_refused(groups, options, message):
    with pytest.raises(InputError, match=message):
        bootstrap(groups, lambda g: 0.0, **options)


def test_the_same_seed_is_used_everywhere_unless_another_is_given():
    values = np.random.default_rng(5).normal(size=12)
    first, again, other = (bootstrap([values], lambda g: g[0].mean(), **seed) for seed in ({}, {}, {"seed": SEED + 1}))
    assert (first.low, first.high) == (again.low, again.high) != (other.low, other.high)


def test_what_depends_on_a_single_packing_has_no_interval():
    """Of the difference of two means an interval would hold in half of the cases; the other mean keeps its own."""
    rng = np.random.default_rng(0)
    groups = [rng.normal(size=1), rng.normal(size=10)]
    found = bootstrap(groups, lambda g: [g[0].mean() - g[1].mean(), g[0].mean(), g[1].mean()])
    assert np.isnan(found.low[:2]).all() and np.isnan(found.high[:2]).all() and np.isfinite(found.value).all()
    assert found.low[2] < found.value[2] < found.high[2]
