"""Spatial correlation of the transverse displacement in oscillating shear, Baumgarten & Tighe fig 7.

Under contact damping it has no length but the box; under Stokes drag it has a minimum that moves out as the frequency
falls. Sites are binned and pairs counted by fast Fourier transform: the cost grows as n log n, not as the n^2 pairs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from jamlab.arrays import Array, Complex
from jamlab.checks import checked
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.force_network import force_network
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.packing.strain_map import SIMPLE_SHEAR
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE
from jamlab.rheology.complex_modulus import check_frequencies
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.equation_of_motion import equation_of_motion
from jamlab.rheology.rounding_error import rounding_error, solve_frequency
from jamlab.rheology.slow_and_fast_limits import find_limits

# version, see jamlab.campaign.tasks; 1 took lanes and bins for absolute lengths, 2 gave rounding where G* is none
CORRELATION_DEFINITION = 3


@dataclass(frozen=True)
class DisplacementCorrelation(Result):
    """Correlation C(delta) of non-affine displacements at one frequency.

    Attributes:
        delta: (m,) distances along the flow, centres of bins, up to half the box.
        correlation: (m,) C; 1 if two sites move alike.
        pairs: (m,) number of pairs in each bin.
        unit: unit of length, for labels.
    """

    _rows = ("delta", "correlation", "pairs")

    delta: Array
    correlation: Array
    pairs: Array
    unit: str = field(default="", repr=False)

    @property
    def length(self) -> float:
        """Distance at which C first falls through zero.

        Raises:
            ConvergenceError: C does not change its sign within half the box.
        """
        below = np.flatnonzero(self.correlation <= 0)
        if not len(below) or below[0] == 0:
            raise ConvergenceError("the displacement correlation has no zero within half the box: use a larger packing")
        k = below[0]
        (x0, x1), (c0, c1) = self.delta[k - 1 : k + 1], self.correlation[k - 1 : k + 1]
        return float(x0 + (x1 - x0) * c0 / (c0 - c1))

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw C over the distance along the flow; the legend gives the distance of its first zero."""
        try:
            label = f"first zero at {self.length:.3g} {self.unit}".rstrip()
        except ConvergenceError:
            label = "no zero within half the box"
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "label": label}
        axes.plot(self.delta, self.correlation, **merged_line(plain, style))
        label_axes(axes, in_unit(r"distance along the flow $\delta$", self.unit), r"correlation $C(\delta)$ of $u_y$")
        axes.legend(fontsize=LEGEND)


@checked
def displacement_response(
    packing: Packing, omega: float, damping: DragLaw | None = None, *, prestress: bool = True
) -> tuple[Packing, Complex]:
    """Compute complex non-affine displacements per oscillating shear stress; returns (backbone, displacements).

    Real part: at peak stress; imaginary part: at zero stress (Baumgarten & Tighe fig 1). The mean is zero.

    Args:
        packing: SP or DP at an energy minimum.
        omega: angular frequency, 1/tau_1.
        damping, prestress: see `jamlab.dynamical_matrices`.

    Raises:
        InputError: omega is not positive.
        ConvergenceError: the packing is not jammed or not stable, or bears no shear stress.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> backbone, u = jamlab.displacement_response(p, omega=1e-2)
        >>> u.shape == (backbone.n, 2), bool(np.allclose(u.mean(axis=0), 0))
        (True, True)
    """
    return next(_displacements(packing, [omega], damping, prestress))


def _displacements(
    packing: Packing, frequencies: Iterable[float], damping: DragLaw | None, prestress: bool
) -> Iterator[tuple[Packing, Complex]]:
    """Yield what `displacement_response` returns, for several frequencies of one equation of motion."""
    for omega, (backbone, u, modulus) in zip(
        frequencies, displacements_per_strain(packing, frequencies, damping, prestress), strict=True
    ):
        if not modulus:
            raise ConvergenceError(
                f"omega = {omega:g}: the packing bears no shear stress, since G* is 0 but for rounding: displacements "
                "per stress have no limit. Use StokesDrag, or a denser packing"
            )
        yield backbone, u / modulus


