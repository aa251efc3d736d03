"""Packing fractions: closed forms, bounds, and the values that Boromand et al. print."""

import numpy as np
import pytest
from drawn_overlaps import drawn_shares
from packings_by_hand import disks, droplets

import jamlab
from jamlab.errors import BoundaryError, InputError
from jamlab.geometry.packing_fraction import lens_area, packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.voids.voids import bound_voids
from jamlab.models.droplets import free_area, regular_polygon
from jamlab.packing.deformation import at_phi


def polygons(places):
    """Regular polygons of twelve vertices and area 1, rims of 0.1, in a box of 4."""
    return droplets([regular_polygon(12, 1.0) + np.array(place) for place in places], 0.2, 4 * np.eye(2))


@pytest.mark.parametrize(
    ("r", "radius_i", "radius_j", "lens"),
    [
        (1.0, 1.0, 1.0, 2 * np.pi / 3 - np.sqrt(3) / 2),
        (np.sqrt(2), 1.0, 1.0, np.pi / 2 - 1),
        (1.0, 1.0, np.sqrt(2), np.pi - 1),  # chord through the centre of the small one
        (0.0, 1.0, 1.0, np.pi),
        (0.0, 0.3, 1.0, 0.09 * np.pi),
        (0.5, 1.0, 0.5, 0.25 * np.pi),
        (0.2, 1.0, 0.5, 0.25 * np.pi),
        (1.5, 1.0, 0.5, 0.0),
        (9.0, 1.0, 0.5, 0.0),
    ],
)
def test_lens_of_two_circles(r, radius_i, radius_j, lens):
    args = np.array([r]), np.array([radius_i]), np.array([radius_j])
    np.testing.assert_allclose(lens_area(*args), lens, atol=1e-14)
    np.testing.assert_allclose(lens_area(args[0], args[2], args[1]), lens, atol=1e-14)


TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])


@pytest.mark.parametrize("r", [1.2, 0.7, 0.6, 0.57, 0.3])
def test_pairs_are_exact_until_three_disks_share_a_point(r):
    """Three disks of radius R share a point from R = r/sqrt(3) on."""
    packing = disks(TRIANGLE * r + 2, [2 * 0.34] * 3, np.diag([5.0, 5.0]))
    exact, pairs = packing_fraction(packing), packing_fraction(packing, "pairs")
    assert pairs < exact * (1 - 1e-6) if r < 0.34 * np.sqrt(3) else pairs == pytest.approx(exact, rel=1e-14)


def test_compressed_packing_has_the_values_of_boromand_figure_1(sp_jammed):
    """Disks at phi = 1.0: rho = 0.95, and A = 1.025 of the one particle shown."""
    packing = jamlab.relax(at_phi(sp_jammed, 1.0))
    np.testing.assert_allclose(packing_fraction(packing), 0.95, atol=0.01)
    np.testing.assert_allclose(packing_fraction(packing, "pairs"), packing_fraction(packing), atol=1e-4)
    factors = shape_factors(packing)
    np.testing.assert_allclose(factors.mean(), 1.025, atol=0.01)
    assert 1 <= factors.min() < 1.025 < factors.max() < 1.1


def test_separate_droplets_count_their_rims_and_nominally_those_of_free_ones():
    packing = polygons([[0.0, 0.0], [2.0, 2.0]])
    covered = packing.polygons.areas + 0.1 * packing.polygons.perimeters + 0.01 * np.pi
    np.testing.assert_allclose(packing_fraction(packing), covered.sum() / 16, rtol=1e-13)
    expected = free_area(np.array([12, 12]), packing.params).sum() / 16
    np.testing.assert_allclose(packing_fraction(packing, "nominal"), expected, rtol=1e-13)


def test_droplets_that_cross_have_no_voids_but_a_fraction():
    packing = polygons([[0.0, 0.0], [0.5, 0.0]])
    with pytest.raises(BoundaryError):
        bound_voids(packing)
    np.testing.assert_allclose(packing_fraction(packing), drawn_shares(packing).sum() / 16, atol=1e-6)


def test_a_method_that_there_is_not_is_refused(sp_jammed):
    for packing, method in ((sp_jammed, "union"), (sp_jammed, ""), (polygons([[0.0, 0.0]]), "pairs")):
        with pytest.raises(InputError, match=repr(method)):
            packing_fraction(packing, method)


@pytest.mark.parametrize("delta", [1e-15, 1e-9])
def test_rims_thinner_than_rounding_of_coordinates(delta):
    """They add p delta/2 to the area, wherever the polygons are."""
    rng, box = np.random.default_rng(3), np.array([[3.0, 0.0], [0.5, 2.0]])
    for _ in range(12):
        rings = [regular_polygon(int(nv), 0.5, turn) + rng.uniform(-2, 2) * box[1] for nv, turn in ((5, 0.3), (8, 1.1))]
        rings[1] = rings[1] + np.array([1.4, 0.2]) + rings[0].mean(axis=0) - rings[1].mean(axis=0)
        packing = droplets(rings, delta, box)
        grown = packing.polygons.areas.sum() + 0.5 * delta * packing.polygons.perimeters.sum()
        assert packing_fraction(packing) == pytest.approx(grown / packing.area, rel=1e-13)
