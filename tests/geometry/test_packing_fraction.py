"""Packing fractions: closed forms, bounds, and the values that Boromand et al. print."""

import numpy as np
import pytest
from packings_by_hand import HEXAGONAL, disks
from scipy.optimize import minimize

from jamlab.errors import InputError
from jamlab.geometry.packing_fraction import exact_method, lens_area, packing_fraction
from jamlab.geometry.particle_shape import particle_areas, shape_factors
from jamlab.models.droplets import free_area, regular_polygon
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


@pytest.mark.parametrize("radius", [0.5, 0.52, 0.577, 0.578, 0.7, 2.0])
def test_hexagonal_crystal(radius):
    packing = disks([[0.2, 0.1]], [2 * radius], HEXAGONAL)
    half_lens = radius**2 * np.arccos(0.5 / radius) - 0.5 * np.sqrt(radius**2 - 0.25)
    pairs = (np.pi * radius**2 - 6 * half_lens) / np.sqrt(0.75)
    exact = 1.0 if radius > np.sqrt(1 / 3) else pairs
    np.testing.assert_allclose(packing_fraction(packing), exact, rtol=1e-13)
    if radius < np.sqrt(0.75):  # second neighbours overlap beyond
        np.testing.assert_allclose(packing_fraction(packing, "pairs"), pairs, rtol=1e-13)


TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])


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


def test_droplets_that_cross_are_summed_by_their_drawn_outlines():
    packing = droplets([[0.0, 0.0], [0.5, 0.0]], 4.0)
    assert exact_method(packing) == "outlines"
    np.testing.assert_allclose(packing_fraction(packing), particle_areas(packing).sum() / 16, rtol=1e-14)


def test_a_method_that_there_is_not_names_the_choices():
    for packing, method in ((random_disks(0), "union"), (random_disks(0), ""), (droplets([[0.0, 0.0]], 4.0), "pairs")):
        with pytest.raises(InputError, match=repr(method)):
            packing_fraction(packing, method)
