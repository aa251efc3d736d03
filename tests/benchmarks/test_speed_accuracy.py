"""Speed-accuracy charts: who is dominated, what is written, what is refused."""

import csv

import numpy as np
import pytest
from commands import call

import jamlab
from jamlab.benchmarks.speed_accuracy.page import defaults_off_the_front, speed_accuracy
from jamlab.benchmarks.speed_accuracy.pareto_figure import pareto_figure
from jamlab.benchmarks.speed_accuracy.topics import TOPICS
from jamlab.benchmarks.speed_accuracy.trial import Topic, Trial, dominated


def test_dominated_points():
    """A staircase by hand: equal time and larger error, equal error and longer time, other panels, no number."""
    rows = [
        Trial("a", "fast", "", 1.0, 1e-2),
        Trial("a", "good", "", 10.0, 1e-6),
        Trial("a", "worse", "", 1.0, 2e-2),
        Trial("a", "slower", "", 20.0, 1e-6),
        Trial("a", "as fast as can be told", "", 11.0, 1e-6),
        Trial("a", "broken", "", np.nan, np.nan),
        Trial("b", "alone", "", 99.0, 1.0),
        Trial("a", "below the floor", "", 30.0, 0.0),
        Trial("a", "at the floor", "", 30.0, 1e-17),
    ]
    assert dominated(rows).tolist() == [False, False, True, True, False, True, False, False, False]


def test_defaults_off_the_front_are_named():
    rows = [Trial("p", "m", "1", 1.0, 1.0, default=True), Trial("p", "better", "", 0.5, 0.5)]
    assert defaults_off_the_front({"topic": rows}) == ["topic, p: m 1"]
    assert defaults_off_the_front({"topic": rows[1:]}) == []


def test_chart_of_packing_fractions(tmp_path):
    """A real measurement: known errors, files, a page that holds its pictures."""
    found = speed_accuracy(tmp_path, ["packing-fraction"], quick=True)["packing-fraction"]
    error = {(t.panel, t.method): t.error for t in found}
    assert all(error[panel, "exact"] < 1e-13 for panel in ("phi = 0.86", "phi = 1.0", "phi = 1.2"))
    assert error["phi = 1.2", "nominal"] > 0.1 > error["phi = 1.2", "pairs"] > 1e-6
    assert all(t.seconds > 0 for t in found)
    with (tmp_path / "speed-accuracy.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(found) and {row["topic"] for row in rows} == {"packing-fraction"}
    assert sum(row["default"] == "True" for row in rows) == 3
    page = (tmp_path / "speed-accuracy.html").read_text()
    assert "data:image/png" in page and "http" not in page and "paper-pairs" in page
    assert (tmp_path / "packing-fraction.png").read_bytes()[:4] == b"\x89PNG"


def test_figure_rings_the_default_and_greys_the_beaten():
    rows = [
        Trial("p", "a", "1", 1.0, 1e-3, default=True),
        Trial("p", "b", "", 2.0, 1.0),
        Trial("p", "c", "", 3.0, np.nan),
    ]
    figure = pareto_figure(Topic("title", "error", "reference", lambda quick: rows), rows)
    axes = figure.axes[0]
    colours = [line.get_color() for line in axes.lines]
    assert "#B8B8B8" in colours and "1 gave no number" in axes.get_title()
    assert sum(line.get_markeredgecolor() == "black" for line in axes.lines) == 1


def test_unknown_topic_is_refused(tmp_path):
    done = call(tmp_path, "chart", "speed-accuracy", "--topic", "weather", "--out", "c")
    assert done.exit_code == 1 and "weather" in done.stderr and "minimisers" in done.stderr
    assert not (tmp_path / "c").exists()
    with pytest.raises(jamlab.InputError):
        speed_accuracy(tmp_path / "c", ["weather"])
    assert all(topic.reference for topic in TOPICS.values())
