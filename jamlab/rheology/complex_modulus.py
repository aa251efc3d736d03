"""The complex shear modulus G*(omega), Baumgarten & Tighe eqs 10-13, by three solvers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arguments.choices import Direction, SpectrumMethod
from jamlab.arrays import Array, ArrayLike, Complex
from jamlab.checks import checked, finite_array
from jamlab.errors import ConvergenceError, InputError, warn
from jamlab.mechanics.force_network import ForceNetwork, force_network
from jamlab.mechanics.masses import Masses, particle_masses
from jamlab.mechanics.negative_moduli import warn_of_negative
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import drawn
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.equation_of_motion import EquationOfMotion, equation_of_motion
from jamlab.rheology.free_droplets import free_droplets, free_droplets_with_inertia
from jamlab.rheology.reduced_model import reduce
from jamlab.rheology.relaxation_spectrum import (
    DENSE,
    RelaxationModes,
    RelaxationSpectrum,
    build_spectrum,
    find_all_modes,
)
from jamlab.rheology.rounding_error import (
    OF_ROUNDING,
    dissipated_loss,
    relative_parts,
    rounding_error,
    solve_frequency,
    variational_modulus,
)
from jamlab.rheology.slow_and_fast_limits import Limits, find_limits

# version, see jamlab.campaign.tasks; 1 took Stokes drag from the mean size of the backbone, without free droplets; 2
# left open how floppy modes move
SPECTRUM_DEFINITION = 3


@dataclass(frozen=True)
class Solving:
    """Which solver gives G*, and where another one checks it."""

    small: int = 256  # displacements up to which the dense solver is the quickest (python -m studies run spectrum)
    # frequencies at which rounding is bounded: the bound varies by less than ten from one to the next
    checks_per_decade: float = 1.0
    between_checks: float = 4.0  # by which a difference to the direct solver may grow from one check to the next
    # Drag of sliding over that of approach: outside, the fast limit leaves errors of its own, which bounds of
    # rounding do not see, and the direct solver is asked as well. 0 leaves sliding out.
    even_contrast: tuple[float, float] = (1e-4, 100.0)
    # 1/tau_1; slower or faster, squares of frequencies over rates overflow; both limits of G* are reached long before
    slowest: float = 1e-100
    fastest: float = 1e100
    # relative rounding of the last sums, over Maxwell elements or columns
    sums: float = 32 * float(np.finfo(np.float64).eps)
    same: float = 1e-12  # relative: frequencies are one


SOLVING = Solving()

LOST = 0.1  # error of |G*| that is warned of
_NOTHING = "G* is 0 but for rounding: neither energy nor drag resists the shear of clusters that do not span the box"


@dataclass(frozen=True)
class ComplexModulus(Result):
    """Shear response over frequency, in the packing's unit of stress and with times in tau_1.

    Attributes:
        omega: (m,) angular frequencies, 1/tau_1.
        storage: (m,) G' in the direction of shear.
        loss: (m,) G''.
        g0: static modulus at fixed box shape, G'(omega -> 0) = `shear_modulus(p, direction=...)` of the same direction;
            negative if the packing is unstable to shear at its box shape.
        eta0: lim G''/omega at low frequency. Floppy modes of a network follow the motion of least dissipation.
        eta_inf: lim G''/omega at high frequency; with masses the viscosity of the affine motion.
        method: solver used.
        error_bound: (m,) bound, by an estimate, of the larger of the relative errors of G' and of G''.
        unit: unit of stress, for labels.
        eta_inf_bound: bound of what rounding changes eta_inf by, in its unit; up to a few percent for droplets.
        direction: of shear, see `complex_modulus`.
    """

    _rows = ("omega", "storage", "loss", "error_bound")

    omega: Array
    storage: Array
    loss: Array
    g0: float
    eta0: float
    eta_inf: float
    method: str
    error_bound: Array
    _spectrum: RelaxationSpectrum | None = field(default=None, repr=False)
    unit: str = field(default="", repr=False)
    eta_inf_bound: float = float("nan")
    direction: Direction = "simple"

    @property
    def spectrum(self) -> RelaxationSpectrum:
        """Maxwell elements whose sum is G*: all of them (method "dense"), or as few as have the same G* at the
        frequencies asked for ("reduced").

        Raises:
            InputError: method "direct" finds none.
        """
        if self._spectrum is None:
            raise InputError(
                f"method {self.method!r} finds no relaxation spectrum: use 'dense' or 'reduced', which take no masses"
            )
        return self._spectrum

    @property
    def tau_star(self) -> float:
        """Time of the slowest relaxation that carries stress, tau* = eta_0/G_0 (Baumgarten & Tighe, below eq 22); nan
        where G_0 is not positive, so that no stress is left to relax to."""
        return self.eta0 / self.g0 if self.g0 > 0 else float("nan")

    @drawn("Line2D, of both curves; `label` names them in the legend")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw G' (solid, filled) and G'' (dashed, open) over frequency, on logarithmic axes.

        The legend counts values that are not positive, which a logarithm cannot show.
        """
        from jamlab.plotting.curves import draw_modulus, label_modulus

        index = index_of(self.direction)
        draw_modulus(axes, self.omega, self.storage, self.loss, index=index, **style)
        label_modulus(axes, self.unit, legend=True, index=index)


