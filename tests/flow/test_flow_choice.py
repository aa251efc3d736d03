"""The least model of a flow: what is promised, what is chosen, and whether a run agrees."""

import numpy as np
import pandas as pd
import pytest

import jamlab
from jamlab.estimates.flow_choice import MOST_STRAIN, RUN_ERROR
from jamlab.estimates.flow_errors import (
    BACKGROUND,
    CHECK,
    COLUMNS,
    MANY,
    SIZE,
    SLIDING,
    SLIDING_BETAS,
    SLIDING_CHECK,
    exceeded_by_few,
    kept_promises,
    measured_range,
    promised_error,
    read_errors,
    rearranging_error,
    relative_amplitude,
    scatter_of_flow,
    sliding_factor,
)
from jamlab.estimates.inertia import inertia_error
from jamlab.rheology.nonlinear_drag import modulus_at_strain
from jamlab.statistics.confidence import STANDARD_ERRORS
from jamlab.studies.least_model import flow_errors as measurement

FILM = jamlab.ContactDamping(alpha=0.5)


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=64, pressure=1e-2, seed=1)


def test_small_strains_need_the_linear_spectrum_and_a_run_agrees(packing):
    choice = jamlab.choose_flow(packing, omega=1.0, amplitude=1e-4, tolerance=0.05)
    assert choice.way == "linear spectrum" and choice.strain == 0 and "contact" not in choice.warning
    run = jamlab.oscillate(packing, 1.0, 1e-4, cycles=3, tolerance=5e-3)
    true = complex(run.storage, run.loss)
    assert abs(choice.modulus - true) <= choice.error * abs(true)
    assert choice.others["static modulus"] > 0.05 and "Stokes drag instead would change G*" in choice.why


def test_infinitely_slow_shear_needs_no_drag_law(packing):
    choice = jamlab.choose_flow(packing, omega=1e-8)
    assert choice.way == "static modulus" and "Stokes or contact" in choice.why
    assert choice.modulus.real == pytest.approx(jamlab.complex_modulus(packing, [1.0]).g0)


def test_large_strains_and_slow_films_need_a_run(packing):
    large = jamlab.choose_flow(packing, omega=1.0, amplitude=0.1)
    slow = jamlab.choose_flow(packing, FILM, omega=1e-8, amplitude=1e-3)
    for choice in (large, slow):
        assert (
            choice.way == "oscillation" and choice.modulus is None and not np.isfinite(choice.others["linear spectrum"])
        )
        assert choice.call.startswith("jamlab.oscillate(p, ") and choice.strain > 0


def test_films_that_move_fast_need_equivalent_damping(packing):
    """Its call gives the modulus that the choice carries."""
    choice = jamlab.choose_flow(packing, jamlab.ContactDamping(alpha=0.9), omega=3.0, amplitude=1e-4, tolerance=0.2)
    assert choice.way == "equivalent damping" and choice.others["linear spectrum"] > 0.2
    found = eval(choice.call, {"jamlab": jamlab, "p": packing})
    assert complex(found.storage[0], found.loss[0]) == pytest.approx(choice.modulus, rel=2e-3)


def test_steady_flow(packing):
    """Half the 95 % interval of the average, over more strain or more disks, fills what the run itself leaves."""
    fast, slow = (jamlab.choose_flow(packing, rate=1e-2, tolerance=t) for t in (0.2, 0.02))
    assert fast.way == slow.way == "flow" and slow.call.startswith("jamlab.flow_curve(p, [0.01]")
    wide = jamlab.choose_flow(jamlab.pack(n=128, pressure=1e-2, seed=1), rate=1e-2, tolerance=0.02)
    for choice, n in ((fast, 64), (slow, 64), (wide, 128)):
        noise = STANDARD_ERRORS * scatter_of_flow() * np.sqrt(SIZE / n / (choice.strain - 1))
        assert choice.error == pytest.approx(np.hypot(RUN_ERROR, noise))
    assert 0.99 * 0.2 < fast.error <= 0.2 and 0.99 * 0.02 < slow.error <= 0.02 and 0.99 * 0.02 < wide.error <= 0.02


