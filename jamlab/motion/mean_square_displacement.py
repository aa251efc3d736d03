"""Mean square displacement of particles in a flow, beyond its affine motion.

Source: C. E. Maloney & M. O. Robbins, J. Phys. Condens. Matter 20, 244128 (2008); A. Rahman, Phys. Rev. 136, A405
(1964), for the non-Gaussian parameter.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array, ArrayLike, Indices, Mask
from jamlab.checks import checked
from jamlab.motion.between_states import Run
from jamlab.motion.lags import axis_of, lags_of
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE, RED


@dataclass(frozen=True, eq=False)
class MeanSquareDisplacement(Result):
    """Mean square displacement over lags, means over particles and first states.

    Attributes:
        lag: (m,) int64, number of states from the first to the second.
        strain: (m,) accumulated strain between them, both directions added; 0 where states carry none.
        time: (m,) time between them, 0 where states carry none.
        along, across: (m,) mean square displacement along x and along y.
        non_gaussian: (m,) <r^4> / (2 <r^2>^2) - 1, 0 for a Gaussian distribution; nan if nothing moves.
        origins: (m,) int64, number of first states.
        unit: unit of length, for labels.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> run = jamlab.quasistatic_shear(p, strain=0.04, strain_step=1e-2, snapshot_every=1e-2)
        >>> found = jamlab.mean_square_displacement(run)
        >>> found.strain.round(6).tolist(), found.origins.tolist(), bool((found.total > 0).all())
        ([0.01, 0.02, 0.03, 0.04], [4, 3, 2, 1], True)
    """

    _rows = ("lag", "strain", "time", "total", "along", "across", "non_gaussian", "origins")

    lag: Indices
    strain: Array
    time: Array
    along: Array
    across: Array
    non_gaussian: Array
    origins: Indices
    unit: str = field(default="", repr=False)

    @property
    def total(self) -> Array:
        """(m,) mean square displacement, <r^2>."""
        return np.asarray(self.along + self.across)

    @property
    def exponent(self) -> Array:
        """(m,) slope of log <r^2> over the logarithm of the lag: 1 of diffusion, 2 of motion at one velocity."""
        if len(self.lag) < 2 or not (self.total > 0).all():
            return np.full(len(self.lag), np.nan)
        return np.asarray(np.gradient(np.log(self.total), np.log(axis_of(self)[0])))

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the mean square displacement, and its part across the flow, over strain, time or states."""
        x, name = axis_of(self)
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "label": r"$\langle\Delta r^2\rangle$"}
        axes.plot(x, self.total, **merged_line(plain, style))
        axes.plot(x, self.across, ".-", color=RED, linewidth=0.8, label=r"$\langle\Delta y^2\rangle$")
        if (self.across > 0).all():
            axes.set_xscale("log")
            axes.set_yscale("log")
        label_axes(axes, name, in_unit("mean square displacement", f"{self.unit}²" if self.unit else ""))
        axes.legend(fontsize=LEGEND)


@checked
def mean_square_displacement(
    run: Run | Iterable[Packing], *, particles: ArrayLike | Mask | None = None
) -> MeanSquareDisplacement:
    """Compute the non-affine mean square displacement over logarithmically spaced lags.

    From each state to the next, the affine motion, the mean motion and lattice vectors are taken off; the rest is
    summed. States must lie so close that no particle moves by half a box beyond the flow between two of them. Means are
    over all pairs of states if these lie evenly (the last may come early, and is left out); else from the first state.

    Also called: msd, MSD, mean_squared_displacement, mean_squared_displacements, diffusion.

    Args:
        run: a run with stored packings (`snapshot_every=...`), or packings of the same particles one after the other.
        particles: (n,) mask, or numbers of the particles to follow. Default: all free particles.

    Raises:
        InputError: fewer than two states, states of different particles, or numbers that are out of range.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> moved = [p.with_state(positions=p.positions + k * np.eye(32, 2)) for k in range(3)]
        >>> found = jamlab.mean_square_displacement(moved)
        >>> (32 * found.total).round(4).tolist()  # less the motion of the whole
        [1.9375, 7.75]
    """
    lags = lags_of(run, particles)
    rows = []
    for moved in lags.displacements():
        squares = moved**2
        along, across = squares.mean(axis=(0, 1))
        whole, fourth = along + across, (squares.sum(axis=2) ** 2).mean()
        rows.append((along, across, fourth / (2 * whole**2) - 1 if whole**2 > 0 else np.nan))
    along, across, odd = np.array(rows).T
    return MeanSquareDisplacement(
        lags.lag, lags.strain, lags.time, along, across, odd, lags.origins, lags.packing.unit_names.length
    )