def index_of(direction: Direction) -> str:
    """The index of a modulus along a direction, in mathematics of matplotlib."""
    name = direction if isinstance(direction, str) else f"{np.degrees(direction):.4g}^\\circ"
    return "xy" if name == "simple" else rf"\mathrm{{{name}}}"


@checked
def complex_modulus(
    packing: Packing,
    omega: ArrayLike,
    damping: DragLaw | None = None,
    *,
    direction: Direction = "simple",
    prestress: bool = True,
    method: SpectrumMethod = "auto",
    masses: Masses | None = None,
) -> ComplexModulus:
    """Compute the complex shear modulus G*(omega) in linear response, without rattlers.

    Solves (K + i omega B) Q = A sigma e_gamma, Baumgarten & Tighe eq 11. Under `StokesDrag` rattling droplets are
    included, because the fluid deforms them. With masses, (K + i omega B - omega^2 M) Q: see `dynamical_matrices`. G*
    is then that of a homogeneous shear, waves of the cell left out, and G' may be negative above a resonance.

    Args:
        packing: SP or DP at an energy minimum.
        omega: (m,) angular frequencies, from 1e-100 to 1e100, in units 1/tau_1.
        damping: linear drag law, default `ContactDamping()`; see `ContactDamping`, `StokesDrag`.
        direction: "simple": simple shear along x; "pure": extension along x, compression along y; or an angle in
            radians: simple shear along (cos, sin).
        prestress: False replaces contacts by unstressed springs; SP only.
        method: "reduced": rational Krylov model, five to nine real factorisations for all frequencies. "direct": one
            complex factorisation per frequency, as in the paper. "dense": full relaxation spectrum, up to 1024 sites.
            "auto": "dense" for small packings and for networks with floppy modes, else "reduced"; with masses "direct".
        masses: mass of each particle, (n,), or one number for all, or {"density": mass per area}, in the unit of
            stiffness of the packing times tau_1^2; vertices share the mass of their droplet; disks have the moment
            of inertia m R^2/2. Default: motion is overdamped.

    Warns:
        JamlabWarning: g0, the static modulus in this direction, is negative: the packing is unstable to shear at its
            box shape; rounding may change |G*| by more than 10 %; or G* is 0, since nothing resists the shear.

    Raises:
        InputError: a frequency out of range, an unknown method, a packing too large for "dense", droplets
            without pre-stress; masses that are not positive, with another method than "direct", or between walls.
        ConvergenceError: the packing is unjammed, not at a minimum or unstable; or "direct" loses all digits of G*.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> s = jamlab.complex_modulus(p, [1e-6, 1.0], damping=jamlab.ContactDamping(beta=1.0))
        >>> g = jamlab.shear_modulus(p, direction="simple")
        >>> bool(np.isclose(s.storage[0], g)), bool(np.isclose(s.loss[0], 1e-6 * s.eta0))
        (True, True)
    """
    how: Any = {"direction": direction, "prestress": prestress, "method": method, "masses": masses}
    found = linear_modulus(packing, omega, damping, **how)
    warn_of_negative(packing, {"g0": found.g0})
    return found


