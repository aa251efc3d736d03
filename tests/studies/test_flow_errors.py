"""What runs of flow promise of other packings, and whether the checks keep it."""

import json
from importlib import resources

import numpy as np
import pandas as pd
import pytest

from jamlab.estimates.flow_errors import FlowCondition, shipped_errors
from studies.flow_errors import COLUMNS, Part, checks_kept, measure_runs, promises, read_runs, reduce_runs

AT = FlowCondition("oscillation", 1.0, 1.0, 1.0)


@pytest.fixture(scope="module")
def runs():
    return read_runs()


def test_what_ships_is_what_the_runs_say(runs):
    stored = json.loads(resources.files("jamlab.estimates").joinpath("flow_errors.json").read_text("utf-8"))
    assert json.loads(json.dumps(reduce_runs(runs).content)) == stored


def test_promises_hold_in_the_checks(runs):
    """Of other packings at random conditions; 95 % are promised, none is far beyond."""
    kept, of = checks_kept(shipped_errors(), runs)
    assert of >= 150 and 0.93 <= kept / of <= 0.995
    checks = runs[runs["part"] == Part.CHECK]
    assert (checks["error"].to_numpy() < 5 * promises(shipped_errors(), checks)).all()
    assert shipped_errors().scatter_of_flow > 0 and (runs["beta"] == 1).all()


def reduced(*runs):
    """What runs promise: part and error, all under linear drag at one condition."""
    at = (64, 1e-2, 1.0, 1.0, 1.0, 1.0)
    rows = [("oscillation", part, k, *at, error, 3, 0.1) for k, (part, error) in enumerate(runs)]
    return reduce_runs(pd.DataFrame(rows, columns=list(COLUMNS)))


def calibrated(errors, many=()):
    return [(Part.CALIBRATE, error) for error in errors] + [(Part.MANY, error) for error in many]


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


def test_rows_of_the_table_are_measured(tmp_path):
    """At the conditions of given runs; one that no run reaches has no row."""
    flows = [("oscillation", Part.CHECK, 1, 64, 1e-2, alpha, drag, 1e-3, 1.0) for alpha, drag in ((1, 1), (0.5, 1e-6))]
    made = measure_runs(tmp_path / "runs.csv.xz", pd.DataFrame(flows, columns=list(COLUMNS[:-3])))
    (row,) = made.to_dict("records")
    assert row.keys() >= set(COLUMNS) and row["error"] < 0.01 and row["pressure"] == pytest.approx(1e-2, rel=1e-5)
