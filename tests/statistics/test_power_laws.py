"""Power laws, windows, finite-size limits and flow curves against data of known exponents; what must be refused."""

import numpy as np
import pytest
from scipy.special import stdtrit

from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.herschel_bulkley import herschel_bulkley
from jamlab.statistics.power_laws import fit_exponent, fit_power_law

X = np.geomspace(1e-4, 0.3, 25)


@pytest.mark.parametrize("exponent", [-0.25, 0.5, 1.7])
def test_one_free_power_law_is_recovered(exponent):
    fit = fit_power_law(X, 3.2 * X**exponent)
    assert fit.exponents == pytest.approx([exponent], rel=1e-12)
    assert fit.coefficients == pytest.approx([3.2], rel=1e-12)
    assert fit.spread < 1e-12
    assert fit_exponent(X[:3], X[:3] ** exponent) == pytest.approx(exponent) and np.isnan(fit_exponent(X[:2], X[:2]))
    assert fit(0.01) == pytest.approx(3.2 * 0.01**exponent)


def test_the_two_terms_of_table_1_are_recovered():
    y = 2.6 * X**0.5 + 4.0 * X
    assert fit_power_law(X[:2], y[:2], (0.5, 1.0)).coefficients == pytest.approx([2.6, 4.0])  # as many points as terms
    fixed = fit_power_law(X, y, (0.5, 1.0))
    assert fixed.coefficients == pytest.approx([2.6, 4.0], rel=1e-10)
    assert 0.5 < fit_power_law(X, y, low=1e-2).exponents[0] < 1.0  # a single one lies between them


def test_units_change_coefficients_only():
    rng = np.random.default_rng(3)
    y = 2.0 * X**0.5 * np.exp(0.1 * rng.normal(size=len(X)))
    a, b = fit_power_law(X, y), fit_power_law(5 * X, 7 * y)
    assert b.exponents == pytest.approx(a.exponents, rel=1e-10)
    assert b.coefficients == pytest.approx(7 * a.coefficients / 5**a.exponents, rel=1e-10)
    assert b.spread == pytest.approx(a.spread)


def test_points_outside_the_window_and_nan_take_no_part():
    y = X**0.5
    y[X > 0.1] *= 9
    y[3] = np.nan
    fit = fit_power_law(X, y, low=1e-3, high=0.1)
    assert fit.exponents == pytest.approx([0.5])
    assert 1e-3 <= fit.low < fit.high <= 0.1


@pytest.mark.parametrize(
    ("y", "options"),
    [
        (X[:-1], {}),
        (X, {"exponents": ()}),
        (X, {"exponents": (1e3,)}),
        (X, {"low": 0.29}),
        (-X, {}),
        (0 * X, {}),
        (X, {"exponents": (0.5, 0.5)}),
    ],
)
def test_impossible_fits_are_refused(y, options):
    with pytest.raises(InputError):
        fit_power_law(X, y, **options)


def test_the_spread_is_the_root_mean_square_of_the_residuals():
    y = 2.0 * X**0.5 * np.where(np.arange(len(X)) % 5, 1.01, 0.9)
    fit = fit_power_law(X, y, (0.5,))
    assert fit.spread == pytest.approx(np.sqrt(np.mean(((fit(X) - y) / fit(X)) ** 2)), rel=1e-9)


def test_points_as_many_as_terms_or_one_more():
    """Through as many points as terms the law goes exactly, and nothing tells its errors; from one more they follow."""
    y = 2.6 * X**0.5 + 4.0 * X
    exact = fit_power_law(X[[3, 20]], y[[3, 20]], (0.5, 1.0))
    assert exact.coefficients == pytest.approx([2.6, 4.0]) and np.isnan(exact.coefficients_stderr).all()
    assert np.isnan(fit_power_law(X[:2], y[:2]).exponents_stderr).all()
    one_more = fit_power_law(X[[3, 12, 20]], (y * (1 + 0.01 * np.cos(np.arange(25))))[[3, 12, 20]], (0.5, 1.0))
    assert (one_more.coefficients_stderr > 0).all() and not one_more.exponents_stderr.any()
    twice = fit_power_law([0.01, 0.01, 0.1], [0.3, 0.31, 1.0], (0.5, 1.0))  # the last point decides alone
    assert np.isnan(twice.coefficients_stderr).all() and np.isfinite(twice.coefficients).all()


SCATTERS = [("times", s) for s in (0.01, 0.2, 0.4, 0.6)] + [("plus", s) for s in (0.01, 0.1, 0.3)]
LAWS = [((0.5, 1.0), (3.6, 0.0)), ((0.5,), (3.6,)), ((0.0, 0.5), (-0.05, 2.0)), (None, (3.6, 0.5))]