def test_linear_flow_shares_its_tolerance_with_its_average(packing):
    """Else its error and that of the average, each as large as allowed, would add up to more."""
    film = jamlab.choose_flow(packing, FILM, rate=1e-3, tolerance=0.3)
    assert film.way == "linear flow" and film.damping == jamlab.ContactDamping()
    assert "jamlab.flow_curve(p, [0.03162], jamlab.ContactDamping()" in film.call
    model = promised_error("flow", 0.5, 1e-3**0.5, 1.0)
    for tolerance in (0.3, 1.05 * model):
        choice = jamlab.choose_flow(packing, FILM, rate=1e-3, tolerance=tolerance)
        noise = STANDARD_ERRORS * scatter_of_flow() / np.sqrt(choice.strain - 1)
        assert choice.way == "linear flow" and choice.error == pytest.approx(np.hypot(model, noise))
        assert choice.error <= tolerance and choice.others[choice.way] == choice.error
    refused = jamlab.choose_flow(packing, FILM, rate=1e-3, tolerance=0.9 * model)
    assert refused.way == "flow" and refused.others["linear flow"] > model and refused.error <= 0.9 * model


def test_no_average_longer_than_any_run(packing):
    """Neither way is offered: near its own error nothing is left for the average."""
    with pytest.raises(jamlab.InputError, match="64 particles sheared by 1000 err by 1"):
        jamlab.choose_flow(packing, rate=1e-2, tolerance=RUN_ERROR * 1.1)
    model = promised_error("flow", 0.5, 1e-3**0.5, 1.0)
    near = jamlab.choose_flow(packing, FILM, rate=1e-3, tolerance=model * (1 + 1e-6))
    assert near.way == "flow" and near.others["linear flow"] > model * (1 + 1e-6) and near.strain <= MOST_STRAIN


def test_steady_flow_runs_as_its_errors_were_measured(packing):
    """Under the background drag of the table; Stokes drag is one itself."""
    film = jamlab.choose_flow(packing, FILM, rate=1e-3, tolerance=0.3)
    curve = eval(film.call, {"jamlab": jamlab, "p": packing})
    assert curve.background == measurement._FLOW["background"] == BACKGROUND
    assert curve.strain + curve.discard == pytest.approx(film.strain)
    assert f"background drag of {BACKGROUND:g}" in film.why
    stokes = jamlab.choose_flow(packing, jamlab.StokesDrag(), rate=1e-2, tolerance=0.2)
    assert "background" not in stokes.call + stokes.why


@pytest.mark.parametrize(
    ("kind", "given"), [("oscillation", {"omega": 1.0, "amplitude": 1e-4}), ("flow", {"rate": 1e-2})]
)
def test_packings_unlike_those_of_the_table_are_named(packing, kind, given):
    """Its size and its pressure, each alone; infinitely small strains take nothing from the table."""
    fewest, (low, high) = measured_range(kind, "n")[0], measured_range(kind, "pressure")
    rows = read_errors().query("kind == @kind")
    assert fewest == rows["n"].min() and (low, high) == (rows["pressure"].min(), rows["pressure"].max())
    assert f"on {fewest:g} disks at pressures from\n    {low:.2g} to {high:.2g}" in jamlab.choose_flow.__doc__
    assert jamlab.choose_flow(packing, **given, tolerance=0.3).warning == ""
    small, loose = jamlab.pack(n=32, pressure=5e-3, seed=1), jamlab.pack(n=64, pressure=1e-3, seed=1)
    few, faint = (jamlab.choose_flow(p, **given, tolerance=0.3).warning for p in (small, loose))
    assert "64 particles or more, not 32" in few and "pressure" not in few
    assert "0.003 to 0.01 of the stiffness, not 0.001" in faint and "particles" not in faint
    assert jamlab.choose_flow(small, omega=1.0).warning == ""


@pytest.mark.parametrize(
    ("law", "rate", "named"),
    [
        (jamlab.ContactDamping(), 1e-5, ["rates (tau rate)^alpha from 0.01 to 0.1, not 1e-05"]),
        (jamlab.ContactDamping(), 500.0, ["rates (tau rate)^alpha from 0.01 to 0.1, not 5e+02"]),
        (jamlab.StokesDrag(), 1e-2, ["under contact drag, not Stokes drag"]),
        (jamlab.StokesDrag(), 1e-5, ["under contact drag, not Stokes drag", "not 1e-05"]),
        (jamlab.ContactDamping(alpha=0.4), 1e-3, ["at alpha from 0.5 to 1, not 0.4"]),
        (jamlab.ContactDamping(tau=10.0), 0.1, ["not 1"]),
        (jamlab.ContactDamping(tau=10.0), 1e-3, []),
        (jamlab.ContactDamping(), 0.1, []),
        (FILM, 1e-4, []),  # as linear drag, at the least and the largest rate of the table
        (FILM, 1e-2, []),
        (FILM, 2e-2, ["not 0.14"]),
    ],
)
def test_steady_flow_unlike_that_of_the_table_is_named(packing, law, rate, named):
    """Its drag law and its linear rate; a run has the scatter of its average from the table too."""
    choice = jamlab.choose_flow(packing, law, rate=rate, tolerance=0.3)
    assert choice.way == "flow" or not named
    found = [each for each in choice.warning.split("; ") if each]
    assert len(found) == len(named) and all(end in each for end, each in zip(named, found, strict=True))


