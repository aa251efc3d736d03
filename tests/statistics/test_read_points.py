"""Published points are read from CSV; what cannot be read is named."""

import numpy as np
import pytest

from jamlab.errors import StorageError
from jamlab.statistics.read_points import read_points


def test_published_points(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("# read off by eye\nrho, z\n0.84,4.0\n\n0.9,\n")
    points = read_points(path, ("rho", "z"))
    np.testing.assert_array_equal(points["rho"], [0.84, 0.9])
    np.testing.assert_array_equal(points["z"], [4.0, np.nan])


def test_bad_points_are_named(tmp_path):
    path = tmp_path / "points.csv"
    with pytest.raises(StorageError):
        read_points(path)
    for text, named in {"": "", "rho,a\n1,2": "rho, a", "rho,z\n1,2,3": "3", "rho,z\n0.8,4\n0.9,four": "four"}.items():
        path.write_text(text)
        with pytest.raises(StorageError) as caught:
            read_points(path, ("rho", "z"))
        assert named in str(caught.value) and str(path) in str(caught.value)