def linear_modulus(
    packing: Packing,
    omega: ArrayLike,
    damping: DragLaw | None = None,
    *,
    direction: Direction = "simple",
    prestress: bool = True,
    method: SpectrumMethod = "auto",
    masses: Masses | None = None,
) -> ComplexModulus:
    """`complex_modulus` without its warning, for those who look at g0 themselves."""
    frequencies = check_frequencies(omega)
    law = damping or ContactDamping()
    inertia = None if masses is None else _checked_masses(packing, masses, method)
    network = force_network(packing)
    network.check_at_rest()
    motion = equation_of_motion(network, law, prestress=prestress, direction=direction)
    free = free_droplets(network, law, direction)
    limits = find_limits(motion, inertia=inertia is not None)
    if method == "auto":
        method = "dense" if motion.moving <= (DENSE.size if limits.floppy.size else SOLVING.small) else "reduced"
    method = method if inertia is None else "direct"
    solve = {"dense": _solve_dense, "direct": _solve_direct, "reduced": _solve_reduced}[method]
    if limits.nothing_resists and method == "direct":
        raise ConvergenceError(f"{_NOTHING}; use StokesDrag, or a denser packing")
    if inertia is None:
        modulus, error, elements = solve(motion, limits, frequencies)
        modulus = modulus + free.modulus(frequencies)
    else:  # inertia, of omega^2, is less than drag at low frequency and more at high: g0 and eta0 stay
        heavy = _motion_with_masses(network, law, inertia, prestress=prestress, direction=direction)
        modulus, error, elements = _solve_direct(heavy, limits, frequencies)
        modulus = modulus + free_droplets_with_inertia(network, law, direction, inertia, frequencies)
    error = error + SOLVING.sums * (1 + 1j)
    if limits.nothing_resists:
        warn(_NOTHING)
    else:
        _warn_of_lost_digits(frequencies, modulus, error)
    unit = packing.unit_names.stress
    return ComplexModulus(
        omega=frequencies,
        storage=modulus.real.copy(),
        loss=modulus.imag.copy(),
        g0=limits.g0,
        eta0=limits.eta0 + free.eta0,
        eta_inf=limits.eta_inf,
        method=method,
        error_bound=np.maximum(error.real, error.imag),
        _spectrum=elements and elements.beside(free, unit),
        unit=unit,
        eta_inf_bound=limits.eta_inf_bound,
        direction=direction,
    )


def _checked_masses(packing: Packing, masses: Masses, method: SpectrumMethod) -> Array:
    """(n,) masses, refused where G* with inertia is not defined or not solved for."""
    if method not in ("auto", "direct"):
        raise InputError(f"method = {method!r} with masses: Maxwell elements have no inertia; use method='direct'")
    if packing.frame.has_walls:
        raise InputError(
            "masses between walls: oscillating walls send waves into the slab, so that G* depends on its height; leave "
            "out masses, or remove the walls with packing.with_state(walls=False, fixed=None)"
        )
    return particle_masses(packing, masses)


def _motion_with_masses(network: ForceNetwork, law: DragLaw, masses: Array, **how: Any) -> EquationOfMotion:
    """The equation of motion with masses (n,) of all particles, rattlers among them."""
    bearing = np.unique(network.whole.particle[network.held])
    return equation_of_motion(network, law, masses=masses[bearing], **how)


def _warn_of_lost_digits(omega: Array, modulus: Complex, relative: Complex) -> None:
    """Warn where rounding may change the modulus |G*| by more than a tenth."""
    error = np.hypot(relative.real * modulus.real, relative.imag * modulus.imag) / np.maximum(
        np.abs(modulus), OF_ROUNDING.nothing
    )
    worst = int(np.argmax(error))
    if error[worst] > LOST and abs(modulus[worst]) > OF_ROUNDING.nothing:
        warn(
            f"G* at omega = {omega[worst]:g} may be wrong by {100 * error[worst]:.2g} % through rounding, see "
            "error_bound: use method='direct', a beta nearer to 1, or a lower frequency"
        )


def check_frequencies(omega: ArrayLike) -> Array:
    """(m,) angular frequencies, refused where G* is at its limit for float64."""
    frequencies = finite_array("omega", np.atleast_1d(omega), (None,))
    bad = frequencies[(frequencies < SOLVING.slowest) | (frequencies > SOLVING.fastest)]
    if len(bad) or not len(frequencies):
        raise InputError(
            f"omega = {bad[0] if len(bad) else frequencies}: give frequencies from {SOLVING.slowest:g} to "
            f"{SOLVING.fastest:g}"
            + ("; outside, G* equals g0 + i omega eta0 or i omega eta_inf" if len(bad) and bad[0] > 0 else "")
        )
    return frequencies


