"""Vibrations of a packing: eigenmodes of its Hessian, the lowest or all, and the number of its zero modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from jamlab.arrays import Array, ArrayLike, Indices, Mask
from jamlab.checks import checked
from jamlab.errors import ConvergenceError, InputError
from jamlab.geometry.contact_network import contacts, remove_rattlers
from jamlab.mechanics.density_of_states import HISTOGRAM, DensityOfStates, density_of
from jamlab.mechanics.factors import SOFT, SymmetricFactors
from jamlab.mechanics.like_packings import packings_of_one_kind
from jamlab.mechanics.masses import Masses, comparable_masses, particle_masses, site_masses
from jamlab.mechanics.stiffness import energy_terms, free_coordinates, hessian
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE
from jamlab.statistics.rows_of_one_kind import Campaign, Select


@dataclass(frozen=True)
class Iteration:
    """How the lowest modes are found."""

    # eigenvalue over the largest that counts as zero: above the rounding of the Hessian, 1e-16 and what factors
    # lose, below the softest modes of stable packings, 1e-5 for disks at pressure 1e-6 k
    zero: float = 1e-9
    # how far below zero, over the largest, the iteration begins: far enough for well-conditioned factors, near
    # enough that the lowest eigenvalues stand apart; and the factor on it until no eigenvalue lies below
    shift: float = 1e-6
    growth: float = 4.0
    # coordinates of which all modes are found at once, by LAPACK: 8192 take 1.5 GB and a quarter of an hour
    most: int = 8192
    part: float = 0.25  # of all modes, up to which the lowest are found by iteration


ITERATION = Iteration()


def participation_ratio(energies: Array, particle: Indices) -> Array:
    """(m,) (sum_i e_i)^2/(N sum_i e_i^2) over the N particles, e_i the sum over the sites of a particle of energies
    (m, n_sites); nan where all are 0. `particle`: (n_sites,) of each site."""
    first = np.flatnonzero(np.diff(particle, prepend=-1))  # sites of a particle are neighbours
    each = np.add.reduceat(energies, first, axis=1)
    total = len(first) * (each**2).sum(axis=1)
    return np.asarray(np.divide(each.sum(axis=1) ** 2, total, out=np.full(len(total), np.nan), where=total > 0))


@dataclass(frozen=True)
class Modes(Result):
    """Eigenmodes H u = omega^2 M u of a Hessian, the lowest, or all; M = 1 without masses.

    Attributes:
        eigenvalues: (m,) ascending, omega^2: energy per length squared, over a mass. Negative ones are instabilities.
        vectors: (m, n_sites, 2) displacements u of disks or vertices, of which the sum of M u^2 is 1.
        particle: (n_sites,) particle of each of them.
        degrees_of_freedom: number of all modes: coordinates that may move.
        rounding: up to which an eigenvalue, of either sign, counts as zero: 1e-9 of the largest stiffness.
        unit: unit of the Hessian, for labels.
        masses: (n_sites,) masses of disks or vertices; None: all 1.

    Example:
        >>> modes = jamlab.lowest_modes(jamlab.pack(n=32, pressure=1e-2, seed=1), 6)
        >>> bool((np.abs(modes.eigenvalues[:2]) < 1e-9).all())  # translations
        True
    """

    _rows = ("eigenvalues", "frequencies", "participation")
    _apart = ("vectors", "particle", "masses")

    eigenvalues: Array
    vectors: Array
    particle: Indices
    degrees_of_freedom: int
    rounding: float
    unit: str = field(default="", repr=False)
    masses: Array | None = field(default=None, repr=False)

    @property
    def frequencies(self) -> Array:
        """(m,) frequencies omega of vibrations, the roots of the eigenvalues; negative for an unstable mode,
        -sqrt(-eigenvalue), as in phonon codes."""
        return np.asarray(np.sign(self.eigenvalues) * np.sqrt(np.abs(self.eigenvalues)))

    @property
    def participation(self) -> Array:
        """(m,) participation ratio (sum_i e_i^2)^2/(N sum_i e_i^4) over the N particles, e_i^2 the sum of m u^2 over
        all vertices of a droplet.

        The share of particles that take part in a mode: 1 for a translation of all, 2/3 for a transverse wave, 1/N for
        one particle (Bell & Dean, Discuss. Faraday Soc. 50, 55 (1970); Mizuno, Shiba & Ikeda, PNAS 114, E9767 (2017)).
        Modes of equal eigenvalue, such as zero modes, mix at will: their ratios mean nothing one by one.
        """
        energies = (self.vectors**2).sum(axis=2)
        return participation_ratio(energies if self.masses is None else energies * self.masses, self.particle)

    @property
    def zero(self) -> Mask:
        """(m,) whether a mode costs nothing: its eigenvalue is zero, up to `rounding`.

        In a stable packing of disks these are two translations, and two of every rattler. A droplet that is a rattler
        has one more: it turns.
        """
        return np.asarray(np.abs(self.eigenvalues) <= self.rounding)

    @checked
    def density(self, bins: int | ArrayLike = HISTOGRAM.bins) -> DensityOfStates:
        """Return D(omega), the number of modes per frequency over the degrees of freedom; see
        `jamlab.density_of_states`, which averages over packings.

        Args:
            bins: number of bins of one width, or their edges, ascending.

        Raises:
            InputError: edges that are not ascending, or beyond the highest of modes that are not all.

        Example:
            >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
            >>> d = jamlab.lowest_modes(p, None).density(10)
            >>> all_modes = np.sum(d.density * np.diff(d.edges)) + d.zero_modes
            >>> bool(np.isclose(all_modes, 1.0))
            True
        """
        return density_of([self], bins)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the eigenvalues over the number of the mode; the legend counts those below zero, beyond rounding.

        >>> ax = jamlab.lowest_modes(jamlab.pack(n=64, pressure=1e-3, seed=1), 40).plot()
        """
        below, count = int(np.sum(self.eigenvalues < -self.rounding)), len(self.eigenvalues)
        label = ("all " if count == self.degrees_of_freedom else "") + f"{count} "
        label += ("modes" if count == self.degrees_of_freedom else "lowest modes") + (
            f", {below} below zero" if below else ""
        )
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "linestyle": "none", "label": label}
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        axes.plot(np.arange(1, len(self.eigenvalues) + 1), self.eigenvalues, **merged_line(plain, style))
        axes.locator_params(axis="x", integer=True)
        inertial = self.masses is not None
        name, unit = (r"$\omega^2$", f"{self.unit}/m") if inertial else ("eigenvalue of the Hessian", self.unit)
        label_axes(axes, "number of the mode", in_unit(name, self.unit and unit))
        axes.legend(fontsize=LEGEND)


