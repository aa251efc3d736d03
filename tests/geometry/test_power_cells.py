"""Disks cut by their power cells, and cells that fill the box: closed forms and clipped polygons."""

import numpy as np
import pytest
import random_packings
import shapely
from hull_cells import hull_areas
from hypothesis import given
from hypothesis import strategies as st
from packings_by_hand import HEXAGONAL, disks, droplets, random_disks

from jamlab.errors import InputError
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.power_cells import disk_cells
from jamlab.geometry.tessellation import find_power_walls, local_packing_fraction, tessellation
from jamlab.models.droplets import regular_polygon


def segment(radius, height):
    """Area beyond a chord at the given distance from the centre."""
    return radius**2 * np.arccos(height / radius) - height * np.sqrt(radius**2 - height**2)


def test_free_disk_is_whole():
    cells = disk_cells(disks([3.0, 4.0], 2.0))
    np.testing.assert_allclose([cells.area[0], cells.perimeter[0]], [np.pi, 2 * np.pi])
    assert len(cells.chords.i) == 0


@pytest.mark.parametrize(("r", "height"), [(1.5, 1.0), (1.2, 0.78541666666667), (0.8, 0.55625), (0.52, 0.0)])
def test_two_unequal_disks(r, height):
    small, large = 0.5, 1.0
    h_large = (r**2 + large**2 - small**2) / (2 * r)  # beyond r for a centre that is cut off
    cells = disk_cells(disks([[0.0, 0.0], [0.0, r]], [2 * large, 2 * small]))
    expected = [np.pi * large**2, np.pi * small**2]
    if r < large + small:
        expected -= np.array([segment(large, h_large), segment(small, r - h_large)])
    np.testing.assert_allclose(cells.area, expected, rtol=1e-14)


@pytest.mark.parametrize("radius", [0.4, 0.5, 0.51, 0.53, 0.56, 1 / np.sqrt(3), 0.6, 1.0, 3.0])
@pytest.mark.parametrize("repeat", [1, 3])
def test_hexagonal_crystal_from_touching_to_confluence(radius, repeat):
    corner = np.stack(np.meshgrid(np.arange(repeat), np.arange(repeat)), axis=-1).reshape(-1, 2) @ HEXAGONAL
    cells = disk_cells(disks(corner, 2 * radius, repeat * HEXAGONAL))
    if radius <= 0.5:
        area, perimeter = np.pi * radius**2, 2 * np.pi * radius
    elif radius < 1 / np.sqrt(3):
        alpha = np.arccos(0.5 / radius)
        area = np.pi * radius**2 - 6 * segment(radius, 0.5)
        perimeter = radius * (2 * np.pi - 12 * alpha) + 12 * radius * np.sin(alpha)
    else:
        area, perimeter = np.sqrt(0.75), 2 * np.sqrt(3)
    np.testing.assert_allclose(cells.area, area, rtol=1e-13)
    np.testing.assert_allclose(cells.perimeter, perimeter, rtol=1e-7 if radius == 1 / np.sqrt(3) else 1e-13)


@pytest.mark.parametrize("x", [0.0, 0.1, 0.5, 0.5 - 1e-17])
def test_nested_disk_has_no_cell(x):
    cells = disk_cells(disks([[x, 0.0], [0.0, 0.0]], [1.0, 2.0]))  # x = 0.5 touches from inside
    np.testing.assert_allclose(cells.area, [0.0, np.pi], rtol=1e-14)
    np.testing.assert_array_equal(cells.perimeter[0], 0.0)
    assert len(cells.chords.i) == 0


def test_of_coincident_disks_the_lowest_index_keeps_its_cell():
    cells = disk_cells(disks([[1.0, 1.0], [2.0, 1.0], [2.0, 1.0], [2.0, 1.0]], 2.0))
    pair = disk_cells(disks([[1.0, 1.0], [2.0, 1.0]], 2.0))
    np.testing.assert_array_equal(cells.area, [*pair.area, 0.0, 0.0])
    np.testing.assert_array_equal(cells.length, pair.length)


@pytest.mark.parametrize("angle", [0.0, 0.1, 0.7, 2.0, 3.0])
def test_circles_through_the_same_two_points(angle):
    """The disk in the middle is covered by the outer two: all three radical lines coincide."""
    x = np.array([-0.7, 0.1, 0.9])
    centres = np.column_stack([x * np.cos(angle), x * np.sin(angle)])
    diameters = 2 * np.hypot(x, 0.5)
    three, two = disk_cells(disks(centres, diameters)), disk_cells(disks(centres[::2], diameters[::2]))
    np.testing.assert_allclose(three.area, [two.area[0], 0.0, two.area[1]], atol=1e-13)
    np.testing.assert_allclose(three.perimeter, [two.perimeter[0], 0.0, two.perimeter[1]], atol=1e-6)
    assert not three.length[three.chords.i == 1].any()


