"""Verdicts on the papers' numbers: when ours agree, differ, or decide nothing."""

import numpy as np
import pytest
from drawn_figures import drawn

from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.published_numbers import Published
from jamlab.studies import conventions
from jamlab.studies.claims import Claim, Verdict, claim


@pytest.mark.parametrize(
    ("low", "high", "relation", "verdict"),
    [
        (0.9, 1.1, "=", "agrees"),
        (1.04, 1.1, "=", "agrees"),  # within the paper's margin
        (1.06, 1.1, "=", "differs"),
        (0.8, 0.94, "=", "differs"),
        (0.7, 1.3, "=", "undecided"),  # would have met 0.8 as well
        (1.06, 2.0, "=", "differs"),  # wide, and yet elsewhere
        (1.2, 1.3, ">", "agrees"),
        (0.9, 1.3, ">", "undecided"),
        (0.7, 0.9, ">", "differs"),
        (0.7, 0.9, "<", "agrees"),
        (1.2, 1.3, "<", "differs"),
    ],
)
def test_verdicts(low, high, relation, verdict):
    c = Claim("f", "q", 0.5 * (low + high), low, high, 1.0, 0.05, relation)
    assert c.verdict == verdict and c.agrees is (verdict == "agrees")


@pytest.mark.parametrize(
    ("low", "high", "paper", "scale", "undecided"),
    [
        (-0.56, 0.66, 0.55, 0.0, True),
        (0.35, 0.62, 0.55, 0.0, False),  # 0.55 is told from 0.27
        (0.3, 0.8, 0.55, 0.0, True),
        (-1.2, -0.4, -0.5, 0.0, True),
        (0.83, 0.86, 0.842, 0.01, True),  # packing fractions: against the distance to onset
        (0.8405, 0.8445, 0.842, 0.01, False),
        (-0.04, 0.04, 0.0, 0.0, False),  # zero has no scale: the margin alone decides
        (-0.1, 0.1, 0.0, 0.0, True),
    ],
)
def test_an_interval_that_could_not_have_disagreed_decides_nothing(low, high, paper, scale, undecided):
    c = Claim("f", "q", 0.5 * (low + high), low, high, paper, 0.05 if paper == 0 else 0.005, scale=scale)
    assert c.verdict == (Verdict.UNDECIDED if undecided else Verdict.AGREES)


@pytest.mark.parametrize(
    ("low", "high", "systematic", "verdict"),
    [
        (0.98, 1.02, 0.1, "agrees"),
        (0.98, 1.02, 0.3, "undecided"),  # an error of the definition never makes a number agree ...
        (1.2, 1.24, 0.3, "undecided"),  # ... nor differ where it could be either
        (1.2, 1.24, 0.1, "differs"),
    ],
)
def test_a_systematic_error_counts_against_agreement(low, high, systematic, verdict):
    assert Claim("f", "q", 0.5 * (low + high), low, high, 1.0, 0.05, systematic=systematic).verdict == verdict


def test_what_is_no_test_is_no_agreement():
    """Neither a number that its paper contradicts nor one that parameters were chosen for."""
    found = Interval(np.array(1.0), np.array(0.99), np.array(1.01))
    one = Published(1.0, 0.05)
    assert claim("f", "q", found, one).text == "agrees"
    assert claim("f", "q", found, one, contradiction="1 and 2", shown_by="g").text == "paper inconsistent: 1 and 2 (g)"
    assert claim("f", "q", found, one, calibrated="gamma").text == "calibrated: meets it; gamma"
    other = Published(2.0, 0.05)
    assert claim("f", "q", found, other, cause="N", shown_by="g").text == "differs: N (g)"
    assert claim("f", "q", found, other).text == "differs: no cause has been measured in these data"


def test_a_value_without_interval_is_not_measured_rather_than_right():
    one = Published(1.0)
    c = claim("f", "q", Interval(np.array(1.0), np.array(np.nan), np.array(np.nan)), one, how="one packing")
    assert not c.agrees and c.text.startswith("not measured: no interval: fewer than five packings, or most of their")
    assert claim("f", "q", None, one, how="no packing").text == "not measured: no packing"
    assert claim("f", "q", None, one, how="no packing", calibrated="gamma").text == "not measured: no packing"
    assert claim("f", "q", None, one).text == "not measured: too few data"


def test_contradictions_are_those_of_the_papers_own_numbers():
    """Each by hand: 3.7 sqrt(0.129) = 1.33; 7.1 * 0.045 + 3.3 sqrt(0.045) - 4 * 0.04 - 2.6 sqrt(0.04) = 0.34; ..."""
    assert conventions.same_states() == pytest.approx((0.129, 1.33, 1.22), abs=5e-3)
    assert conventions.exponent_of_contacts() == pytest.approx(0.66, abs=5e-3)


def test_numbers_that_the_paper_itself_contradicts_say_so():
    """z_J of disks is 4 - 2/N' by counting; one exponent of 0.8 is not that of table 1."""
    told = {c.quantity: c for name in ("tables", "boromand-6") for c in drawn(name).claims}
    counting, single = told["z_J, SP(φ)"], told["single exponent of z - z_J in drho, DP"]
    assert counting.verdict is Verdict.INCONSISTENT and counting.contradiction == conventions.contradiction_of_counting(
        256
    )
    assert (
        single.verdict is Verdict.INCONSISTENT
        and single.contradiction == conventions.contradiction_of_single_exponent()
    )