@checked
def lowest_modes(
    packing: Packing, count: int | None = 10, *, prestress: bool = True, masses: Masses | None = None
) -> Modes:
    """Find the modes with the smallest eigenvalues at fixed box, translations and rattlers included. Fixed particles do
    not move.

    Args:
        packing: SP or DP; Hessian as `jamlab.hessian`.
        count: how many; None: all. More than a quarter of all modes are found by a dense matrix, of at most 8192
            coordinates.
        prestress: False replaces contacts by unstressed springs.
        masses: mass of each particle, (n,), or one number for all, or {"density": mass per area}; vertices share that
            of their droplet. Default: 1 for each disk or vertex.

    Raises:
        InputError: count out of range, too many coordinates for a dense matrix, a mass that is not positive, or
            masses whose ratio is above 1e4.
        ConvergenceError: the eigenvalue iteration did not end, or missed one of several equal eigenvalues.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> modes = jamlab.lowest_modes(p, 6)
        >>> bool((np.diff(modes.eigenvalues) >= 0).all()), modes.vectors.shape
        (True, (6, 32, 2))
        >>> jamlab.lowest_modes(p, None).vectors.shape
        (64, 32, 2)
    """
    moving = free_coordinates(packing)
    size = len(moving)
    count = size if count is None else count
    if isinstance(count, bool) or not 0 < count <= size:
        raise InputError(f"count = {count!r}: must be a whole number from 1 to {size}, or None for all")
    weight = None if masses is None else site_masses(packing, comparable_masses(packing, masses))
    matrix, root = _free_hessian(packing, prestress), np.ones(size)
    if weight is not None:
        root = np.sqrt(np.repeat(weight, 2)[moving])
        over = sparse.diags_array(1 / root, format="csc")
        matrix = (over @ matrix @ over).tocsc()
    if size <= SOFT.dense or count > ITERATION.part * size:
        if size > ITERATION.most:
            raise InputError(
                f"{count} modes of {size} coordinates: the dense matrix takes at most {ITERATION.most}; "
                f"give count = {int(ITERATION.part * size)} or less, or a smaller packing"
            )
        values, vectors = np.linalg.eigh(matrix.toarray())
        values, vectors = values[:count], vectors[:, :count]
    else:
        values, vectors = _find_lowest(matrix, count, packing.frame.all_free, root)
    everywhere = np.zeros((count, 2 * len(packing.positions)))
    everywhere[:, moving] = vectors.T if weight is None else vectors.T / root
    return Modes(
        eigenvalues=values,
        vectors=everywhere.reshape(count, -1, 2),
        particle=packing.particle,
        degrees_of_freedom=size,
        rounding=_rounding(packing, matrix, prestress, weight),
        unit=packing.unit_names.stress,
        masses=weight,
    )


