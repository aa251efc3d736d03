"""Theory of displacements in a disordered elastic sheet: random forces of zero sum on an incompressible solid.

Forces are the divergence of a white random stress, |f_k|^2 ~ k^2, and the solid answers with u_k = f_k/(G k^2), along
the direction perpendicular to k; so n S_T = c/k^2. A drag of n per area and velocity makes G k^2 + i omega n of the
denominator, which screens waves longer than the length l_s = (|G*|/(n omega))^(1/2).
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array

LONGEST = 300  # waves over the box whose sum is C
SAMPLES, WAVES = 4000, 32  # random fields, and the waves of each
STEP, BOX, SMOOTH = 0.02, 24.0, 0.03  # of the grid on which C of a screened field is found, in l_s


def first_zero(x: Array, c: Array) -> float:
    """Where C first falls through zero, by linear interpolation; nan without one."""
    k = int((c <= 0).argmax())
    if k == 0:
        return float("nan")
    return float(x[k - 1] + (x[k] - x[k - 1]) * c[k - 1] / (c[k - 1] - c[k]))


def along_flow(waves: int, share: float, fourfold: float) -> Array:
    """(2 waves + 1, 2 waves + 1) power of u_y over whole wavevectors, in a circle: transverse power (1 + a cos 4
    theta)/k^2 and a share of it along k."""
    m = np.arange(-waves, waves + 1)
    x, y = np.meshgrid(m, m, indexing="ij")
    square = x**2 + y**2
    inside = (square > 0) & (square <= waves**2)
    square = np.where(inside, square, 1)
    turned = 1 + fourfold * (1 - 8 * x**2 * y**2 / square**2)
    return np.asarray(np.where(inside, turned * (x**2 + share * y**2) / square**2, 0.0))


@cache
def zero_in_box(share: float = 0.0, fourfold: float = 0.0) -> float:
    """Zero of the mean C(x) of u_y along the flow, over the box. For an incompressible isotropic sheet C is -ln(2 sin
    pi x) but for its first wave, so that the zero is 1/6 + 0.0025."""
    power = along_flow(LONGEST, share, fourfold).sum(axis=1)[LONGEST:]
    power[0] *= 0.5  # waves across the flow have no partner along it
    x = np.linspace(0.02, 0.5, 961)
    return first_zero(x, power @ np.cos(2 * np.pi * np.outer(np.arange(LONGEST + 1), x)))


@cache
def mean_of_zeros(share: float = 0.0, fourfold: float = 0.0) -> tuple[float, float]:
    """Mean and standard deviation of the zeros of C of single Gaussian fields: one box has few long waves, so that the
    mean of their zeros is not the zero of the mean."""
    rng = np.random.default_rng(1)
    power = along_flow(WAVES, share, fourfold)[WAVES:]
    power[0, : WAVES + 1] = 0.0  # of each pair k, -k one
    x = np.linspace(0.01, 0.5, 246)
    waves = np.cos(2 * np.pi * np.outer(np.arange(WAVES + 1), x))
    drawn = rng.exponential(size=(SAMPLES, *power.shape))
    zeros = np.array([first_zero(x, c) for c in np.einsum("sxy,xy->sx", drawn, power) @ waves])
    return float(np.nanmean(zeros)), float(np.nanstd(zeros))


def screening(k: Array, modulus: complex, drag: float) -> Array:
    """|G* k^2/(G* k^2 + i omega n)|^2, by which drag lowers the power at k; `drag`: omega n."""
    return np.asarray(np.abs(1.0 / (1.0 + 1j * drag / (modulus * k**2))) ** 2)


@cache
def screened_zero(phase: float) -> float:
    """Zero of C(x) of u_y at peak stress over l_s, where G* has this phase: u_k per stress is f_k/(e^(i phase) k^2 + i)
    with lengths in l_s."""
    x, square = _grid()
    u: NDArray[Any] = (1.0 / (np.exp(1j * phase) * square + 1j)).real
    power = u**2 * x**2 * np.exp(-square * SMOOTH**2)
    power[0, 0] = 0.0
    c = np.fft.ifft(power.sum(axis=1)).real
    half = len(c) // 2
    return first_zero(np.asarray(np.arange(half) * STEP), np.asarray(c[:half], dtype=np.float64))


@cache
def _grid() -> tuple[Array, Array]:
    q = 2 * np.pi * np.fft.fftfreq(round(BOX / STEP), d=STEP)
    x, y = np.meshgrid(q, q, indexing="ij")
    return x, x**2 + y**2
