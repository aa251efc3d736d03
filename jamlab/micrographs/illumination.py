"""Uneven light and noise: divide a picture by its background, so that droplets are 0 and the ground is 1.

The level of droplets is averaged over their inner parts, the level of the ground is a smooth surface through the
middles of voids, where blur does not reach. Both begin as envelopes: polynomials of second degree, fitted by least
squares that weigh pixels above and below differently (asymmetric least squares).

Scale bars and labels that were drawn into a picture are taken for droplets or ground: cut them off.

Sources: J. Immerkaer, Comput. Vis. Image Underst. 64, 300 (1996), for the noise; P. H. C. Eilers, Anal. Chem. 75, 3631
(2003), for asymmetric least squares; N. Otsu, IEEE Trans. SMC 9, 62 (1979), for the first threshold.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Mask
from jamlab.errors import InputError
from jamlab.micrographs.picture_files import distance_inside, scikit_image
from jamlab.micrographs.segmentation import granulometry

ENVELOPE = 0.95  # weight of pixels beyond an envelope; the others weigh 1 - ENVELOPE
ROUNDS = 12  # of an asymmetric fit: its weights settle in six to ten
COARSE = 128  # pixels along a side on which envelopes are fitted: light varies more slowly than droplets
FINE = 15  # pixels of radius: levels of larger droplets are taken from every second pixel, or fewer
REFINEMENTS = 2  # of both levels after the envelopes; a third changes rho by less than 0.001
REACH = 2.0  # radii over which the level of droplets is averaged
INNER = 0.25  # radii from the outline that the inner part of a droplet keeps
LEAST_CONTRAST = 0.02  # between droplets and ground, of the range of the picture: below, there is nothing to see
SMOOTH_NOISE = 0.08  # noise left after denoising, of the contrast: a third of a film blurred to 0.25
WIDE = 0.7  # of the wide voids in radius that a void must be for the level of the ground: narrower ones are less dark
DIM = 0.1  # of the picture is darker than where denoising is measured: noise stands out most in dim light
LARGEST_FILTER = 2.5  # pixels, standard deviation of the denoising filter
MAD = 1.4826  # standard deviation over median absolute deviation of a normal distribution


@dataclass(frozen=True)
class Darkness:
    """A picture without its background."""

    values: Array  # (h, w), 0 in droplets and 1 on the ground, with all noise
    smooth: Array  # (h, w), the same, denoised
    noise: float  # standard deviation of the noise in `values`
    filter: float  # standard deviation, in pixels, of the filter that denoised
    light: float  # brightest over darkest level of the droplets
    radius: float  # pixels, typical radius of droplets by granulometry
    ground: int  # number of voids that the level of the ground rests on
    opening: float  # pixels, radius of the largest disc in the wider ones of them
    contrast: float  # between droplets and ground, of the range of the picture

    def wrapped(self, margin: int) -> Darkness:
        """The same repeated periodically around itself, `margin` pixels wide."""
        return replace(
            self, values=np.pad(self.values, margin, mode="wrap"), smooth=np.pad(self.smooth, margin, mode="wrap")
        )


def noise_level(grey: Array) -> float:
    """Standard deviation of the noise: median of a second difference that straight edges and ramps do not change."""
    kernel = np.array([[1.0, -2, 1], [-2, 4, -2], [1, -2, 1]]) / 6
    return float(MAD * np.median(np.abs(ndimage.convolve(grey, kernel))))


def remove_background(bright: Array, noise: float) -> Darkness | None:
    """Turn grey values of bright droplets into darkness; None if nothing stands out from light and noise.

    Args:
        bright: (h, w) grey values, droplets brighter than the ground.
        noise: standard deviation of the noise.
    """
    first = width_of_filter(noise / max(bright.std(), 1e-12))
    quiet = _blur(bright, first)
    high, low = envelope(quiet, ENVELOPE), envelope(quiet, 1 - ENVELOPE)
    radius, ground, opening, few = 0.0, 0, 0.0, _samples(bright.shape)
    for turn in range(REFINEMENTS + 2):
        contrast = float(np.median((high - low)[few]))
        if contrast < max(LEAST_CONTRAST, 0.5 * noise):
            return None
        step = np.maximum(high - low, 0.2 * contrast)
        values, width = (high - bright) / step, width_of_filter(noise / float(np.quantile(step[few], DIM)))
        smooth = _blur(values, width)
        if turn > REFINEMENTS:
            break
        level = 0.5 if radius else scikit_image().filters.threshold_otsu(smooth)
        mask = smooth < level
        radius = granulometry(mask)[0]
        if radius <= 0:
            return None
        every = max(1, int(radius / FINE))
        thin = np.s_[::every, ::every]
        inner = every * distance_inside(mask[thin])
        high = _droplet_level(bright, inner > max(INNER * radius, 1.5), REACH * radius, every)
        low, ground, opening = _ground_level(bright, ~mask[thin], low, every)
    light = np.quantile(step[few], [0.02, 0.98])
    return Darkness(
        values, smooth, noise / contrast, width, float(light[1] / light[0]), radius, ground, opening, contrast
    )


def width_of_filter(noise: float) -> float:
    """Standard deviation s of the Gaussian that leaves noise/(2 sqrt(pi) s) = `SMOOTH_NOISE`; 0 if it is there."""
    return min(noise / (2 * np.sqrt(np.pi) * SMOOTH_NOISE), LARGEST_FILTER) if noise > SMOOTH_NOISE else 0.0


def _blur(values: Array, width: float) -> Array:
    return np.asarray(ndimage.gaussian_filter(values, width, mode="nearest")) if width > 0 else values.copy()


def _powers(degree: int) -> list[tuple[int, int]]:
    """Powers of x and y in a surface of that degree."""
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


def _terms(y: Array, x: Array, degree: int) -> Array:
    return np.stack([x**i * y**j for i, j in _powers(degree)], axis=-1)


def _grid(shape: tuple[int, ...]) -> tuple[Array, Array]:
    y, x = (np.linspace(-1, 1, count) for count in shape)
    return np.broadcast_to(y[:, None], shape), np.broadcast_to(x, shape)


def _samples(shape: tuple[int, ...]) -> tuple[slice, ...]:
    """Pixels that are enough for what varies more slowly than droplets."""
    step = max(1, round(max(shape) / COARSE))
    return tuple(slice(min(step, side) // 2, None, step) for side in shape)


def envelope(grey: Array, above: float) -> Array:
    """Surface of second degree that pixels are above of (`above` small) or below of (large)."""
    few = _samples(grey.shape)
    y, x = _grid(grey.shape)
    terms = _terms(y[few].ravel(), x[few].ravel(), 2)
    return _surface(_asymmetric_fit(terms, grey[few].ravel(), above), grey.shape, 2)


def _asymmetric_fit(terms: Array, values: Array, above: float) -> Array:
    weight = np.ones(len(values))
    for _ in range(ROUNDS):
        fit = _weighted_fit(terms, values, weight)
        weight = np.where(values > terms @ fit, above, 1 - above)
    return fit


def _weighted_fit(terms: Array, values: Array, weight: Array) -> Array:
    """Least squares by their normal equations, which for so few terms lose a few digits of sixteen."""
    weighted = terms.T * weight
    return np.asarray(np.linalg.lstsq(weighted @ terms, weighted @ values, rcond=None)[0])


def _surface(fit: Array, shape: tuple[int, ...], degree: int) -> Array:
    """Surface over the whole picture."""
    matrix = np.zeros((degree + 1, degree + 1))  # powers of y along rows, of x along columns
    matrix[tuple(np.array(_powers(degree)).T[::-1])] = fit
    y, x = (np.vander(np.linspace(-1, 1, count), degree + 1, increasing=True) for count in shape)
    return np.asarray(y @ matrix @ x.T)


def _droplet_level(grey: Array, kept: Mask, reach: float, thin: int) -> Array:
    """Level of droplets: a surface of second degree through the kept pixels, and what lies `reach` wide beside it.
    `kept`: of every `thin`th pixel."""
    few = grey[::thin, ::thin]
    step = max(1, round(max(grey.shape) / COARSE / thin))
    y, x = _grid(few.shape)
    coarse = kept[::step, ::step]
    if coarse.sum() < 20:
        return np.full(grey.shape, few[kept].mean() if kept.any() else grey.max())
    terms = _terms(y[::step, ::step][coarse], x[::step, ::step][coarse], 2)
    fit = np.asarray(np.linalg.lstsq(terms, few[::step, ::step][coarse], rcond=None)[0], dtype=np.float64)
    return _surface(fit, grey.shape, 2) + _near_mean(few - _surface(fit, few.shape, 2), kept, reach, thin, grey.shape)


def _near_mean(values: Array, kept: Mask, reach: float, thin: int, shape: tuple[int, ...]) -> Array:
    """(h, w) mean of the kept pixels near each pixel, `reach` wide; 0 far from all of them.

    Args:
        values, kept: of every `thin`th pixel.
        shape: h and w.
    """
    step = max(1, int(reach / 8 / thin))  # a field that smooth needs no more samples
    small = np.s_[::step, ::step]
    box = [ndimage.uniform_filter(part, step) for part in (kept.astype(np.float64), np.where(kept, values, 0.0))]
    weight, total = (ndimage.gaussian_filter(part[small], reach / step / thin, mode="nearest") for part in box)
    weight = np.maximum(weight, 0.0)
    trust = 1e-3
    field = total / (weight + trust)
    for count in shape:  # linear between samples, down the columns and then along the rows, as columns of the transpose
        place = np.minimum(np.arange(count) / (step * thin), len(field) - 1)
        low = place.astype(np.int64)
        less, more = field[low], field[np.minimum(low + 1, len(field) - 1)]
        field = (less + (place - low)[:, None] * (more - less)).T
    return np.asarray(field)


def _ground_level(grey: Array, ground: Mask, otherwise: Array, thin: int) -> tuple[Array, int, float]:
    """Surface through the middles of the widest voids; second degree, first or none by their number. `ground`: of every
    `thin`th pixel."""
    # at least, since a film may be one pixel of these wide
    depth = thin * distance_inside(ground) - (thin - 1)
    tops = (depth == ndimage.maximum_filter(depth, 8 // thin + 1)) & (depth > 1.5)
    if not tops.any():
        return otherwise, 0, 0.0
    places = thin * np.argwhere(tops)
    wide = depth[tops]
    places = places[wide >= WIDE * np.quantile(wide, 0.9)]
    mean = ndimage.uniform_filter(grey, 3)[tuple(places.T)]
    shape = np.array(grey.shape) - 1
    y, x = (2 * places / shape - 1).T
    degree = 2 if len(places) >= 24 else 1 if len(places) >= 9 else 0
    terms = _terms(y, x, degree)
    weight = np.ones(len(places))
    for _ in range(ROUNDS):  # least absolute deviations: a void that blur has filled counts little
        fit = _weighted_fit(terms, mean, weight)
        off = mean - terms @ fit
        weight = np.where(off > 0, 0.4, 1.0) / np.maximum(np.abs(off), 1e-3)
    return _surface(fit, grey.shape, degree), len(places), float(np.quantile(wide, 0.9))


def blur_of(darkness: Darkness) -> float:
    """Standard deviation of the blur, pixels, from the steepest edges: a blurred step has slope 1/(sqrt(2 pi) s)."""
    own = max(1.0, darkness.filter)
    slope = ndimage.gaussian_gradient_magnitude(darkness.values, own)
    edge = (darkness.smooth > 0.35) & (darkness.smooth < 0.65)
    if not edge.any():
        return 0.0
    width = 1 / (np.sqrt(2 * np.pi) * np.quantile(slope[edge], 0.8))
    return float(np.sqrt(max(width**2 - own**2, 0.0)))


def read_darkness(grey: Array) -> Darkness:
    """Darkness of a picture of bright droplets."""
    darkness = remove_background(grey, noise_level(grey))
    if darkness is None:
        raise InputError("no droplets can be distinguished from uneven light and noise: check the picture")
    return darkness