def test_each_cell_is_the_disk_clipped_by_its_radical_lines():
    rng = np.random.default_rng(5)
    x, radius = rng.random((12, 2)) * 2 + 9, rng.uniform(0.3, 0.7, 12)
    angle = 2 * np.pi * np.arange(4096) / 4096
    cells = disk_cells(disks(x, 2 * radius))
    for i in range(12):
        shape = shapely.Polygon(x[i] + radius[i] * np.column_stack([np.cos(angle), np.sin(angle)]))
        for j in np.delete(np.arange(12), i):
            # keep |y - x_i|^2 - R_i^2 < |y - x_j|^2 - R_j^2
            normal = (x[j] - x[i]) / np.hypot(*(x[j] - x[i]))
            apart = np.hypot(*(x[j] - x[i]))
            foot = x[i] + normal * (apart**2 + radius[i] ** 2 - radius[j] ** 2) / (2 * apart)
            along = 10 * np.array([-normal[1], normal[0]])
            corners = [foot - along, foot + along, foot + along - 10 * normal, foot - along - 10 * normal]
            shape = shape.intersection(shapely.Polygon(corners))
        np.testing.assert_allclose([cells.area[i], cells.perimeter[i]], [shape.area, shape.length], atol=1e-5)


def test_hexagonal_and_square_lattice():
    crystal, lattice = tessellation(disks([0.2, 0.1], 0.9, HEXAGONAL)), tessellation(disks([0.3, 0.9], 0.9, np.eye(2)))
    assert (crystal.sides.tolist(), lattice.sides.tolist()) == ([6], [4])
    np.testing.assert_allclose(crystal.wall_length, np.full(3, np.sqrt(1 / 3)), rtol=1e-12)
    np.testing.assert_allclose(lattice.wall_length, np.ones(2), rtol=1e-12)
    np.testing.assert_allclose([crystal.area[0], lattice.area[0]], [np.sqrt(0.75), 1.0], rtol=1e-12)
    local = local_packing_fraction(disks([0.2, 0.1], 0.9, HEXAGONAL))
    np.testing.assert_allclose(local, np.pi * 0.45**2 / np.sqrt(0.75), rtol=1e-12)


def test_wall_between_unequal_disks_lies_on_the_radical_line():
    """In a row: h = (r^2 + R_i^2 - R_j^2)/(2 r) from either neighbour."""
    packing = disks([[0.5, 0.5], [2.0, 0.5]], [1.6, 0.8], [[3.0, 0.0], [0.0, 1.0]])
    h = (1.5**2 + 0.8**2 - 0.4**2) / 3.0
    cells = tessellation(packing)
    np.testing.assert_allclose(cells.area, [2 * h, 3 - 2 * h], rtol=1e-12)
    x = np.unique(np.round(cells.lines[np.abs(np.ptp(cells.lines[:, :, 0], axis=1)) < 1e-9][:, 0, 0], 9))
    np.testing.assert_allclose(np.unique(np.round(np.mod(x, 3), 9)), np.sort(np.mod([0.5 + h, 0.5 - h], 3)), rtol=1e-8)


@given(st.integers(0, 2**32 - 1))
def test_cells_fill_the_box_and_obey_euler(seed):
    packing = random_disks(seed)
    cells = tessellation(packing)
    np.testing.assert_allclose(cells.area.sum(), packing.area, rtol=1e-9)
    lone = (cells.area > 0).sum()
    np.testing.assert_allclose(cells.sides.sum(), 6 * lone)
    np.testing.assert_allclose(np.hypot(*np.diff(cells.lines, axis=1)[:, 0].T).sum(), cells.wall_length.sum())
    local = local_packing_fraction(packing)
    assert np.array_equal(np.isnan(local), cells.area == 0) and np.nanmax(local) <= 1 + 1e-9
    np.testing.assert_allclose(np.nansum(local * cells.area) / packing.area, packing_fraction(packing), rtol=1e-9)


def test_disk_inside_another_may_have_no_cell():
    packing = disks([[0.5, 0.5], [0.5, 0.5]], [0.6, 0.2], np.eye(2))
    assert tessellation(packing).area.tolist() == pytest.approx([1.0, 0.0])
    assert np.isnan(local_packing_fraction(packing)).tolist() == [False, True]
    assert disk_cells(packing).area[1] == 0


