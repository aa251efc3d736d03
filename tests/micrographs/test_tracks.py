"""Droplets followed: the same droplet has the same number; bad sources are refused."""

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from scipy.optimize import linear_sum_assignment

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.tracks import _link, _match

pytest.importorskip("skimage")


@pytest.mark.parametrize(("moved", "droplets"), [(4.9, 1), (5.1, 2)])
def test_no_droplet_goes_further_than_half_the_spacing(moved, droplets):
    tables = [pd.DataFrame({"x": [x], "y": [0.0], "cell": [100.0]}) for x in (0.0, moved)]
    assert _link(tables)["particle"].nunique() == droplets


def test_a_droplet_that_is_missed_keeps_its_number_as_long_as_it_is_remembered():
    places = [[0.0, 20.0, 40.0], [0.0, 40.5], [0.5, 41.0], [0.5, 21.0, 41.0]]  # the second is missed twice
    tables = [pd.DataFrame({"x": x, "y": 0.0, "cell": 100.0}) for x in places]
    for memory, last in ((1, [0, 3, 2]), (2, [0, 1, 2])):
        linked = _link(tables, memory)
        assert linked.loc[linked["frame"] == 3, "particle"].tolist() == last


def test_matching_is_that_of_all_distances_and_takes_no_square_of_memory():
    rng = np.random.default_rng(4)
    for n, m in ((30, 30), (40, 20), (15, 40)):
        old, new = 10 * rng.random((n, 2)), 10 * rng.random((m, 2))
        squared = np.minimum(((old[:, None] - new) ** 2).sum(axis=2), 1.0)
        expected = squared[linear_sum_assignment(squared)].sum()
        rows, columns = _match(old, new, 1.0)
        assert len(set(rows)) == len(set(columns)) == len(rows) > 3
        assert squared[rows, columns].sum() + min(n, m) - len(rows) == pytest.approx(expected, rel=1e-12)
    many = 100 * rng.random((8_000, 2))  # all distances would be 0.5 GB
    rows, columns = _match(many, many + 0.01, 0.5)
    assert len(rows) == len(many) and (rows == columns).mean() > 0.99


def test_pictures_are_linked_whatever_their_order_of_droplets(tmp_path):
    y, x = np.mgrid[:160, :200]
    pictures = []
    for shift in range(3):
        a = 32
        away = np.hypot((x - 2 * shift - (y // a) % 2 * 13) % a - a / 2, y % a - a / 2)
        pictures.append(1 / (1 + np.exp(away - 13)))
        Image.fromarray((255 * pictures[-1]).astype(np.uint8)).save(tmp_path / f"frame{shift}.png")
    tracks = jamlab.track_droplets(sorted(tmp_path.glob("*.png")), contrast="bright")
    moved = tracks.sort_values("frame").groupby("particle")["x"].diff().dropna()
    seen = tracks.groupby("particle").size()
    assert (seen == 3).sum() > 10 and list(np.unique(tracks["frame"])) == [0, 1, 2]
    np.testing.assert_allclose(moved, 2.0, atol=0.6)
    pd.testing.assert_frame_equal(
        jamlab.track_droplets(np.array(pictures), contrast="bright")[["frame", "particle"]],
        tracks[["frame", "particle"]],
    )


def test_bad_sources_are_refused(tmp_path):
    picture = np.random.default_rng(1).random((40, 40))
    for source, how in ((tmp_path, {}), ("t.csv", {}), (1.5, {}), ([picture], {}), ([picture] * 2, {"memory": -1})):
        with pytest.raises(InputError):
            jamlab.track_droplets(source, **how)
