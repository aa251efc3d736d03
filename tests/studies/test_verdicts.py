"""The rule that compares a number of a paper with ours."""

import re
from dataclasses import replace

import frozen_rule
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jamlab.statistics.confidence import Interval
from studies.papers.forest import SPAN, bars
from studies.papers.statements import Measured, Sentence, Statement, statements
from studies.papers.verdicts import Verdict, first_line, judge, paper_error, scale, summary
from studies.reference_data import open_tables

ONE = Statement(
    *("x", "f", "[B] sec 1", "q", "$q$", 1.0, "=", 0.005, "line", 2.0, "exponent"),
    *(Sentence.MEASURED, "we find 1.00", "", "", "measures"),
)
AGREEMENT = (Verdict.AGREES, Verdict.SMALL)


def found(value, error, *others, widen=1.0):
    """A number with a standard error, and other analyses as pairs of both."""
    ends = lambda v, u: (v, v - 1.96 * widen * u, v + 1.96 * widen * u)  # noqa: E731
    moved = {f"{k}": Interval(*map(np.array, ends(value + widen * (v - value), u))) for k, (v, u) in enumerate(others)}
    return Measured(*ends(value, error), moved)


@pytest.mark.parametrize(
    ("ours", "how", "verdict"),
    [
        (found(1.03, 0.01), "=", "agrees"),
        (found(1.03, 0.05), "=", "compatible, weak"),
        (found(1.03, 0.3), "=", "not resolved"),
        (found(1.15, 0.01), "=", "tension"),
        (found(1.5, 0.01), "=", "differs"),
        (found(1.5, 0.01, (1.02, 0.01)), "=", "not resolved"),  # another analysis meets the paper
        (found(1.5, 0.01, (0.5, 0.01)), "=", "not resolved"),  # one between them would
        (found(1.5, 0.01, (1.4, 0.01)), "=", "differs"),
        (found(1.0, 0.01, (1.14, 0.01)), "=", "compatible, weak"),
        (found(1.3, 0.05), ">", "agrees"),
        (found(1.05, 0.05), ">", "not resolved"),
        (found(0.88, 0.05), ">", "tension"),
        (found(0.8, 0.05), ">", "differs"),
        (found(0.8, 0.05, (1.0, 0.05)), ">", "not resolved"),
        (found(0.8, 0.05), "<", "agrees"),
        (found(np.nan, np.nan), "=", "no data"),
        (Measured(1.0), "=", "no data"),  # a value without interval
        (found(1.05, 0.01), "theory", "small difference"),  # seen, and within the tolerance
        (found(1.05, 0.01, (1.01, 0.01)), "theory", "agrees"),
        (
            found(1.5, 0.001, (1.09, 0.001)),
            "theory",
            "tension",
        ),  # 90 errors, 0.9 tolerances
        (found(1.5, 0.001, (1.11, 0.001)), "theory", "differs"),
        (found(0.95, 0.01), ">", "tension"),  # five errors, half a tolerance
    ],
)
def test_classes(ours, how, verdict):
    """The paper shows a line over two decades: its error is 0.05; the tolerance is 0.1. A theory has no error."""
    relation, stated = {"theory": ("=", "theory"), "=": ("=", "line")}.get(how, (how, "bound"))
    assert judge(replace(ONE, relation=relation, stated=stated), ours).verdict == verdict


def test_by_hand():
    """Off by 0.2: u = 0.03 of packings, 0.06/sqrt(3) of the analysis towards the paper, 0.05 of the paper."""
    j = judge(ONE, found(1.2, 0.03, (1.14, 0.03)))
    assert j.pull == pytest.approx(0.2 / np.sqrt(0.03**2 + 0.06**2 / 3 + 0.05**2))
    assert j.kindest == pytest.approx(0.14 / np.hypot(0.03, 0.05))
    assert j.resolution == pytest.approx(0.2 + 1.645 * np.hypot(0.03, 0.06 / 3**0.5))


@pytest.mark.parametrize(
    ("stated", "argument", "error"),
    [
        *(
            ("stated", 0.2, 0.2),
            ("fit", 0.0, np.hypot(0.005 / 3**0.5, 0.03)),
            ("line", 2.0, 0.05),
            ("read", 0.01, 0.01),
        ),
        *(("share", 0.001, 0.005 / 3**0.5), ("word", 0.05, 0.05), ("about", 0.1, 0.1), ("order", 0.29, 0.29)),
        *(("theory", 0.0, 0.0), ("bound", 0.0, 0.0), ("digits", 0.0, 0.005 / 3**0.5)),
    ],
)
def test_the_papers_error_follows_from_how_it_states_the_number(stated, argument, error):
    assert paper_error(replace(ONE, stated=stated, argument=argument), 0.03) == pytest.approx(error)


