"""What runs of flow promise of other packings, and whether the checks keep it."""

import json
from importlib import resources

import numpy as np
import pandas as pd
import pytest

from jamlab.estimates.flow_errors import SLIDING_BETAS, Flow, shipped_errors
from studies.flow_errors import COLUMNS, Part, checks_kept, measure_runs, promises, read_runs, reduce_runs

AT = Flow("oscillation", 1.0, 1.0, 1.0)


@pytest.fixture(scope="module")
def runs():
    return read_runs()


def test_what_ships_is_what_the_runs_say(runs):
    stored = json.loads(resources.files("jamlab.estimates").joinpath("flow_errors.json").read_text("utf-8"))
    assert json.loads(json.dumps(reduce_runs(runs).content)) == stored


def test_promises_hold_in_the_checks(runs):
    """Of other packings at random conditions, and at other beta; 95 % are promised, none is far beyond."""
    for part, beta, least in ((Part.CHECK, 1.0, 150), (Part.SLIDING_CHECK, None, 300)):
        kept, of = checks_kept(shipped_errors(), runs, None, beta)
        assert of >= least and 0.93 <= kept / of <= 0.995
        checks = runs[runs["part"] == part]
        assert (checks["error"].to_numpy() < 5 * promises(shipped_errors(), checks)).all()
    seeds = [set(runs.loc[runs["part"] == part, "seed"]) for part in (Part.SLIDING, Part.SLIDING_CHECK)]
    assert all(seeds) and not seeds[0] & seeds[1] and len(runs) > 2000
    assert shipped_errors().scatter_of_flow(10.0) > shipped_errors().scatter_of_flow() > 0


def reduced(*runs):
    """What runs promise: part, beta and error, all under linear drag at one condition."""
    rows = [
        ("oscillation", part, k, 64, 1e-2, 1.0, 1.0, 1.0, beta, error, 3, 0.1)
        for k, (part, beta, error) in enumerate(runs)
    ]
    return reduce_runs(pd.DataFrame(rows, columns=list(COLUMNS)))


def calibrated(errors, many=()):
    return [(Part.CALIBRATE, 1.0, error) for error in errors] + [(Part.MANY, 1.0, error) for error in many]


def test_a_promise_is_the_upper_end_of_what_was_measured():
    """Equal errors promise just these, else the largest of 20 packings, the second of 39; of few, nothing."""
    assert reduced(*calibrated([0.1] * 20)).promise(AT) == pytest.approx(0.1)
    assert reduced(*calibrated(np.linspace(0.01, 0.2, 20))).promise(AT) == pytest.approx(0.2)
    many = calibrated(np.linspace(0.01, 0.19, 19), np.linspace(0.2, 0.39, 20))
    assert reduced(*many).promise(AT) == pytest.approx(0.38)
    assert reduced(*calibrated([0.1] * 18)).promise(AT) == np.inf
    assert reduced(*calibrated([1e-7] * 20)).promise(AT) == 0.01
    table = shipped_errors()
    assert table.promise(AT._replace(alpha=0.3)) == table.promise(AT._replace(alpha=0.5, drag=1e-3)) == np.inf
    calm, wild = (table.promise(AT._replace(amplitude=x)) for x in (1e-3, 3.0))
    assert calm < 0.05 < 0.5 < wild


def test_the_factor_of_other_damping_is_what_few_runs_exceed():
    """20 runs up to three times what is promised: the largest; the worse end counts; promises are not made narrower."""
    usual = calibrated([0.1] * 20)
    for errors, factor in ((np.linspace(0.1, 0.3, 20), 3.0), (np.full(20, 0.05), 1.0), (np.full(18, 0.05), np.inf)):
        table = reduced(*usual, *((Part.SLIDING, 10.0, error) for error in errors))
        assert table.sliding_factor("oscillation", 10.0) == pytest.approx(factor)
        assert table.promise(AT._replace(beta=10.0)) == pytest.approx(0.1 * factor)
        assert table.promise(AT._replace(beta=11.0)) == np.inf
    runs = [(Part.SLIDING, 0.1, 0.3)] * 4 + [(Part.SLIDING, 0.1, 0.1)] * 56 + [(Part.SLIDING, 10.0, 0.1)] * 60
    assert reduced(*usual, *runs).sliding_factor("oscillation", 3.0) == pytest.approx(3.0)
    checks = [(Part.SLIDING_CHECK, 0.1, 0.09), (Part.SLIDING_CHECK, 0.1, 0.5), (Part.SLIDING_CHECK, 10.0, 0.09)]
    table = reduced(*usual, *((Part.SLIDING, beta, 0.1) for beta in SLIDING_BETAS * 20), *checks)
    kept = table.content["kept"]
    assert [tuple(kept["oscillation"][end]) for end in ("0.1", "10", "ends")] == [(1, 2), (1, 1), (2, 3)]
    assert tuple(kept["flow"]["ends"]) == (0, 0)


def test_rows_of_the_table_are_measured(tmp_path):
    """At the conditions of given runs; one that no run reaches has no row."""
    flows = [("oscillation", Part.CHECK, 1, 64, 1e-2, alpha, drag, 1e-3, 1.0) for alpha, drag in ((1, 1), (0.5, 1e-6))]
    made = measure_runs(tmp_path / "runs.csv.xz", pd.DataFrame(flows, columns=list(COLUMNS[:-3])))
    (row,) = made.to_dict("records")
    assert row.keys() >= set(COLUMNS) and row["error"] < 0.01 and row["pressure"] == pytest.approx(1e-2, rel=1e-5)
