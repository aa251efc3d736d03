"""One confidence for all intervals, and the error that is left beside a bias."""

import inspect
import re
from importlib import resources
from pathlib import Path

import pytest
from scipy import stats

from jamlab.statistics.bootstrap import bootstrap
from jamlab.statistics.confidence import CONFIDENCE, STANDARD_ERRORS, room


def test_standard_errors_hold_a_normal_variable_so_often():
    assert stats.norm.cdf(STANDARD_ERRORS) - stats.norm.cdf(-STANDARD_ERRORS) == pytest.approx(CONFIDENCE)
    assert inspect.signature(bootstrap).parameters["level"].default == CONFIDENCE


def test_no_module_has_a_confidence_of_its_own():
    """Were it another constant, or 2 in its place, changing the first would leave some intervals as they were."""
    own = re.compile(
        r"\b1\.96\b|(level|confidence)\w*(: float)? = 0\.95|two standard errors"
        r"|\b2(\.0)? \* [\w(]*(scatter|standard_error|stderr)"
        r"|(ppf|ndtri|stdtrit|quantile)\([^\n]*\b0\.(95|05|975|025)\b",
        re.IGNORECASE,
    )
    found = [p.name for p in Path(str(resources.files("jamlab"))).rglob("*.py") if own.search(p.read_text("utf-8"))]
    assert found == ["confidence.py"]


def test_bias_and_scatter_fill_an_error():
    assert room(0.2, 0.12) == pytest.approx(0.16) and room(0.2, 0.0) == 0.2
    assert room(0.1, 0.4) == room(0.4, 0.4) == 0.2
