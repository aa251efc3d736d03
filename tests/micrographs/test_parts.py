"""Parts of reading a micrograph, each against what is known: light, noise, scale, annotations, sizes, rendering."""

import numpy as np
import pytest
from scipy import ndimage

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.illumination import (
    fill_in,
    find_drawn,
    find_flat,
    noise_level,
    remove_background,
    sort_annotations,
)
from jamlab.micrographs.picture_files import distance_inside
from jamlab.micrographs.picture_numbers import size_distribution
from jamlab.micrographs.segmentation import find_markers, granulometry
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


def test_light_of_a_strip_is_levelled():
    """A strip is narrower than the pixels that its light is taken from are apart."""
    y, x = np.mgrid[:3000, :10]
    tall = (np.hypot(y % 12 - 6, x - 5) < 4.5) + 0.2 * y / 3000
    for strip in (tall, tall.T):
        assert remove_background(strip, np.ones(strip.shape, dtype=bool), 0.0) is not None


def test_background_is_divided_out():
    light = np.linspace(1, 0.4, X.shape[1])
    darkness = remove_background(0.1 + 0.8 * light * DISCS, np.ones(DISCS.shape, dtype=bool), 0.0)
    assert np.abs(darkness.values[DISCS > 0]).max() < 0.05
    assert np.abs(darkness.values[DISCS == 0] - 1).max() < 0.05
    assert darkness.light == pytest.approx(2.4, rel=0.1)


def test_glow_around_droplets_does_not_move_their_edge():
    """Light that spreads beyond a droplet, as around photoelastic disks, lifts the ground beside it."""
    y, x = np.mgrid[:260, :260] + 0.5
    away = np.min([np.hypot(x - 70 - 120 * i, y - 70 - 120 * j) for i in (0, 1) for j in (0, 1)], axis=0) - 40
    sharp = np.clip(0.5 - away, 0, 1)
    picture = ndimage.gaussian_filter(sharp + (1 - sharp) * 0.2 * np.exp(-away.clip(0) / 12), 2.5)
    found = jamlab.micrograph(picture, contrast="bright")
    np.testing.assert_allclose(np.sqrt(found.interiors / np.pi), 40, atol=0.35)


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


def test_bars_are_found_and_filled_in():
    """White and black bars over droplets and ground; a picture without one has none."""
    clean = 1 - DISCS
    assert not find_drawn(clean, 0.0, 14).any()
    for level in (-0.6, 1.8, 1.0):
        drawn = clean.copy()
        drawn[110:114, 60:120] = level
        mask = find_drawn(drawn, 0.0, 14)
        assert mask[111, 64:116].all() and mask.sum() < 400
        thin, thick = sort_annotations(mask, 14)
        assert thin.any() and not thick.any()
        wrong = (np.abs(fill_in(drawn, thin) - clean) > 0.5)[110:114, 60:120].mean()
        assert wrong < 0.35 < (np.abs(drawn - clean) > 0.5)[110:114, 60:120].mean()


def test_flat_pixels_in_noise_are_drawn():
    noisy = DISCS + 0.05 * np.random.default_rng(2).normal(size=DISCS.shape)
    assert not find_flat(noisy, 0.05).any()
    noisy[10:20, 30:50] = 0.7
    found = find_flat(noisy, 0.05)
    assert found[10:20, 30:50].all() and found.sum() == 200


@pytest.mark.parametrize(
    ("radii", "kind"),
    [
        (np.full(40, 5.0), "monodisperse"),
        (np.repeat([5.0, 7.0], 20), "bidisperse"),
        (np.linspace(3.0, 9.0, 40), "polydisperse"),
        (np.full(4, 5.0), "too few"),
    ],
)
def test_kinds_of_sizes(radii, kind):
    radii = radii * (1 + 0.02 * np.random.default_rng(3).normal(size=len(radii)))
    sizes = size_distribution(np.pi * radii**2)
    assert sizes.kind == kind and str(sizes).startswith(kind)
    if kind == "bidisperse":
        assert sizes.ratio == pytest.approx(1.4, rel=0.02) and sizes.large == 0.5


def test_shape_factor_of_known_outlines():
    turn = 2 * np.pi * np.arange(400) / 400
    assert shape_factor(np.column_stack([np.cos(turn), np.sin(turn)])) == pytest.approx(1, abs=1e-4)
    assert shape_factor(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])) == pytest.approx(4 / np.pi)


def test_rendered_light_bars_and_dark_droplets(dp_dense):
    plain = jamlab.synthetic_micrograph(dp_dense, 64)
    lit = jamlab.synthetic_micrograph(dp_dense, 64, light=0.5, blur=0.7)
    np.testing.assert_allclose(lit, plain * np.linspace(1, 0.5, 64), atol=1e-12)
    barred = jamlab.synthetic_micrograph(dp_dense, 64, scale_bar=True)
    assert (barred != plain).any() and (barred[barred != plain] == max(1.0, plain.max())).all()
    dark = jamlab.synthetic_micrograph(dp_dense, 64, dark=True)
    np.testing.assert_allclose(dark, 1 - plain, atol=1e-12)


def test_films_divide_droplets(dp_dense):
    thin, wide = (jamlab.synthetic_micrograph(dp_dense, 100, film=film, blur=0.0).mean() for film in (0.0, 2.0))
    assert thin == pytest.approx(jamlab.packing_fraction(dp_dense), abs=0.005)
    assert thin - wide > 0.03


BAD = [{"pixels": 5}, {"blur": -1.0}, {"noise": np.nan}, {"light": 0.0}, {"vignette": 1.0}, {"seed": -1}]


def test_rendering_refuses(dp_onset, sp_jammed):
    tilted = dp_onset.with_state(box=dp_onset.box + np.array([[0, 0], [0.1, 0]]))
    for packing, how in [(sp_jammed, {}), (tilted, {}), *((dp_onset, how) for how in BAD)]:
        with pytest.raises(InputError) as error:
            jamlab.synthetic_micrograph(packing, **how)
        assert not how or next(iter(how)) in str(error.value)
