"""Means of flow curves over packings against plain numpy, and what has no common mean."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from one_of_each import RATES, flow_curve

import jamlab

MEANS = ("stress", "elastic_stress", "pressure", "normal_stress_difference", "z_all")


@pytest.fixture(scope="module")
def curves():
    """Four packings, whose stresses scatter by 5 %."""
    rng, found = np.random.default_rng(1), []
    for seed in (1, 2, 3, 4):
        packing = jamlab.pack(8, 2e-2, seed=seed)
        run = jamlab.shear(packing, 0.1, 1e-3, rows=2)
        curve = flow_curve(packing, run)
        values = {name: getattr(curve, name) * (1 + 0.05 * rng.normal(size=len(RATES))) for name in MEANS}
        found.append(replace(curve, drift=np.zeros(len(RATES)), **values))
    return found


@pytest.fixture
def rows(curves):
    """The same as a campaign has them."""
    parts = []
    for seed, curve in enumerate(curves):
        who = {"task": f"t{seed}", "model": "sp", "n": 8, "seed": seed, "ensemble": "fixed-box", "state": 0}
        who |= {"phi": 0.86 + 1e-4 * seed, "target_pressure": 2e-2, "damping": "contact", "beta": 1.0, "eta_f": np.nan}
        found = {"rate": curve.rate, "converged": curve.finished}
        for name in MEANS:
            column = "flow_pressure" if name == "pressure" else name
            found |= {column: getattr(curve, name), f"{column}_stderr": getattr(curve, f"{name}_stderr")}
        parts.append(pd.DataFrame(who | found))
    return pd.concat(parts[::-1])


def test_means_and_errors_are_those_over_packings(curves):
    found = jamlab.mean_flow_curve(curves)
    assert found.rate.tolist() == RATES.tolist() and found.packings.tolist() == [4] * len(RATES)
    for name in MEANS:
        values = np.array([getattr(curve, name) for curve in curves])
        assert getattr(found, name) == pytest.approx(values.mean(axis=0), rel=1e-12)
        error = np.sqrt(((values - values.mean(axis=0)) ** 2).sum(axis=0) / 3 / 4)
        assert getattr(found, f"{name}_stderr") == pytest.approx(error, rel=1e-9)
        assert np.all(getattr(found, f"{name}_low") < getattr(found, name))
        assert np.all(getattr(found, name) < getattr(found, f"{name}_high"))
    one = jamlab.mean_flow_curve(curves[:1])
    assert np.array_equal(one.stress_stderr, curves[0].stress_stderr) and np.isnan(one.stress_low).all()


def test_a_table_has_the_means_of_its_curves(curves, rows):
    by_hand, found = jamlab.mean_flow_curve(curves), jamlab.mean_flow_curve(rows)
    for name in MEANS:
        assert getattr(found, name) == pytest.approx(getattr(by_hand, name), rel=1e-14)
        assert getattr(found, f"{name}_stderr") == pytest.approx(getattr(by_hand, f"{name}_stderr"), rel=1e-9)
    assert found.packings.tolist() == by_hand.packings.tolist()
    assert "contact" in found.plot().get_legend().get_texts()[0].get_text()


def test_the_law_is_found_and_no_lucky_rate_decides_it(curves):
    """sigma = 0.01 + 0.1 rate^(1/2), within three standard errors; one rate where packings agree by chance."""
    found = jamlab.mean_flow_curve(curves)
    lucky = replace(found, stress_stderr=np.where(RATES == RATES[1], 1e-9, found.stress_stderr))
    for mean in (found, lucky):
        fit = mean.herschel_bulkley()
        assert abs(fit.yield_stress - 0.01) < 3 * fit.yield_stress_stderr
        assert abs(fit.exponent - 0.5) < 3 * fit.exponent_stderr
        assert np.all(fit.stress_stderr > 0.01 * fit.stress)


def test_flows_that_are_not_steady_are_left_out(curves, rows):
    drifting = replace(curves[1], drift=np.where(RATES == RATES[2], 9.0, 0.0))
    with pytest.warns(jamlab.JamlabWarning, match=r"1 of 16 flows.*1 at rate 0\.1"):
        found = jamlab.mean_flow_curve([curves[0], drifting, *curves[2:]])
    assert found.packings.tolist() == [4, 4, 3, 4]
    off = (rows.seed == 1) & (rows.rate == RATES[2])
    with pytest.warns(jamlab.JamlabWarning, match="left out"):
        table = jamlab.mean_flow_curve(rows.assign(converged=~off, stress=rows.stress.where(~off)))
    assert table.stress == pytest.approx(found.stress, rel=1e-14)
    with pytest.warns(jamlab.JamlabWarning), pytest.raises(jamlab.InputError, match="no flow is steady"):
        jamlab.mean_flow_curve(rows.assign(converged=False))


@pytest.mark.parametrize(
    ("change", "chosen"),
    [
        ({"damping": "stokes", "beta": np.nan, "eta_f": 1.0}, {"damping": "contact"}),
        ({"target_pressure": 1e-2, "state": 1}, {"target_pressure": 2e-2}),
        ({"target_pressure": np.nan, "phi": 0.9, "state": 1}, {"state": 0}),
        ({"n": 16}, {"n": 8}),
    ],
)
def test_kinds_of_flows_are_chosen_by_name(rows, change, chosen):
    both = pd.concat([rows, rows.assign(task="other" if "n" in change else rows.task, **change)])
    with pytest.raises(jamlab.InputError, match=r"several kinds: .*select="):
        jamlab.mean_flow_curve(both)
    assert jamlab.mean_flow_curve(both, select=chosen).packings.tolist() == [4] * len(RATES)


def test_impossible_means_are_refused(curves, rows):
    other = replace(curves[1], damping=jamlab.StokesDrag())
    dense = replace(curves[1], frames=(jamlab.pack(8, 4e-2, seed=1),) * 5)
    for wrong, named in (([], "one or more"), ([curves[0], other], "damping"), ([curves[0], dense], "2 kinds")):
        with pytest.raises(jamlab.InputError, match=named):
            jamlab.mean_flow_curve(wrong)
    again = pd.concat([rows, rows.assign(task="of another sweep")])
    for table, named in (
        (again, "seed 0 has 2 tasks"),
        (pd.concat([rows, rows]), "twice"),
        (rows.drop(columns="z_all"), "no column 'z_all'"),
    ):
        with pytest.raises(jamlab.InputError, match=named):
            jamlab.mean_flow_curve(table)
    with pytest.raises(jamlab.InputError, match="select"):
        jamlab.mean_flow_curve(curves, select={"n": 8})


def test_a_packing_counts_once_at_each_rate(curves):
    with pytest.raises(jamlab.InputError, match=r"curves\[0\] and curves\[4\] are of the same packing"):
        jamlab.mean_flow_curve([*curves, curves[0]])
