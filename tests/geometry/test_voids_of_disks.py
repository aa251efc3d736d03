"""Voids between disks: closed forms, the torus, degenerate input, a raster of pixels; graphs on a torus."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from packings_by_hand import HEXAGONAL, disks, random_disks

import jamlab
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts, remove_rattlers
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.voids.voids import PLATEAU_BORDER, void_statistics, voids

TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])


def check_sum(packing, found, tolerance=1e-12):
    rho = packing_fraction(packing)
    np.testing.assert_allclose(found.area.sum() / packing.area + rho, 1.0, rtol=0, atol=tolerance)
    for values in (found.area, found.perimeter, found.shape_factor, found.centroid[found.percolating == 0]):
        assert np.isfinite(values).all()
    assert (found.area > 0).all() and (found.shape_factor >= 1 - 1e-9)[found.percolating == 0].all()


def test_three_touching_disks_enclose_a_plateau_border():
    found = voids(disks(TRIANGLE + 3, 1.0))
    inner = found.percolating == 0
    np.testing.assert_array_equal([found.sides[inner], found.islands[inner]], [[3], [0]])
    np.testing.assert_allclose(found.area[inner], (np.sqrt(3) - np.pi / 2) / 4, rtol=1e-13)
    np.testing.assert_allclose(found.perimeter[inner], np.pi / 2, rtol=1e-13)
    np.testing.assert_allclose(found.shape_factor[inner], np.pi / (4 * np.sqrt(3) - 2 * np.pi), atol=1e-10, rtol=0)
    np.testing.assert_allclose(PLATEAU_BORDER, 4.8706, atol=5e-5)
    np.testing.assert_allclose(found.centroid[inner], [TRIANGLE.mean(axis=0) + 3], rtol=1e-13)


@pytest.mark.parametrize("gap", [-1e-15, -1e-13, 0.0, 1e-16, 1e-13])
def test_disks_touch_within_rounding(gap):
    found = voids(disks(TRIANGLE * (1 + gap) + 3, 1.0))
    np.testing.assert_allclose(found.shape_factor.max(), PLATEAU_BORDER, rtol=1e-5 if gap == -1e-13 else 1e-6)


@pytest.mark.parametrize("radius", [0.5, 0.55, 0.6, 0.7])
def test_square_lattice_of_a_disk_larger_than_half_the_box(radius):
    found = voids(disks([0.3, 0.9], 2 * radius, np.eye(2)))
    alpha = np.arccos(0.5 / radius)
    covered = np.pi * radius**2 - 4 * (radius**2 * alpha - 0.5 * radius * np.sin(alpha))
    np.testing.assert_array_equal(found.sides, [4])
    np.testing.assert_allclose(found.area, 1 - covered, rtol=1e-12)
    np.testing.assert_allclose(found.perimeter, radius * (2 * np.pi - 8 * alpha), rtol=1e-12)
    np.testing.assert_allclose(found.centroid, [[0.8, 0.4]], rtol=1e-12)


@pytest.mark.parametrize("radius", [np.sqrt(0.5), 0.75, 3.0])
def test_covered_cell_has_no_voids(radius):
    """sqrt(1/2): four disks meet in one point."""
    found = voids(disks([0.3, 0.9], 2 * radius, np.eye(2)))
    assert [len(a) for a in (found.sides, found.area, found.shape_factor, found.centroid)] == [0, 0, 0, 0]


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_free_disks_float_in_one_void(n):
    found = voids(disks(np.array([[1.0, 1.0], [1.5, 9.0], [9.0, 1.3], [14.0, 14.0]])[:n], 2.0))
    assert [a.tolist() for a in (found.sides, found.islands, found.percolating)] == [[n], [n], [2]]
    np.testing.assert_allclose([found.area[0], found.perimeter[0]], [400 - n * np.pi, 2 * np.pi * n], rtol=1e-13)
    assert np.isnan(found.centroid).all()


@pytest.mark.parametrize("tilt", [0.0, 0.3, 1.0, -2.0])
@pytest.mark.parametrize("d", [1.0, 1.1])
def test_two_rows_divide_the_torus_in_two_strips(tilt, d):
    """Where disks just touch, the strip of either side comes to the same point, which lies opposite to a disk."""
    box = [[1.0, 0.0], [tilt, 3.0]]
    found = voids(disks([[0.3, 0.9], [0.8, 2.0]], d, box))
    assert found.percolating.tolist() == [1, 1]
    between = np.sort(found.area)
    half_lens = 0.25 * d**2 * np.arccos(1 / d) - 0.25 * np.sqrt(d**2 - 1)
    np.testing.assert_allclose(between.sum(), 3 - 2 * (np.pi * 0.25 * d**2 - 2 * half_lens), rtol=1e-13)
    np.testing.assert_allclose(np.diff(between), 0.8, rtol=1e-12)  # rows 1.1 and 1.9 apart, otherwise alike


@pytest.mark.parametrize("place", [[0.8, 0.4], [0.81, 0.39], [-3.2, 5.4]])
def test_rattler_in_a_cage_is_an_island(place):
    packing = disks([[0.3, 0.9], place], [1.02, 0.35], np.eye(2))
    found, cage = voids(packing), voids(disks([0.3, 0.9], 1.02, np.eye(2)))
    assert [a.tolist() for a in (found.sides, found.islands, found.percolating)] == [[4], [1], [0]]
    np.testing.assert_allclose(found.area, cage.area - np.pi * 0.175**2, rtol=1e-12)
    np.testing.assert_allclose(found.perimeter, cage.perimeter + np.pi * 0.35, rtol=1e-12)
    wrapped = np.mod(place, 1.0)
    centre = (cage.centroid[0] * cage.area[0] - wrapped * np.pi * 0.175**2) / found.area[0]
    np.testing.assert_allclose(found.centroid[0], centre, rtol=1e-11)


def test_rattler_that_touches_one_particle_is_one_more_side():
    packing = disks([[0.3, 0.9], [0.66, 0.54]], [1.02, 0.06], np.eye(2))
    found = voids(packing)
    assert [a.tolist() for a in (found.sides, found.islands, found.percolating)] == [[5], [0], [0]]


def test_clusters_with_voids_inside_float_in_a_void():
    packing = disks(np.concatenate([TRIANGLE + 3, TRIANGLE + 12]), 1.05)
    found = voids(packing)
    order = np.argsort(found.area)
    np.testing.assert_array_equal(found.sides[order], [3, 3, 6])
    np.testing.assert_array_equal(found.islands[order], [0, 0, 2])
    np.testing.assert_array_equal(found.percolating[order], [0, 0, 2])
    check_sum(packing, found)


@pytest.mark.parametrize("count", [3, 4, 5, 8])
@pytest.mark.parametrize("regular", [True, False])
def test_circles_through_one_point(count, regular):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        turn = 2 * np.pi * np.arange(count) / count
        centres = 0.8 * np.column_stack([np.cos(turn), np.sin(turn)]) if regular else rng.normal(size=(count, 2))
        packing = disks(centres + rng.uniform(5, 6), 2 * np.hypot(*centres.T))
        check_sum(packing, voids(packing))


def test_lattice_points_with_all_degeneracies_at_once():
    for seed in range(40):
        rng = np.random.default_rng(seed)
        n = rng.integers(1, 20)
        packing = disks(rng.integers(0, 8, (n, 2)) / 4, rng.choice([0.25, 0.5, 1.0, 1.25], n), 2 * np.eye(2))
        check_sum(packing, voids(packing))


@given(st.integers(0, 2**32 - 1))
def test_voids_and_disks_fill_the_cell(seed):
    packing = random_disks(seed)
    check_sum(packing, voids(packing))


def test_probabilities_add_up_and_open_voids_are_counted_apart():
    crystal = voids(disks([0.2, 0.1], 1.02, HEXAGONAL))
    lattice = voids(disks([0.3, 0.9], 1.02, np.eye(2)))
    open_void = voids(disks([3.0, 3.0], 1.0))
    total = void_statistics(crystal, lattice, open_void)
    assert (total.sides.tolist(), total.number.tolist(), total.percolating) == ([3, 4], [2, 1], 1)
    np.testing.assert_allclose(total.probability, [2 / 3, 1 / 3], rtol=1e-14)
    np.testing.assert_allclose(total.area, [crystal.area.mean(), lattice.area[0]], rtol=1e-12)
    np.testing.assert_allclose(total.plateau, crystal.shape_factor[0] / PLATEAU_BORDER, rtol=1e-12)
    found = voids(random_disks(1, 40))
    spread = [
        found.shape_factor[(found.sides == k) & (found.percolating == 0)].std() for k in void_statistics(found).sides
    ]
    np.testing.assert_allclose(
        void_statistics(found).shape_factor_spread, spread, atol=1e-6
    )  # of one void alone it is 0
    with pytest.raises(InputError):
        void_statistics()
    assert np.isnan(void_statistics(lattice).plateau)
    assert void_statistics(voids(disks([0.2, 0.1], 1.0, HEXAGONAL))).plateau == pytest.approx(1.0, rel=1e-10)


def test_isostatic_network_has_its_faces(sp_jammed):
    """Without rattlers, Euler on the torus: N' - N_c + faces = 0, so that the mean number of sides is 2 N_c/faces."""
    network, found = contacts(sp_jammed), voids(remove_rattlers(sp_jammed))
    assert len(found.area) == network.n_contacts - network.n_backbone
    assert found.sides.sum() == 2 * network.n_contacts and not found.islands.any()


def test_voids_between_flat_walls_add_up_to_the_slab():
    """Not to the box, which holds the walls as well."""
    p = jamlab.with_walls(jamlab.pack(24, 1e-2, 1), 1.5, flat=True)
    slab = p.box[0, 0] * (p.frame.planes[1] - p.frame.planes[0])
    assert jamlab.voids(p).area.sum() == pytest.approx((1 - jamlab.packing_fraction(p)) * slab, rel=1e-9)
    assert slab < 0.95 * p.area
