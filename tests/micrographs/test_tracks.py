"""Droplets followed: affine motion has its strain and no D2min, a swap of four is a T1, bad tables are refused."""

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from scipy.optimize import linear_sum_assignment

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.tracks import _link, _match

pytest.importorskip("skimage")


def frames(*places):
    parts = [
        pd.DataFrame({"frame": k, "particle": np.arange(len(p)), "x": p[:, 0], "y": p[:, 1]})
        for k, p in enumerate(places)
    ]
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def lattice():
    k, m = np.meshgrid(np.arange(8), np.arange(8))
    places = np.column_stack([(k + 0.5 * (m % 2)).ravel(), np.sqrt(0.75) * m.ravel()])
    return places + 0.03 * np.random.default_rng(1).normal(size=places.shape)


def test_affine_motion_has_its_strain_and_no_d2min(lattice):
    gradient = np.array([[0.01, 0.02], [0.0, -0.005]])
    tracks = jamlab.track_droplets(frames(lattice, lattice @ (np.eye(2) + gradient) + 3.0))
    now = tracks.table[tracks.table["frame"] == 1].dropna()  # a corner has two neighbours and no strain
    assert len(now) >= 60
    np.testing.assert_allclose(now["strain_xx"], 0.01, atol=1e-10)
    np.testing.assert_allclose(now["strain_yy"], -0.005, atol=1e-10)
    np.testing.assert_allclose(now["strain_xy"], 0.01, atol=1e-10)
    assert now["d2min"].max() < 1e-20 and tracks.table["d2min"].isna().sum() == 2 * len(lattice) - len(now)
    assert tracks.count == 64 and tracks.spacing == pytest.approx(1, abs=0.05)


def test_d2min_of_one_that_moves_alone_is_its_displacement_squared():
    """The vectors to the six neighbours of a triangular lattice change alike, which no gradient fits."""
    angle = np.arange(6) * np.pi / 3
    ring = np.vstack([[[0.0, 0.0]], np.column_stack([np.cos(angle), np.sin(angle)])])
    moved = ring + np.where(np.arange(7)[:, None] == 0, [0.06, 0.08], 0.0)
    now = jamlab.track_droplets(frames(ring, moved)).table.query("frame == 1 and particle == 0")
    assert now["d2min"].item() == pytest.approx(0.01)


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


def test_frames_keep_their_numbers_and_columns_of_others_are_not_lost(lattice):
    shifted = lattice[:, ::-1] * [1.0, 1.1]
    halves = frames(lattice, shifted).assign(frame=lambda t: 0.5 * t["frame"])
    tracks = jamlab.track_droplets(halves)
    assert len(tracks.events) and set(tracks.events["frame"]) == {0.5}
    again = jamlab.track_droplets(tracks.table)
    pd.testing.assert_frame_equal(again.table, tracks.table)
    with pytest.raises(InputError):
        jamlab.track_droplets(halves.assign(strain_xx=7.0))


def test_four_that_swap_neighbours_are_one_t1():
    around = 2.0 * np.column_stack([np.cos(np.arange(8) * np.pi / 4 + 0.2), np.sin(np.arange(8) * np.pi / 4 + 0.2)])
    wide = np.vstack([[[0.5, 0], [-0.5, 0], [0, 0.9], [0, -0.9]], around])
    tall = np.vstack([[[0.9, 0], [-0.9, 0], [0, 0.5], [0, -0.5]], around])
    events = jamlab.track_droplets(frames(wide, tall)).events
    swaps = events[events["kind"] == "T1"]
    assert [tuple(row) for row in swaps[["a", "b", "c", "d"]].to_numpy()] == [(0, 1, 2, 3)]
    back = jamlab.track_droplets(frames(tall, wide)).events.query("kind == 'T1'")
    assert [tuple(row) for row in back[["a", "b", "c", "d"]].to_numpy()] == [(2, 3, 0, 1)]


def test_pictures_are_linked_whatever_their_order_of_droplets(tmp_path):
    y, x = np.mgrid[:160, :200]
    pictures = []
    for shift in range(3):
        a = 32
        away = np.hypot((x - 2 * shift - (y // a) % 2 * 13) % a - a / 2, y % a - a / 2)
        pictures.append(1 / (1 + np.exp(away - 13)))
        Image.fromarray((255 * pictures[-1]).astype(np.uint8)).save(tmp_path / f"frame{shift}.png")
    tracks = jamlab.track_droplets(sorted(tmp_path.glob("*.png")), contrast="bright")
    moved = tracks.table.sort_values("frame").groupby("particle")["x"].diff().dropna()
    assert tracks.count > 10 and len(tracks.events) == 0
    np.testing.assert_allclose(moved, 2.0, atol=0.6)
    again = jamlab.track_droplets(pictures, contrast="bright")
    assert again.count == tracks.count
    assert tracks.plot().get_xlabel() == "x"
    tracks.table.to_csv(tmp_path / "tracks.csv", index=False)
    assert jamlab.track_droplets(tmp_path / "tracks.csv").count == tracks.count


def test_bad_tables_and_sources_are_refused(lattice, tmp_path):
    table = frames(lattice, lattice)
    (tmp_path / "t.csv").write_text("a,b\n1,2\n")
    for source in (
        table.drop(columns="particle"),
        table[table["frame"] == 0],
        table.assign(x=np.nan),
        table.assign(particle=0),
        table.assign(y=0.0),
        table[table["particle"] < 2],
        tmp_path / "nowhere",
        tmp_path,  # no pictures
        tmp_path / "t.csv",
        1.5,
    ):
        with pytest.raises(InputError) as error:
            jamlab.track_droplets(source)
        assert "\n" not in str(error.value)
    with pytest.raises(InputError):
        jamlab.track_droplets(table, memory=-1)
