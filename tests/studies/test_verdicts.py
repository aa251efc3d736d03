"""Verdicts on the papers' numbers: when ours agree, differ, or decide nothing."""

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from drawn_figures import drawn, tables
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import ks_2samp

from jamlab.errors import InputError
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.power_laws import fit_exponent
from studies import conventions, pages
from studies.baumgarten.crossovers import _ends
from studies.boromand.onset import _same_distribution
from studies.claims import SUMMARY, Claim, Verdict, claim, halves
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, vary_bootstrap
from studies.published_numbers import Published
from studies.tables import DATA

CLAIMS = Path("docs", "explanation", "claims_of_the_papers.csv")


@pytest.mark.parametrize(
    ("low", "high", "others", "relation", "verdict"),
    [
        (0.96, 1.04, (), "=", "agrees"),
        (1.04, 1.1, (), "=", "undecided"),  # reaches the paper's value within its margin, and reaches beyond
        (1.06, 1.1, (), "=", "differs"),
        (0.8, 0.94, (), "=", "differs"),
        (1.06, 2.0, (), "=", "differs"),  # wide, and yet elsewhere
        (1.0, 1.3, (), ">", "agrees"),
        (0.9, 1.3, (), ">", "undecided"),
        (0.7, 0.9, (), ">", "differs"),
        (0.7, 0.9, (), "<", "agrees"),
        (1.2, 1.3, (), "<", "differs"),
        (0.98, 1.02, ((0.97, 0.99), (1.0, 1.04)), "=", "agrees"),
        (0.98, 1.02, ((1.01, 1.06),), "=", "undecided"),  # choices of the fit count as packings do
        (1.2, 1.24, ((0.98, 1.02),), "=", "undecided"),
        (1.2, 1.24, ((0.7, 0.8),), "=", "undecided"),  # one on either side: some window between would agree
        (1.2, 1.24, ((1.4, 1.5), (1.1, 1.2)), "=", "differs"),
        (1.2, 1.24, ((1.06, 1.07),), "=", "differs"),  # with the interval of the choice, not that of the number
        (1.2, 1.24, ((1.06, np.nan),), "=", "undecided"),  # which stands where the choice has none
        (1.2, 1.3, ((1.1, 1.2),), ">", "agrees"),
        (1.2, 1.3, ((0.9, 1.1),), ">", "undecided"),
    ],
)
def test_one_rule_for_packings_and_for_choices_of_the_fit(low, high, others, relation, verdict):
    margin = 0.05 if relation == "=" else 0.0
    family = {str(k): Interval(*map(np.array, (np.nanmean(ends), *ends))) for k, ends in enumerate(others)}
    c = Claim("f", "q", 0.5 * (low + high), low, high, 1.0, margin, relation, family=family)
    assert c.verdict == verdict
    assert (f"from {c.allowed[0]:.4g} to {c.allowed[1]:.4g}" in c.reason) is (verdict == "undecided")


@given(
    *(st.floats(-2, 2), st.floats(0, 2), st.lists(st.tuples(st.floats(-3, 3), st.floats(0, 2)), max_size=3)),
    *(st.floats(0, 1), st.sampled_from("=<>")),
)
def test_more_packings_or_choices_never_turn_agreement_into_difference(value, half, others, margin, relation):
    """Narrowing an interval, or leaving choices out, may decide a number, and never swaps one verdict for the other."""
    family = {str(k): Interval(*map(np.array, (v, v - h, v + h))) for k, (v, h) in enumerate(others)}
    wide = Claim("f", "q", value, value - half, value + half, 1.0, margin, relation, family=family)
    narrow = Claim("f", "q", value, value - 0.5 * half, value + 0.5 * half, 1.0, margin, relation)
    assert wide.verdict in (narrow.verdict, Verdict.UNDECIDED)


def test_a_family_holds_what_its_choices_give():
    """x^2 has the exponent 2 in every window; a choice without a value is left out."""
    x = np.geomspace(0.1, 10, 21)
    slope = lambda low=0.1, high=10.0: fit_exponent(*(v[(x >= low) & (x <= high)] for v in (x, x**2)))  # noqa: E731
    assert halves(0.1, 10.0) == ({"low": pytest.approx(1.0)}, {"high": pytest.approx(1.0)})
    choices = (*halves(0.1, 10.0), {"low": 9.0})
    _, every = vary_bootstrap([np.ones(5)], lambda _, **window: slope(**window), *choices)
    assert {choice: float(v.value) for choice, v in every.items()} == pytest.approx({"low = 1": 2, "high = 1": 2})
    assert not claim("f", "q", None, Published(1.0), family={"a": None, "b": float("nan")}).family


def test_a_choice_has_the_interval_of_its_own_packings():
    """Twice the mean of the same packings has twice the interval, on the same resamples; a choice that fails, none."""

    def mean(groups, factor=1.0):
        if factor > 2:
            raise InputError("too large")
        return factor * groups[0].mean()

    packings = [np.random.default_rng(1).normal(3.0, 1.0, 30)]
    found, every = vary_bootstrap(packings, mean, {"factor": 2.0}, {"factor": 3.0})
    ends = lambda v: [float(v.value), float(v.low), float(v.high)]  # noqa: E731
    assert ends(found) == ends(bootstrap(packings, mean)) and list(every) == ["factor = 2"]
    assert ends(every["factor = 2"]) == pytest.approx([2 * end for end in ends(found)])


