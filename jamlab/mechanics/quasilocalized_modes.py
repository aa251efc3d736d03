"""Quasi-localised modes by the harmonic approximation alone: pseudo-harmonic modes.

D. Richard, G. Kapteijns, J. A. Giannini, M. L. Manning and E. Lerner, Phys. Rev. Lett. 126, 015501 (2021): minima over
displacements z of the cost

    C(z) = (z H z)^2 / sum_<ij> (z_ij . z_ij)^2,    z_ij = z_j - z_i of pairs ij that interact,

low where a soft motion lies in few pairs. Waves spread over the packing, so that the sum in the denominator is small
and the cost large: hybridisation with waves, which harmonic modes suffer from, drops out.

At a minimum H z = lambda L(z) z with L the sum over pairs weighted by z_ij^2. The sum of fourth powers is a convex
function, so z <- H^-1 L(z) z at constant energy lowers the cost in every step (M. Journee, Y. Nesterov, P. Richtarik
and R. Sepulchre, J. Mach. Learn. Res. 11, 517 (2010)). For a droplet, z_i is the mean displacement of its vertices, an
extension of this package.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse

from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import checked, finite_array
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.factors import SOFT, PositiveSolver, instability
from jamlab.mechanics.force_network import ForceNetwork, force_network
from jamlab.mechanics.masses import Masses, particle_masses, site_masses
from jamlab.mechanics.stiffness import hessian, solved_coordinates
from jamlab.mechanics.vibrations import lowest_modes, participation_ratio
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE


@dataclass(frozen=True)
class CostMinimisation:
    """How minima of the cost are found."""

    tolerance: float = 1e-9  # residual at which the iteration ends
    most_steps: int = 20_000
    same: float = 1e-6  # 1 less the overlap of two modes that are one


MINIMISATION = CostMinimisation()


@dataclass(frozen=True)
class QuasilocalizedModes(Result):
    """Quasi-localised modes of a packing, each a minimum of the cost.

    Attributes:
        eigenvalues: (m,) ascending, omega^2 = z H z/z M z; M = 1 without masses.
        cost: (m,) C, unit of the square of the eigenvalues without masses.
        vectors: (m, n_sites, 2) displacements z of disks or vertices, of which the sum of M z^2 is 1; 0 of rattlers.
        particle: (n_sites,) particle of each of them.
        starts: (m,) how many starts ended in this minimum.
        residual: (m,) norm of H z - lambda L z over that of H z, in the norm of the energy.
        unit: unit of the Hessian, for labels.
        masses: (n_sites,) masses of disks or vertices.

    Example:
        >>> found = jamlab.quasilocalized_modes(jamlab.pack(n=64, pressure=1e-2, seed=1), 5)
        >>> bool((found.residual < 1e-8).all()), int(found.starts.sum())
        (True, 5)
    """

    _rows = ("eigenvalues", "frequencies", "participation", "cost", "starts", "residual")
    _apart = ("vectors", "particle", "masses")

    eigenvalues: Array
    cost: Array
    vectors: Array
    particle: Indices
    starts: Indices
    residual: Array
    unit: str = field(repr=False)
    masses: Array = field(repr=False)

    @property
    def frequencies(self) -> Array:
        """(m,) frequencies omega."""
        return np.sqrt(self.eigenvalues)

    @property
    def participation(self) -> Array:
        """(m,) participation ratio, see `Modes.participation`."""
        return participation_ratio((self.vectors**2).sum(axis=2) * self.masses, self.particle)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the participation ratio over the frequency.

        >>> ax = jamlab.quasilocalized_modes(jamlab.pack(n=64, pressure=1e-2, seed=1), 5).plot()
        """
        label = f"{len(self.cost)} quasi-localised modes"
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "linestyle": "none", "label": label}
        axes.plot(self.frequencies, self.participation, **merged_line(plain, style))
        unit = self.unit and f"$\\sqrt{{{self.unit}/m}}$"
        label_axes(axes, in_unit(r"frequency $\omega$", unit), "participation ratio")
        axes.set_ylim(bottom=0.0)
        axes.legend(fontsize=LEGEND)


