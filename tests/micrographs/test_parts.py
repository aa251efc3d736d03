"""Parts of reading a micrograph, each against what is known: light, noise, scale, rendering."""

import numpy as np
import pytest

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.illumination import noise_level, remove_background
from jamlab.micrographs.picture_files import distance_inside
from jamlab.micrographs.segmentation import edge_of, find_markers, granulometry
from jamlab.micrographs.walls import shape_factor

pytest.importorskip("skimage")
Y, X = np.mgrid[:150, :160]
DISCS = ((X % 32 - 16) ** 2 + (Y % 32 - 16) ** 2 < 14**2).astype(np.float64)


def test_noise_level_sees_noise_and_no_edges():
    noise = np.random.default_rng(1).normal(size=DISCS.shape)
    assert noise_level(DISCS) == 0
    assert noise_level(0.01 * X + 0.1 * noise) == pytest.approx(0.1, rel=0.05)


def test_distances_are_those_of_pixels():
    """Half of the mask as a view with strides, since thinned pictures are views."""
    mask = np.random.default_rng(2).random((90, 170)) < 0.97
    thin = mask[:, ::2]
    away = np.argwhere(~thin)
    places = np.indices(thin.shape).reshape(2, -1).T
    exact = np.sqrt(((places[:, None] - away) ** 2).sum(axis=2).min(axis=1)).reshape(thin.shape)
    np.testing.assert_array_equal(distance_inside(thin), exact)
    assert np.isinf(distance_inside(np.ones((9, 12), dtype=bool))).all()


def test_the_edge_of_a_picture_has_four_sides():
    assert set(edge_of(np.arange(12).reshape(3, 4))) == set(range(12)) - {5, 6}


def test_light_of_a_strip_is_levelled():
    """A strip is narrower than the pixels that its light is taken from are apart."""
    y, x = np.mgrid[:3000, :10]
    tall = (np.hypot(y % 12 - 6, x - 5) < 4.5) + 0.2 * y / 3000
    for strip in (tall, tall.T):
        assert remove_background(strip) is not None


def test_background_is_divided_out():
    light = np.linspace(1, 0.4, X.shape[1])
    darkness = remove_background(0.1 + 0.8 * light * DISCS)
    assert np.abs(darkness.values[DISCS > 0]).max() < 0.05
    assert np.abs(darkness.values[DISCS == 0] - 1).max() < 0.05
    assert darkness.light == pytest.approx(2.4, rel=0.1)


def test_granulometry_finds_the_radius():
    assert granulometry(DISCS > 0)[0] == pytest.approx(14, abs=1.5)
    assert granulometry(np.zeros((30, 30), dtype=bool)) == (0, 0)


@pytest.mark.parametrize("neck", [0.8, 0.88, 0.94])
@pytest.mark.parametrize("radius", [14.0, 40.0])
def test_two_discs_are_one_droplet_if_their_neck_is_wide(neck, radius):
    """The neck of two discs of radius r, d apart, is sqrt(r^2 - d^2/4) in half."""
    y, x = np.mgrid[: int(4 * radius), : int(6 * radius)]
    for wider, expected in ((1.06, 1), (0.84, 2)):
        apart = radius * np.sqrt(1 - (wider * neck) ** 2)
        discs = np.min([np.hypot(x - 3 * radius + side * apart, y - 2 * radius) for side in (-1, 1)], axis=0) < radius
        markers, inner = find_markers(discs, radius, radius, neck)
        assert inner == expected == markers.max()


def test_shape_factor_of_known_outlines():
    turn = 2 * np.pi * np.arange(400) / 400
    assert shape_factor(np.column_stack([np.cos(turn), np.sin(turn)])) == pytest.approx(1, abs=1e-4)
    assert shape_factor(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])) == pytest.approx(4 / np.pi)


def test_rendered_light(dp_dense):
    plain = jamlab.synthetic_micrograph(dp_dense, 64)
    lit = jamlab.synthetic_micrograph(dp_dense, 64, light=0.5, blur=0.7)
    np.testing.assert_allclose(lit, plain * np.linspace(1, 0.5, 64), atol=1e-12)


def test_films_divide_droplets(dp_dense):
    thin, wide = (jamlab.synthetic_micrograph(dp_dense, 100, film=film, blur=0.0).mean() for film in (0.0, 2.0))
    assert thin == pytest.approx(jamlab.packing_fraction(dp_dense), abs=0.005)
    assert thin - wide > 0.03


BAD = [{"pixels": 5}, {"blur": -1.0}, {"noise": np.nan}, {"light": 0.0}, {"seed": -1}]


def test_rendering_refuses(dp_onset, sp_jammed):
    tilted = dp_onset.with_state(box=dp_onset.box + np.array([[0, 0], [0.1, 0]]))
    for packing, how in [(sp_jammed, {}), (tilted, {}), *((dp_onset, how) for how in BAD)]:
        with pytest.raises(InputError) as error:
            jamlab.synthetic_micrograph(packing, **how)
        assert not how or next(iter(how)) in str(error.value)
