"""Relaxation spectrum: G*(omega) as a sum of Maxwell elements beside a spring and a dashpot.

The generalised modes K v = lambda B v of the equation of motion (Baumgarten & Tighe eq 12) turn its solution into
G* = G_0 + i omega eta_inf + sum_i g_i i omega/(lambda_i + i omega), g_i >= 0. Every term is positive, so neither G' nor
G'' is ever a small difference of large numbers, however low or high the frequency.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array, Complex
from jamlab.errors import InputError
from jamlab.laws.pair_law import PairLaw
from jamlab.mechanics.factors import SymmetricFactors
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE
from jamlab.rheology.equation_of_motion import EquationOfMotion
from jamlab.rheology.slow_and_fast_limits import Limits


@dataclass(frozen=True)
class DenseSpectra:
    """Spectra that are found from dense matrices."""

    short: float = 100.0  # lengths over rounding below which directions may have none
    size: int = 2048  # displacements, so 1024 sites: 3 s and 0.4 GB; time grows as the cube


DENSE = DenseSpectra()


@dataclass(frozen=True)
class RelaxationSpectrum(Result):
    """Spring, dashpot and Maxwell elements in parallel.

    Attributes:
        g0: static modulus.
        eta_inf: viscosity of infinitely fast flow.
        rates: (m,) lambda_i, ascending, 1/tau_1. Of droplets those beyond 1e8 have three digits and beyond 1e12 none,
            since rounding decides what they dissipate; they carry less than 1e-6 of G*.
        strengths: (m,) g_i > 0, unit of stress.
        unit: unit of stress, for labels.
    """

    _rows = ("rates", "strengths")

    g0: float
    eta_inf: float
    rates: Array
    strengths: Array
    unit: str = field(default="", repr=False)

    @property
    def eta0(self) -> float:
        """lim G''/omega, omega -> 0."""
        return float(self.eta_inf + np.sum(self.strengths / self.rates))

    def modulus(self, omega: Array) -> Complex:
        """(f,) complex G* at frequencies (f,)."""
        y = omega[:, None] / self.rates
        weight = self.strengths / (1.0 + y**2)
        storage = self.g0 + np.sum(weight * y**2, axis=1)
        loss = self.eta_inf * omega + np.sum(weight * y, axis=1)
        return np.asarray(storage + 1j * loss)

    def beside(self, other: RelaxationSpectrum, unit: str) -> RelaxationSpectrum:
        """This spectrum in parallel with another one; `unit`: of stress."""
        rates, strengths = (np.concatenate([getattr(s, n) for s in (self, other)]) for n in ("rates", "strengths"))
        order = np.argsort(rates, kind="stable")
        g0, eta_inf = self.g0 + other.g0, self.eta_inf + other.eta_inf
        return RelaxationSpectrum(g0, eta_inf, rates[order], strengths[order], unit)

    @drawn('Line2D, such as marker="s"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the strength of every Maxwell element over its rate; spring and dashpot stand in the legend."""
        count = len(self.rates)
        label = f"{count} Maxwell elements\n$G_0$ = {self.g0:.3g}, $\\eta_\\infty$ = {self.eta_inf:.3g}"
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "linestyle": "none", "label": label}
        axes.loglog(self.rates, self.strengths, **merged_line(plain, style))
        label_axes(axes, r"relaxation rate $\lambda_i\,\tau_1$", in_unit("strength $g_i$", self.unit))
        axes.legend(fontsize=LEGEND)


@dataclass(frozen=True)
class RelaxationModes:
    """Generalised modes in a space that holds the difference x of fast and slow response."""

    rates: Array  # (j,) lambda
    vectors: Array  # (m, j), coefficients on the basis of that space
    amplitudes: Array  # (j,) of x on the modes
    energies: Array  # (j,) v^T K v

    def coefficients(self, omega: Array) -> Complex:
        """(m, f) coefficients of q - q_slow at unit strain: amplitude times i omega/(lambda + i omega)."""
        share = 1j * omega / (self.rates[:, None] + 1j * omega)
        return np.asarray(self.vectors @ (self.amplitudes[:, None] * share))


