"""Controls of estimators: they find what was put in, and fail where an estimator is blind."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_figures import tables

from jamlab.errors import InputError
from studies.papers import verdicts
from studies.papers.boromand.conventions import SIZES, table_fit
from studies.papers.controls import control, laws, stated
from studies.papers.controls.passed import Control, control_of, controls, failed
from studies.papers.statements import Measured, find, keywords, paper, statements
from studies.papers.verdicts import withdraw
from studies.reference_data import open_tables
from studies.tables import DATA

PLANS = {(plan.id, plan.way): plan for plan in control.plans()}
EXACT = 1e-3  # of the number: ends of windows and lines between places


def put_in(name, way, **changed):
    """Put a law in, and measure it with other settings of the estimator."""
    s, plan = statements()[name], PLANS[name, way]
    given = keywords(plan.settings)
    value = given.pop("expected", s.value)
    made = getattr(stated, way)(tables(), s, stated=given.pop("stated", value), **given)
    settings = ", ".join(f"{key}={v}" for key, v in (keywords(s.settings) | changed).items())
    return control.judge(plan, *control.repeat(replace(s, settings=settings), made, control.tolerance(s, value)))


def test_every_number_that_is_tested_has_a_control_or_a_reason():
    assert control.uncontrolled() == []
    assert {plan.id for plan in control.plans()} <= set(statements())
    assert len(PLANS) == len(control.plans())  # no control twice
    assert all(plan.reason for plan in control.plans())
    ids = [plan.id for plan in control.plans()]
    assert all(ids.count(plan.id) == 1 for plan in control.plans() if not plan.way)


def test_the_table_that_ships_holds_all_controls():
    shipped = {(c.id, c.control): c for rows in controls().values() for c in rows}
    assert set(shipped) == {key for key, plan in PLANS.items() if plan.way}
    for key, c in shipped.items():
        assert c.stated == pytest.approx(PLANS[key].expected, rel=1e-5) and c.law == PLANS[key].reason
        assert c.tolerance == pytest.approx(control.tolerance(statements()[c.id], c.stated), rel=1e-5)
        unsure = 0.0 if c.control == control.DISKS else 1.645 * c.error
        assert c.passes == (abs(c.recovered - c.stated) + unsure <= c.tolerance)


@pytest.mark.parametrize(
    "name",
    [
        *("B4-C", "B4-lambda", "B6-alpha0", "B6-a", "B10-theta-sp", "B10-onset-dp", "B11-kappa", "B11-omega-small-dp"),
        *("BT-z0-dp", "BT-G1-sp-rho", "T4-beta-star", "T5-approach", "T5-mean-sliding"),
        *("T7-length-stokes", "T8-a-contact", "T8-tail-stokes"),
    ],
)
def test_a_law_that_an_estimator_can_see_is_recovered(name):
    """All packings drawn once have the law as their mean: the number is exact, whatever our packings say."""
    plan = next(plan for plan in control.plans() if plan.id == name and plan.way)
    found = control.run(plan, tables())
    size = abs(found.stated) or 1.0
    assert found.passes and found.plain == pytest.approx(found.stated, abs=max(20 * EXACT * size, 1e-9))


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("B6-z-nearest-sp", {"beyond": 1e-3, "places": "ROOT"}),  # beyond N^-2 the exponent is 0.5
        ("B11-zeta-large", {"low": 0.01}),  # two decades, of which the law holds over 0.7
        ("B11-omega-large-sp", {"low": 0.001}),
        ("T3-Delta-loss", {"low": 1e-8, "high": 1e-6}),  # slow: G'' is linear
    ],
)
def test_a_wrong_window_fails(name, changed):
    way = next(plan.way for plan in control.plans() if plan.id == name)
    assert put_in(name, way).passes
    wrong = put_in(name, way, **changed)
    assert not wrong.passes and abs(wrong.plain - wrong.stated) > wrong.tolerance


def test_noise_alone_can_fail():
    """Right on average, but a bias as large as the tolerance is not excluded; most repeats without a value."""
    plan = PLANS["B11-kappa", "in_states"]
    rng = np.random.default_rng(1)
    exact = 0.75 + 0.075 * rng.normal(size=10_000)
    assert control.judge(plan, 0.75, exact).passes
    assert not control.judge(plan, 0.75, 0.75 + np.array([-1.0, 1.0]) * 0.2).passes
    assert not control.judge(plan, 0.75, np.where(np.arange(40) < 30, np.nan, 0.75)).passes
    found = control.judge(plan, 0.75, exact)
    assert found.error == pytest.approx(found.scatter / 100)


def test_disks_are_one_sample():
    """Repeats of the same disks do not make their error smaller, and the value is ours."""
    plan = PLANS["B6-z-root-dp", control.DISKS]
    found = control.judge(plan, 0.6, np.random.default_rng(1).normal(0.61, 0.02, size=1000))
    assert found.recovered == 0.6 and found.error == pytest.approx(0.02, rel=0.1) and not found.passes
    assert control.judge(plan, 0.54, np.full(40, 0.54)).passes


def test_packings_keep_their_scatter_and_their_places():
    """The mean is the law; one packing lies above the mean wherever ours does."""
    s = statements()["BT-z0-sp-phi"]
    made = stated.in_states(tables(), s, "table", stated=s.value)
    new, old = (find(s.sample)(t, "SP(φ)", "z").groups[0] for t in (made, tables()))
    assert new.shape == old.shape
    off, before = (values - values.mean(axis=0) for values in (new, old))
    known = np.abs(before) > 1e-3 * np.abs(old.mean(axis=0))
    assert known.sum() > 20 and (np.sign(off[known]) == np.sign(before[known])).all()


@pytest.mark.parametrize("n", SIZES)
def test_finite_packings_follow_the_table_beyond_the_crossover(n):
    star = n**-2.0
    for column, power in (("z", 1.0), ("G", 0.0)):
        law, fit = laws.finite_size(1.0, float, "d_rho", column), table_fit("DP(ρ)", column)
        far, near = np.array([1.5, 3.0, 100.0]) * star, np.array([0.01, 0.1, 0.99]) * star
        assert law(far, n, "dp") == pytest.approx(fit(far))
        assert np.diff(np.log(law(near, n, "dp"))) == pytest.approx(power * np.diff(np.log(near)), abs=1e-12)
        assert law(star * (1 - 1e-12), n, "dp") == pytest.approx(law(star, n, "dp"))


def test_laws_by_hand():
    """Eq 11 with C = 1.21 at dphi = 0.0625: 0.0625 - 1.21 (0.0625 - 0.015625)."""
    shared = 0.0625 - 1.21 * 0.046875
    assert laws.area(0, float)(np.array([0.0625]), 32, "sp") == pytest.approx(shared)
    assert laws.area_by_phi(0, float)(np.array([0.8, 0.9025]), 32, "sp") == pytest.approx([0, shared])
    lost = 1 - (0.84 + 1.21 * 0.046875) / 0.9025
    assert laws.lost_area(0, float)(np.array([1.21 * 0.046875]), 32, "sp") == pytest.approx([lost], abs=1e-6)
    rho = np.array([0.80, 0.85])
    assert laws.table_by_rho(0, float)(rho, 32, "dp") == pytest.approx([0, 3.3 * 0.015**0.5 + 7.1 * 0.015])
    end = laws.table_to_confluence(0.98, float)(np.array([0.14 - 1e-9, 0.14 + 1e-9, 0.16]), 32, "sp")
    assert end == pytest.approx([2.6 * 0.14**0.5 + 4 * 0.14] * 2 + [2.03], abs=1e-6)
    line = laws.confluence(1, lambda x: 5 * x, at=0.03)(np.array([0.0, 0.1]), 64, "dp")
    assert line == pytest.approx([2 / 64, 2 / 64 + 0.5])
    both = laws.two_powers(2.5, lambda x: 8.0, before=1.5, end=0.1, decades=1.0)(np.array([0.001, 0.01, 0.1]), 32, "sp")
    assert both == pytest.approx([8 * 10**-4.0, 8 * 10**-2.5, 8.0])


def test_a_failed_control_is_told():
    short = [c for rows in controls().values() for c in rows if not c.passes]
    assert short and all(failed(c.id) for c in short)
    assert failed("B11-kappa") == "" and control_of("B8-P3-sp") == () and failed("B8-P3-sp") == ""
    parts = failed("B5-z-parts")
    assert "0.84 for 0.88" in parts and "table 1" in parts


def test_a_number_whose_estimator_fails_has_no_verdict():
    """It is no test, whatever it comes to; without data there is nothing to take back."""
    blind, seen = statements()["B5-z-parts"], statements()["B11-kappa"]
    ours = Measured(0.88, 0.879, 0.881)
    found = withdraw(verdicts.judge(blind, ours))
    assert verdicts.judge(blind, ours).verdict == "agrees" and found.verdict == "no verdict" and not blind.tested
    assert found.explanation == failed("B5-z-parts") and "0.84 for 0.88" in found.explanation
    assert withdraw(verdicts.judge(blind, Measured())).verdict == "no data"
    kept = verdicts.judge(seen, Measured(0.75, 0.749, 0.751))
    assert withdraw(kept) == kept and kept.verdict == "agrees" and seen.tested


def test_a_number_without_a_control_is_refused(tmp_path):
    with pytest.raises(InputError, match="B8-P3-sp"):
        control.write_controls(tmp_path, tables(), ["B8-P3-sp"])


def test_controls_are_the_same_again(tmp_path):
    """Those of our packings that take least, as they ship; the seed is that of the number."""
    names = ["B10-theta-sp", "B10-onset-dp"]
    ours = open_tables(DATA)
    path = control.write_controls(tmp_path, ours, names)
    again = controls(path.parent)
    for name in names:
        for new, old in zip(again[name], control_of(name), strict=True):
            assert isinstance(new, Control) and new.recovered == pytest.approx(old.recovered, rel=1e-4)
            assert new.error == pytest.approx(old.error, rel=0.02)
    assert paper("B10-theta-sp") == again["B10-theta-sp"][0].stated