def test_set_voronoi_cells_follow_outlines_not_centres():
    """Two rectangles of widths 1 and 3 in a row, 0.2 apart: the walls lie in the middle of the gaps."""
    box = np.array([[4.4, 0.0], [0.0, 1.2]])
    low = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    packing = droplets([low + 0.1, low * [3.0, 1.0] + [1.3, 0.1]], 0.1, box)
    for spacing, error in ((0.1, 2e-3), (0.02, 1e-4)):
        cells = tessellation(packing, spacing)
        np.testing.assert_allclose(cells.area, [1.2 * 1.2, 3.2 * 1.2], rtol=error)
    covered = packing.polygons.areas + 0.05 * packing.polygons.perimeters + np.pi * 0.0025
    np.testing.assert_allclose(local_packing_fraction(packing), covered / cells.area, rtol=2e-3)


def test_cells_of_jammed_droplets(dp_dense):
    coarse, fine = tessellation(dp_dense), tessellation(dp_dense, 0.0125)
    np.testing.assert_allclose(coarse.area, fine.area, rtol=2e-3)
    np.testing.assert_allclose(fine.area.sum(), dp_dense.area, rtol=1e-9)
    assert coarse.sides.sum() == 6 * dp_dense.n
    assert 0.8 < local_packing_fraction(dp_dense).min() < local_packing_fraction(dp_dense).max() < 1.001


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan])
def test_spacing_is_checked(spacing):
    with pytest.raises(InputError, match="spacing"):
        tessellation(droplets([regular_polygon(5, 1.0)], 0.1, 3 * np.eye(2)), spacing)


@given(random_packings.packings())
def test_cells_are_those_of_the_lifted_hull(packing):
    """Of disks, and of points along outlines."""
    owner, points, radius = packing.kind.power_points(packing, 0.2)
    area, walls = find_power_walls(points, radius, packing.box, owner)
    wanted = np.bincount(owner, hull_areas(points, radius, packing.box, 3 * np.abs(packing.box).max()))
    np.testing.assert_allclose(area, wanted, atol=1e-11 * packing.area)
    names = np.column_stack([walls.i, walls.j, walls.shift])[walls.length > 1e-9].tolist()
    assert {(j, i, -a, -b) for i, j, a, b in names} <= {(*name,) for name in names}
    np.testing.assert_allclose(walls.length, np.hypot(*(walls.ends[:, 1] - walls.ends[:, 0]).T), atol=1e-11)


SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
NAIL = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.3], [0.55, 0.3], [0.55, 1.0], [0.53, 1.0], [0.53, 0.3], [0.0, 0.3]])


def at(x, y, ring=NAIL):
    return ring + np.array([x, y])


RINGS = {
    "apart": [SQUARE, at(1.3, 0.4, 0.7 * SQUARE), at(0.1, 1.2)],
    "nearer than points": [SQUARE, at(1.005, 0.4, 0.7 * SQUARE), at(0.1, 1.002)],
    "one inside another": [SQUARE, at(0.31, 0.31, 0.3 * SQUARE), at(1.1, 1.2)],
    "crossing": [SQUARE, at(0.71, 0.33, 0.6 * SQUARE), at(0.1, 0.83)],
    "on its own image": [at(0.0, 0.5, NAIL * np.array([1.97, 1.0]))],
}


@pytest.mark.parametrize("spacing", [0.03, 0.2])
@pytest.mark.parametrize("name", RINGS)
def test_walls_of_outlines_are_those_of_all_points(name, spacing):
    """Cells of points along outlines are cut outside of the outlines alone: where some points could have walls inside,
    all is cut. The wanted walls are those of points that each have an owner."""
    packing = droplets([ring + 0.01 for ring in RINGS[name]], 0.1, np.array([[2.0, 0.0], [0.3, 2.5]]))
    owner, points, radius = packing.kind.power_points(packing, spacing)
    area, walls = find_power_walls(points, radius, packing.box, owner)
    each, all_walls = find_power_walls(points, radius, packing.box, np.arange(len(points)))
    np.testing.assert_allclose(area, np.bincount(owner, each), rtol=1e-12)
    wanted = (owner[all_walls.i] != owner[all_walls.j]) | all_walls.shift.any(axis=1)
    for found, kept in ((walls, walls.length > 1e-9), (all_walls, wanted & (all_walls.length > 1e-9))):
        order = np.lexsort(np.column_stack([found.i, found.j, found.shift])[kept].T)
        rows = [value[kept][order] for value in (found.i, found.j, found.shift, found.length, found.ends)]
        if found is walls:
            first = rows
    for one, other in zip(first, rows, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