def test_the_docstring_says_which_steady_flow_was_measured():
    rows = read_errors().query("kind == 'flow'")
    (least, largest), (slow, fast) = (measured_range("flow", column) for column in ("alpha", "drag"))
    assert (least, largest) == (rows["alpha"].min(), rows["alpha"].max()) and least > 0  # no Stokes drag
    assert (slow, fast) == (rows["drag"].min(), rows["drag"].max())
    said = " ".join(jamlab.choose_flow.__doc__.split())
    assert f"alpha from {least:g} to {largest:g}" in said and f"(tau_1 rate)^alpha from {slow:g} to {fast:g}" in said


def test_checks_stand_beside_what_they_checked(packing):
    """Of the same kind and the same end of beta, or both between them; never beside a run, which is their truth."""
    given = {"omega": 1.0, "amplitude": 1e-4, "tolerance": 0.5}

    def said(law=None, **how):
        return jamlab.choose_flow(packing, law, **(how or given)).reasons[0]

    shares = {beta: kept_promises(part=SLIDING_CHECK, kind="oscillation", beta=beta) for beta in (*SLIDING_BETAS, None)}
    assert "such promises held in {} of {} checks".format(*kept_promises(part=CHECK, kind="oscillation")) in said()
    assert said().endswith("checks")
    for beta, end, words in ((0.1, 0.1, "0.1"), (10.0, 10.0, "10"), (3.0, None, "0.1 and 10")):
        end = "held in {} of {} checks at beta = {}".format(*shares[end], words)
        assert said(jamlab.ContactDamping(beta)).endswith(end)
    flow = said(FILM, rate=1e-3, tolerance=0.3)
    assert "of linear drag held in {} of {} checks".format(*kept_promises(part=CHECK, kind="flow")) in flow
    assert "95 % err by less than" in flow and "95 % err by less than" in said()
    run, average = said(omega=1.0, amplitude=0.1), said(rate=1e-2)
    assert "promises" not in run + average + said(omega=1.0)
    assert said(omega=1e-8).startswith("static modulus errs by")  # linear response of this packing, no share of many
    assert run.startswith("oscillation is run, to 1 %") and "at most" not in run + average + said()


def test_shares_are_counted_by_kind_and_beta():
    """Half of the checks of G* at one end kept what was promised, all at the other; flow has none."""
    runs = [("calibrate", 1.0, 0.1)] * 2 + [(MANY, 1.0, 1e-3)] * 39 + [(SLIDING, 0.1, 0.1)] * 20
    runs += [(SLIDING, 10.0, 0.1)] * 20 + [(SLIDING_CHECK, 0.1, e) for e in (0.09, 0.5)] + [(SLIDING_CHECK, 10.0, 0.09)]
    rows = [
        ("oscillation", part, k, 64, 1e-2, 1.0, 1.0, 1.0, beta, error, 3, 0.1)
        for k, (part, beta, error) in enumerate(runs)
    ]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    found = [kept_promises(table, SLIDING_CHECK, "oscillation", beta) for beta in (0.1, 10.0, None)]
    assert found == [(1, 2), (1, 1), (2, 3)] and kept_promises(table, SLIDING_CHECK, "flow") == (0, 0)


def test_inertia(packing):
    """LAMMPS' disks of small mass are off by 4 % at mass times frequency 0.1, and by a tenth of that at 0.01."""
    heavy, light = (inertia_error(packing, jamlab.ContactDamping(), 0.1, mass) for mass in (1.0, 0.1))
    assert 0.02 < heavy < 0.08 and light == pytest.approx(0.1 * heavy, rel=0.1)
    assert "irrelevant" in jamlab.choose_flow(packing, omega=0.1, mass=0.1).why
    assert "gran/hooke" in jamlab.choose_flow(packing, omega=0.1, mass=10.0).warning


def test_promises_hold_in_the_checks():
    """Of other packings at random conditions; 95 % are promised."""
    kept, of = kept_promises()
    assert of >= 40 and kept >= 0.9 * of


def test_no_check_is_far_beyond_its_promise():
    """A packing that rearranged at a strain of 0.04 overlaps was once 48 % off where 1.6 % were promised."""
    checks = read_errors().query("part == 'check'")
    conditions = zip(*(checks[name].tolist() for name in ("kind", "alpha", "drag", "amplitude")), strict=True)
    promised = np.array([promised_error(*condition) for condition in conditions])
    assert (checks["error"].to_numpy() < 5 * promised).all()


