"""Figures of both papers from tables in which the papers' laws hold, their report and their command."""

import json

import numpy as np
import pandas as pd
import pytest
from bare_pictures import artists
from commands import call_studies
from drawn_figures import FIGURES, PICTURES, PUBLISHED, drawn, saved, tables
from matplotlib.axes import Axes

from studies import pages
from studies.panels import drawing
from studies.papers.statements import Sentence
from studies.papers.verdicts import SUMMARY
from studies.study import Group, Study


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_keeps_what_it_draws(name):
    drawing = drawn(name)
    table = drawing.table
    assert list(table.columns) == ["panel", "series", "x", "y", "low", "high"]
    assert np.isfinite(table[["x", "y"]].to_numpy()).all() and len(table) > 10
    beside = name.startswith(("dynamics-", "beyond-", "onset-")) and name not in PUBLISHED
    pictures = name in (*PICTURES, "baumgarten-1", "boromand-8-laws") or beside
    assert drawing.caption and bool(drawing.claims) is not pictures  # of which no paper has numbers
    panels = artists(drawing.figure, Axes)  # insets too
    for (panel, series), points in table.groupby(["panel", "series"]):
        (axes,) = (axes for axes in panels if axes.get_gid() == panel)
        drawn_points = {tuple(place) for line in axes.lines for place in line.get_xydata()}
        assert set(zip(points["x"], points["y"], strict=True)) <= drawn_points, (panel, series)
    for axes in drawing.figure.axes:
        assert (axes.get_xlabel() and axes.get_ylabel()) or name == "tables" or name in PICTURES


# files, report and command --------------------------------------------------------------------------------------------


def test_a_fault_of_a_figure_is_no_lack_of_data(tmp_path):
    """A column that the code names wrongly is no table that lacks it."""
    broken = Study("broken", "Broken", {}, lambda tables: tables.read("states")["no such column"])
    with pytest.raises(KeyError):
        pages.write_page(tmp_path, "page", Group("Title", "", [broken]), tables())


def test_json_holds_the_numbers_of_figures_and_claims(tmp_path):
    names = ["baumgarten-4", "baumgarten-5"]
    words = ["draw", *names, "--from", saved(tmp_path / "reference"), "--out", tmp_path / "out", "--json"]
    content = json.loads(call_studies(tmp_path, *words).stdout)
    fields = {"figure", "quantity", "value", "low", "high", "below", "above", "family", "paper", "margin", "relation"}
    rows = content["rows"]
    assert all({*fields, "sentence", "words", "no_test", "where", "verdict"} <= set(row) for row in rows)
    assert all(row["family"] or row["below"] == row["above"] == 0 for row in rows)
    assert [row["verdict"] for row in rows] == [c.verdict for name in names for c in drawn(name).claims]
    assert {row["sentence"] for row in rows} <= {str(kind) for kind in Sentence} and rows[0]["where"].startswith("[T] ")
    assert content["captions"] == {name: drawn(name).caption for name in names}
    assert pd.read_csv(tmp_path / "out" / pages.VERDICTS)["verdict"].tolist() == [row["verdict"] for row in rows]
    claims = [c for name in names for c in drawn(name).claims if c.measured.known and c.statement.counted]
    tests = sum(c.statement.tested for c in claims)
    assert (tmp_path / "out" / SUMMARY).read_text().startswith(f"Our packings test {tests} numbers of ")


def test_a_curve_without_points_has_no_name_in_the_legend():
    out, (axes,) = drawing("boromand-6", 1, 1, 3.0, 3.0)
    out.curve(axes, "N = 16", [1.0], [np.nan])
    out.curve(axes, "N = 32", [1.0], [2.0])
    assert axes.get_legend_handles_labels()[1] == ["N = 32"]
