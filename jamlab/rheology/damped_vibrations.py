"""Damped vibrations of a packing with masses: every solution u exp(s t) of M u'' + B u' + K u = 0 at fixed box.

F. Tisseur and K. Meerbergen, SIAM Rev. 43, 235 (2001), review the quadratic eigenvalue problem (s^2 M + s B + K) u = 0.
Here it is written in the undamped modes of K and M, where motions that neither energy nor drag resists stand apart:
they have s = 0 twice, for position and velocity, and no eigenvector for the second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array, Complex, Indices, Mask
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.mechanics.masses import Masses, comparable_masses, mass_matrix_diagonal, site_masses
from jamlab.mechanics.stiffness import free_coordinates
from jamlab.mechanics.vibrations import participation_ratio
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, label_decades, merged_line
from jamlab.plotting.palette import BLUE
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.equation_of_motion import dynamical_matrices


@dataclass(frozen=True)
class DampedSpectra:
    """How all solutions are found."""

    most: int = 1536  # coordinates: half a minute and 0.3 GB
    zero: float = 1e-9  # of K or of B, over the largest eigenvalue, that is none
    simple: float = 1e-6  # slope of the characteristic polynomial above which one step of Newton refines a root
    oscillating: float = 1e-9  # frequency over |s| above which a pair of solutions oscillates


DAMPED = DampedSpectra()


@dataclass(frozen=True)
class DampedVibrations(Result):
    """Solutions u exp(s t) of the damped equation of motion. Of two conjugate ones, that with a positive frequency
    stands here.

    Attributes:
        eigenvalues: (m,) complex s, 1/tau_1, ordered by frequency, then by attenuation.
        vectors: (m, n_sites, 2) complex displacements of disks or vertices.
        rotations: (m, n) complex rotations of disks; 0 where drag does not turn them. With the vectors, M u^2 adds up
            to 1.
        particle: (n_sites,) particle of each of them.
        free: number of motions that neither energy nor drag resists, such as translations under contact damping. They
            have s = 0 twice and are not among the others.
        masses: (n_sites,) masses of disks or vertices.

    Example:
        >>> p = jamlab.pack(n=16, pressure=1e-2, seed=1)
        >>> found = jamlab.damped_vibrations(p, jamlab.StokesDrag(), masses=1.0)
        >>> bool((found.attenuation >= -1e-9).all()), bool(np.allclose(found.attenuation[found.oscillating], 0.5))
        (True, True)
    """

    _rows = ("frequencies", "attenuation", "damping_ratio", "participation")
    _apart = ("vectors", "rotations", "particle", "masses")

    eigenvalues: Complex
    vectors: Complex
    rotations: Complex
    particle: Indices
    free: int
    masses: Array

    @property
    def frequencies(self) -> Array:
        """(m,) angular frequency Im s of the oscillation, 1/tau_1; 0 of motion that decays without one."""
        return np.asarray(self.eigenvalues.imag)

    @property
    def attenuation(self) -> Array:
        """(m,) rate -Re s at which the amplitude decays, 1/tau_1; negative of an unstable packing."""
        return np.asarray(-self.eigenvalues.real)

    @property
    def damping_ratio(self) -> Array:
        """(m,) attenuation over |s|: 1 of motion without oscillation, 1/(2 Q) of a resonance of quality Q; nan of s =
        0."""
        size = np.abs(self.eigenvalues)
        return np.asarray(np.divide(self.attenuation, size, out=np.full(len(size), np.nan), where=size > 0))

    @property
    def oscillating(self) -> Mask:
        """(m,) whether the frequency is above 0."""
        return np.asarray(self.frequencies > 0)

    @property
    def participation(self) -> Array:
        """(m,) participation ratio, see `Modes.participation`, of m |u|^2."""
        return participation_ratio((np.abs(self.vectors) ** 2).sum(axis=2) * self.masses, self.particle)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the attenuation of oscillating modes over their frequency, on logarithmic axes; the legend counts the
        others.

        >>> ax = jamlab.damped_vibrations(jamlab.pack(n=16, pressure=1e-2, seed=1), masses=1.0).plot()
        """
        shown, count = self.oscillating, len(self.eigenvalues)
        label = f"{shown.sum()} oscillate, {count - shown.sum()} decay, {self.free} free"
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "linestyle": "none", "label": label}
        axes.loglog(self.frequencies[shown], self.attenuation[shown], **merged_line(plain, style))
        label_axes(axes, in_unit(r"frequency Im $s$", r"$1/\tau_1$"), in_unit(r"attenuation $-$Re $s$", r"$1/\tau_1$"))
        label_decades(axes)
        axes.legend(fontsize=LEGEND)