@checked
def quasilocalized_modes(
    packing: Packing,
    count: int = 10,
    *,
    starts: ArrayLike | None = None,
    prestress: bool = True,
    masses: Masses | None = None,
) -> QuasilocalizedModes:
    """Find quasi-localised modes, pseudo-harmonic modes of Richard et al. (2021), from the lowest harmonic modes.

    Minimises C(z) = (z H z)^2 / sum_<ij> (z_ij . z_ij)^2 over pairs ij in contact, z_ij = z_j - z_i, to a residual of
    1e-9. Of a droplet z_i is the mean over its vertices, while H acts on all of them. Rattlers are left out.

    Also called: soft_spots, quasilocalized, quasilocalised, quasilocalised_modes, qlm, qlms, phm,
    pseudo_harmonic_modes, nonphononic_modes, cubic_modes, glassy_modes.

    Args:
        packing: SP or DP at an energy minimum, without flat walls.
        count: number of harmonic modes with a frequency above zero, the lowest, from which minimisation starts. Several
            may end in one minimum.
        starts: (k, n_sites, 2) displacements to start from instead, such as the response to a force dipole.
        prestress: False replaces contacts by unstressed springs; SP only.
        masses: as in `lowest_modes`, of omega^2 = z H z/z M z; the minima do not depend on them.

    Raises:
        InputError: starts of another shape or without energy, flat walls, count beyond the modes that there are, too
            many coordinates, see `lowest_modes`.
        ConvergenceError: the packing is unjammed, not at a minimum, unstable or has floppy modes; or an iteration does
            not end.

    Example:
        >>> p = jamlab.pack(n=64, pressure=1e-2, seed=1)
        >>> soft = jamlab.quasilocalized_modes(p, 5)
        >>> harmonic = jamlab.lowest_modes(p, None)
        >>> bool(soft.frequencies[0] >= harmonic.frequencies[~harmonic.zero][0])
        True
    """
    if packing.frame.is_flat:
        raise InputError(
            "quasilocalized_modes between flat walls: particles slide along them at no cost; use rough walls, "
            "jamlab.with_walls(packing), or remove the walls with packing.with_state(walls=False, fixed=None)"
        )
    network = force_network(packing)
    network.check_at_rest()
    weight = np.ones(len(packing.positions))
    if masses is not None:
        weight = site_masses(packing, particle_masses(packing, masses))
    given = _harmonic(packing, count, prestress) if starts is None else _given(packing, starts)
    minima = _Cost(network, prestress).minimise(given[:, network.held].reshape(len(given), -1).T)
    z = np.zeros((len(given), len(packing.positions), 2))
    z[:, network.held] = minima.vectors.T.reshape(len(given), -1, 2)
    if packing.frame.all_free:  # relative to the centre of mass of what moves
        moving = np.where(network.held, weight, 0.0)
        z[:, network.held] -= np.einsum("s,msi->mi", moving / moving.sum(), z)[:, None]
    inertia = np.einsum("s,msi->m", weight, z**2)
    first, ended = _distinct(z.reshape(len(z), -1), minima.costs)
    order = first[np.argsort(1 / inertia[first], kind="stable")]
    return QuasilocalizedModes(
        eigenvalues=1 / inertia[order],
        cost=minima.costs[order],
        vectors=z[order] / np.sqrt(inertia[order])[:, None, None],
        particle=packing.particle,
        starts=np.array([int(np.sum(ended == k)) for k in order]),
        residual=minima.residuals[order],
        unit=packing.unit_names.stress,
        masses=weight,
    )


def _given(packing: Packing, starts: ArrayLike) -> Array:
    given = finite_array("starts", starts, (None, len(packing.positions), 2))
    if not len(given):
        raise InputError("starts: give one displacement or more, or leave it out")
    largest = np.abs(given).max(axis=(1, 2), keepdims=True)
    return given / np.where(largest > 0, largest, 1.0)  # the cost does not depend on the size


def _harmonic(packing: Packing, count: int, prestress: bool) -> Array:
    """The lowest `count` modes with a frequency above zero."""
    asked = count
    while True:
        modes = lowest_modes(packing, min(asked + count, 2 * int(packing.frame.free_sites.sum())), prestress=prestress)
        costing = modes.vectors[~modes.zero]
        if len(costing) >= count:
            return np.asarray(costing[:count])
        if len(modes.eigenvalues) == modes.degrees_of_freedom:
            raise InputError(f"count = {count}: the packing has {len(costing)} modes with a frequency above zero")
        asked = 2 * asked + int(modes.zero.sum())


