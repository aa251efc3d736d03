"""Means of steady flow against correlated series with a known error, and against the rows of a run."""

from dataclasses import fields, replace

import numpy as np
import pytest

import jamlab
from jamlab.statistics.confidence import STANDARD_ERRORS

ROWS, MEMORY = 600, 0.8  # rows of a series, and how much of a row is left in the next
STRESS, PRESSURE = 0.02, 0.1


@pytest.fixture(scope="module")
def run():
    return jamlab.quasistatic_shear(jamlab.pack(n=16, pressure=1e-2, seed=1), 0.3, strain_step=5e-3)


def series(run, **values):
    """The run with rows of other values, evenly spaced up to a strain of 3."""
    arrays = {
        each.name: np.zeros(ROWS) for each in fields(run) if np.shape(getattr(run, each.name)) == run.strain.shape
    }
    arrays |= {"event": np.zeros(ROWS, bool), "converged": np.ones(ROWS, bool), "area": np.ones(ROWS)}
    return replace(run, **arrays | {"strain": np.linspace(0, 3, ROWS)} | values)


def correlated(rng):
    """Values of variance 1, each like its neighbour: the mean has the variance (1 + a)/(1 - a)/m."""
    found, noise = np.empty(ROWS), rng.normal(size=ROWS)
    found[0] = noise[0]
    for k in range(1, ROWS):
        found[k] = MEMORY * found[k - 1] + np.sqrt(1 - MEMORY**2) * noise[k]
    return found


def test_errors_are_those_of_correlated_series(run):
    """Of stress, pressure and their ratio: intervals of 95 % hold the truth, and are no wider than they need be."""
    rng, hits, errors = np.random.default_rng(1), [], []
    for _ in range(60):
        stress, pressure = (mean * (1 + 0.1 * correlated(rng)) for mean in (STRESS, PRESSURE))
        found = series(run, stress=stress, pressure=pressure).steady(discard=1.0)
        truth = {"stress": STRESS, "pressure": PRESSURE, "mu": STRESS / PRESSURE}
        told = {name: getattr(found, f"{name}_stderr") for name in truth}
        hits.append([abs(getattr(found, name) - truth[name]) < STANDARD_ERRORS * told[name] for name in truth])
        errors.append([told[name] / truth[name] for name in truth])
    kept = np.sum(np.linspace(0, 3, ROWS) >= 1.0) - 1
    known = 0.1 * np.sqrt((1 + MEMORY) / (1 - MEMORY) / kept) * np.array([1, 1, np.sqrt(2)])
    assert np.all(np.mean(hits, axis=0) > 0.9)
    assert np.all(np.mean(errors, axis=0) > known) and np.all(np.mean(errors, axis=0) < 1.6 * known)


def test_a_ratio_that_does_not_scatter_has_no_error(run):
    """Stress and pressure that rise and fall together."""
    pressure = PRESSURE * (1 + 0.1 * correlated(np.random.default_rng(2)))
    found = series(run, stress=0.2 * pressure, pressure=pressure).steady(discard=1.0)
    assert found.mu == pytest.approx(0.2) and found.mu_stderr < 1e-12 < found.stress_stderr
    assert np.isnan(series(run, stress=pressure).steady().mu)  # no pressure


def test_means_are_those_of_the_rows(run):
    mean, kept = run.steady(discard=0.1), run.strain >= 0.1 - 1e-9
    for name in ("stress", "pressure", "normal_stress_difference", "z_all", "energy"):
        assert getattr(mean, name) == pytest.approx(getattr(run, name)[kept][1:].mean(), rel=1e-12)
    assert mean.mu == pytest.approx(mean.stress / mean.pressure) and mean.strain == pytest.approx(0.2)
    drops = run.drops.size[run.drops.strain >= 0.1]
    assert len(drops) and mean.plastic_events == pytest.approx(len(drops) / 0.2)
    assert mean.stress_drop == pytest.approx(drops.mean())
    table = mean.to_dataframe().set_index("quantity")
    assert table.loc["mu", "mean"] == mean.mu and table.loc["pressure", "stderr"] == mean.pressure_stderr


def test_shear_the_other_way_has_the_same_means_but_for_the_sign(run):
    back = replace(run, strain=-run.strain, stress=-run.stress, elastic_stress=-run.elastic_stress)
    mean, other = run.steady(0.1), back.steady(0.1)
    assert (other.stress, other.stress_stderr, other.mu) == pytest.approx((-mean.stress, mean.stress_stderr, -mean.mu))
    assert (other.plastic_events, other.stress_drop) == pytest.approx((mean.plastic_events, mean.stress_drop))


def test_too_few_rows_are_refused(run):
    with pytest.raises(jamlab.InputError, match=r"only 1[0-9] rows lie beyond strain 0\.25"):
        run.steady(discard=0.25)
    with pytest.raises(jamlab.InputError, match=r"only 0 rows.*: shear to more than 5, or discard less than 0\.3$"):
        run.steady(discard=5.0)
