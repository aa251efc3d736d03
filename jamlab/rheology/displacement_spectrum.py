"""Spectrum of the non-affine displacements in shear, transverse and longitudinal, over the wavevectors of the box.

Disorder acts on an elastic solid as random forces of zero sum, of which shear resists the transverse part and
compression the longitudinal one. Near onset B >> G, so that displacements are transverse and fall as 1/k^2: B. DiDonna
and T. Lubensky, Phys. Rev. E 72, 066619 (2005).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.mechanics.elasticity import linear_response
from jamlab.mechanics.force_network import force_network
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import drawn
from jamlab.plotting.palette import BLUE, RED
from jamlab.rheology.displacement_correlation import displacements_per_strain
from jamlab.rheology.drag_law import DragLaw
from jamlab.statistics.rows_of_one_kind import Campaign, Select
from jamlab.structure.structure_factor import ShellMeans, ValuesAtWavevectors, Waves, places, waves_of, without_walls


class _Powers(ValuesAtWavevectors):
    """Powers of one direction."""

    _label = "power of displacements"


@dataclass(frozen=True)
class DisplacementShells(Result):
    """Mean powers of displacements over shells of wavevectors of about one length.

    Attributes:
        k: (m,) mean length of the wavevectors in each shell that has any.
        transverse: (m,) mean transverse power, every wavevector of every packing weighs alike.
        transverse_error: (m,) its standard error: over packings; of one packing over its wavevectors, nan where a shell
            has one.
        longitudinal: (m,) mean longitudinal power.
        longitudinal_error: (m,) its standard error.
        wavevectors: (m,) int64, number of wavevectors, those of all packings.
        packings: number of packings.
        unit: unit of k, for labels.
        value_unit: unit of powers, for labels.

    Example:
        >>> shells = jamlab.displacement_spectrum(jamlab.pack(n=64, pressure=1e-2, seed=1), k_max=6.0).shells()
        >>> bool(shells.transverse[0] > shells.longitudinal[0])
        True
    """

    _rows = ("k", "transverse", "transverse_error", "longitudinal", "longitudinal_error", "wavevectors")

    k: Array
    transverse: Array
    transverse_error: Array
    longitudinal: Array
    longitudinal_error: Array
    wavevectors: Indices
    packings: int
    unit: str = field(default="", repr=False)
    value_unit: str = field(default="", repr=False)

    @drawn("Line2D, of both curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw both powers over k, logarithmic, with a band of one standard error to each side.

        >>> ax = jamlab.displacement_spectrum(jamlab.pack(n=64, pressure=1e-3, seed=1), k_max=6.0).shells().plot()
        """
        for name, mean, error, look in (
            ("transverse", self.transverse, self.transverse_error, {"color": BLUE}),
            ("longitudinal", self.longitudinal, self.longitudinal_error, {"color": RED, "marker": "s"}),
        ):
            counted = (self.wavevectors, self.packings, self.unit, self.value_unit, _Powers._label)
            ShellMeans(self.k, mean, error, *counted).plot(axes, **{"label": name, **look, **style})