def test_other_damping_of_sliding_has_wider_promises(packing):
    """Between a tenth and ten times that of approach; beyond, nothing but a run."""
    at_one, other = (
        jamlab.choose_flow(packing, jamlab.ContactDamping(beta), omega=1.0, amplitude=1e-3, tolerance=0.3)
        for beta in (1.0, 0.1)
    )
    assert not other.warning and "checks at beta = 0.1" in other.why and "at beta" not in at_one.why
    factor = sliding_factor("oscillation", 0.1)
    assert other.way == "linear spectrum" and 1 < factor < 3
    assert other.error == pytest.approx(
        factor * promised_error("oscillation", 1.0, 1.0, relative_amplitude(packing, 1e-3))
    )
    beyond = jamlab.choose_flow(packing, jamlab.ContactDamping(0.01), omega=1.0, amplitude=1e-3, tolerance=0.3)
    assert beyond.way == "oscillation" and "measured from 0.1 to 10" in beyond.why
    film = jamlab.ContactDamping(20.0, alpha=0.9)
    flow = jamlab.choose_flow(packing, film, rate=1e-2, tolerance=0.5)
    assert flow.way == "flow" and "beta from 0.1 to 10" in flow.warning
    assert "rearrange" not in beyond.why
    assert scatter_of_flow(beta=10.0) > scatter_of_flow() > 0


def test_promises_hold_in_checks_of_other_damping():
    """On packings whose runs did not make the factor; 95 % are promised, and 93 % kept."""
    kept, of = kept_promises(part=SLIDING_CHECK)
    assert of >= 100 and kept >= 0.9 * of
    table = read_errors()
    seeds = [set(table.loc[table["part"] == part, "seed"]) for part in (SLIDING, SLIDING_CHECK)]
    assert all(seeds) and not seeds[0] & seeds[1]


def test_the_factor_of_other_damping_is_what_few_runs_exceed():
    """20 runs up to three times what is promised: the largest; promises kept everywhere are not made narrower."""
    made = {
        (part, k): error
        for part, errors in (("calibrate", (0.1, 0.1)), (MANY, (1e-3,) * 39))
        for k, error in enumerate(errors)
    }
    for errors, factor in ((np.linspace(0.1, 0.3, 20), 3.0), (np.full(20, 0.05), 1.0), (np.full(18, 0.05), np.inf)):
        parts = made | {(SLIDING, k): error for k, error in enumerate(errors)}
        rows = [("oscillation", *key, 64, 1e-2, 1.0, 1.0, 1.0, 1.0, e, 3, 0.1) for key, e in parts.items()]
        table = pd.DataFrame(rows, columns=list(COLUMNS))
        assert sliding_factor("oscillation", 10.0, table) == pytest.approx(factor)
        assert promised_error("oscillation", 1.0, 1.0, 1.0, table, beta=10.0) == pytest.approx(0.1 * factor)
        assert promised_error("oscillation", 1.0, 1.0, 1.0, table, beta=11.0) == np.inf


def test_the_worse_end_of_beta_makes_the_factor():
    """Four runs of 60 at beta = 0.1 are three times off: more than one in twenty there, less of the 120 at both."""
    runs = [("calibrate", 1.0, 0.1)] * 2 + [(MANY, 1.0, 1e-3)] * 39
    runs += [(SLIDING, 0.1, 0.3)] * 4 + [(SLIDING, 0.1, 0.1)] * 56 + [(SLIDING, 10.0, 0.1)] * 60
    rows = [
        ("oscillation", part, k, 64, 1e-2, 1.0, 1.0, 1.0, beta, error, 3, 0.1)
        for k, (part, beta, error) in enumerate(runs)
    ]
    assert sliding_factor("oscillation", 3.0, pd.DataFrame(rows, columns=list(COLUMNS))) == pytest.approx(3.0)


def promise(*errors, many=(1e-3,) * 39, drag=1.0, amplitude=1.0):
    """What a table promises of a few packings with some errors, and many with others."""
    rows = [
        ("oscillation", part, k, 64, 1e-2, 1.0, 1.0, 1.0, 1.0, error, 3, 0.1)
        for part, each in (("calibrate", errors), (MANY, many))
        for k, error in enumerate(each)
    ]
    return promised_error("oscillation", 1.0, drag, amplitude, pd.DataFrame(rows, columns=list(COLUMNS)))


