"""Cells around particles: lattices, Euler's theorem, nearest points, local packing fraction."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from packings_by_hand import HEXAGONAL, disks, droplets, random_disks

from jamlab.errors import InputError
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.power_cells import disk_cells
from jamlab.geometry.tessellation import local_packing_fraction, tessellation
from jamlab.packing.free_droplet import regular_polygon


def test_hexagonal_and_square_lattice():
    crystal, lattice = tessellation(disks([0.2, 0.1], 0.9, HEXAGONAL)), tessellation(disks([0.3, 0.9], 0.9, np.eye(2)))
    assert (crystal.sides.tolist(), lattice.sides.tolist()) == ([6], [4])
    np.testing.assert_allclose(crystal.wall_length, np.full(3, np.sqrt(1 / 3)), rtol=1e-12)
    np.testing.assert_allclose(lattice.wall_length, np.ones(2), rtol=1e-12)
    np.testing.assert_allclose([crystal.area[0], lattice.area[0]], [np.sqrt(0.75), 1.0], rtol=1e-12)
    np.testing.assert_allclose(
        local_packing_fraction(disks([0.2, 0.1], 0.9, HEXAGONAL)), np.pi * 0.45**2 / np.sqrt(0.75), rtol=1e-12
    )


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


@given(st.integers(0, 2**32 - 1))
def test_cells_do_not_depend_on_origin_image_or_lattice_vectors(seed):
    packing, rng = random_disks(seed), np.random.default_rng(seed)
    cells = tessellation(packing)
    other = packing.with_state(
        positions=packing.positions + rng.normal(size=2) + rng.integers(-3, 4, (packing.n, 2)) @ packing.box,
        box=packing.box + np.outer([0, 1], [rng.integers(-3, 4), 0]),
    )
    np.testing.assert_allclose(tessellation(other).area, cells.area, atol=1e-9)
    np.testing.assert_array_equal(tessellation(other).sides, cells.sides)


def test_areas_by_sampling():
    packing = random_disks(11)
    x = np.random.default_rng(0).random((40_000, 2)) @ packing.box
    moves = np.stack(np.meshgrid(*[np.arange(-4, 5)] * 2), axis=-1).reshape(-1, 2) @ packing.box
    power = np.full((len(x), packing.n), np.inf)
    for move in moves:
        d = x[:, None] - packing.positions - move
        power = np.minimum(power, (d**2).sum(axis=2) - packing.diameters**2 / 4)
    share = np.bincount(power.argmin(axis=1), minlength=packing.n) / len(x)
    np.testing.assert_allclose(tessellation(packing).area / packing.area, share, atol=0.01)


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
    covered = packing.polygon_areas + 0.05 * packing.perimeters + np.pi * 0.0025
    np.testing.assert_allclose(local_packing_fraction(packing), covered / cells.area, rtol=2e-3)


def test_cells_of_jammed_droplets(dp_dense):
    coarse, fine = tessellation(dp_dense), tessellation(dp_dense, 0.0125)
    np.testing.assert_allclose(coarse.area, fine.area, rtol=2e-3)
    np.testing.assert_allclose(fine.area.sum(), dp_dense.area, rtol=1e-9)
    assert coarse.sides.sum() == 6 * dp_dense.n
    assert 0.8 < local_packing_fraction(dp_dense).min() < local_packing_fraction(dp_dense).max() < 1.001


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan])
def test_spacing_is_checked(spacing):
    with pytest.raises(InputError, match="spacing is"):
        tessellation(droplets([regular_polygon(5, 1.0)], 0.1, 3 * np.eye(2)), spacing)