def test_what_is_no_test_is_no_agreement():
    """Neither a number that its paper contradicts nor one that parameters were chosen for."""
    found = Interval(np.array(1.0), np.array(0.99), np.array(1.01))
    one = Published(1.0, 0.05)
    assert claim("f", "q", found, one).text == "agrees"
    assert claim("f", "q", found, one, contradiction="1 and 2", shown_by="g").text == "paper inconsistent: 1 and 2 (g)"
    assert claim("f", "q", found, one, calibrated="gamma").text == "calibrated: agrees; gamma"
    assert claim("f", "q", found, one, unlike="other drag").text.startswith("undecided: other drag; from 0.99")
    other = Published(2.0, 0.05)
    assert claim("f", "q", found, other, cause="N", shown_by="g").text == "differs: N (g)"
    assert claim("f", "q", found, other).text == "differs: no cause has been measured in these data"


def test_a_value_without_interval_is_not_measured_rather_than_right():
    one = Published(1.0)
    c = claim("f", "q", Interval(np.array(1.0), np.array(np.nan), np.array(np.nan)), one, how="one packing")
    assert c.text.startswith("not measured: no interval: fewer than five packings, or most of their")
    assert claim("f", "q", None, one, how="no packing").text == "not measured: no packing"
    assert claim("f", "q", None, one, how="no packing", calibrated="gamma").text == "not measured: no packing"
    assert claim("f", "q", None, one).text == "not measured: too few data"


def test_contradictions_are_those_of_the_papers_own_numbers():
    """Each by hand: 3.7 sqrt(0.129) = 1.33; 7.1 * 0.045 + 3.3 sqrt(0.045) - 4 * 0.04 - 2.6 sqrt(0.04) = 0.34; ..."""
    assert conventions.same_states() == pytest.approx((0.129, 1.33, 1.22), abs=5e-3)
    assert conventions.end_of_droplet_fit() == pytest.approx(0.958, abs=5e-4)
    assert conventions.exponents_of_tables() == pytest.approx((0.66, 0.92), abs=5e-3)


def test_numbers_that_the_paper_itself_contradicts_say_so():
    """One exponent of 0.8 is neither that of table 1 nor that of table 2, whether ours meets it or not."""
    told = {c.quantity: c for c in drawn("boromand-6").claims}
    for table, what in ((1, "z - z_J"), (2, "G")):
        single = told[f"single exponent of {what} in drho, DP"]
        assert single.verdict is Verdict.INCONSISTENT
        assert single.contradiction == conventions.contradiction_of_single_exponent(table)


def test_two_packings_of_a_size_do_not_hide_the_others():
    """Of 1024 disks few reach z = 6: the collapse of sizes is that of the others."""
    states = tables().states
    found = {c.quantity: c for c in drawn("boromand-7").claims}["exponent of (z_conf - z) N in N, SP"]
    disks = states[(states["model"] == "sp") & (states["n"] == states["n"].max())]
    few = disks[(disks["z"] < 6) | disks["seed"].isin(disks["seed"].unique()[:2])].assign(n=2048)
    both = EnsembleTables({"states": pd.concat([states, few])}.get)
    (c,) = (c for c in pages.draw("boromand-7", both).claims if c.quantity == found.quantity)
    assert found.measured and (c.value, c.low, c.high) == (found.value, found.low, found.high)


WITHOUT_NUMBER = {"method", "drawn", "no number", "not measured"}  # what may stand for a number


def test_every_claim_of_the_papers_has_its_numbers_and_every_number_its_claim():
    """The list by section against the rows that ship, `summary.txt`, of which the slow test draws every one anew."""
    listed = list(csv.reader((Path(__file__).parents[2] / CLAIMS).read_text(encoding="utf-8").splitlines()))[1:]
    lines = (DATA / SUMMARY).read_text(encoding="utf-8").splitlines()[1:]
    numbers = {line.strip().split(" | ")[0] for line in lines}
    named = {name for _, _, cell in listed for name in cell.split(" | ") if name not in WITHOUT_NUMBER}
    assert len(listed) > 80 and all(place.startswith(("[B] ", "[T] ")) and fact for place, fact, _ in listed)
    assert named - numbers == set() and numbers - named == set()


def test_samples_of_one_distribution_are_told_from_others():
    """Two thousand numbers, and the same a tenth of a width further: scipy's test of both."""
    a, b = np.random.default_rng(3).normal(0.84, 0.01, (2, 2000))
    for other in (b, b + 0.001):
        assert _same_distribution(a, other) == pytest.approx(ks_2samp(a, other, method="asymp").pvalue, rel=0.05)
    assert _same_distribution(a, a) == 1


def test_regimes_of_root_laws_end_where_they_cross():
    """G'' = omega^0.5 meets eta_0 omega at 0.3 p and eta_inf omega at 2, whatever the packings' common factor."""
    pressures, omega = [1e-4, 1e-3, 1e-2], np.geomspace(1e-3, 10, 401)
    numbers = [[(0.3 * p) ** -0.5, 2**-0.5, *omega**0.5] for p in pressures]
    drawn = [np.outer([0.8, 1.2], row) for row in numbers]
    ends = _ends(pressures, [omega] * 3, drawn)
    assert ends == pytest.approx([0, np.log10(0.3), np.log10(2)], abs=1e-4)
    assert _ends(pressures, [omega] * 3, drawn, pressure=0)[1] == pytest.approx(ends[1])