_Solution = tuple[Complex, Complex, RelaxationSpectrum | None]  # G*, relative errors of G' and of G'', elements


def _solve_direct(motion: EquationOfMotion, limits: Limits, omega: Array) -> _Solution:
    modulus, error = _solve_each(motion, limits, omega)
    lost = omega[~(np.abs(error) < np.abs(modulus))]
    if len(lost):
        raise ConvergenceError(
            f"omega = {lost[0]:g}: method='direct' loses all digits of G* to rounding; use method='dense' or "
            "'reduced', or a frequency nearer to the relaxation rates"
        )
    return modulus, relative_parts(error, modulus), None


def _solve_each(motion: EquationOfMotion, limits: Limits, omega: Array) -> tuple[Complex, Complex]:
    """(f,) G* by one factorisation for each frequency, and bounds of the errors of G' and, imaginary, of G''."""
    modulus, error = np.empty((2, len(omega)), dtype=np.complex128)
    for index, w in enumerate(omega):
        q, modulus[index], left = solve_frequency(motion, limits.floppy, w)
        if motion.mass is not None:  # a resonance may leave little of a sum of large parts
            modulus[index] = modulus[index].real + 1j * dissipated_loss(motion, q[:, None], omega[[index]])[0]
        rounding = rounding_error(motion, q[:, None], omega[[index]])[0]
        error[index] = rounding + abs(left.real) + 1j * abs(left.imag)
    return modulus, error


def _solve_dense(motion: EquationOfMotion, limits: Limits, omega: Array) -> _Solution:
    found, basis = find_all_modes(motion, limits)
    elements = build_spectrum(found, limits, motion.area)
    return elements.modulus(omega), _estimate_rounding(motion, limits, found, basis, elements, omega), elements


def _solve_reduced(motion: EquationOfMotion, limits: Limits, omega: Array) -> _Solution:
    model = reduce(motion, limits, omega)
    rounding = _estimate_rounding(motion, limits, model.modes, model.basis, model.spectrum, omega)
    return model.spectrum.modulus(omega), model.missing * (1 + 1j) + rounding, model.spectrum


def _estimate_rounding(
    motion: EquationOfMotion,
    limits: Limits,
    found: RelaxationModes,
    basis: Array,
    elements: RelaxationSpectrum,
    omega: Array,
) -> Complex:
    """(f,) relative rounding errors of G' and of G'' of a spectrum, from some frequencies on which the response is
    written out; between two of them the larger is taken. To the bound for any solver comes what the sum of Maxwell
    elements differs from the work done by that response; and from the direct solver, where drag is so uneven that the
    response itself may be wrong."""
    low, high = omega.min(), omega.max()
    samples = np.geomspace(low, high, 2 + int(SOLVING.checks_per_decade * np.log10(high / low)))
    if len(omega) <= len(samples):
        samples = np.unique(omega)
    q = limits.slow[:, None] + basis @ found.coefficients(samples)
    modulus = elements.modulus(samples)
    gap = modulus - variational_modulus(motion, q, samples)
    bound, least = rounding_error(motion, q, samples) + _by_parts(gap), _by_parts(modulus)
    if motion.contrast and not SOLVING.even_contrast[0] <= motion.contrast <= SOLVING.even_contrast[1]:
        direct, own = _solve_each(motion, limits, samples)
        bound = bound + SOLVING.between_checks * _by_parts(modulus - direct) + own
        least = np.minimum(least.real, np.abs(direct.real)) + 1j * np.minimum(least.imag, np.abs(direct.imag))
    relative = relative_parts(bound, least)
    right = np.minimum(np.searchsorted(samples, omega * (1 - SOLVING.same)), len(samples) - 1)
    left = np.where(samples[right] <= omega * (1 + SOLVING.same), right, np.maximum(right - 1, 0))
    storage, loss = (np.maximum(part[left], part[right]) for part in (relative.real, relative.imag))
    return np.asarray(storage + 1j * loss)


def _by_parts(difference: Complex) -> Complex:
    """(f,) moduli of the real and of the imaginary parts."""
    return np.asarray(np.abs(difference.real) + 1j * np.abs(difference.imag))
