"""Droplets followed: the same droplet has the same number; bad sources are refused."""

import json

import numpy as np
import pandas as pd
import pytest
from commands import call
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


def test_a_stack_of_labels_that_is_a_colour_picture_is_refused_with_the_remedy(tmp_path):
    pytest.importorskip("tifffile").imwrite(tmp_path / "t.tif", STACK.astype(np.uint16), photometric="rgb")
    with pytest.raises(InputError, match=r"source has 1 frame: .* give labels="):
        jamlab.track_droplets(tmp_path / "t.tif")
    assert jamlab.track_droplets(labels=tmp_path / "t.tif")["frame"].max() == 2


# series of labels -----------------------------------------------------------------------------------------------------

ROW, COLUMN = np.mgrid[:90, :120] + 0.5


def moving(k):
    """Labels of twelve circles that move by 1.5 pixels a frame."""
    away = np.hypot((COLUMN - 1.5 * k) % 30 - 15, ROW % 30 - 15)
    return np.where(away < 13, np.floor(ROW / 30) * 4 + np.floor((COLUMN - 1.5 * k) % 120 / 30) + 1, 0).astype(int)


STACK = np.array([moving(k) for k in range(3)])


@pytest.fixture(scope="module")
def expected():
    return jamlab.track_droplets(labels=STACK)


FORMS = {
    "list": lambda path: {"source": list(STACK)},
    "array": lambda path: {"source": STACK},
    "list of labels": lambda path: {"labels": list(STACK)},
    "masks": lambda path: {"source": STACK > 0},
    "masks of bytes": lambda path: {"source": (255 * (STACK > 0)).astype(np.uint8)},
    "micrographs": lambda path: {"source": [jamlab.micrograph(labels=each) for each in STACK]},
    "pages": lambda path: {"source": path / "t.tif"},
    "pages of labels": lambda path: {"labels": str(path / "t.tif")},
    "npy": lambda path: {"source": str(path / "t.npy")},
    "files": lambda path: {"labels": [path / f"{k}.png" for k in range(3)]},
    "files as source": lambda path: {"source": [path / f"{k}.png" for k in range(3)]},
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.slow
def test_labels_are_tracked_in_every_form(tmp_path, expected, form):
    pytest.importorskip("tifffile").imwrite(tmp_path / "t.tif", STACK.astype(np.uint16), photometric="minisblack")
    np.save(tmp_path / "t.npy", STACK)
    for k, each in enumerate(STACK):
        Image.fromarray(each.astype(np.uint8)).save(tmp_path / f"{k}.png")
    tracks = jamlab.track_droplets(**FORMS[form](tmp_path))
    columns = ["frame", "x", "y", "area"]
    pd.testing.assert_frame_equal(
        tracks[columns].sort_values(columns, ignore_index=True),
        expected[columns].sort_values(columns, ignore_index=True),
    )
    moved = tracks.sort_values("frame").groupby("particle")["x"].diff().dropna()
    assert (tracks.groupby("particle").size() == 3).sum() == 9 and abs(moved - 1.5).max() <= 0.51


def test_a_dark_frame_is_passed_over_and_named():
    dark = 0 * STACK[1]
    with pytest.warns(jamlab.JamlabWarning, match="frame 1 of 3 without droplets") as caught:
        tracks = jamlab.track_droplets([STACK[0], dark, STACK[2]], memory=1)
    named = [each.filename for each in caught if each.category is jamlab.JamlabWarning]
    assert named == [__file__] and sorted(set(tracks["frame"])) == [0, 2]
    assert (tracks.groupby("particle").size() == 2).sum() == 9
    with pytest.warns(jamlab.JamlabWarning):
        forgotten = jamlab.track_droplets([STACK[0], dark, STACK[2]])
    assert forgotten["particle"].nunique() == len(forgotten)
    picture = 1 / (1 + np.exp(np.hypot(COLUMN % 30 - 15, ROW % 30 - 15) - 12))
    with pytest.warns(jamlab.JamlabWarning, match="frame 0 of 3"):
        assert set(jamlab.track_droplets([0 * picture, picture, picture], contrast="bright")["frame"]) == {1, 2}


@pytest.mark.parametrize(
    ("source", "how", "words"),
    [
        ([STACK[0], 1.5 * STACK[1]], {}, "frame 1: labels must be whole"),
        ([STACK[0], STACK[1][:-9]], {}, r"frame 1 has the size \(81, 120\)"),
        ([0 * STACK[0]] * 2, {}, "no frame of 2 has droplets"),
        (["no.png", "none.png"], {}, r"frame 0: no\.png"),
        (STACK[0], {}, "one array"),
        (STACK[:1], {}, "1 frame: tracking"),
        (None, {}, "give pictures"),
        (STACK * 1.1, {"labels": STACK[:2]}, "3 pictures and 2 labels"),
    ],
)
def test_errors_of_a_series_name_the_frame(source, how, words):
    with pytest.raises(InputError, match=words):
        jamlab.track_droplets(source, **how)


def test_what_is_measured_already_takes_no_more_arguments():
    found = [jamlab.micrograph(labels=each) for each in STACK[:2]]
    for how, words in (
        ({"pixel": 2.0}, "pixel: frames are Micrographs"),
        ({"labels": STACK[:2]}, "labels: frames are"),
    ):
        with pytest.raises(InputError, match=words):
            jamlab.track_droplets(found, **how)
    with pytest.raises(InputError, match="frame 1 is a ndarray"):
        jamlab.track_droplets([found[0], STACK[1]])


def test_command_tracks_a_file_of_several_pages(tmp_path, expected):
    np.save(tmp_path / "t.npy", STACK)
    done = call(tmp_path, "analyze", "--labels", "t.npy", "--csv", "tracks.csv", "--json")
    shown = json.loads(done.stdout)
    assert [each["count"] for each in shown["frames"]] == [(expected["frame"] == k).sum() for k in range(3)]
    assert shown["in_all_frames"] == 9 and len(pd.read_csv(tmp_path / "tracks.csv")) == len(expected)
    refused = call(tmp_path, "analyze", "--labels", "t.npy", "--overlay", "x.png")
    assert refused.exit_code == 1 and "--overlay: not for a series" in refused.stderr
    np.save(tmp_path / "one.npy", STACK[0])
    refused = call(tmp_path, "analyze", "--labels", "one.npy", "--memory", "1")
    assert refused.exit_code == 1 and "--memory" in refused.stderr


def test_command_prints_two_digits_of_an_uncertainty(tmp_path):
    np.save(tmp_path / "one.npy", STACK[0])
    row = next(line for line in call(tmp_path, "analyze", "--labels", "one.npy").stdout.splitlines() if " rho " in line)
    uncertainty = jamlab.micrograph(labels=STACK[0]).numbers["rho"].uncertainty
    assert f"{float(f'{uncertainty:.2g}'):g}" in row.split()
