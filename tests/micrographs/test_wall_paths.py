"""Closed paths along walls: circles and ellipses come back, gaps in a wall are bridged, a void between four is none."""

import numpy as np
import pytest
from scipy import ndimage

pytest.importorskip("skimage")
from jamlab.micrographs.wall_paths import ANGLES, find_paths, path_areas, path_odds, path_terms

Y, X = np.mgrid[:120, :120].astype(float)


def ring(a, b, wall=2.5, gap=0.0):
    """Darkness of an elliptic wall about the middle, `gap` radians of it missing."""
    along = np.arctan2(Y - 60, X - 60)
    away = (np.hypot((X - 60) / a, (Y - 60) / b) - 1) * np.sqrt(a * b)
    dark = ndimage.gaussian_filter((abs(away) < wall).astype(float), 1.0)
    return np.where(abs(along) < gap / 2, 0.0, dark)


def paths_of(dark, middles, radii):
    return find_paths(dark, 1.0, 1, np.array(middles, dtype=float), np.array(radii, dtype=float))


@pytest.mark.parametrize(("a", "b"), [(30.0, 30.0), (36.0, 26.0), (14.0, 14.0)])
@pytest.mark.parametrize("gap", [0.0, 0.5])
def test_the_inner_edge_of_a_wall_is_found(a, b, gap):
    found = paths_of(ring(a, b, gap=gap), [(62, 59)], [0.9 * np.sqrt(a * b)])
    inner = np.pi * (a - 2.5) * (b - 2.5)
    assert path_areas(found.inner)[0] == pytest.approx(inner, rel=0.05)
    assert inner * 0.97 < path_areas(found.light)[0] < path_areas(found.outer)[0] < np.pi * (a + 2) * (b + 2)


def test_a_droplet_beyond_the_edge_ends_beyond_it():
    found = paths_of(ring(30.0, 30.0)[60:], [(60, 10)], [26.0])
    assert found.inner[0, :, 1].min() < -0.5 and found.features[0, 9] < 0.8


def test_a_droplet_is_likelier_than_the_void_between_four():
    away = np.min([abs(np.hypot(X - x, Y - y) - 38) for x in (20, 100) for y in (20, 100)], axis=0)
    dark = ndimage.gaussian_filter((away < 2.0).astype(float), 1.0)
    found = paths_of(dark, [(20, 20), (60, 60)], [34.0, 16.0])
    one = np.ones(2)
    full, void = path_odds(path_terms(found, 0.98 * one, np.array([34.0, 16.0]), one, 0 * one))
    assert full > void


def test_paths_do_not_depend_on_how_the_picture_is_turned():
    dark = ring(34.0, 25.0) + 0.02 * np.random.default_rng(1).normal(size=X.shape)
    straight, turned = (paths_of(part, [(59.5, 59.5)], [28.0]) for part in (dark, np.rot90(dark)))
    np.testing.assert_allclose(path_areas(straight.light), path_areas(turned.light), rtol=1e-9)
    assert len(ANGLES) % 4 == 0  # so that a quarter turn takes rays to rays