def find_modes(k: Array, b: Array, x: Array) -> RelaxationModes:
    """RelaxationModes of a symmetric pencil K v = lambda B v, K positive definite, B semi-definite. The pencil (K, K +
    sigma B) has eigenvalues lambda/(lambda + sigma) between 0 and 1 even where B is singular; with sigma in the middle
    of the rates that carry x, slow and fast ones keep their digits. Rates are quotients v^T K v / v^T B v: 1 -
    lambda/(lambda + sigma) would lose as many digits as lambda exceeds sigma. Modes without dissipation and without
    energy are left out. `x`: (m,) vector whose amplitudes are wanted."""
    energy, dissipation = float(x @ k @ x), float(x @ b @ x)
    if not (energy > 0 and dissipation > 0):  # the packing answers alike at all frequencies
        empty = np.zeros(0)
        return RelaxationModes(empty, np.zeros((len(x), 0)), empty, empty)
    from scipy import linalg

    sigma = energy / dissipation
    metric = k + sigma * b
    basis = _range_of(metric)
    _, vectors = linalg.eigh(k, metric) if basis is None else np.linalg.eigh(basis.T @ k @ basis)
    if basis is not None:
        vectors = basis @ vectors
    amplitudes = vectors.T @ (metric @ x)
    energies, losses = (np.einsum("im,im->m", vectors, matrix @ vectors) for matrix in (k, b))
    rounding = len(x) * np.finfo(np.float64).eps  # of the products above: less dissipation is none
    least = PairLaw.floppy * np.einsum("im,i->m", vectors**2, k.diagonal())
    kept = np.flatnonzero((energies > least) & (sigma * losses > rounding * energies))
    rates = energies[kept] / losses[kept]
    order = np.argsort(rates)
    kept = kept[order]
    return RelaxationModes(rates[order], vectors[:, kept], amplitudes[kept], energies[kept])


def _range_of(metric: Array) -> Array | None:
    """(m, j) basis, orthonormal under a metric (m, m), of the directions that have a length under it; None if all
    have."""
    scale = 1 / np.sqrt(metric.diagonal())
    scaled, least = metric * np.outer(scale, scale), len(metric) * float(np.finfo(np.float64).eps)
    if np.linalg.eigvalsh(scaled)[0] > DENSE.short * least:
        return None
    values, vectors = np.linalg.eigh(scaled)
    kept = values > least
    return np.asarray(scale[:, None] * vectors[:, kept] / np.sqrt(values[kept]))


def build_strengths(found: RelaxationModes, area: float) -> Array:
    """(j,) strengths of the Maxwell elements of modes: g_i = (v^T K v) x_i^2 / A."""
    return np.asarray(found.energies * found.amplitudes**2 / area)


def build_spectrum(found: RelaxationModes, limits: Limits, area: float) -> RelaxationSpectrum:
    """Build the Maxwell elements of a packing from its modes."""
    strengths = build_strengths(found, area)
    kept = strengths > 0
    return RelaxationSpectrum(limits.g0, limits.eta_inf, found.rates[kept], strengths[kept])


def find_all_modes(motion: EquationOfMotion, limits: Limits) -> tuple[RelaxationModes, Array]:
    """Find every generalised mode, dense, rotations eliminated; and the basis (m, j) that their vectors refer to."""
    moving, size = motion.moving, motion.size
    if moving > DENSE.size:
        raise InputError(
            f"method 'dense' with {moving} displacements: it takes at most {DENSE.size}; use method='reduced'"
        )
    basis = np.zeros((size, moving))
    basis[:moving] = np.eye(moving)
    if size > moving:
        coupling = motion.b_qq[moving:, :moving].toarray()
        basis[moving:] = -SymmetricFactors(motion.b_qq[moving:, moving:].tocsc()).solve(coupling)
    k = motion.k_qq[:moving, :moving].toarray()
    b = basis.T @ (motion.b_qq @ basis)
    return find_modes(k, 0.5 * (b + b.T), (limits.fast - limits.slow)[:moving]), basis