@dataclass(frozen=True)
class DisplacementSpectrum(Result):
    """Powers of non-affine displacements at the wavevectors of packings, see `jamlab.displacement_spectrum`.

    Attributes:
        wavevectors: (m, 2) reciprocal lattice vectors up to `k_max`, without 0: of each pair k, -k that with k_x > 0,
            or k_x = 0 and k_y > 0; by packing, k_x, then k_y.
        state: (m,) int64, packing of each wavevector, from 0.
        transverse: (m,) power of displacements perpendicular to k, an area.
        longitudinal: (m,) power of displacements along k, an area.
        packings: number of packings.
        width: 2 pi over the root of the area of the box, the mean over packings: default width of shells.
        unit: unit of wavevectors, for labels.
        value_unit: unit of powers, for labels.

    Example:
        >>> s = jamlab.displacement_spectrum(jamlab.pack(n=32, pressure=1e-2, seed=1), k_max=6.0)
        >>> s.wavevectors.shape == (len(s.transverse), 2), bool(s.k.max() <= 6.0)
        (True, True)
    """

    _rows = ("state", "wavevectors", "k", "transverse", "longitudinal")

    wavevectors: Array
    state: Indices
    transverse: Array
    longitudinal: Array
    packings: int
    width: float
    unit: str = field(default="", repr=False)
    value_unit: str = field(default="", repr=False)

    @checked
    def shells(self, bins: int | ArrayLike | None = None) -> DisplacementShells:
        """Average both powers over shells of wavevectors of about one length.

        Args:
            bins: number of equal shells up to the longest wavevector, or ascending edges. Default: the middles of
                shells are multiples of `width`.

        Returns:
            `DisplacementShells`, of the shells that have wavevectors.

        Raises:
            InputError: edges that do not ascend or have no wavevector between them, or too many shells.

        Example:
            >>> s = jamlab.displacement_spectrum(jamlab.pack(n=32, pressure=1e-2, seed=1), k_max=6.0)
            >>> len(s.shells(3).k)
            3
        """
        where = (self.state, self.packings, self.width, self.unit, self.value_unit)
        across, along = (
            _Powers(self.wavevectors, each, *where).shells(bins) for each in (self.transverse, self.longitudinal)
        )
        return DisplacementShells(
            k=across.k,
            transverse=across.mean,
            transverse_error=across.error,
            longitudinal=along.mean,
            longitudinal_error=along.error,
            wavevectors=across.wavevectors,
            packings=self.packings,
            unit=self.unit,
            value_unit=self.value_unit,
        )

    @property
    def k(self) -> Array:
        """(m,) lengths of the wavevectors."""
        return np.asarray(np.hypot(*self.wavevectors.T))

    @drawn("Line2D, of both curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the means over shells, see `DisplacementShells.plot`."""
        self.shells().plot(axes, **style)


@checked
def displacement_spectrum(
    packings: Packing | Sequence[Packing] | Campaign,
    k_max: float,
    omega: float | None = None,
    damping: DragLaw | None = None,
    *,
    prestress: bool = True,
    select: Select | None = None,
) -> DisplacementSpectrum:
    """Compute the transverse and longitudinal power of non-affine displacements, |sum of u exp(-i k.r)|^2/N.

    Also called: displacement_structure_factor, nonaffine_spectrum.

    u is the displacement per strain gamma of x -> x + gamma y, less the affine one and less the mean over particles. r
    and u are of the centres of disks (SP) or the area centroids of droplets (DP, to first order in the displacements of
    the vertices). The N particles form the backbone: rattlers are left out.

    By default shear is infinitely slow, and no drag law matters. At a frequency u is complex; the power is the sum
    over the part in phase with the strain and the part a quarter period behind, twice the mean over a cycle.
    Along floppy modes u is 0 in slow shear and balances drag at a frequency.

    Args:
        packings: one, SP or DP at an energy minimum; or several of one kind: their values follow each other, and
            `DisplacementSpectrum.shells` averages over them. Or a campaign, whose converged states are taken.
        k_max: longest wavevector, 1/length.
        omega: angular frequency, 1/tau_1. Default: infinitely slow shear.
        damping: drag law at that frequency, default `ContactDamping()`; refused without `omega`.
        prestress: False sets the contact forces in the Hessian to zero. SP only.
        select: of a campaign: columns of its table "states" and their values in the states that are wanted.

    Returns:
        `DisplacementSpectrum`: `wavevectors` (m, 2), `transverse` and `longitudinal` (m,).

    Raises:
        InputError: walls, fixed particles, droplets with prestress=False, packings of several kinds or one that is
            given twice, `k_max` below the shortest wavevector of a box, or `damping` without `omega`.
        ConvergenceError: a packing is not jammed, not at a minimum or not stable.

    Example:
        >>> p = jamlab.pack(n=64, pressure=1e-3, seed=1, ensemble="shear-stabilized")
        >>> s = jamlab.displacement_spectrum(p, k_max=1.0)
        >>> bool(s.transverse.mean() > 3 * s.longitudinal.mean())  # near onset the solid is nearly incompressible
        True
    """
    if omega is None and damping is not None:
        raise InputError(f"damping = {damping}: infinitely slow shear knows no drag; give omega too, or no damping")
    each = without_walls(packings, select, "the spectrum of displacements")
    for number, packing in enumerate(each):
        if not packing.frame.all_free:
            raise InputError(
                f"packings[{number}] has fixed particles: the spectrum of displacements is of a periodic box, uniform "
                "in space; free them, packing.with_state(fixed=None), and relax the packing"
            )
    waves = [waves_of(packing, k_max) for packing in each]
    powers = [_powers(packing, own, omega, damping, prestress) for packing, own in zip(each, waves, strict=True)]
    return DisplacementSpectrum(
        transverse=np.concatenate([power.transverse for power in powers]),
        longitudinal=np.concatenate([power.longitudinal for power in powers]),
        value_unit=f"{each[0].unit_names.length}²",
        **places(each, waves),
    )


class Power(NamedTuple):
    """Power of a vector field at wavevectors."""

    transverse: Array  # (m,)
    longitudinal: Array  # (m,)


def _powers(packing: Packing, waves: Waves, omega: float | None, damping: DragLaw | None, prestress: bool) -> Power:
    """Powers of one packing."""
    if omega is None:
        backbone, u = slow_displacements(packing, prestress)
    else:
        backbone, u, _ = next(displacements_per_strain(packing, [omega], damping, prestress))
    return power_of(waves, backbone.centroids, backbone.kind.centroid_displacements(backbone, u))


def slow_displacements(packing: Packing, prestress: bool) -> tuple[Packing, NDArray[Any]]:
    """Return the backbone and the non-affine displacements (n_sites, 2) per strain of infinitely slow shear."""
    network = force_network(packing)
    return network.packing, linear_response(packing, prestress=prestress).displacements[network.held, :, 0, 1]


def power_of(waves: Waves, points: Array, u: NDArray[Any]) -> Power:
    """Power of displacements u (n, 2), real or complex, less their mean, at points (n, 2)."""
    u = u - u.mean(axis=0)
    x, y = waves.k.T / np.hypot(*waves.k.T)
    transverse, longitudinal = np.zeros(len(x)), np.zeros(len(x))
    for part in (u.real, u.imag) if np.iscomplexobj(u) else (u,):
        along_x, along_y = (waves.sum_over(points, each) for each in part.T)
        transverse += np.abs(x * along_y - y * along_x) ** 2 / len(u)
        longitudinal += np.abs(x * along_x + y * along_y) ** 2 / len(u)
    return Power(transverse, longitudinal)