def scattered(rng, kind, scatter, law, count):
    """Data around a law whose mean they keep: by a factor each, or by a part of the mean height."""
    powers, truth = law
    x, noise = np.geomspace(1e-3, 0.1, count), rng.normal(size=count)
    y = truth[0] * x ** truth[1] if powers is None else (x[:, None] ** powers) @ truth
    if kind == "times":
        return x, y * np.exp(scatter * noise - 0.5 * scatter**2)
    return x, y + scatter * np.abs(y).mean() * noise


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize(("kind", "scatter"), SCATTERS)
def test_scatter_does_not_bias_the_fit(kind, scatter, law):
    """The mean over many samples is the truth, within its standard error; and 95 % intervals hold it."""
    rng, count, samples = np.random.default_rng(7), 40, 60
    powers, truth = law
    if powers is None and (kind, scatter) == ("plus", 0.3):
        count = 160  # of fewer, one in a hundred samples is so far below zero at its lower end that no power law is
    found, held = [], []
    for _ in range(samples):
        fit = fit_power_law(*scattered(rng, kind, scatter, law, count), powers)
        fitted = [(fit.coefficients, fit.coefficients_stderr), (fit.exponents, fit.exponents_stderr)]
        values, errors = np.hstack(fitted if powers is None else fitted[:1])
        found.append(values)
        held.append(np.abs(values - truth) <= stdtrit(count - len(truth), 0.975) * errors)
    found = np.array(found)
    off = np.abs(found.mean(axis=0) - truth) / (found.std(axis=0, ddof=1) / samples**0.5)
    assert (off < 3.5).all()
    assert (np.mean(held, axis=0) > 0.8).all()


def test_zeros_and_negative_values_count():
    """Without them the law near onset comes out too high, and too flat."""
    rng = np.random.default_rng(2)
    x = np.geomspace(1e-4, 1e-2, 400)
    y = 3.6 * x**0.5 + 0.1 * rng.normal(size=400)
    y[::7] = 0.0
    y[1::7] = 7.2 * x[1::7] ** 0.5
    assert (y < 0).sum() >= 50
    fit = fit_power_law(x, y, (0.5,))
    assert fit.coefficients == pytest.approx(np.mean(y / x**0.5), rel=1e-12)  # of one term: the mean of the ratios
    assert fit.coefficients == pytest.approx([3.6], abs=3 * fit.coefficients_stderr[0])
    assert fit_power_law(x, y).exponents == pytest.approx([0.5], abs=0.15)
    assert fit_power_law(x[y > 0], y[y > 0]).exponents[0] < 0.35
    assert fit_power_law(x, -y, (0.5, 1.0)).coefficients == pytest.approx(-fit_power_law(x, y, (0.5, 1.0)).coefficients)


def test_the_free_law_has_relative_residuals_without_mean_or_slope():
    rng = np.random.default_rng(5)
    y = 2.0 * X**0.7 * rng.lognormal(0, 0.5, len(X))
    fit = fit_power_law(X, y)
    residual = y / fit(X) - 1
    assert residual.sum() == pytest.approx(0, abs=1e-10) and residual @ np.log(X) == pytest.approx(0, abs=1e-9)
    assert fit.spread == pytest.approx(np.sqrt(np.mean(residual**2)))


RATES = np.geomspace(1e-4, 1.0, 9)
LAW = 2e-3 + 0.05 * RATES**0.5


def test_points_that_scatter_by_more_than_their_errors_make_the_errors_of_the_law_larger():
    """By so much that they follow from the scatter, whatever errors the points came with."""
    stress = LAW * (1 + 0.05 * np.array([1, -1, 1, -1, 0, 1, -1, 1, -1]))
    one, other = (herschel_bulkley(RATES, stress, part * LAW) for part in (1e-3, 1e-2))
    assert one.misfit == pytest.approx(10 * other.misfit, rel=1e-4) and other.misfit > 1
    for name in ("yield_stress_stderr", "consistency_stderr", "exponent_stderr"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-3)


def test_points_that_scatter_by_less_keep_theirs():
    one, other = (herschel_bulkley(RATES, LAW, part * LAW) for part in (1e-3, 1e-2))
    assert other.exponent_stderr == pytest.approx(10 * one.exponent_stderr, rel=1e-3)


@pytest.mark.parametrize("shift", [2.1e-3, 0.2])
def test_stresses_may_be_zero_or_negative(shift):
    """As those of a packing whose residual stress was not taken off."""
    found = herschel_bulkley(RATES, LAW - shift, 1e-3 * LAW)
    assert found.yield_stress == pytest.approx(2e-3 - shift, rel=1e-3) and found.exponent == pytest.approx(0.5)


def test_a_yield_stress_within_two_errors_of_zero_is_not_resolved():
    seen, lost = (herschel_bulkley(RATES, LAW - shift, 1e-3 * LAW) for shift in (0.0, 2e-3))
    assert seen.resolved and "NOT RESOLVED" not in str(seen)
    assert not lost.resolved and "yield stress NOT RESOLVED" in str(lost)


def test_curves_that_hold_no_exponent_are_refused():
    for stress in (0.3 + 0 * RATES, 0.3 + 1e-12 * RATES, 0.3 + 0.05 * RATES**3):
        with pytest.raises((InputError, ConvergenceError)):
            herschel_bulkley(RATES, stress, 1e-3 * LAW)


def test_the_misfit_is_the_root_of_chi_squared_per_degree_of_freedom():
    stress, error = LAW * (1 + 0.01 * np.array([1, -1, 1, -1, 0, 1, -1, 1, -1])), 0.02 * LAW
    found = herschel_bulkley(RATES, stress, error)
    assert found.misfit == pytest.approx(np.sqrt(np.sum(((found(RATES) - stress) / error) ** 2) / (9 - 3)), rel=1e-6)
