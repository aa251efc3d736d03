"""Uneven light and noise: divide a picture by its background, so that droplets are 0 and the ground is 1.

The level of droplets is a polynomial through their inner parts, the level of the ground one through the middles of
voids, where blur does not reach. Both begin as envelopes: polynomials of second degree, fitted by least squares that
weigh pixels above and below differently (asymmetric least squares).

Scale bars and labels that were drawn into a picture are taken for droplets or ground: cut them off.

Sources: J. Immerkaer, Comput. Vis. Image Underst. 64, 300 (1996), for the noise; P. H. C. Eilers, Anal. Chem. 75, 3631
(2003), for asymmetric least squares; N. Otsu, IEEE Trans. SMC 9, 62 (1979), for the first threshold.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polygrid2d, polyvander2d
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.picture_files import distance_inside, scikit_image
from jamlab.micrographs.segmentation import granulometry


@dataclass(frozen=True)
class Light:
    """How light and noise are taken out of a picture."""

    envelope: float = 0.95  # weight of pixels beyond an envelope; the others weigh 1 - ENVELOPE
    rounds: int = 12  # of an asymmetric fit: its weights settle in six to ten
    coarse: int = 128  # pixels along a side on which envelopes are fitted: light varies more slowly than droplets
    refinements: int = 2  # of both levels after the envelopes; a third changes rho by less than 0.001
    many: int = 200  # samples inside droplets, for a level of fourth degree
    inner: float = 0.25  # radii from the outline that the inner part of a droplet keeps
    # between droplets and ground, of the range of the picture: below, there is nothing to see
    least_contrast: float = 0.02
    smooth_noise: float = 0.08  # noise left after denoising, of the contrast: a third of a film blurred to 0.25
    # of the wide voids in radius that a void must be for the level of the ground: narrower ones are less dark
    wide: float = 0.7
    dim: float = 0.1  # of the picture is darker than where denoising is measured: noise stands out most in dim light
    largest_filter: float = 2.5  # pixels, standard deviation of the denoising filter


LIGHT = Light()

MAD = 1.4826  # standard deviation over median absolute deviation of a normal distribution


@dataclass(frozen=True)
class Darkness:
    """A picture without its background."""

    values: Array  # (h, w), 0 in droplets and 1 on the ground, with all noise
    smooth: Array  # (h, w), the same, denoised
    noise: float  # standard deviation of the noise in `values`
    filter: float  # standard deviation, in pixels, of the filter that denoised
    light: float  # brightest over darkest level of the droplets
    ground: int  # number of voids that the level of the ground rests on
    opening: float  # pixels, radius of the largest disc in the wider ones of them


def noise_level(grey: Array) -> float:
    """Standard deviation of the noise: median of a second difference that straight edges and ramps do not change."""
    kernel = np.array([[1.0, -2, 1], [-2, 4, -2], [1, -2, 1]]) / 6
    return float(MAD * np.median(np.abs(ndimage.convolve(grey, kernel))))


def remove_background(bright: Array) -> Darkness | None:
    """Turn grey values (h, w), droplets brighter than the ground, into darkness; None if nothing stands out from light
    and noise."""
    noise = noise_level(bright)
    first = width_of_filter(noise / max(bright.std(), 1e-12))
    quiet = _blur(bright, first)
    high, low = envelope(quiet, LIGHT.envelope), envelope(quiet, 1 - LIGHT.envelope)
    radius, ground, opening, few = 0.0, 0, 0.0, _samples(bright.shape)
    for turn in range(LIGHT.refinements + 2):
        contrast = float(np.median((high - low)[few]))
        if contrast < max(LIGHT.least_contrast, 0.5 * noise):
            return None
        step = np.maximum(high - low, 0.2 * contrast)
        values, width = (high - bright) / step, width_of_filter(noise / float(np.quantile(step[few], LIGHT.dim)))
        smooth = _blur(values, width)
        if turn > LIGHT.refinements:
            break
        level = 0.5 if radius else scikit_image().filters.threshold_otsu(smooth)
        mask = smooth < level
        radius = granulometry(mask)[0]
        if radius <= 0:
            return None
        high = _droplet_level(bright, distance_inside(mask) > max(LIGHT.inner * radius, 1.5))
        low, ground, opening = _ground_level(bright, ~mask, low)
    light = np.quantile(step[few], [0.02, 0.98])
    return Darkness(values, smooth, noise / contrast, width, float(light[1] / light[0]), ground, opening)


def width_of_filter(noise: float) -> float:
    """Standard deviation s of the Gaussian that leaves noise/(2 sqrt(pi) s) = `smooth_noise`; 0 if it is there."""
    if noise <= LIGHT.smooth_noise:
        return 0.0
    return float(min(noise / (2 * np.sqrt(np.pi) * LIGHT.smooth_noise), LIGHT.largest_filter))


def _blur(values: Array, width: float) -> Array:
    return np.asarray(ndimage.gaussian_filter(values, width, mode="nearest")) if width > 0 else values.copy()


def _samples(shape: tuple[int, ...]) -> tuple[slice, ...]:
    """Pixels that are enough for what varies more slowly than droplets."""
    step = max(1, round(max(shape) / LIGHT.coarse))
    return tuple(slice(min(step, side) // 2, None, step) for side in shape)


def _few(mask: Mask) -> Indices:
    """(m, 2) those pixels of a mask."""
    chosen = np.zeros(mask.shape, dtype=bool)
    chosen[_samples(mask.shape)] = mask[_samples(mask.shape)]
    return np.argwhere(chosen)


def _fitted(grey: Array, places: Indices, degree: int, weigh: Callable[[Array], Array] | None = None) -> Array:
    """(h, w) polynomial surface through the values at some places (m, 2), rows and columns. `weigh`: weights from
    residuals, so that least squares are repeated."""
    powers = np.array([(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]).T
    axes = [np.linspace(-1, 1, side) for side in grey.shape]
    x, y = (axis[place] for axis, place in zip(axes, places.T, strict=True))
    terms, values = (
        polyvander2d(x, y, (degree, degree)).reshape(-1, degree + 1, degree + 1)[:, *powers],
        grey[tuple(places.T)],
    )
    weight, matrix = np.ones(len(values)), np.zeros((degree + 1, degree + 1))
    for _ in range(LIGHT.rounds if weigh else 1):  # normal equations, which lose few digits for so few terms
        weighted = terms.T * weight
        fit = np.linalg.lstsq(weighted @ terms, weighted @ values, rcond=None)[0]
        weight = weigh(values - terms @ fit) if weigh else weight
    matrix[tuple(powers)] = fit
    return np.asarray(polygrid2d(axes[0], axes[1], matrix))


def envelope(grey: Array, above: float) -> Array:
    """Surface of second degree that pixels are above of (`above` small) or below of (large)."""
    return _fitted(grey, _few(np.ones(grey.shape, dtype=bool)), 2, lambda off: np.where(off > 0, above, 1 - above))


def _droplet_level(grey: Array, kept: Mask) -> Array:
    """Level of droplets: a surface through the kept pixels."""
    places = _few(kept)
    if len(places) < 20:
        return np.full(grey.shape, grey[kept].mean() if kept.any() else grey.max())
    return _fitted(grey, places, 4 if len(places) >= LIGHT.many else 2)


def _ground_level(grey: Array, ground: Mask, otherwise: Array) -> tuple[Array, int, float]:
    """Surface through the middles of the widest voids; second degree, first or none by their number."""
    depth = distance_inside(ground)
    tops = (depth == ndimage.maximum_filter(depth, 9)) & (depth > 1.5)
    if not tops.any():
        return otherwise, 0, 0.0
    places, wide = np.argwhere(tops), depth[tops]
    places = places[wide >= LIGHT.wide * np.quantile(wide, 0.9)]
    degree = 2 if len(places) >= 24 else 1 if len(places) >= 9 else 0
    # least absolute deviations: a void that blur has filled counts little
    level = _fitted(
        ndimage.uniform_filter(grey, 3),
        places,
        degree,
        lambda off: np.where(off > 0, 0.4, 1.0) / np.maximum(np.abs(off), 1e-3),
    )
    return level, len(places), float(np.quantile(wide, 0.9))


def blur_of(darkness: Darkness) -> float:
    """Standard deviation of the blur, pixels, from the steepest edges: a blurred step has slope 1/(sqrt(2 pi) s)."""
    own = max(1.0, darkness.filter)
    slope = ndimage.gaussian_gradient_magnitude(darkness.values, own)
    edge = (darkness.smooth > 0.35) & (darkness.smooth < 0.65)
    if not edge.any():
        return 0.0
    width = 1 / (np.sqrt(2 * np.pi) * np.quantile(slope[edge], 0.8))
    return float(np.sqrt(max(width**2 - own**2, 0.0)))
