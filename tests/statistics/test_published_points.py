"""Published points from CSV: columns by name, comments, empty fields; what is wrong is named with its line."""

import numpy as np
import pytest

from jamlab.errors import StorageError
from jamlab.statistics.published_numbers import read_points


def test_published_points(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("# read off by eye\nrho, z\n0.84,4.0\n\n0.9,\n")
    points = read_points(path, ("rho", "z"))
    np.testing.assert_array_equal(points["rho"], [0.84, 0.9])
    np.testing.assert_array_equal(points["z"], [4.0, np.nan])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("rho,a\n1,2", "has columns rho, a: needs rho, z"),
        ("rho,z\n1,2,3", "line 2: 3 fields, needs 2"),
        ("rho,z\n0.8,4\n0.9,four", "line 3: 'four' in column z"),
    ],
)
def test_bad_points_are_named(tmp_path, text, message):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(StorageError, match=message):
        read_points(path, ("rho", "z"))


def test_missing_points(tmp_path):
    with pytest.raises(StorageError, match=r"none\.csv cannot be read"):
        read_points(tmp_path / "none.csv")
