"""Pictures: what is drawn where, from packings whose picture is known."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

import jamlab
from jamlab.figures import packing_pictures as figures
from jamlab.figures.html_page import save_picture
from jamlab.packing.free_droplet import regular_polygon

BOX = np.diag([4.0, 4.0])


def drawn(packing):
    figure = Figure()
    axes = figure.subplots()
    figures.draw_packing(axes, packing, "title")
    return axes


def fills(axes):
    """Paths of all that is filled."""
    return [path for part in axes.collections if isinstance(part, PolyCollection) for path in part.get_paths()]


def lines(axes):
    """Straight lines of two ends: those between particles in contact."""
    segments = [s for part in axes.collections if isinstance(part, LineCollection) for s in part.get_segments()]
    return [segment for segment in segments if len(segment) == 2]


def test_particles_repeat_in_every_periodic_image():
    packing = jamlab.Packing("sp", BOX, [[0.1, 2.0], [2.0, 2.0]], {"eps": 1.0}, diameters=[1.0, 1.4])
    centres = np.array([path.vertices[:-1].mean(axis=0) for path in fills(drawn(packing))])
    cells = 4.0 * np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)
    wanted = (packing.positions[:, None] + cells).reshape(-1, 2)
    assert len(centres) == len(wanted) == 18
    assert all(np.min(np.hypot(*(centres - place).T)) < 0.03 for place in wanted)


def test_contact_lines_cross_the_boundary_from_both_sides():
    packing = jamlab.Packing("sp", BOX, [[0.2, 1.0], [3.6, 1.0]], {"eps": 1.0}, diameters=[1.0, 1.0])
    ends = {tuple(np.round(line[:, 0], 9)) for line in lines(drawn(packing))}
    assert ends == {(-3.8, -4.4), (0.2, -0.4), (4.2, 3.6)}  # one contact in three columns of images


def test_droplets_are_filled_to_their_rim():
    polygon = regular_polygon(12, 1.0)
    params = {"gamma": 0.1, "ka": 50.0, "eps": 1.0, "delta": 0.2, "eta": 0.0, "contact": "outline", "a0": [1.0]}
    packing = jamlab.Packing("dp", BOX, polygon + 2.0, params, offsets=[0, 12])
    (fill,) = (path.vertices for path in fills(drawn(packing)) if path.contains_point((2.0, 2.0)))
    assert abs(np.hypot(*(fill - 2.0).T).max() - np.hypot(*polygon[0]) - 0.1) < 1e-3


@pytest.mark.parametrize("kind", ["pdf", "svg"])
def test_pictures_of_lines_are_the_same_every_time(tmp_path, kind):
    files = [tmp_path / f"{name}.{kind}" for name in ("a", "b")]
    for file in files:
        figure = Figure(figsize=(2, 2))
        figure.subplots().plot([1, 3, 2], clip_on=True)
        save_picture(figure, file)
    first, second = (file.read_bytes() for file in files)
    assert first == second and first.startswith({"pdf": b"%PDF", "svg": b"<?xml"}[kind])


def test_states_without_a_value_are_counted_not_drawn():
    table = {"rho": np.array([0.84, 0.86, 0.88]), "g": np.array([np.nan, 0.1, 0.2])}
    axes = figures.curve_figure({"dp": table}, "g", "G").axes[0]
    assert any("1 DP state(s)" in text.get_text() for text in axes.get_legend().get_texts())
    assert axes.get_xlabel() and axes.get_ylabel() == "G"
