"""Density of states of packings of several N, and its collapse at low frequency.

Where D = A omega^beta, a packing has about N A omega^(beta + 1)/(beta + 1) modes below omega for each degree of freedom
of a particle. Its lowest frequency is then of order N^(-1/(1 + beta)), and D N^(beta/(1 + beta)) over omega
N^(1/(1 + beta)) is one curve for all N: beta = 4 of quasi-localised modes (E. Lerner, G. During and E. Bouchbinder,
Phys. Rev. Lett. 117, 035501 (2016)), beta = 1 of waves in two dimensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.mechanics.density_of_states import DensityOfStates, density_of
from jamlab.mechanics.like_packings import check_distinct, group_by_number
from jamlab.mechanics.masses import Masses
from jamlab.mechanics.vibrations import Modes, modes_of
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, label_decades, merged_line
from jamlab.plotting.palette import COLOURS, ordered_colours

LEAST = 0.3  # of the mean, to which bands are drawn down


@dataclass(frozen=True)
class DensityBySize(Result):
    """D(omega) of packings of several N, each a mean over packings, and the collapse of low frequencies.

    Attributes:
        n_particles: (s,) numbers of particles, ascending.
        densities: `DensityOfStates` of each N.
        lowest: (s,) lowest frequency above zero, mean over packings.
        lowest_stderr: (s,) its standard error over packings; nan of one packing.
        omega_exponent: beta of the collapse, D ~ omega^beta.
        unit: unit of eigenvalues, for labels.

    Example:
        >>> packings = [jamlab.pack(n, 1e-2, seed) for n in (16, 32) for seed in (1, 2)]
        >>> found = jamlab.density_by_size(packings, bins=10, omega_exponent=1.0)
        >>> found.n_particles.tolist(), [d.packings for d in found.densities]
        ([16, 32], [2, 2])
    """

    n_particles: Indices
    densities: tuple[DensityOfStates, ...] = field(repr=False)
    lowest: Array
    lowest_stderr: Array
    omega_exponent: float
    unit: str = field(default="", repr=False)

    @property
    def lowest_exponent(self) -> float:
        """beta by which the lowest frequency falls with N, as N^(-1/(1 + beta)): by least squares of logarithms; nan
        of one N."""
        if len(self.n_particles) < 2:
            return float("nan")
        slope = np.polyfit(np.log(self.n_particles), np.log(self.lowest), 1)[0]
        return float(-1 / slope - 1)

    def _columns(self) -> dict[str, Any]:
        """A row for each N and frequency."""
        counts = [len(each.omega) for each in self.densities]
        number = np.repeat(self.n_particles, counts)
        names = ("omega", "density", "density_low", "density_high")
        columns = {name: np.concatenate([getattr(each, name) for each in self.densities]) for name in names}
        share = 1 / (1 + self.omega_exponent)
        scaled = {
            "scaled_omega": columns["omega"] * number**share,
            "scaled_density": columns["density"] * number ** (self.omega_exponent * share),
        }
        return {"n": number} | columns | scaled

    @drawn("Line2D, of all curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the collapse: D N^(beta/(1 + beta)) over omega N^(1/(1 + beta)), on logarithmic axes.

        >>> ax = jamlab.density_by_size([jamlab.pack(n, 1e-2, 1) for n in (16, 32)], 10).plot()
        """
        share, colours = 1 / (1 + self.omega_exponent), list(COLOURS)
        if len(self.n_particles) > len(colours):
            colours = ordered_colours(len(self.n_particles))
        for n, each, colour in zip(self.n_particles, self.densities, colours, strict=False):
            seen = each.density > 0
            x, factor = each.omega[seen] * n**share, n ** (self.omega_exponent * share)
            plain = {"color": colour, "marker": "o", "markersize": 3, "label": f"$N$ = {n}, {each.packings} packings"}
            axes.loglog(x, factor * each.density[seen], **merged_line(plain, style))
            low = np.maximum(each.density_low, LEAST * each.density)  # a logarithm has no 0
            ends = (factor * low[seen], factor * each.density_high[seen])
            axes.fill_between(x, *ends, color=merged_line(plain, style)["color"], alpha=0.2, linewidth=0)
        units = (f"$\\sqrt{{{self.unit}/m}}$", f"$\\sqrt{{m/{self.unit}}}$") if self.unit else ("", "")
        x, y = rf"$\omega\,N^{{{share:.3g}}}$", rf"$D\,N^{{{self.omega_exponent * share:.3g}}}$"
        label_axes(axes, in_unit(x, units[0]), in_unit(y, units[1]))
        label_decades(axes)
        axes.legend(fontsize=LEGEND)


@checked
def density_by_size(
    packings: Sequence[Packing],
    bins: int | ArrayLike = 40,
    *,
    omega_exponent: float = 4.0,
    count: int | None = None,
    rattlers: bool = True,
    prestress: bool = True,
    masses: Masses | None = None,
) -> DensityBySize:
    """Return D(omega) of packings of several N, and its collapse for D ~ omega^beta.

    Also called: finite_size_scaling, n_scaling, dos_by_size, density_collapse.

    Args:
        packings: of several N that differ in nothing else but their random start.
        bins: number of bins of one width, or their edges, ascending; for a power law edges such as np.geomspace gives.
        omega_exponent: beta, above 0.
        count: lowest modes of each packing that are found; None: all. Bins may not reach beyond them.
        rattlers, prestress, masses: as in `density_of_states`.

    Raises:
        InputError: packings that differ in more than N, one that is given twice, bins that are not ascending or beyond
            the modes, beta that is not positive, a packing without a mode above zero among those asked for.

    Example:
        >>> packings = [jamlab.pack(n, 1e-2, seed) for n in (16, 32) for seed in (1, 2)]
        >>> table = jamlab.density_by_size(packings, np.geomspace(0.1, 2.0, 9)).to_dataframe()
        >>> list(table)[-2:], len(table)
        (['scaled_omega', 'scaled_density'], 16)
    """
    if not packings:
        raise InputError("packings: give one or more")
    check_distinct(dict(enumerate(packings)))
    densities, lowest, spread, numbers = [], [], [], []
    for n, members in sorted(group_by_number(packings).items()):
        modes = [modes_of(packings[k], _at_most(packings[k], count), rattlers, prestress, masses) for k in members]
        found = np.array([_lowest(each, k) for each, k in zip(modes, members, strict=True)])
        densities.append(density_of(modes, bins))
        numbers.append(n)
        lowest.append(found.mean())
        spread.append(found.std(ddof=1) / np.sqrt(len(found)) if len(found) > 1 else np.nan)
    return DensityBySize(
        n_particles=np.array(numbers),
        densities=tuple(densities),
        lowest=np.array(lowest),
        lowest_stderr=np.array(spread),
        omega_exponent=omega_exponent,
        unit=packings[0].unit_names.stress,
    )


def _at_most(packing: Packing, count: int | None) -> int | None:
    """All modes where there are fewer than `count`."""
    return None if count is None or count >= 2 * packing.frame.free_sites.sum() else count


def _lowest(modes: Modes, number: int) -> float:
    above = modes.frequencies[~modes.zero & (modes.eigenvalues > 0)]
    if not len(above):
        raise InputError(
            f"packings[{number}] has no mode with a frequency above zero among {len(modes.eigenvalues)}: give more, "
            "count=None, or leave it out"
        )
    return float(above[0])
