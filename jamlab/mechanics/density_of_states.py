"""Density of states: the number of vibrations per frequency, as a mean over packings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from jamlab.arrays import Array, ArrayLike, Mask
from jamlab.checks import finite_array
from jamlab.errors import InputError
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE
from jamlab.statistics.confidence import bootstrap


@dataclass(frozen=True)
class Histogram:
    """How modes are counted."""

    bins: int = 40  # of one width, from 0 to the highest frequency
    most: int = 100_000
    resamples: int = 1000  # the ends of a 95 % interval to a tenth of its width


HISTOGRAM = Histogram()


@dataclass(frozen=True)
class DensityOfStates(Result):
    """D(omega): modes per frequency over the degrees of freedom, the mean over packings.

    Its integral is the number of modes in the bins over the number of degrees of freedom, the coordinates that may
    move. Over all frequencies it is 1 - `zero_modes` - `unstable`: these two shares have no place in the bins.

    Attributes:
        omega: (m,) middles of the bins; masses are 1.
        density: (m,) D.
        density_low, density_high: (m,) ends of the 95 % interval over packings; nan of one packing.
        edges: (m + 1,) of the bins.
        zero_modes: share of modes that cost nothing, see `Modes.zero`: translations, rattlers, mechanisms.
        unstable: share of modes with an eigenvalue below zero.
        packings: number of packings.
        unit: unit of eigenvalues, for labels.

    Example:
        >>> packings = [jamlab.pack(n=16, pressure=1e-2, seed=seed) for seed in (1, 2, 3)]
        >>> d = jamlab.density_of_states(packings, bins=[0.0, 1.0, 2.0, 3.0])
        >>> d.packings, bool(np.isclose(d.density.sum() + d.zero_modes + d.unstable, 1.0))
        (3, True)
    """

    _rows = ("omega", "density", "density_low", "density_high")

    omega: Array
    density: Array
    density_low: Array
    density_high: Array
    edges: Array
    zero_modes: float
    unstable: float
    packings: int
    unit: str = field(default="", repr=False)

    @drawn("Line2D, of the mean")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw D over the frequency, with a band of its interval over packings.

        >>> ax = jamlab.density_of_states([jamlab.pack(16, 1e-2, seed) for seed in (1, 2)]).plot()
        """
        label = f"{self.packings} packing{'s' * (self.packings > 1)}, {self.zero_modes:.2g} in zero modes"
        look = merged_line({"color": BLUE, "linewidth": 1.6, "drawstyle": "steps-mid", "label": label}, style)
        axes.plot(self.omega, self.density, **look)
        axes.fill_between(
            self.omega, self.density_low, self.density_high, step="mid", color=look["color"], alpha=0.25, linewidth=0
        )
        label_axes(axes, in_unit(r"frequency $\omega$", self.unit and f"$\\sqrt{{{self.unit}/m}}$"), r"$D(\omega)$")
        axes.legend(fontsize=LEGEND)


class Spectrum(Protocol):
    """Modes of one packing, ascending."""

    @property
    def frequencies(self) -> Array:
        """(m,) frequencies."""

    @property
    def zero(self) -> Mask:
        """(m,) whether a mode costs nothing."""

    @property
    def degrees_of_freedom(self) -> int:
        """Number of all modes."""

    @property
    def unit(self) -> str:
        """Unit of eigenvalues."""


def density_of(spectra: Sequence[Spectrum], bins: int | ArrayLike) -> DensityOfStates:
    """D(omega) of the modes of some packings, which weigh alike."""
    edges = _edges(spectra, bins)
    width = np.diff(edges)
    counted, zero, unstable = [], [], []
    for each in spectra:
        costing = each.frequencies[~each.zero]
        counted.append(np.histogram(costing, edges)[0] / (width * each.degrees_of_freedom))
        zero.append(each.zero.sum() / each.degrees_of_freedom)
        unstable.append(np.sum(costing < 0) / each.degrees_of_freedom)
    found = bootstrap([np.array(counted)], lambda groups: groups[0].mean(axis=0), resamples=HISTOGRAM.resamples)
    return DensityOfStates(
        omega=0.5 * (edges[1:] + edges[:-1]),
        density=found.value,
        density_low=found.low,
        density_high=found.high,
        edges=edges,
        zero_modes=float(np.mean(zero)),
        unstable=float(np.mean(unstable)),
        packings=len(spectra),
        unit=spectra[0].unit,
    )


def _edges(spectra: Sequence[Spectrum], bins: int | ArrayLike) -> Array:
    """Edges of the bins; those that are given may not reach beyond the highest mode, unless all modes are there."""
    partly = [each for each in spectra if len(each.frequencies) < each.degrees_of_freedom]
    known = min((float(each.frequencies[-1]) for each in partly), default=np.inf)
    if isinstance(bins, int | float):
        if not isinstance(bins, int) or not 1 <= bins <= HISTOGRAM.most:
            raise InputError(f"bins = {bins}: must be a number of bins from 1 to {HISTOGRAM.most}, or edges, ascending")
        highest = min(known, max(float(each.frequencies[-1]) for each in spectra))
        if not highest > 0 or all(each.zero.all() for each in spectra):
            raise InputError("no mode has a frequency above zero: give a jammed packing, or more modes")
        return np.linspace(0.0, highest, bins + 1)
    edges = finite_array("bins", bins, (None,))
    if len(edges) < 2 or edges[0] < 0 or not np.all(np.diff(edges) > 0):
        raise InputError(f"bins = {edges}: give the edges of bins, two or more, from 0 on, ascending")
    if edges[-1] > known:
        raise InputError(f"bins end at {edges[-1]:g}, but only the modes up to {known:.4g} are known: take all of them")
    return edges
