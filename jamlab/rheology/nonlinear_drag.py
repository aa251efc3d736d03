"""Non-linear drag as an equivalent linear damping, Baumgarten & Tighe eqs 23-29.

Drag grows as the power alpha of the relative velocity (eq 9): 1/2 for mobile surfactants, 2/3 for immobile ones
(Bretherton). In one cycle of given amplitude and frequency a linear drag with another time tau_alpha dissipates as
much; that time replaces tau_1 in the linear equation of motion. Not exact: harmonics are left out, and so is that
contacts move by different amounts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, root_scalar
from scipy.special import gamma

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.packing.force_laws import drag_stiffness
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.plotting.drawable import drawn
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping

if TYPE_CHECKING:
    pass


_LOG_STRESS = 1e-4  # to which the stress amplitude of a strain is found: the method errs by far more


@dataclass(frozen=True)
class NonlinearModulus:
    """Response to a shear stress of given amplitude.

    Attributes:
        omega: (m,) angular frequencies, 1/tau_1.
        storage, loss: (m,) G', G''; they depend on the stress.
        tau: (m,) equivalent time tau_alpha, tau_1.
        error: (m,) estimate of the relative error of the linear solution, not of the method.
        unit: of stress, for labels.

    Example:
        >>> s = jamlab.nonlinear_modulus(jamlab.pack(n=32, pressure=1e-2, seed=1), [1e-2, 1.0], alpha=0.5, stress=1e-5)
        >>> bool(s.tau[0] > s.tau[1])  # slow flow feels more drag
        True
    """

    omega: Array
    storage: Array
    loss: Array
    tau: Array
    error: Array
    unit: str = field(default="", repr=False)

    __repr__ = short_repr

    @drawn("Line2D, of both curves; `label` names them in the legend")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw G' (solid, filled) and G'' (dashed, open) over frequency, on logarithmic axes.

        >>> p = jamlab.pack(n=64, pressure=1e-3, seed=1)
        >>> ax = jamlab.nonlinear_modulus(p, np.logspace(-6, 2, 41), 0.5, 1e-5).plot(label="α = 1/2")
        """
        from jamlab.plotting.curves import draw_modulus, label_modulus

        draw_modulus(axes, self.omega, self.storage, self.loss, **style)
        label_modulus(axes, self.unit, legend=True)


@checked
def equivalent_time(omega: ArrayLike, force: float, alpha: float, *, stiffness: float = 1.0) -> Array:
    """Solve for the time tau_alpha, (m,) in units of tau_1, of an oscillator driven by a force at each frequency.

    tau_alpha = tau_1 (tau_1 u_0 omega/rho_0)^(alpha - 1) (2/sqrt(pi)) Gamma(1 + alpha/2)/Gamma(3/2 + alpha/2) with
    u_0 = (F_0/k)/sqrt(1 + (omega tau_alpha)^2) (eqs 24 and 25; the exponent that eq 25 prints, alpha, would not give
    tau_1 at alpha = 1). rho_0 = 1, as in the paper.

    Args:
        omega: (m,) angular frequencies, 1/tau_1.
        force: F_0.
        alpha: exponent of the drag law, from 0 to 2, both excluded.
        stiffness: k.

    Raises:
        InputError: a value that is not positive, alpha outside its range.

    Example:
        >>> jamlab.equivalent_time([1e-2, 1.0], force=1e-5, alpha=1.0)
        array([1., 1.])
    """
    w = np.atleast_1d(np.asarray(omega, dtype=np.float64))
    if not (np.all(np.isfinite(w)) and np.all(w > 0)):
        raise InputError(f"omega = {omega!r}: frequencies must be positive and finite")
    for name, value in (("force", force), ("stiffness", stiffness)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value}: must be positive")
    if not 0 < alpha < 2:
        raise InputError(f"alpha = {alpha}: the exponent of the drag law must lie between 0 and 2")
    prefactor = 2 / np.sqrt(np.pi) * gamma(1 + alpha / 2) / gamma(1.5 + alpha / 2)

    def excess(log_tau: float, log_rate: float) -> float:
        """ln of the left side of the equation over its right side; rises with tau for every alpha in range."""
        log_amplitude = np.log(force / stiffness) - 0.5 * np.logaddexp(0.0, 2 * (log_rate + log_tau))
        return float(log_tau - np.log(prefactor) - (alpha - 1) * (log_amplitude + log_rate))

    def solve(log_rate: float) -> float:
        low, high = -1.0, 1.0
        while excess(low, log_rate) > 0:
            low *= 2
        while excess(high, log_rate) < 0:
            high *= 2
        return float(
            np.exp(brentq(excess, low, high, args=(log_rate,), xtol=1e-13))
        )  # tau to 13 digits, all that logs have

    return np.array([solve(log_rate) for log_rate in np.log(w)])


