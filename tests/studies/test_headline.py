"""The picture of headline numbers: which rows it shows, what it writes, and that nothing is cut or overprinted."""

from dataclasses import replace
from itertools import combinations

import pytest

from studies.papers.headline import (
    HEADLINES,
    MOST,
    NARROW,
    SPAN,
    WIDE,
    differences,
    headline,
    headlines,
    missing_rows,
    theirs,
    unexplained,
)
from studies.papers.statements import Measured, reasons, statements
from studies.papers.verdicts import Verdict, judge

REASONS = list(dict.fromkeys(reasons().values()))


def found(names, factor=1.02):
    """Rows whose number is the paper's, or off by a factor; of an exponent of zero, off by as much."""
    values = {name: statements()[name].value for name in names}
    moved = {name: value * factor if value else factor - 1 for name, value in values.items()}
    return [judge(statements()[name], Measured(v, v - 0.002, v + 0.002)) for name, v in moved.items()]


def marked(names, verdict):
    return [replace(c, verdict=verdict) for c in found(names)]


def test_every_name_is_a_row_and_every_paper_has_some():
    assert missing_rows() == [] and len(HEADLINES) == 16
    rows = [statements()[name] for name in HEADLINES]
    assert all(s.counted and s.tested and s.relation == "=" and s.value for s in rows)
    assert [s.where[:3] for s in rows] == ["[B]"] * 7 + ["[T]"] * 9  # in two blocks


def test_headline_numbers_come_in_the_order_of_the_list():
    assert [c.statement.id for c in headlines(found(sorted(HEADLINES)))] == list(HEADLINES)
    assert headlines([replace(c, measured=Measured()) for c in found(HEADLINES)]) == []


@pytest.mark.parametrize("verdict", list(Verdict))
def test_what_differs_follows_from_the_verdicts(verdict):
    names = [name for name in reasons() if statements()[name].tested]
    shown = differences(marked(reversed(names), verdict))
    lines = dict.fromkeys(tuple(reasons()[name].partition(": ")[::2]) for name in names)
    assert [(what, why) for what, why, _ in shown] == (list(lines) if verdict in ("differs", "tension") else [])


def test_a_reason_shows_the_first_of_its_rows_that_differs():
    (shown,) = differences(marked(["T7-logarithm"], Verdict.TENSION))
    assert shown[2].statement.id == "T7-logarithm"
    (shown,) = differences(marked(["T7-logarithm", "T7-length-stokes"], Verdict.TENSION))
    assert shown[2].statement.id == "T7-length-stokes"


def test_a_difference_without_a_reason_is_told():
    assert unexplained(marked(["B11-kappa"], Verdict.DIFFERS)) == ["B11-kappa"]
    assert unexplained(marked(["B11-kappa"], Verdict.WEAK)) == unexplained(marked(reasons(), Verdict.DIFFERS)) == []


@pytest.mark.parametrize("look", [WIDE, NARROW])
def test_nothing_is_cut_or_overprinted(look):
    drawing = headline([*found(HEADLINES), *marked(reasons(), Verdict.DIFFERS)], look)
    figure = drawing.figure
    figure.draw_without_rendering()
    frame, boxes = figure.bbox, [text.get_window_extent() for axes in figure.axes for text in axes.texts]
    assert len(REASONS) > MOST and len(boxes) == 4 + 3 * len(HEADLINES) + 1 + 3 * MOST + 1
    assert all(frame.x0 <= b.x0 and b.x1 <= frame.x1 and frame.y0 <= b.y0 and b.y1 <= frame.y1 for b in boxes)
    assert not [pair for pair in combinations(boxes, 2) if overlap(*pair)]
    ends = figure.axes[0].get_tightbbox()
    assert ends.y0 >= frame.y0


def overlap(one, other):
    """Whether two boxes share more than a pixel."""
    return min(one.x1, other.x1) - max(one.x0, other.x0) > 1 and min(one.y1, other.y1) - max(one.y0, other.y0) > 1


def test_bars_end_at_the_axis():
    wide = [replace(c, statistical=1.0) for c in found(HEADLINES)]
    axes = headline(wide).figure.axes[0]
    assert all(SPAN[0] <= x <= SPAN[1] for line in axes.lines for x in line.get_xdata())
    assert theirs(found(["T8-tail-stokes"])[0]) == ">−0.545"
