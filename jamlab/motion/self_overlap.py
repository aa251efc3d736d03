"""Self-overlap of a flow: the share of particles that have not moved by more than a length, and how much it fluctuates.

Source: N. Lačević, F. W. Starr, T. B. Schrøder & S. C. Glotzer, J. Chem. Phys. 119, 7372 (2003); for flows of soft
disks C. Heussinger, L. Berthier & J.-L. Barrat, EPL 90, 20005 (2010).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array, ArrayLike, Indices, Mask
from jamlab.checks import checked
from jamlab.errors import InputError, named
from jamlab.motion.between_states import Run
from jamlab.motion.lags import axis_of, lags_of
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, label_axes, merged_line
from jamlab.plotting.palette import BLUE

_LENGTH = 0.3  # mean sizes, as in Lačević et al.


@dataclass(frozen=True, eq=False)
class SelfOverlap(Result):
    """Self-overlap Q over lags, means over particles and first states.

    Attributes:
        lag, strain, time, origins: as in `MeanSquareDisplacement`.
        overlap: (m,) Q, share of particles displaced by at most `length`.
        susceptibility: (m,) chi_4 = n (<Q^2> - <Q>^2) over first states; nan for a single one.
        length: the distance, unit of length of the packings.
        unit: unit of length, for labels.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> run = jamlab.quasistatic_shear(p, strain=0.04, strain_step=1e-2, snapshot_every=1e-2)
        >>> bool(jamlab.self_overlap(run).overlap[0] > 0.5)
        True
    """

    _rows = ("lag", "strain", "time", "overlap", "susceptibility", "origins")

    lag: Indices
    strain: Array
    time: Array
    overlap: Array
    susceptibility: Array
    origins: Indices
    length: float
    unit: str = field(default="", repr=False)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the overlap over strain, time or states."""
        x, name = axis_of(self)
        label = f"moved by no more than {self.length:.3g} {self.unit}".rstrip()
        axes.plot(
            x, self.overlap, **merged_line({"color": BLUE, "marker": "o", "markersize": 4, "label": label}, style)
        )
        axes.set_xscale("log")
        axes.set_ylim(0.0, 1.05)
        label_axes(axes, name, "self-overlap $Q$")
        axes.legend(fontsize=LEGEND)


@checked
def self_overlap(
    run: Run | Iterable[Packing], length: float | None = None, *, particles: ArrayLike | Mask | None = None
) -> SelfOverlap:
    """Compute the share of particles with a non-affine displacement of at most `length`, over lags.

    Args:
        run: as in `jamlab.mean_square_displacement`, with the same motion and lags.
        length: the distance, unit of length of the packings. Default: 0.3 mean sizes.
        particles: (n,) mask, or numbers of the particles to follow. Default: all free particles.

    Raises:
        InputError: a length that is not above 0; and as in `jamlab.mean_square_displacement`.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> moved = [p.with_state(positions=p.positions + k * np.eye(32, 2)) for k in range(2)]
        >>> float(jamlab.self_overlap(moved, length=0.5).overlap[0])  # 2 of 32 moved by 1
        0.9375
    """
    lags = lags_of(run, particles)
    size = _LENGTH * mean_size(lags.packing) if length is None else length
    if not (np.isfinite(size) and size > 0):
        raise InputError(f"{named('length', size)}: must be a finite distance above 0, such as 0.3 mean sizes")
    shares = [(np.hypot(*np.moveaxis(moved, 2, 0)) <= size).mean(axis=1) for moved in lags.displacements()]
    n = lags.moved.shape[1]
    spread = np.array([n * each.var() if len(each) > 1 else np.nan for each in shares])
    mean = np.array([each.mean() for each in shares])
    unit = lags.packing.unit_names.length
    return SelfOverlap(lags.lag, lags.strain, lags.time, mean, spread, lags.origins, float(size), unit)
