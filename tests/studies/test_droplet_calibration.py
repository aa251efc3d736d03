"""Calibration of the droplets' law, on made-up sweeps whose answer is known."""

import numpy as np
import pandas as pd
import pytest

import jamlab
from studies.droplet_calibration import CENTRE, CONFLUENCE, FITTED, LAWS, TARGETS, draw_calibration, fit, read_off
from studies.ensemble_tables import EnsembleTables

BEST = {name: factor * CENTRE[name] for name, factor in zip(FITTED, (1.5, 1.2, 0.8), strict=True)}
SLOPES = {"z(0.05)": (0, 0, 0.4), "z(0.1)": (0, 0.1, 0.5), "g(0.05)": (0.08, 0, 0), "g(0.1)": (0.17, 0.02, 0.01)}


def means(best):
    """Observables linear in log2 of the parameters that meet every target at `best`."""
    rows = {}
    for label, law in LAWS.items():
        off = np.array([np.log2(law[name] / best[name]) for name in FITTED])
        rows[label] = {key: target.value + off @ SLOPES.get(key, (0.01, 0.02, 0.03)) for key, target in TARGETS.items()}
    return pd.DataFrame(rows).T


def test_observables_are_read_off_at_fixed_distances():
    rho = np.linspace(0.83, CONFLUENCE, 13)
    d = rho - 0.83
    states = pd.DataFrame({"rho": rho, "z": 4 + 10 * d, "g": 2 * d, "shape": 1.02 + 0.3 * d, "area": 1 - 0.05 * d})
    found = read_off(states)
    assert {k: v for k, v in found.items() if "(" in k} == pytest.approx(
        {"z(0.05)": 4.5, "z(0.1)": 5.0, "g(0.05)": 0.1, "g(0.1)": 0.2, "g(0.15)": 0.3}
    )
    assert found["shape"] == pytest.approx(1.068) and found["area lost"] == pytest.approx(0.008)
    assert np.isnan(read_off(states[:-1])["shape"])  # it ends before confluence
    states.loc[5, "g"] = np.nan  # unstable
    assert read_off(states)["g(0.1)"] == pytest.approx(0.2)


def test_fit_finds_the_parameters_that_meet_the_targets():
    law, predicted = fit(means(BEST))
    assert law == pytest.approx(BEST, rel=1e-3)
    assert predicted == pytest.approx([target.value for target in TARGETS.values()], abs=1e-3)
    beyond, _ = fit(means(BEST | {"gamma": 4 * CENTRE["gamma"]}))
    assert beyond["gamma"] == pytest.approx(2 * CENTRE["gamma"])  # the edge of the scan
    rows = means(BEST).rename_axis("law").reset_index().assign(seed=1)
    drawn = draw_calibration(EnsembleTables(lambda name: rows))
    assert {k: v["value"] for k, v in drawn.numbers.items()} == pytest.approx(BEST, rel=1e-3)
    with pytest.raises(jamlab.InputError):
        fit(means(BEST).drop(index="ka halved"))
