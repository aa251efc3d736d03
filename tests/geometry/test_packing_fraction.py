"""Packing fractions: closed forms, bounds, and the values that Boromand et al. print."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from packings_by_hand import HEXAGONAL, disks
from scipy.optimize import minimize

from jamlab.errors import InputError
from jamlab.geometry.packing_fraction import exact_method, lens_area, packing_fraction, shared_fraction
from jamlab.geometry.particle_shape import particle_areas, shape_factors
from jamlab.packing.free_droplet import free_area, regular_polygon
from jamlab.packing.neighbors import periodic_pairs
from jamlab.packing.packing import Packing


def random_disks(seed, n=12, scale=0.35):
    rng = np.random.default_rng(seed)
    return disks(rng.random((n, 2)), scale * rng.uniform(0.5, 1.4, n), np.array([[1.0, 0.0], [0.4, 1.0]]))


def droplets(positions, side):
    law = {"gamma": 0.05, "ka": 10.0, "eps": 1.0, "delta": 0.2, "eta": 0.0, "contact": "outline"}
    law["a0"] = np.ones(len(positions))
    ring = regular_polygon(12, 1.0)
    vertices = np.concatenate([x + ring for x in np.asarray(positions)])
    return Packing("dp", np.diag([side, side]), vertices, law, offsets=12 * np.arange(len(positions) + 1))


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


def test_separate_disks_cover_their_nominal_area():
    packing = disks([[0.0, 0.0], [2.5, 2.5]], [1.0, 1.4], np.diag([5.0, 5.0]))
    for method in ("exact", "pairs", "nominal"):
        np.testing.assert_allclose(packing_fraction(packing, method), np.pi / 4 * 2.96 / 25, rtol=1e-14)


@pytest.mark.parametrize("radius", [0.5, 0.52, 0.577, 0.578, 0.7, 2.0])
def test_hexagonal_crystal(radius):
    packing = disks([[0.2, 0.1]], [2 * radius], HEXAGONAL)
    half_lens = radius**2 * np.arccos(0.5 / radius) - 0.5 * np.sqrt(radius**2 - 0.25)
    pairs = (np.pi * radius**2 - 6 * half_lens) / np.sqrt(0.75)
    exact = 1.0 if radius > np.sqrt(1 / 3) else pairs
    np.testing.assert_allclose(packing_fraction(packing), exact, rtol=1e-13)
    if radius < np.sqrt(0.75):  # second neighbours overlap beyond
        np.testing.assert_allclose(packing_fraction(packing, "pairs"), pairs, rtol=1e-13)


def test_pairs_count_the_smaller_disk_of_a_nested_pair():
    packing = disks([[1.0, 1.0], [1.1, 1.0]], [2.0, 0.5], np.diag([4.0, 4.0]))
    assert exact_method(packing) == "cells"
    for method in ("pairs", "exact"):
        np.testing.assert_allclose(packing_fraction(packing, method), np.pi / 16, rtol=1e-14)


TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])


def test_triples_add_the_reuleaux_triangle_once_and_the_paper_twice():
    packing = disks(TRIANGLE, [2.0, 2.0, 2.0], np.diag([5.0, 5.0]))
    pairs, reuleaux = packing_fraction(packing, "pairs"), (np.pi - np.sqrt(3)) / 2 / 25
    np.testing.assert_allclose(packing_fraction(packing, "triples"), pairs + reuleaux, rtol=1e-13)
    np.testing.assert_allclose(packing_fraction(packing, "paper-triples"), pairs + 2 * reuleaux, rtol=1e-13)
    np.testing.assert_allclose(packing_fraction(packing), pairs + reuleaux, rtol=1e-13)


def test_triples_of_images_in_a_small_cell():
    """A hexagonal crystal of one disk, compressed until its holes have closed: only triples meet, at every hole."""
    radius = 0.6
    packing = disks([[0.2, 0.1]], [2 * radius], HEXAGONAL)
    np.testing.assert_allclose(packing_fraction(packing, "triples"), 1.0, rtol=1e-13)
    repeated = disks(np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) @ HEXAGONAL, np.full(4, 2 * radius), 2 * HEXAGONAL)
    np.testing.assert_allclose(packing_fraction(repeated, "triples"), 1.0, rtol=1e-13)


def test_nested_disks_as_triples():
    packing = disks([[1.0, 1.0], [1.1, 1.0], [1.2, 1.05], [2.2, 1.0]], [2.0, 0.8, 0.2, 1.0], np.diag([6.0, 6.0]))
    np.testing.assert_allclose(packing_fraction(packing, "triples"), packing_fraction(packing, "cells"), rtol=1e-13)
    coincident = disks([[1.0, 1.0]] * 3, [2.0] * 3, np.diag([6.0, 6.0]))
    np.testing.assert_allclose(packing_fraction(coincident, "triples"), np.pi / 36, rtol=1e-13)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, 0.2, 0.35]))
def test_bonferroni(seed, scale):
    """pairs <= exact <= triples and nominal; nothing covers more than the cell or less than its largest disk."""
    packing = random_disks(seed, scale=scale)
    pairs, triples, exact = (packing_fraction(packing, m) for m in ("pairs", "triples", "cells"))
    assert pairs <= exact + 1e-12 and exact <= triples + 1e-12
    assert np.pi / 4 * packing.diameters.max() ** 2 - 1e-12 <= exact <= min(1.0, packing.phi) + 1e-12
    np.testing.assert_allclose(packing_fraction(packing), exact, rtol=1e-12)
    if exact_method(packing) == "pairs":
        np.testing.assert_allclose([pairs, triples], exact, rtol=1e-12)


def test_lens_as_printed_lacks_its_arcs():
    packing = disks([[1.0, 1.0], [2.0, 1.0]], [2.0, 2.0], np.diag([5.0, 5.0]))
    expected = (2 * np.pi - 0.5 * np.sqrt(3)) / 25  # (1/2) sqrt((2 - 1)(1 - 0)(1 + 0)(1 + 2))
    np.testing.assert_allclose(packing_fraction(packing, "paper-pairs"), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("r", "method"), [(1.2, "pairs"), (0.7, "pairs"), (0.6, "pairs"), (0.57, "cells"), (0.3, "cells")]
)
def test_pairs_are_used_as_long_as_they_are_exact(r, method):
    """Three disks of radius R share a point from R = r/sqrt(3) on."""
    packing = disks(TRIANGLE * r + 2, [2 * 0.34] * 3, np.diag([5.0, 5.0]))
    assert exact_method(packing) == method
    np.testing.assert_allclose(packing_fraction(packing), packing_fraction(packing, "cells"), rtol=1e-14)


def test_compressed_packing_has_the_values_of_boromand_figure_1():
    """Disks at phi = 1.0: rho = 0.95, and A = 1.025 of the one particle shown."""
    n = 64
    rng = np.random.default_rng(1)
    diameters = np.where(np.arange(n) % 2, 1.0, 1.4)
    side = np.sqrt(np.pi / 4 * np.sum(diameters**2))
    box = np.diag([side, side])

    def energy(x):
        x = x.reshape(n, 2)
        near = periodic_pairs(x, box, 1.4)
        s, r = 0.5 * (diameters[near.i] + diameters[near.j]), np.hypot(*near.r.T)
        overlap = np.maximum(1 - r / s, 0)
        force = (overlap / (s * r))[:, None] * near.r
        gradient = np.zeros((n, 2))
        np.add.at(gradient, near.i, force)
        np.add.at(gradient, near.j, -force)
        return 0.5 * np.sum(overlap**2), gradient.ravel()

    found = minimize(energy, side * rng.random(2 * n), jac=True, method="L-BFGS-B", options={"maxiter": 400})
    packing = disks(found.x.reshape(n, 2), diameters, box)
    assert found.fun / n < 0.01
    np.testing.assert_allclose(packing_fraction(packing), 0.95, atol=0.01)
    np.testing.assert_allclose(packing_fraction(packing, "pairs"), packing_fraction(packing), atol=1e-4)
    factors = shape_factors(packing)
    np.testing.assert_allclose(factors.mean(), 1.025, atol=0.01)
    assert 1 <= factors.min() < 1.025 < factors.max() < 1.1


def test_separate_droplets_count_their_rims_and_nominally_those_of_free_ones():
    packing = droplets([[0.0, 0.0], [2.0, 2.0]], 4.0)
    covered = packing.polygon_areas + 0.1 * packing.perimeters + 0.01 * np.pi
    np.testing.assert_allclose(packing_fraction(packing), covered.sum() / 16, rtol=1e-13)
    expected = free_area(np.array([12, 12]), packing.params).sum() / 16
    np.testing.assert_allclose(packing_fraction(packing, "nominal"), expected, rtol=1e-13)


def test_overlapping_droplets_cover_less_than_apart_and_never_more_than_the_cell():
    apart, close = (droplets([[0.0, 0.0], [x, 0.1]], 4.0) for x in (2.0, 1.25))
    assert packing_fraction(close) < packing_fraction(apart) - 1e-3
    np.testing.assert_allclose(packing_fraction(droplets([[0.0, 0.0]], 0.9)), 1.0, rtol=1e-12)
    assert exact_method(close) == "boundary"


def test_what_two_droplets_share_is_the_area_common_to_their_outlines():
    """Drawn as polygons with round rims, without jamlab; a longer outline has more rim, which phi does not know."""
    packing = droplets([[1.5, 2.0], [2.75, 2.1]], 4.0)
    first, second = (shapely.Polygon(ring).buffer(0.1, quad_segs=256) for ring in packing.positions.reshape(2, 12, 2))
    shared = first.intersection(second).area / 16
    assert shared > 1e-4 and shared_fraction(packing) == pytest.approx(shared, rel=1e-4)
    stretched = packing.with_state(positions=packing.positions * [1.1, 1 / 1.1])
    own = packing.polygon_areas.sum() + 0.1 * stretched.perimeters.sum() + 2 * 0.01 * np.pi
    assert shared_fraction(stretched) == pytest.approx(own / 16 - packing_fraction(stretched), abs=1e-12)
    assert shared_fraction(stretched) > stretched.phi - packing_fraction(stretched)


def test_what_disks_share_is_what_phi_counts_too_often():
    packing = random_disks(1)
    assert shared_fraction(packing) == pytest.approx(packing.phi - packing_fraction(packing), abs=1e-13)


def test_droplets_that_cross_are_summed_by_their_drawn_outlines():
    packing = droplets([[0.0, 0.0], [0.5, 0.0]], 4.0)
    assert exact_method(packing) == "outlines"
    np.testing.assert_allclose(packing_fraction(packing), particle_areas(packing).sum() / 16, rtol=1e-14)


def test_a_method_that_there_is_not_names_the_choices():
    for method in ("union", ""):
        choices = "exact, pairs, triples, cells, paper-pairs, paper-triples, nominal"
        with pytest.raises(InputError, match=rf"{method!r}.*{choices}"):
            packing_fraction(random_disks(0), method)
    for method in ("pairs", "triples"):
        with pytest.raises(InputError, match=f"'{method}'.*model dp.*exact, nominal"):
            packing_fraction(droplets([[0.0, 0.0]], 4.0), method)
