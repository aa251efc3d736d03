"""Non-linear drag as an equivalent linear damping, Baumgarten & Tighe eqs 23-29.

Drag grows as the power alpha of the relative velocity (eq 9): at a wall 2/3 for mobile surfactants (Bretherton; Le
Merrer et al., Soft Matter 11, 368 (2015); the paper has immobile there, before eq 9), 1/2 for immobile ones. In one
cycle of given amplitude and frequency a linear drag with another time tau_alpha dissipates as much; that time replaces
tau_1 in the linear equation of motion. Not exact: harmonics are left out, and so is that contacts move by different
amounts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from jamlab.arguments.choices import SpectrumMethod
from jamlab.arrays import Array, ArrayLike
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.mechanics.negative_moduli import warn_of_negative
from jamlab.packing.natural_units import stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.rheology.complex_modulus import ComplexModulus, check_frequencies, linear_modulus
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw

_LOG_STRESS = 1e-4  # to which the stress amplitude of a strain is found: the method errs by far more


@dataclass(frozen=True)
class NonlinearModulus(Result):
    """Response to a shear stress of given amplitude.

    Attributes:
        omega: (m,) angular frequencies, 1/tau_1.
        storage, loss: (m,) G', G''; they depend on the stress.
        tau: (m,) equivalent time tau_alpha, in units of tau_1.
        error_bound: (m,) estimated bound of the relative error of the linear solution, not of the approximation.
        unit: unit of stress, for labels.
    """

    _rows = ("omega", "storage", "loss", "tau", "error_bound")

    omega: Array
    storage: Array
    loss: Array
    tau: Array
    error_bound: Array
    unit: str = field(default="", repr=False)

    direction: ClassVar[str] = "simple"
    plot = ComplexModulus.plot


@checked
def effective_relaxation_time(omega: ArrayLike, force: float, alpha: float, *, stiffness: float = 1.0) -> Array:
    """Compute the effective relaxation time tau_alpha of power-law drag at each frequency, (m,) in units of tau_1.

    tau_alpha = tau_1 (tau_1 u_0 omega/rho_0)^(alpha - 1) (2/sqrt(pi)) Gamma(1 + alpha/2)/Gamma(3/2 + alpha/2) with
    u_0 = (F_0/k)/sqrt(1 + (omega tau_alpha)^2) (eqs 24 and 25; eq 25 prints the exponent alpha, which does not
    give tau_1 at alpha = 1). rho_0, the unit of length, is the mean particle size (1 in the paper).

    Args:
        omega: (m,) angular frequencies, 1/tau_1.
        force: typical contact force F_0.
        alpha: exponent of the drag law, from 0 to 2, both excluded.
        stiffness: k.

    Raises:
        InputError: a value that is not positive, alpha outside its range.

    Example:
        >>> jamlab.effective_relaxation_time([1e-2, 1.0], force=1e-5, alpha=1.0)
        array([1., 1.])
    """
    from scipy.optimize import brentq
    from scipy.special import gamma

    w = check_frequencies(omega)
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
    damping: DragLaw | None = None,
    *,
    stress: float | None = None,
    amplitude: float | None = None,
    prestress: bool = True,
    method: SpectrumMethod = "auto",
) -> NonlinearModulus:
    """Compute G*(omega) for power-law contact drag at an amplitude of shear stress or strain (equivalent linear drag).

    All contacts have the same effective relaxation time, at the typical force F_0 = stress times mean size (the paper
    gives F_0 ~ stress without a factor). This rescales the frequency of the linear problem: G*_alpha(omega) =
    G*_1(omega tau_alpha(omega)/tau_1). If `amplitude` is given, stress = |G*| amplitude is solved
    self-consistently.

    Args:
        packing: SP or DP.
        omega: (m,) angular frequencies, 1/tau_1.
        damping: `ContactDamping` (default, beta = 1, linear), whose alpha is the power, or a linear law.
        stress: stress amplitude, unit of stress of the packing. Give it or `amplitude`.
        amplitude: strain amplitude.
        prestress: see `jamlab.dynamical_matrices`.
        method: solver, see `jamlab.complex_modulus`.

    Warns:
        JamlabWarning: the static modulus is negative, see `jamlab.complex_modulus`.

    Raises:
        InputError: a value is out of range, or both or neither of two alternatives are given.
        ConvergenceError: the packing is not jammed or not stable.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> s = jamlab.nonlinear_modulus(p, [1e-2, 1.0], jamlab.ContactDamping(alpha=1.0), stress=1e-5)
        >>> bool(np.allclose(s.storage, jamlab.complex_modulus(p, [1e-2, 1.0]).storage))  # alpha = 1 is linear
        True
    """
    given: Any = {"stress": stress, "amplitude": amplitude, "prestress": prestress, "method": method}
    found, static = equivalent_modulus(packing, omega, damping, **given)
    warn_of_negative(packing, {"G_xy, the static modulus,": static})
    return found


def equivalent_modulus(
    packing: Packing,
    omega: ArrayLike,
    damping: DragLaw | None = None,
    *,
    stress: float | None = None,
    amplitude: float | None = None,
    prestress: bool = True,
    method: SpectrumMethod = "auto",
) -> tuple[NonlinearModulus, float]:
    """`nonlinear_modulus` without its warning, and the static modulus of which it would warn."""
    from scipy.optimize import root_scalar

    if (stress is None) == (amplitude is None):
        raise InputError(f"stress = {stress}, amplitude = {amplitude}: give one of them")
    frequencies, law, stiffness = check_frequencies(omega), damping or ContactDamping(), stiffness_scale(packing)
    power = law.alpha
    if power != 1 and law.name != ContactDamping.name:
        raise InputError(
            f"{law}: the equivalent time of eqs 24 and 25 holds for contact damping alone; use jamlab.oscillate, or "
            "jamlab.complex_modulus of a linear law"
        )

    def time_at(w: ArrayLike, stress: float) -> Array:
        """Equivalent time at frequencies and a stress amplitude, which times the mean size, over the stiffness times
        it, is u_0."""
        return effective_relaxation_time(np.asarray(w) * law.tau, stress, power, stiffness=stiffness)

    def modulus(w: ArrayLike) -> ComplexModulus:
        return linear_modulus(packing, w, law.linear(), prestress=prestress, method=method)

    def stress_at(w: float, strain: float) -> float:
        """Stress amplitude at a strain amplitude: log |G*(stress)| strain = log stress."""

        def excess(log_stress: float, exact: bool = True) -> float:
            found = modulus([w * (time_at(w, np.exp(log_stress))[0] if exact else 1.0)])
            return float(np.log(strain * np.hypot(found.storage[0], found.loss[0])) - log_stress)

        guess = excess(0.0, exact=False)
        if power == 1:
            return float(np.exp(guess))
        return float(np.exp(root_scalar(excess, x0=guess, x1=guess + 0.5, xtol=_LOG_STRESS).root))

    if amplitude is None:
        assert stress is not None
        tau = time_at(frequencies, stress)
    else:
        check_number("amplitude", amplitude, np.inf)
        tau = np.array([time_at(w, stress_at(float(w), amplitude))[0] for w in frequencies])
    linear = modulus(frequencies * tau)
    found = NonlinearModulus(frequencies, linear.storage, linear.loss, tau, linear.error_bound, linear.unit)
    return found, linear.g0