@checked
def density_of_states(
    packings: Packing | Sequence[Packing] | Campaign,
    bins: int | ArrayLike = HISTOGRAM.bins,
    *,
    select: Select | None = None,
    rattlers: bool = True,
    prestress: bool = True,
    masses: Masses | None = None,
) -> DensityOfStates:
    """Return D(omega), the number of modes per frequency over the degrees of freedom, as a mean over packings.

    All modes of every packing are found, see `lowest_modes`. Zero modes and modes with a negative eigenvalue are not in
    the bins: the shares `zero_modes` and `unstable` of the result tell how many there are, and the integral of D over
    all frequencies is 1 less these two.

    Args:
        packings: one or several of one kind: they differ in nothing but their random start. Or a campaign, whose
            converged states are taken.
        bins: number of bins of one width, or their edges, ascending.
        select: of a campaign: columns of its table "states" and their values in the states that are wanted, such as
            {"n": 128, "target_pressure": 1e-3}.
        rattlers: False leaves out particles without load-bearing contacts, and their degrees of freedom. Rattlers of
            disks have zero modes only, but droplets also change their shape.
        prestress: False replaces contacts by unstressed springs; of disks only.
        masses: as in `lowest_modes`; (n,) masses belong to the particles of every packing.

    Raises:
        InputError: packings of several kinds, or one that is given twice, edges that are not ascending, or too many
            coordinates.

    Example:
        >>> packings = [jamlab.pack(n=32, pressure=1e-3, seed=seed) for seed in (1, 2, 3)]
        >>> d = jamlab.density_of_states(packings, bins=20, rattlers=False)
        >>> d.density.shape, d.packings, bool(d.zero_modes > 0)  # translations
        ((20,), 3, True)
    """
    each = packings_of_one_kind(packings, select)
    return density_of([modes_of(packing, None, rattlers, prestress, masses) for packing in each], bins)


def modes_of(packing: Packing, count: int | None, rattlers: bool, prestress: bool, masses: Masses | None) -> Modes:
    """`lowest_modes` of a packing with or without its rattlers; masses always refer to the packing with them."""
    kept = packing if rattlers else remove_rattlers(packing)
    if masses is not None:
        masses = particle_masses(packing, masses)
        masses = masses if rattlers else masses[~contacts(packing).rattlers]
    return lowest_modes(kept, count, prestress=prestress, masses=masses)


def _free_hessian(packing: Packing, prestress: bool) -> sparse.csc_array:
    matrix, moving = hessian(packing, prestress=prestress), free_coordinates(packing)
    return matrix if packing.frame.all_free else matrix[moving][:, moving].tocsc()


@checked
def count_zero_modes(packing: Packing, *, prestress: bool = True) -> int:
    """Count zero modes: in a stable packing of disks 2 per rattler and 2 translations (between flat walls 1, with
    other fixed particles 0).

    Eigenvalues below 1e-9 of the largest stiffness count as zero. By Sylvester's law of inertia, the factors of H - s
    and H + s give the number of eigenvalues below s and below -s.

    Args:
        packing: SP or DP. A rattler with a contact of vanishing overlap feels the stiffness of this contact: it has one
            zero mode less.
        prestress: False replaces contacts by unstressed springs; every zero mode is then a mechanism.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> jamlab.count_zero_modes(p) == 2 + 2 * int(jamlab.contacts(p).rattlers.sum())
        True
    """
    matrix = _free_hessian(packing, prestress)
    shift = _rounding(packing, matrix, prestress)
    if shift == 0:  # nothing touches
        return int(matrix.shape[0])
    return SymmetricFactors(matrix, -shift).negative - SymmetricFactors(matrix, shift).negative