def _distinct(vectors: Array, costs: Array) -> tuple[Indices, Indices]:
    """Numbers of modes (m, n) of which no other is the same, and (m,) the number of the one that each is."""
    size = np.linalg.norm(vectors, axis=1)
    overlap = np.abs(vectors @ vectors.T) / np.outer(size, size)
    ended = (overlap > 1 - MINIMISATION.same).argmax(axis=1)
    return np.unique(ended), ended


@dataclass(frozen=True)
class _Minima:
    vectors: Array  # (n, m) displacements of energy z H z = 1
    costs: Array  # (m,)
    residuals: Array  # (m,)


class _Cost:
    """The cost of displacements of a force network."""

    def __init__(self, network: ForceNetwork, prestress: bool) -> None:
        packing = network.packing
        self._solved, size = solved_coordinates(packing), 2 * len(packing.positions)
        self._size, self._held_first = size, packing.frame.all_free
        matrix = hessian(packing, prestress=prestress)[self._solved][:, self._solved].tocsc()
        self._hessian, self._solver = matrix, PositiveSolver()
        try:
            self._solver.factorise(matrix)
        except ConvergenceError as error:
            raise instability(matrix, SOFT.named) from error
        pairs = packing.kind.pairs(packing)
        kept = pairs.i != pairs.j
        ends, count = np.column_stack([pairs.i[kept], pairs.j[kept]]), int(kept.sum())
        signs, rows = np.tile([-1.0, 1.0], count), np.repeat(np.arange(count), 2)
        apart = sparse.csr_array((signs, (rows, ends.ravel())), shape=(count, packing.n))
        share = 1.0 / np.bincount(packing.particle)[packing.particle]
        sites = np.arange(len(share))
        mean = sparse.csr_array((share, (packing.particle, sites)), shape=(packing.n, len(share)))
        self._relative = sparse.csr_array(sparse.kron(apart @ mean, np.eye(2)))[:, self._solved]

    def _slope(self, z: Array) -> tuple[Array, Array]:
        """(n, m) L(z) z, and (m,) the sum of the fourth powers, z L(z) z."""
        relative = (self._relative @ z).reshape(-1, 2, z.shape[1])
        weighted = (relative**2).sum(axis=1, keepdims=True) * relative
        slope = self._relative.T @ weighted.reshape(-1, z.shape[1])
        return slope, (z * slope).sum(axis=0)

    def minimise(self, displacements: Array) -> _Minima:
        """Iterate from displacements (2 n_sites, m), each to its minimum."""
        z = displacements[self._solved]
        if self._held_first:
            z = z - np.tile(displacements[:2], (len(z) // 2, 1))
        force = self._hessian @ z
        energy, fourth = (z * force).sum(axis=0), self._slope(z)[1]
        if not ((energy > 0) & (fourth > 0)).all():
            bad = int(np.argmin((energy > 0) & (fourth > 0)))
            raise InputError(f"starts[{bad}] moves no two particles that touch apart: give another displacement")
        z, force = z / np.sqrt(energy), force / np.sqrt(energy)
        left, fourths = np.full(z.shape[1], np.inf), np.ones(z.shape[1])
        for _ in range(MINIMISATION.most_steps):
            live = np.flatnonzero(left > MINIMISATION.tolerance)
            if not len(live):
                break
            slope, fourths[live] = self._slope(z[:, live])
            step = self._solver.solve(slope)
            apart, unbalanced = step / fourths[live] - z[:, live], slope / fourths[live] - force[:, live]
            left[live] = np.sqrt(np.maximum((apart * unbalanced).sum(axis=0), 0.0))
            size = np.sqrt((step * slope).sum(axis=0))
            z[:, live], force[:, live] = step / size, slope / size
        else:
            raise ConvergenceError(
                f"quasi-localised modes: a residual of {left.max():.2g} is left after {MINIMISATION.most_steps} steps, "
                f"not {MINIMISATION.tolerance:g}: give other starts"
            )
        everywhere = np.zeros((self._size, z.shape[1]))
        everywhere[self._solved] = z
        return _Minima(everywhere, 1 / self._slope(z)[1], left)