def test_lines_that_look_like_one_have_the_slope_and_the_height_of_one():
    """Two lines over two decades, 0.1 decades apart: at one end, slopes differ by 0.05; everywhere, heights by 1.26."""
    assert paper_error(ONE, 0.0) == pytest.approx(0.1 / 2)
    assert paper_error(replace(ONE, number="coefficient", value=3.0), 0.0) == pytest.approx(3 * 0.259, rel=1e-3)


def test_scales():
    kinds = ("exponent", "coefficient", "ratio", "density", "contacts", "shape", "void shape", "share", "decades")
    assert [scale(kind, 1.5) for kind in kinds] == [1.5, 1.5, 1.0, 0.16, 2.0, 0.5, 1.5, 1.5, 5.0]
    assert scale("exponent", 0.0) == 0.5 and scale("share", 0.02) == 0.2
    assert {s.number for s in statements().values() if s.counted} <= set(kinds)


numbers = st.floats(-3, 3)
errors = st.floats(1e-6, 2)


@given(
    *(st.sampled_from([s for s in statements().values() if s.stated]), numbers, errors),
    *(st.lists(st.tuples(numbers, errors), max_size=3), st.floats(1, 20)),
)
def test_a_wide_interval_can_only_lose_an_agreement(statement, off, error, others, widen):
    """What does not agree does not come to agree by wider intervals, or analyses further apart."""
    value = statement.value + off
    moved = [(statement.value + other, u) for other, u in others]
    narrow, wide = (judge(statement, found(value, error, *moved, widen=w)).verdict for w in (1.0, widen))
    assert wide not in AGREEMENT or narrow in AGREEMENT


def test_counts_are_of_tests():
    """Neither definitions, nor numbers that unprinted parameters decide, nor those of other papers; bounds apart."""
    kinds = (Sentence.MEASURED, Sentence.UNPRINTED, Sentence.DEFINITION)
    rows = [judge(replace(ONE, sentence=kind), found(1.0, 0.01)) for kind in kinds]
    rows.append(judge(replace(ONE, where="Tighe 2010"), found(1.0, 0.01)))
    rows.append(judge(replace(ONE, sentence=Sentence.DEFINITION, statistic=""), Measured()))  # nothing to measure
    rows.append(judge(replace(ONE, figure="g", relation=">", stated="bound"), found(1.3, 0.05)))
    said = "Our packings test 2 numbers of both papers. 1 agree within the tolerance"
    ended = "and 1 bounds are met. Of the other numbers, 0 lack data, and 2 are no tests."
    assert first_line(rows).startswith(said) and first_line(rows).endswith(ended)
    off = judge(ONE, found(1.29, 0.001))  # known to lie within 30 % of the scale, and three standard errors off
    _, short, bounded, *_ = summary([*rows[:4], off])
    assert short.startswith("Of 2 published numbers, 1 are compatible with ours, 0 are not resolved")
    assert re.findall(r"\d+", bounded) == ["30", "1", "2"]
    assert rows[0].text.startswith("1 ± 0.01")
    row = rows[1].row()
    assert (row["sentence"], row["words"], row["no_test"]) == ("unprinted parameters", "we find 1.00", row["sentence"])


# sentences ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "word", "reason"),
    [
        *(("measured", "", ""), ("drawn", "", ""), ("approximate", "", ""), ("guess", "", "guess")),
        *(("unprinted parameters", "", "unprinted parameters"), ("definition", "", "definition")),
        *(("measured", "paper inconsistent", "paper inconsistent"), ("guess", "duplicate", "duplicate")),
        ("measured", "identity", "identity"),
    ],
)
def test_whether_a_number_is_a_test_follows_from_its_sentence(kind, word, reason):
    row = replace(ONE, sentence=Sentence(kind), no_test=word)
    assert (row.reason, row.tested) == (reason, not reason)
    assert row.listed == (word != "duplicate")
    assert replace(row, statistic="").listed == (word not in ("duplicate", "identity") and kind != "definition")


