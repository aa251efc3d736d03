"""Micrographs: pictures with known numbers come back with them, and what is wrong is doubted or refused."""

import json

import numpy as np
import pytest
from commands import call
from PIL import Image
from rendered_pictures import droplets_seen, picture_errors, truth
from scipy import stats

import jamlab
from jamlab.errors import InputError, StorageError
from jamlab.micrographs.picture_numbers import LIMITS
from jamlab.micrographs.quality import DOUBT
from jamlab.packing.quantities import COLUMNS

skimage = pytest.importorskip("skimage")


def discs(centres, radius, shape=(130, 150)):
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    picture = np.zeros(shape)
    for cx, cy in centres:
        picture = np.maximum(picture, np.clip(radius - np.hypot(x - cx, y - cy) + 0.5, 0, 1))
    return picture


def lattice(gap, radius=16, **how):
    """Hexagonal lattice that the edge of the picture cuts."""
    a = 2 * radius + gap
    k, m = np.meshgrid(np.arange(-6, 12), np.arange(-2, 10))
    centres = np.column_stack([(a * (k + 0.5 * m)).ravel(), (a * np.sqrt(0.75) * m).ravel()])
    return discs(centres + 3, radius, **how)


@pytest.fixture(scope="module")
def touching():
    return jamlab.micrograph(lattice(1.0, shape=(185, 190)), pixel=0.5, contrast="bright")


@pytest.fixture(scope="module")
def rendered(dp_dense):
    """A packing as a camera sees it: uneven light, noise, blur."""
    how = {"light": 0.6, "noise": 0.05, "blur": 1.0}
    return jamlab.synthetic_micrograph(dp_dense, 150, film=1.5, **how)


def test_films_between_large_droplets_are_not_taken_for_the_ground(dp_dense):
    """Levels of large droplets are of every second pixel, of which a film may be one wide: rho was 0.05 too low."""
    *_, denser = jamlab.compress(dp_dense, to=0.95, step=0.03)
    found = jamlab.micrograph(np.tile(jamlab.synthetic_micrograph(denser, 256), (2, 2)), contrast="bright")
    assert found.rho == pytest.approx(jamlab.packing_fraction(denser), abs=0.02)


def test_hexagonal_lattice(touching):
    assert touching.count >= DOUBT.fewest and touching.cut > 0 and touching.quality == "good"
    np.testing.assert_allclose(touching.areas.mean(), np.pi * 8**2, rtol=0.1)  # films and their corners
    np.testing.assert_allclose(touching.shape_factor, 1.0, atol=0.02)
    np.testing.assert_allclose(touching.cells.mean(), np.sqrt(0.75) * 16.5**2, rtol=0.02)
    assert touching.z == 6.0 and not touching.rattlers.any()
    assert touching.voids.probability == {3: 1.0}
    means = {name: number for name, number in touching.numbers.items() if number.count}
    assert means.keys() - COLUMNS == set() and means["shape_factor_rim"].value == touching.shape_factor.mean()


def test_means_say_how_far_they_are_known(rendered):
    """Standard errors by hand; a picture of few droplets is doubted for that, whatever it looks like."""
    found = jamlab.micrograph(rendered, contrast="bright")
    held = found.contacts[~found.rattlers]
    z = found.numbers["z"]
    assert (z.value, z.count) == (found.z, len(held)) and z.error == pytest.approx(held.std(ddof=1) / len(held) ** 0.5)
    low, high = stats.t.interval(0.95, len(held) - 1, z.value, z.error)
    assert z.interval == pytest.approx((low - LIMITS["z"], high + LIMITS["z"]))  # and what a good picture may err
    assert found.numbers["rho"].value == found.rho and 0.001 < found.numbers["rho"].error < 0.02
    assert f"z = {found.z:.2f} ± {z.uncertainty:.2f}" in repr(found) and len(repr(found)) < 200
    assert found.reasons[-1] == f"{found.count} whole droplets only, needs {DOUBT.fewest}: means over more may differ"


def test_table_has_a_row_per_droplet(touching):
    table = touching.table()
    assert len(table) == touching.count and set(table["quality"]) == {"good"}
    np.testing.assert_array_equal(table["contacts"], 6)
    places = np.rint(table[["y", "x"]].to_numpy() / 0.5).astype(int)
    np.testing.assert_array_equal(touching.labels[tuple(places.T)], table["droplet"])