def _rounding(packing: Packing, matrix: sparse.csc_array, prestress: bool, weight: Array | None = None) -> float:
    """Up to which an eigenvalue of the Hessian over masses (n_sites,) counts as zero."""
    terms = energy_terms(packing, prestress=prestress)  # what cancels in their sum, as images of one disk, is rounding
    lightest = [1.0 if weight is None else _lightest(packing, weight)[term.sites].min(axis=1) for term in terms]
    sizes = [np.abs(term.hessian).max(axis=(1, 2, 3, 4), initial=0.0) for term in terms]
    largest = max((float((size / m).max(initial=0.0)) for size, m in zip(sizes, lightest, strict=True)), default=0.0)
    return ITERATION.zero * max(largest, float(sparse.linalg.norm(matrix, np.inf)))


def _lightest(packing: Packing, weight: Array) -> Array:
    """(n_sites,) masses, infinite of fixed particles, which do not move."""
    return np.where(packing.frame.free_sites, weight, np.inf)


def _find_lowest(
    matrix: sparse.csc_array, count: int, drifts: bool = True, root: Array | None = None
) -> tuple[Array, Array]:
    """Take the zero modes known beforehand, then the smallest other eigenvalues by inverse iteration from below.
    Lanczos iteration finds equal eigenvalues once only, and zero is the one that packings have many times. `root`:
    (size,) roots of the masses by which the matrix is divided."""
    null = _span_known_zero_modes(matrix, np.ones(matrix.shape[0]) if root is None else root)
    if not drifts:
        null = null[:, :-2]
    scale = float(sparse.linalg.norm(matrix, np.inf))
    if scale == 0:  # nothing touches
        return np.zeros(count), null[:, :count].toarray()
    shift = ITERATION.shift * scale
    while (factors := SymmetricFactors(matrix, shift)).negative:
        shift *= ITERATION.growth

    def without_null(x: Array) -> Array:
        return np.asarray(x - null @ (null.T @ x))

    inverse = LinearOperator(matrix.shape, matvec=lambda x: without_null(factors.solve(without_null(x))), dtype=float)
    start = without_null(np.random.default_rng(0).standard_normal(matrix.shape[0]))
    try:
        values, vectors = eigsh(matrix, k=count, sigma=-shift, OPinv=inverse, v0=start)
    except ArpackNoConvergence as error:
        raise ConvergenceError(f"the {count} lowest modes were not found: {error}") from error
    values = np.concatenate([np.zeros(null.shape[1]), values])
    order = np.argsort(values, kind="stable")[:count]
    highest = values[order[-1]] - ITERATION.zero * scale
    below = int(np.sum(values[order] < highest))  # found; the factors count all there are
    if SymmetricFactors(matrix, -highest).negative > below:
        raise ConvergenceError(f"some of the {count} lowest modes have equal eigenvalues and were missed: ask for more")
    return values[order], np.hstack([null.toarray(), vectors])[:, order]


def _span_known_zero_modes(matrix: sparse.csc_array, root: Array) -> sparse.csc_array:
    """Span the modes that certainly cost nothing, orthonormal: free coordinates, and two translations of the others."""
    free = np.diff(matrix.indptr) == 0
    free |= np.bincount(matrix.indices, np.abs(matrix.data), matrix.shape[0]) == 0
    alone = np.flatnonzero(free)
    held = np.flatnonzero(~free)
    columns = np.concatenate([np.arange(len(alone)), len(alone) + held % 2])
    mass_per_axis = np.bincount(held % 2, root[held] ** 2, minlength=2)
    values = np.concatenate([np.ones(len(alone)), root[held] / np.sqrt(mass_per_axis[held % 2])])
    shape = (matrix.shape[0], len(alone) + 2)
    return sparse.csc_array((values, (np.concatenate([alone, held]), columns)), shape=shape)