WORDS = {  # of the quoted words -> what the sentence cannot be
    r"\blikely\b": set(Sentence) - {Sentence.GUESS},
    r"\b(slopes? (of|equal)|(solid|dashed|dotted) lines?)\b": {Sentence.MEASURED, Sentence.GUESS},
    r"\b(assuming|from Eq\. 5)|Kelvin|solved exactly|directly proportional": {Sentence.MEASURED, Sentence.DRAWN},
    r"O\(1\)|\b(similar|nearly|weak|comparable|approximately|little|indistinguishable|qualitatively|resemble)\b": {
        *(Sentence.MEASURED, Sentence.DRAWN, Sentence.GUESS, Sentence.DEFINITION)
    },
}


def test_quoted_words_agree_with_the_kind_of_sentence():
    """A word that marks a guess, a drawing, a derivation or an estimate stands in no sentence of another kind; quotes
    are short; a number that is read, or said in words, is approximate."""
    of_papers = [s for s in statements().values() if s.where.startswith("[")]
    for s in of_papers:
        assert 0 < len(s.words.split()) <= 25, s.id
        assert not [w for w, barred in WORDS.items() if re.search(w, s.words) and s.sentence in barred], s.id
        if s.stated in ("read", "word", "about", "order", "share") and s.tested:
            assert s.sentence == Sentence.APPROXIMATE, s.id
    assert [s.id for s in of_papers if s.sentence == Sentence.GUESS] == ["T8-a-same"]
    assert {s.sentence for s in of_papers} == set(Sentence)


@pytest.mark.parametrize(
    ("column", "tolerance", "rows"),
    [
        ("g", 0.028, "B5-g-parts B5-g-models BT-G0-dp BT-G1-dp BT-G-ratio"),
        ("shape_factor", 0.006, "B4-A-092-dp B4-A-099-dp B4-A-confluence-dp"),
        ("z_010", 0.2, "BT-z0-dp BT-z1-dp BT-z-ratio"),
        ("rho_star", 0.016, "B9-confluence-dp B9-limit-dp"),
    ],
)
def test_parameters_that_are_not_printed_decide_what_they_move(column, tolerance, rows):
    """Means over packings of 64 droplets under other force laws spread by more than three tolerances, or do not."""
    laws = open_tables().droplet_laws.query("n == 64").groupby(["gamma", "delta", "eps", "nv_small"])[column]
    means = laws.mean()[laws.count() >= 4]
    moves = means.max() - means.min() > 3 * tolerance
    assert {statements()[name].sentence == Sentence.UNPRINTED for name in rows.split()} == {moves}


# the rule of 27 November 2026 -----------------------------------------------------------------------------------------


@given(
    *(st.sampled_from([s for s in statements().values() if s.id in frozen_rule.frozen_rows()]), numbers, errors),
    st.lists(st.tuples(numbers, errors), max_size=3),
)
def test_the_frozen_rule_judges_as_the_rule_of_today(statement, off, error, others):
    """By its own arithmetic; a number within one tolerance by some analysis does not differ any more."""
    row = frozen_rule.frozen_rows()[statement.id]
    same = replace(statement, stated=row["stated"], argument=row["argument"], number=row["number"])
    m = found(statement.value + off, error, *[(statement.value + other, u) for other, u in others])
    ours = [(m.value, m.low, m.high), *((float(v.value), float(v.low), float(v.high)) for v in m.variants.values())]
    then, today = frozen_rule.frozen_verdict(row, same.relation, same.value, same.margin, ours), judge(same, m).verdict
    side = {"=": 0, ">": 1, "<": -1}[same.relation]
    off = [-side * (v - same.value) if side else abs(v - same.value) for v, _, _ in ours]
    near = min(off) < max(0.1 * scale(same.number, same.value), same.margin)
    assert today == then or (then == "differs" and near and today in ("tension", "compatible, weak", "not resolved"))


def test_a_bar_is_in_units_of_the_scale():
    """Off by 0.06 where the scale is 0.5: u = 0.01 of packings, 0.03/sqrt(3) of the analysis."""
    half = replace(ONE, value=0.5, margin=0.1)
    (bar,) = bars([judge(half, found(0.56, 0.01, (0.59, 0.01))), judge(half, Measured())])
    assert bar.off == pytest.approx(0.12) and bar.packings == pytest.approx(1.96 * 0.02)
    assert bar.both == pytest.approx(1.96 * 2 * np.hypot(0.01, 0.03 / 3**0.5))
    assert (bar.low, bar.high, bar.paper) == pytest.approx((-0.2, 0.2, 0.1))
    (far,) = bars([judge(replace(half, relation=">", stated="bound"), found(2.0, 0.01))])
    assert far.shown == SPAN < far.off and (far.low, far.high) == (0, SPAN)
