"""Distributions of sizes: maximum likelihood against closed forms, quadrature and samples whose law is known."""

import numpy as np
import pytest
from scipy.integrate import quad

import jamlab
from jamlab.statistics.size_distribution import SizeLaw, fit_sizes


def sample(count, exponent, cutoff, seed):
    """Sizes above 1, by rejection."""
    rng, found = np.random.default_rng(seed), np.zeros(0)
    steep = max(exponent, 1.1)
    while len(found) < count:
        s = (1 - rng.random(count)) ** (-1 / (steep - 1))
        keep = rng.random(count) < np.exp(-(s - 1) / cutoff) * s ** (steep - exponent) / cutoff ** (steep - exponent)
        found = np.append(found, s[keep])
    return found[:count]


def test_a_power_law_has_the_closed_form():
    s = 3.0 * (1 - np.random.default_rng(1).random(400)) ** (-1 / 0.7)
    law = fit_sizes(s, 3.0, truncated=False)
    assert law.exponent == pytest.approx(1 + 400 / np.log(s / 3.0).sum(), rel=1e-12) and law.cutoff == np.inf
    assert law.exponent == pytest.approx(1.7, abs=0.12) and law.count == 400
    cumulative = 1 - (s / 3.0) ** (1 - law.exponent)
    order = np.sort(cumulative)
    steps = np.arange(401) / 400
    assert law.distance == pytest.approx(max(abs(order - steps[1:]).max(), abs(order - steps[:-1]).max()), rel=1e-9)


@pytest.mark.parametrize(("exponent", "cutoff"), [(1.5, 100.0), (1.25, 1e3), (0.8, 30.0)])
def test_a_law_that_is_cut_off_matches_its_means(exponent, cutoff):
    """Which is where the likelihood is largest, by quadrature; exponent and cutoff are those of the sample."""
    s = sample(2000, exponent, cutoff, 2)
    law = fit_sizes(s, 1.0)
    t, b = law.exponent, 1 / law.cutoff

    def mean(weight):
        return quad(lambda u: weight(np.exp(u)) * np.exp((1 - t) * u - b * np.exp(u)), 0, 12, limit=400)[0]

    whole = mean(lambda x: 1.0)
    assert mean(np.log) / whole == pytest.approx(np.log(s).mean(), rel=1e-7)
    assert mean(lambda x: x) / whole == pytest.approx(s.mean(), rel=1e-7)
    assert t == pytest.approx(exponent, abs=0.12) and law.cutoff == pytest.approx(cutoff, rel=0.3)
    part = quad(lambda u: np.exp((1 - t) * u - b * np.exp(u)), np.log(5.0), 12, limit=400)[0]
    assert law.beyond([5.0])[0] == pytest.approx(part / whole, rel=1e-6)


def test_the_unit_of_sizes_does_not_matter():
    s = sample(300, 1.3, 50.0, 3)
    one, other = fit_sizes(s), fit_sizes(1e-7 * s)
    assert other.exponent == pytest.approx(one.exponent, rel=1e-9)
    assert other.cutoff == pytest.approx(1e-7 * one.cutoff, rel=1e-7) and other.least == pytest.approx(1e-7 * one.least)


def test_the_least_size_leaves_out_what_is_no_power_law():
    """Sizes below 1 are spread evenly."""
    s = np.append(np.random.default_rng(4).random(300), sample(600, 1.8, 1e9, 5))
    law = fit_sizes(s, truncated=False)
    assert 0.8 < law.least < 1.6 and law.exponent == pytest.approx(1.8, abs=0.15)
    assert fit_sizes(s, s.min(), truncated=False).distance > 3 * law.distance


@pytest.mark.parametrize(
    ("sizes", "how", "words"),
    [
        ([1.0, 2.0], {}, "2 sizes"),
        ([0.0] * 20, {}, "0 is not positive"),
        ([-1.0, *range(1, 20)], {}, "-1 is not positive"),
        ([2.0] * 20, {}, "all 20 sizes are 2"),
        (list(range(1, 30)), {"least_size": 25.0}, "5 sizes from 25 on"),
        (list(range(1, 30)), {"least_size": -1.0}, "least_size = -1.0"),
        ([float("nan")] * 20, {}, "sizes"),
        ([[1.0, 2.0]], {}, "sizes"),
    ],
)
def test_sizes_without_a_law_are_refused(sizes, how, words):
    with pytest.raises(jamlab.InputError, match=words):
        fit_sizes(sizes, **how)


def test_a_law_is_one_at_its_least_size():
    assert SizeLaw(1.5, 10.0, 2.0, 9, 0.0).beyond([1.0, 2.0]).tolist() == [1.0, 1.0]