@checked
def nonlinear_modulus(
    packing: Packing,
    omega: ArrayLike,
    alpha: float,
    stress: float,
    *,
    prestress: bool = True,
    method: str = "auto",
) -> NonlinearModulus:
    """G*(omega) under balanced contact drag with exponent alpha, at a shear stress amplitude.

    All contacts get the same equivalent time, that of the typical force F_0 = stress times the mean diameter; the paper
    says F_0 ~ stress and gives no factor. A time that is the same everywhere only rescales the frequency of the linear
    problem: G*_alpha(omega) = G*_1(omega tau_alpha(omega)/tau_1).

    Args:
        packing: SP in units "k", or DP.
        omega: (m,) angular frequencies, 1/tau_1.
        alpha: exponent of the drag law; 1 is linear.
        stress: amplitude, unit of stress of the packing.
        prestress: see `jamlab.dynamical_matrices`.
        method: solver, see `jamlab.complex_modulus`.

    Raises:
        InputError: a value out of range.
        ConvergenceError: the packing is not jammed or not stable.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> s = jamlab.nonlinear_modulus(p, [1e-2, 1.0], alpha=1.0, stress=1e-5)
        >>> bool(np.allclose(s.storage, jamlab.complex_modulus(p, [1e-2, 1.0]).storage))  # alpha = 1 is linear
        True
    """
    frequencies = np.atleast_1d(np.asarray(omega, dtype=np.float64))
    tau = equivalent_time(frequencies, stress * _length(packing), alpha, stiffness=drag_stiffness(packing))
    linear = complex_modulus(packing, frequencies * tau, ContactDamping(), prestress, method)
    return NonlinearModulus(frequencies, linear.storage, linear.loss, tau, linear.error, linear.unit)


def modulus_at_strain(packing: Packing, omega: float, amplitude: float, damping: ContactDamping) -> complex:
    """G*(omega) under contact drag with exponent alpha, where the amplitude of the strain is given.

    The stress amplitude that equivalent damping asks for is |G*| times that of the strain, which is solved for.

    Args:
        packing: SP or DP.
        omega: angular frequency, 1/tau_1.
        amplitude: of the strain.
        damping: contact drag; of alpha = 1, G* of `complex_modulus`.
    """
    linear = ContactDamping(beta=damping.beta, tau=damping.tau, arms=damping.arms)
    stiffness = drag_stiffness(packing)

    def modulus(log_stress: float) -> complex:
        force = np.exp(log_stress) * _length(packing)
        tau = equivalent_time(omega * damping.tau, force, damping.alpha, stiffness=stiffness)[0]
        found = complex_modulus(packing, [omega * tau], linear)
        return complex(found.storage[0], found.loss[0])

    if damping.alpha == 1.0:
        return modulus(0.0)
    first = complex_modulus(packing, [omega], linear)
    guess = float(np.log(amplitude * np.hypot(first.storage[0], first.loss[0])))
    solved = root_scalar(
        lambda y: float(np.log(amplitude * abs(modulus(y)))) - y, x0=guess, x1=guess + 0.5, xtol=_LOG_STRESS
    )
    return modulus(solved.root)


def _length(packing: Packing) -> float:
    return float(np.mean(packing.diameters)) if packing.diameters is not None else 1.0
