"""Pictures of voids, cells and overlaps: what is drawn where."""

import numpy as np
import pytest
import shapely
from matplotlib.figure import Figure

from jamlab.figures import packing_pictures as geometry_figures
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.voids.voids import void_paths, voids
from jamlab.packing.packing import Packing


def disks(positions, diameters, box):
    return Packing("sp", np.asarray(box), np.atleast_2d(positions), {"eps": 1.0}, diameters=diameters)


def axes_of(draw, packing):
    axes = Figure().subplots()
    draw(axes, packing, "title")
    assert axes.get_title() == "title"
    return axes


@pytest.mark.parametrize("state", ["sp", "dp"])
def test_void_paths_enclose_their_area(request, state):
    packing = disks([[0.3, 0.9], [0.81, 0.39]], [1.02, 0.35], np.eye(2))
    if state == "dp":
        packing = request.getfixturevalue("dp_dense")
    found = voids(packing)
    for path, area, centre in zip(void_paths(found), found.area, found.centroid, strict=True):
        signed = abs(sum(_signed(ring) for ring in path.to_polygons(closed_only=True)))  # islands run the other way
        np.testing.assert_allclose(signed, area, rtol=0.02)
        assert np.abs((path.vertices.mean(axis=0) - centre) @ np.linalg.inv(packing.box)).max() <= 0.5


def _signed(ring):
    (x, y), (u, v) = ring[:-1].T, ring[1:].T
    return 0.5 * float(np.sum(x * v - y * u))


def test_legend_names_the_sides_that_occur_and_open_voids():
    axes = axes_of(geometry_figures.draw_voids, disks([0.3, 0.9], [1.02], np.eye(2)))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["4"]
    axes = axes_of(geometry_figures.draw_voids, disks([2.0, 2.0], [1.02], 5 * np.eye(2)))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["percolates"]


def test_overlaps_are_lenses():
    axes = axes_of(geometry_figures.draw_overlaps, disks([[1.0, 1.0], [2.0, 1.0]], [1.4, 1.4], 4 * np.eye(2)))
    shaded = [
        c for c in axes.collections if len(c.get_facecolor()) and np.allclose(c.get_facecolor()[:, :3], 0x6F / 255)
    ]
    areas = [shapely.Polygon(p.vertices).area for c in shaded for p in c.get_paths()]
    lens = 2 * 0.49 * np.arccos(0.5 / 0.7) - np.sqrt(0.49 - 0.25)
    np.testing.assert_allclose(areas, lens, rtol=0.02)
    assert len(areas) == 2 * 9  # from either particle, in nine cells


def test_walls_of_a_row_stand_in_the_middle():
    axes = axes_of(geometry_figures.draw_cells, disks([[0.5, 0.5], [1.5, 0.5]], [0.8, 0.8], [[2.0, 0.0], [0.0, 1.0]]))
    lines = np.concatenate([c.get_segments() for c in axes.collections if hasattr(c, "get_segments")])
    upright = lines[np.abs(np.ptp(lines[:, :, 0], axis=1)) < 1e-9][:, 0, 0]
    assert {0.0, 1.0, 2.0} <= set(np.round(upright, 9) + 0.0)


def test_figure_of_either_model(dp_dense, sp_jammed):
    for packing in (dp_dense, sp_jammed):
        overlaps, middle, cells, scale = geometry_figures.geometry_figure(packing).axes
        assert middle.get_title() == rf"{len(voids(packing).sides)} voids, $\rho$ = {packing_fraction(packing):.4f}"
        assert (overlaps.get_title(), scale.get_ylabel()) == ("overlaps", "local packing fraction")
        assert cells.get_title() == {"sp": "power cells", "dp": "set-Voronoi cells"}[packing.model]
