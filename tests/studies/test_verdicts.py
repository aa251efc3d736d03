"""The rule that compares a number of a paper with ours."""

from dataclasses import replace

import numpy as np
import pytest

from jamlab.statistics.bootstrap import Interval
from studies.papers.statements import Measured, Statement
from studies.papers.verdicts import Comparison, first_line

ONE = Statement("x", "f", "[B] sec 1", "q", "$q$", 1.0, "=", 0.05, "line", 2.0, "exponent", "measured", "said")


@pytest.mark.parametrize(
    ("low", "high", "others", "relation", "verdict"),
    [
        (0.96, 1.04, (), "=", "agrees"),
        (1.04, 1.1, (), "=", "undecided"),  # reaches the paper's value within its margin, and reaches beyond
        (1.06, 1.1, (), "=", "differs"),
        (1.06, 2.0, (), "=", "differs"),  # wide, and yet elsewhere
        (1.0, 1.3, (), ">", "agrees"),
        (0.9, 1.3, (), ">", "undecided"),
        (0.7, 0.9, (), ">", "differs"),
        (0.7, 0.9, (), "<", "agrees"),
        (0.98, 1.02, ((1.01, 1.06),), "=", "undecided"),  # analyses count as packings do
        (1.2, 1.24, ((0.7, 0.8),), "=", "undecided"),  # one on either side: some window between would agree
        (1.2, 1.24, ((1.06, 1.07),), "=", "differs"),  # with the interval of the analysis, not that of the number
        (1.2, 1.24, ((1.06, np.nan),), "=", "undecided"),  # which stands where the analysis has none
    ],
)
def test_one_rule_for_packings_and_for_analyses(low, high, others, relation, verdict):
    statement = replace(ONE, relation=relation, margin=0.05 if relation == "=" else 0.0)
    variants = {str(k): Interval(*map(np.array, (np.nanmean(ends), *ends))) for k, ends in enumerate(others)}
    assert Comparison(statement, Measured(0.5 * (low + high), low, high, variants)).verdict == verdict


def test_what_is_no_test_is_no_agreement():
    found = Measured(1.0, 0.99, 1.01)
    expected = {"paper inconsistent": "paper inconsistent", "fit target": "calibrated", "not comparable": "undecided"}
    for status, verdict in expected.items():
        assert Comparison(replace(ONE, status=status), found).verdict == verdict
    assert Comparison(ONE, Measured(1.0)).verdict == "not measured"  # a value without interval
    rows = [Comparison(replace(ONE, status=status), found) for status in ("measured", "identity")]
    rows.append(Comparison(replace(ONE, where="Tighe 2010"), found))
    assert first_line(rows) == "1 numbers of both papers: agrees 1."
    assert rows[0].row()["verdict"] == "agrees"