def test_overlay_is_a_picture_and_whole(touching, tmp_path):
    touching.draw(tmp_path / "overlay.png")
    with Image.open(tmp_path / "overlay.png") as image:
        assert image.width > 600
    labels = [text.get_text() for text in touching.plot().texts]
    assert labels == [str(k) for k in range(1, touching.count + 1)]
    with pytest.raises(StorageError):
        touching.draw(tmp_path / "nowhere" / "overlay.png")
    assert [path.name for path in tmp_path.iterdir()] == ["overlay.png"]


def outside(figure):
    """Inches by which something drawn sticks out of a figure."""
    figure.draw_without_rendering()
    box, size = figure.get_tightbbox(), figure.get_size_inches()
    return max(-box.x0, -box.y0, box.x1 - size[0], box.y1 - size[1])


def test_plot_passes_its_style_to_the_outlines(touching):
    axes = touching.plot(linewidth=3, color="black")
    assert axes.collections[0].get_linewidths() == [3]
    np.testing.assert_array_equal(axes.collections[0].get_edgecolors(), [[0, 0, 0, 1]])
    with pytest.raises(InputError):
        touching.plot(nonsense=1)


@pytest.mark.parametrize("shape", [(185, 190), (60, 190), (185, 70)])
@pytest.mark.slow
def test_titles_and_legends_are_shown_whole(shape, tmp_path):
    from matplotlib import pyplot

    found = jamlab.micrograph(lattice(1.0, shape=shape), contrast="bright")
    assert outside(found.plot().figure) <= 0
    pyplot.close("all")
    found.draw(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        border = np.array(image.convert("L"))
    assert (np.concatenate([border[0], border[-1], border[:, 0], border[:, -1]]) == 255).all()
    figure, axes = pyplot.subplots(figsize=(4, 4))
    found.plot(axes)
    assert axes.get_title().count("\n") == 1 and outside(figure) <= 0
    pyplot.close("all")


@pytest.mark.parametrize("depth", [-0.05, 0.05])
def test_droplets_that_the_edge_cuts_by_a_twentieth_of_their_radius_are_not_whole(depth):
    y, x = np.mgrid[:160, :192] + 0.5
    away = np.hypot((x + 16 * depth) % 34 - 16, y % 34 - 16)
    found = jamlab.micrograph(1 / (1 + np.exp(3 * (away - 16))), contrast="bright")
    assert (found.centres[:, 0].min() > 34) == (depth > 0)


def test_dark_droplets_are_seen_as_such():
    picture = lattice(1.0, shape=(100, 110))
    dark, bright = jamlab.micrograph(1 - picture), jamlab.micrograph(picture)
    assert bright.contrast == "bright" and dark.contrast == "dark"
    np.testing.assert_allclose(dark.areas, bright.areas, rtol=1e-9)


def test_droplets_apart_touch_none_and_are_doubted():
    found = jamlab.micrograph(lattice(8.0, shape=(110, 120)), contrast="bright")
    assert np.isnan(found.z) and found.rattlers.all() and not found.contacts.any()
    assert found.z_all == 0 and found.numbers["z"].quality == "doubtful"


def test_four_periods_of_a_rendered_packing_come_back(dp_dense):
    period = jamlab.synthetic_micrograph(dp_dense, 150, film=1.5, noise=0.05, blur=1.0)
    picture = np.tile(period, (2, 2)) * np.linspace(1, 0.6, 300)
    found = jamlab.micrograph(picture, contrast="bright", pixel=dp_dense.box[0, 0] / 150)
    known = jamlab.measure(dp_dense)
    assert abs(found.rho - known["rho"]) < 0.015 and abs(found.z - known["z"]) <= 0.4
    assert abs(found.shape_factor.mean() - known["shape_factor_rim"]) < 0.02
    own, distance = droplets_seen(dp_dense, found)
    assert distance.max() < 0.05 and len(set(own)) == dp_dense.n < found.count
    local = jamlab.local_packing_fraction(dp_dense)[own]
    np.testing.assert_allclose(found.table()["local_packing_fraction"], local, atol=0.03)


def test_edges_cut_droplets(dp_dense):
    """Errors of what the picture shows whole; the truth itself counts fewer than the packing has."""
    known = truth(dp_dense)
    assert 0 < known.count < dp_dense.n
    row = picture_errors(dp_dense, 150, known, film=1.5)
    assert row["right"], row
    assert set(LIMITS) < set(row) and row["quality"] == "doubtful" and "whole droplets only" in row["reasons"]


@pytest.mark.parametrize("name", [pytest.param("page", marks=pytest.mark.slow), "coins", "text", "logo"])
def test_photographs_of_something_else_are_doubted_or_refused(name):
    """Coins on cloth, print, a drawing with an opacity channel."""
    try:
        found = jamlab.micrograph(getattr(skimage.data, name)()[40:190, 40:210])
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert found.quality == "doubtful" and found.numbers["rho"].quality == "doubtful"


def test_command_writes_overlay_and_csv_and_names_the_unit(rendered, tmp_path):
    Image.fromarray((rendered * 2**15).clip(0, 65535).astype(np.uint16)).save(tmp_path / "photo.png")
    done = call(
        tmp_path, "analyze", "photo.png", "--contrast", "bright", "--overlay", "out.png", "--csv", "droplets.csv"
    )
    assert done.exit_code == 0, done.stderr
    rows = (tmp_path / "droplets.csv").read_text().splitlines()
    assert rows[0].startswith("droplet,x,y,area")
    verdicts = [row.rpartition(",")[2] for row in rows[1:]]  # each is that of the droplet, not of the few droplets
    assert set(verdicts) <= {"good", "doubtful"} and verdicts.count("good") > len(verdicts) / 2
    assert (tmp_path / "out.png").stat().st_size > 10_000 and "unit: pixels" in done.stdout
    # few droplets: the verdict is beside the means that it concerns, its reason below
    assert "quality: doubtful" in done.stdout and "whole droplets only" in done.stdout
    doubtful = [line.split()[0] for line in done.stdout.partition("cut:")[0].splitlines() if "?" in line]
    assert len(rows) > 1 and doubtful == ["rho", "z", "shape_factor_rim"]


SQUARE = np.eye(20)
BAD = {
    "one level": (np.zeros((20, 20)), {}),
    "not finite": (np.full((20, 20), np.nan), {}),
    "seven colours": (np.zeros((20, 20, 7)), {}),
    "no pixels": (np.zeros((0, 0)), {}),
    "film": (SQUARE, {"film": 0.0}),
    "pixel": (SQUARE, {"pixel": -1.0}),
    "no file": ("nowhere.png", {}),
    "noise": (np.random.default_rng(1).normal(size=(60, 60)), {}),
    "a ramp": (np.mgrid[:60, :60][0] / 60, {}),
    "no channel": (SQUARE, {"channel": "red"}),
    "nothing": (None, {}),
    "one label": (None, {"labels": np.ones((50, 50), dtype=int)}),
    "no label pixels": (None, {"labels": np.zeros((0, 0))}),
    "below zero": (None, {"labels": -np.eye(50, dtype=int)}),
    "probabilities": (None, {"labels": np.eye(50) / 2}),
    "labels not finite": (None, {"labels": np.full((50, 50), np.nan)}),
    "label colours": (None, {"labels": np.dstack([np.eye(50), np.zeros((50, 50)), np.eye(50)])}),
    "letters": (None, {"labels": np.array([["a", "b"]])}),
    "stack of labels": (None, {"labels": np.zeros((3, 50, 50, 4), dtype=int)}),
    "no label file": (None, {"labels": "nowhere.npy"}),
    "rings": (SQUARE, {"contrast": "ring"}),
    "one droplet": (discs([(40, 40)], 25, shape=(80, 80)), {}),
    "all cut": (None, {"labels": np.kron([[1, 0, 2], [0, 0, 0], [3, 0, 4]], np.ones((20, 20), dtype=int))}),
    "other size": (np.random.default_rng(1).random((60, 60)), {"labels": np.eye(50, dtype=int)}),
    "both": (None, {"labels": np.eye(50, dtype=int), "contrast": "dark"}),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_picture_of_droplets_is_refused_in_one_line(name):
    picture, options = BAD[name]
    with pytest.raises(InputError) as error:
        jamlab.micrograph(picture, **options)
    assert "\n" not in str(error.value)


def test_command_prints_json_and_refuses(tmp_path):
    Image.fromarray((255 * lattice(1.0, shape=(185, 190))).astype(np.uint8)).save(tmp_path / "lattice.png")
    shown = json.loads(call(tmp_path, "analyze", "lattice.png", "--json").stdout)
    assert shown["quality"] == "good" and shown["reasons"] == [] and shown["unit"] == "pixels"
    assert shown["void_sides"] == {"3": 1.0} and shown["z"] == [6.0] and shown["interval_95"]["z"] == [5.6, 6.4]
    Image.fromarray(np.random.default_rng(2).integers(0, 255, (50, 50), dtype=np.uint8)).save(tmp_path / "noise.png")
    for more in (("--csv", "x.csv"), ("--overlay", "noise.png")):
        done = call(tmp_path, "analyze", "noise.png", *more)
        assert done.exit_code == 1 and done.stdout == "" and done.stderr.strip().count("\n") == 0
    assert not (tmp_path / "x.csv").exists()