def displacements_per_strain(
    packing: Packing, frequencies: Iterable[float], damping: DragLaw | None, prestress: bool
) -> Iterator[tuple[Packing, Complex, complex]]:
    """Yield the backbone, complex non-affine displacements (n_sites, 2) per oscillating strain, without their mean, and
    G*, 0 where nothing but rounding is left of it; for several frequencies of one equation of motion."""
    network = force_network(packing)
    network.check_at_rest()
    motion = equation_of_motion(network, damping or ContactDamping(), prestress=prestress)
    floppy = find_limits(motion).floppy  # refuses what is not stable
    for omega in check_frequencies(list(frequencies)):
        q, modulus, left = solve_frequency(motion, floppy, omega)
        rounding = rounding_error(motion, q[:, None], np.array([omega]))[0]
        bears = abs(rounding) + abs(left) < abs(modulus)
        u: Complex = np.zeros(network.packing.positions.shape, dtype=np.complex128)
        u.reshape(-1)[motion.displaced] = q[: motion.moving]
        u += network.packing.frame.wall_offsets @ SIMPLE_SHEAR.T  # walls are not affine
        yield network.packing, u - network.packing.frame.drift(u), modulus if bears else 0.0


@checked
def displacement_correlation(
    packing: Packing,
    omega: float,
    damping: DragLaw | None = None,
    *,
    prestress: bool = True,
) -> DisplacementCorrelation:
    """Correlate displacements: C(delta) = <u_y(x) u_y(x + delta)>/<u_y^2> along the flow, at peak stress.

    Pairs share a lane along the flow, about one mean diameter high (droplets: mean root of the rest area); the box is
    cut from its origin. Bins of delta are about half as wide.

    Args:
        packing: SP or DP at an energy minimum.
        omega: angular frequency, 1/tau_1.
        damping, prestress: see `jamlab.dynamical_matrices`.

    Raises:
        InputError: omega is not positive, or the box is too small.
        ConvergenceError: the packing is not jammed or not stable, or bears no shear stress.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> c = jamlab.displacement_correlation(p, omega=1e-2)
        >>> c.delta.shape == c.correlation.shape
        True
    """
    return displacement_correlations(packing, [omega], damping, prestress=prestress)[0]


def displacement_correlations(
    packing: Packing,
    frequencies: Iterable[float],
    damping: DragLaw | None = None,
    *,
    prestress: bool = True,
) -> list[DisplacementCorrelation]:
    """`displacement_correlation` at several frequencies, for which the equation of motion is built and checked once."""
    unit, size = packing.unit_names.length, mean_size(packing)
    return [
        replace(correlation_along_x(backbone.positions, u[:, 1].real, packing.box, size=size), unit=unit)
        for backbone, u in _displacements(packing, frequencies, damping, prestress)
    ]


def correlation_along_x(
    positions: Array, values: Array, box: Array, *, lane: float = 1.0, width: float = 0.5, size: float = 1.0
) -> DisplacementCorrelation:
    """Correlation of values (n,) at positions (n, 2) of a periodic box, between sites of one lane; see above. `size`:
    of particles, in which `lane` and `width` are given."""
    # four bins at least: the correlation is known up to half the box, and a zero needs two of them
    height, length = box[1, 1] / size, box[0, 0] / size
    for name, value, side in (("lane", lane, height), ("width", width, length / 4)):
        if not 0 < value <= side:
            raise InputError(
                f"{name} = {value}: must be positive and at most {side:.3g} mean diameters in this box; along "
                "the flow the box must be two mean diameters long: use a larger packing"
            )
    lanes, bins = int(height / lane), int(length / width)
    fraction = positions @ np.linalg.inv(box)
    x = (positions - np.floor(fraction) @ box)[:, 0] / box[0, 0]
    row = np.minimum((fraction[:, 1] % 1.0 * lanes).astype(np.int64), lanes - 1)
    column = np.minimum((x % 1.0 * bins).astype(np.int64), bins - 1)
    cell = row * bins + column

    def products(weights: Array) -> Array:
        """(bins,) sum over ordered pairs of two different sites, by their distance in bins."""
        grid = np.bincount(cell, weights, minlength=lanes * bins).reshape(lanes, bins)
        power = np.abs(np.fft.rfft(grid, axis=1)) ** 2
        sums = np.fft.irfft(power, n=bins, axis=1).sum(axis=0)
        sums[0] -= np.sum(weights**2)
        return np.asarray(sums)

    half = bins // 2
    counted = np.rint(products(np.ones_like(values))[:half])
    summed = products(values)[:half]
    kept = counted > 0
    delta = (np.arange(half) * box[0, 0] / bins)[kept]
    return DisplacementCorrelation(delta, summed[kept] / counted[kept] / np.mean(values**2), counted[kept])