def test_promises_hold_where_one_packing_in_ten_rearranges():
    """Five packings mostly show none; 39 and a new one are drawn 2000 times, which knows the share to 0.005."""
    rng = np.random.default_rng(1)
    errors = rng.lognormal(-5, 0.3, (2000, 40)) * np.where(rng.random((2000, 40)) < 0.1, 100, 1)
    unforeseen = (errors[:, :5].max(axis=1) < 0.1) & (errors[:, -1] > 0.1)
    kept = [last <= exceeded_by_few(each) for *each, last in errors]
    assert np.mean(unforeseen) > 0.05 and 0.935 < np.mean(kept) < 0.965
    assert promise(0.01, 0.01, 0.012, many=errors[0, :-1]) == pytest.approx(exceeded_by_few(errors[0, :-1]))


def test_the_error_that_few_exceed():
    """The second largest of 39, the largest of 19 to 38, none of fewer; with more strain no less."""
    errors = np.arange(39.0)
    assert [exceeded_by_few(errors[:n]) for n in (39, 38, 19, 18)] == [37.0, 37.0, 18.0, np.inf]
    assert promise(0.1, 0.1, 0.1, many=(0.2,) * 38 + (0.9,)) == pytest.approx(0.2)
    assert promise(0.1, 0.1, 0.1, many=(0.2,) * 18) == promise(0.1, 0.1, 0.1, many=()) == np.inf
    drags, amplitudes = np.geomspace(1e-4, 10, 12), np.geomspace(1e-3, 1, 12)
    found = np.array([[rearranging_error(drag, part) for part in amplitudes] for drag in drags])
    assert (np.diff(found, axis=1) >= 0).all() and found[0, 0] < 0.05 < 0.3 < found[0, -1]


def test_a_promise_is_the_upper_end_of_what_was_measured():
    """Equal errors promise just these, others more; where nothing was measured, nothing is promised."""
    assert promise(0.1, 0.1, 0.1) == pytest.approx(0.1)
    assert promise(0.05, 0.1, 0.2) > 0.2 and promise(1e-6, 1e-7) == 0.01
    assert promise(0.1) == np.inf
    table = read_errors()
    assert promised_error("oscillation", 0.3, 1.0, 0.1) == promised_error("oscillation", 0.5, 1e-3, 0.1) == np.inf
    calm, wild = (promised_error("oscillation", 1.0, 1.0, x) for x in (1e-3, 3.0))
    assert calm < 0.05 < 0.5 < wild and len(table) > 200


def test_a_strain_of_one_overlap(packing):
    overlap = jamlab.evaluate(packing).pressure / packing.params["k"]
    assert relative_amplitude(packing, overlap) == pytest.approx(1.0, rel=1e-6)


def test_equivalent_damping_at_a_strain(packing):
    """Its stress is |G*| times the strain; linear drag has no such choice."""
    found = modulus_at_strain(packing, 0.3, 1e-3, FILM)
    same = jamlab.nonlinear_modulus(packing, [0.3], 0.5, stress=abs(found) * 1e-3)
    assert complex(same.storage[0], same.loss[0]) == pytest.approx(found, rel=1e-3)
    linear = jamlab.complex_modulus(packing, [0.3])
    plain = modulus_at_strain(packing, 0.3, 1e-3, jamlab.ContactDamping())
    assert plain == pytest.approx(complex(linear.storage[0], linear.loss[0]))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "omega = None, rate = None: give one of them"),
        ({"omega": 1.0, "rate": 1.0}, "give one of them"),
        ({"omega": 1.0, "damping": FILM}, "depend on amplitude however small"),
        ({"omega": 1.0, "tolerance": 1e-4}, "tolerance = 0.0001: no error below 0.01"),
        ({"rate": 1.0, "mass": -1.0}, "mass = -1.0"),
        ({"rate": 0.0}, "rate = 0.0: must be"),
    ],
)
def test_refused(packing, given, message):
    with pytest.raises(jamlab.InputError, match=message):
        jamlab.choose_flow(packing, **given)


def test_a_table_that_goes_on_comes_back_whole(tmp_path, monkeypatch):
    """What was read to go on from must not be what is returned."""
    whole = read_errors()
    path = tmp_path / "errors.csv"
    whole[whole["seed"] != 101].to_csv(path, index=False)
    missing = whole[whole["seed"] == 101].drop(columns=["part", "seed"])
    monkeypatch.setattr(measurement, "_random", lambda seed: (None, []))
    monkeypatch.setattr(measurement, "_runs", lambda packing, conditions: iter(missing.to_dict("records")))
    assert len(measurement.measure_errors(path)) == len(whole)