@checked
def damped_vibrations(
    packing: Packing, damping: DragLaw | None = None, *, masses: Masses = 1.0, prestress: bool = True
) -> DampedVibrations:
    """Find all damped vibrations of a packing with masses, at fixed box, rattlers included.

    Solves (s^2 M + s B + K) u = 0 with the matrices of `dynamical_matrices`. Fixed particles do not move.

    Args:
        packing: SP or DP, of at most 1536 coordinates: two for each disk or vertex that may move, and one for each disk
            that drag turns.
        damping: linear drag law, default `ContactDamping()`.
        masses: as in `complex_modulus`.
        prestress: False replaces contacts by unstressed springs; SP only.

    Raises:
        InputError: too many coordinates, a mass that is not positive, masses whose ratio is above 1e4, droplets without
            pre-stress, drag that is not linear.

    Example:
        >>> p = jamlab.pack(n=16, pressure=1e-2, seed=1)
        >>> found = jamlab.damped_vibrations(p, jamlab.ContactDamping(beta=0.0), masses={"density": 1.0})
        >>> found.free >= 2  # translations, and rattlers
        True
    """
    weight = comparable_masses(packing, masses)
    k, b = dynamical_matrices(packing, damping or ContactDamping(), prestress=prestress)
    sites, spins = len(packing.positions), packing.kind.rotations(packing)
    turning = 2 * sites + np.flatnonzero(packing.frame.free[:spins])
    moving = np.concatenate([free_coordinates(packing), turning[b.diagonal()[turning] > 0]])
    if len(moving) > DAMPED.most:
        raise InputError(
            f"{len(moving)} coordinates: the dense solver takes at most {DAMPED.most}; give a smaller packing, or "
            "jamlab.complex_modulus(packing, omega, masses=...) for the response"
        )
    root = np.sqrt(mass_matrix_diagonal(packing, weight)[moving])
    stiffness, drag = (matrix[moving][:, moving].toarray() / np.outer(root, root) for matrix in (k, b))
    values, modes, free = _solve(stiffness, drag)
    everywhere = np.zeros((len(values), 2 * sites + spins), dtype=np.complex128)
    everywhere[:, moving] = modes.T / root
    return DampedVibrations(
        eigenvalues=values,
        vectors=everywhere[:, : 2 * sites].reshape(len(values), sites, 2),
        rotations=everywhere[:, 2 * sites :],
        particle=packing.particle,
        free=free,
        masses=site_masses(packing, weight),
    )


def _solve(stiffness: Array, drag: Array) -> tuple[Complex, Complex, int]:
    """(m,) s with Im s >= 0, (n, m) normalised vectors, and the number of motions that nothing resists. Both matrices
    (n, n) are divided by roots of masses."""
    squares, basis = np.linalg.eigh(stiffness)
    scale = max(float(np.abs(squares).max(initial=0.0)), np.finfo(np.float64).tiny)
    loose = np.abs(squares) <= DAMPED.zero * scale
    losses, turn = np.linalg.eigh(basis[:, loose].T @ drag @ basis[:, loose])
    largest = float(np.linalg.norm(drag, 2)) if len(drag) else 0.0
    resisted = losses > DAMPED.zero * largest
    kept = np.column_stack([basis[:, loose] @ turn[:, resisted], basis[:, ~loose]])
    squares = np.concatenate([np.zeros(int(resisted.sum())), squares[~loose]])
    damped = kept.T @ drag @ kept
    values, vectors = _linearised(squares, 0.5 * (damped + damped.T))
    values = np.where(np.abs(values.imag) > DAMPED.oscillating * np.abs(values), values, values.real)
    upper = np.flatnonzero(values.imag >= 0)
    order = upper[np.lexsort((-values[upper].real, values[upper].imag))]
    return values[order], kept @ vectors[:, order], int(loose.sum() - resisted.sum())


def _linearised(squares: Array, drag: Array) -> tuple[Complex, Complex]:
    """(2 m,) s and (m, 2 m) vectors of s^2 + s B + diag(squares), by the companion matrix of positions and velocities
    over a rate of the middle, and one step of Newton along each vector."""
    size = len(squares)
    if not size:
        return np.zeros(0, dtype=np.complex128), np.zeros((0, 0), dtype=np.complex128)
    rate = float(np.sqrt(np.abs(squares).max())) or float(np.abs(drag).max())
    companion = np.block([[np.zeros((size, size)), rate * np.eye(size)], [np.diag(-squares / rate), -drag]])
    values, found = np.linalg.eig(companion)
    vectors = found[:size] / np.linalg.norm(found[:size], axis=0)
    dragged = drag @ vectors
    square, constant = (vectors**2).sum(axis=0), squares @ vectors**2
    linear, largest = (np.einsum("im,im->m", each, dragged) for each in (vectors, vectors.conj()))
    slope = 2 * values * square + linear  # 0 at critical damping
    simple = np.abs(slope) > DAMPED.simple * (2 * np.abs(values) + np.abs(largest))
    step = (values**2 * square + values * linear + constant) / np.where(simple, slope, np.inf)
    return values - step, vectors.astype(np.complex128)
