"""The least model that a flow needs: static modulus, linear spectrum, equivalent damping, or a run; and how long.

Errors come from a table of runs, see `flow_errors`, and from the packing itself, where linear response tells.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.flow_errors import (
    CHECK,
    LEAST_ERROR,
    SIZE,
    SLIDING_BETAS,
    SLIDING_CHECK,
    STOKES,
    kept_promises,
    law_number,
    promised_error,
    rearranging_error,
    relative_amplitude,
    relative_drag,
    scatter_of_flow,
    sliding_factor,
)
from jamlab.flow.oscillate import LARGEST_AMPLITUDE
from jamlab.flow.shear import LARGEST_RATE
from jamlab.flow.shear_run import TRANSIENT
from jamlab.packing.packing import Packing
from jamlab.rheology.complex_modulus import ComplexModulus, complex_modulus
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.inertia import inertia_error
from jamlab.rheology.nonlinear_drag import modulus_at_strain

RUN_ERROR = 0.01  # of `oscillate` at its default tolerance, with room for cycles that still drift
MOST_STRAIN = 1e3


@dataclass(frozen=True)
class FlowChoice:
    """What a flow needs, and why.

    Attributes:
        way: "static modulus", "linear spectrum", "equivalent damping", "oscillation", "linear flow" or "flow".
        error: relative error of |G*| or of the stress that 95 % of new packings stay below.
        others: way -> error of each that was considered; infinite where nothing was measured.
        damping: least drag law that does: that asked for, linear drag in its place, or Stokes drag if both agree.
        strain: to shear in all: start-up and average of steady flow, or all cycles; 0 if nothing is run.
        modulus: G* by the way chosen, if nothing is run, else None.
        call: what to call, with `p` for the packing.
        reasons: one sentence each: way, drag law, inertia, length.
        warning: what makes errors doubtful here; empty if nothing does.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> print(jamlab.choose_flow(p, omega=1.0, amplitude=1e-5, tolerance=0.05).way)
        linear spectrum
    """

    way: str
    error: float
    others: dict[str, float]
    damping: Damping
    strain: float
    modulus: complex | None
    call: str
    reasons: tuple[str, ...]
    warning: str = ""

    @property
    def why(self) -> str:
        """All reasons in one text."""
        return "; ".join(self.reasons)

    def __repr__(self) -> str:
        doubt = f"; DOUBTFUL: {self.warning}" if self.warning else ""
        return f"FlowChoice({self.way}, error up to {self.error:.2g}, {self.call}; {self.why}{doubt})"


@checked
def choose_flow(
    packing: Packing,
    damping: Damping | None = None,
    *,
    omega: float | None = None,
    amplitude: float | None = None,
    rate: float | None = None,
    tolerance: float = 0.1,
    mass: float = 0.0,
) -> FlowChoice:
    """Choose the cheapest model expected to give G* at a frequency, or the stress of steady flow at a rate.

    Give `omega`, with `amplitude` unless strains are infinitely small, or `rate`. Nothing is run: linear response of
    the packing and a table of errors, `jamlab chart flow-table`, tell. It was measured on 64 disks and holds for
    larger packings, which scatter less; of contact damping, for beta from 0.1 to 10 and alpha from 0.5 to 1. Beyond,
    the answer is a run.

    Args:
        packing: SP or DP at a minimum.
        damping: drag of the system in question, default `ContactDamping()`.
        omega: angular frequency, 1/tau_1.
        amplitude: of the strain.
        rate: of steady shear, 1/tau_1.
        tolerance: relative error of |G*| or of the stress that is allowed.
        mass: of the mean particle, k tau_1^2; whether it could matter is said.

    Raises:
        InputError: neither frequency nor rate or both, power-law drag without an amplitude, a tolerance that no run
            keeps, a value out of range.
        ConvergenceError: the packing is not jammed, or not stable.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> slow = jamlab.choose_flow(p, jamlab.ContactDamping(alpha=0.5), omega=1e-4, amplitude=1e-3)
        >>> slow.way, slow.others["equivalent damping"] > 0.1
        ('oscillation', True)
    """
    law = damping or ContactDamping()
    if (omega is None) == (rate is None):
        raise InputError(f"omega = {omega}, rate = {rate}: give one of them, a frequency or a rate of steady shear")
    check_number("tolerance", tolerance, 1.0)
    if tolerance < RUN_ERROR:
        raise InputError(
            f"tolerance = {tolerance:g}: no error below {RUN_ERROR:g} was measured; run, and compare steps"
        )
    if not (np.isfinite(mass) and mass >= 0):
        raise InputError(f"mass = {mass!r}: must be 0 or a mass in k tau_1^2")
    if rate is not None:
        check_number("rate", rate, LARGEST_RATE)
        return _for_flow(packing, law, rate, tolerance, mass)
    assert omega is not None
    check_number("omega", omega, 1e3)
    if amplitude is not None:
        check_number("amplitude", amplitude, LARGEST_AMPLITUDE)
    elif law_number(law) not in (STOKES, 1.0):
        raise InputError(f"{law}: its moduli depend on amplitude however small it is: give amplitude")
    return _for_oscillation(packing, law, omega, amplitude, tolerance, mass)


def _for_oscillation(
    packing: Packing, law: Damping, omega: float, amplitude: float | None, tolerance: float, mass: float
) -> FlowChoice:
    number, linear = law_number(law), _linear(law)
    spectrum = complex_modulus(packing, [omega], linear)
    plain = complex(spectrum.storage[0], spectrum.loss[0])
    strain = amplitude or 0.0
    best, error, condition = plain, 0.0, "infinitely small strain"
    if amplitude is not None:
        drag, part = relative_drag(law, omega, amplitude), relative_amplitude(packing, amplitude)
        error = promised_error("oscillation", number, drag, part, beta=_beta(law))
        condition = f"strain of {part:.2g} overlaps, drag {drag:.2g} of elasticity"
        rearranged = sliding_factor("oscillation", _beta(law)) * rearranging_error(drag, part)
        if LEAST_ERROR < error < np.inf and error == rearranged:
            condition += ", where packings begin to rearrange"
        if isinstance(law, ContactDamping) and law.alpha < 1:
            best = modulus_at_strain(packing, omega, amplitude, law)
    others = {"static modulus": _by_way_of(spectrum.g0, best, error), "linear spectrum": _by_way_of(plain, best, error)}
    if number not in (STOKES, 1.0):
        others["equivalent damping"] = error
    others["oscillation"] = RUN_ERROR
    way = next(name for name, each in others.items() if each <= tolerance)
    values = {"static modulus": complex(spectrum.g0), "linear spectrum": plain, "equivalent damping": best}
    cycles = _cycles(spectrum, omega) if way == "oscillation" else 0
    least, about_drag = _least_drag(packing, law, linear, omega, best, tolerance, way)
    about_mass, heavy = _inertia(packing, linear, omega, mass, tolerance)
    length = f"{cycles} cycles, until slow relaxation is over" if cycles else "nothing is run"
    return FlowChoice(
        way,
        others[way],
        others,
        least,
        4.0 * strain * cycles,
        values.get(way),
        _call(way, law, omega, strain, best, cycles),
        (_compare(way, others, tolerance, condition, _beta(law)), about_drag, about_mass, length),
        _doubts(packing, law, heavy),
    )


def _for_flow(packing: Packing, law: Damping, rate: float, tolerance: float, mass: float) -> FlowChoice:
    number = law_number(law)
    slow = relative_drag(law, rate, 1.0)  # rate at which linear drag gives the same stress
    average = max(1.0, (2 * scatter_of_flow(beta=_beta(law)) / tolerance) ** 2 * SIZE / packing.n)
    others: dict[str, float] = {}
    if number not in (STOKES, 1.0):
        others["linear flow"] = promised_error("flow", number, slow, 1.0, beta=_beta(law))
    others["flow"] = RUN_ERROR
    way = next(name for name, each in others.items() if each <= tolerance)
    strain = TRANSIENT + average
    if strain > MOST_STRAIN:
        raise InputError(f"tolerance = {tolerance:g}: {packing.n} disks would have to shear by {strain:.2g}; give more")
    used = _linear(law) if way == "linear flow" else law
    at = slow / law.tau if way == "linear flow" else rate
    about_mass, heavy = _inertia(packing, _linear(law), 1.0 / law.tau, mass, tolerance)
    return FlowChoice(
        way,
        others[way],
        others,
        used,
        strain,
        None,
        f"jamlab.flow_curve(p, [{at:.4g}], {_spell(used)}, strain={average:.3g})",
        (
            _compare(way, others, tolerance, f"stress of linear drag at rate {slow:.2g}", _beta(law)),
            "no linear spectrum flows, and drag laws part at any rate",
            about_mass,
            f"strain {TRANSIENT:g} of start-up and {average:.2g} of average, for two standard errors of {tolerance:g}",
        ),
        _doubts(packing, law, heavy),
    )


def _linear(law: Damping) -> Damping:
    if isinstance(law, StokesDrag):
        return law
    return ContactDamping(beta=law.beta, tau=law.tau, arms=law.arms)


def _beta(law: Damping) -> float:
    return law.beta if isinstance(law, ContactDamping) else 1.0


def _by_way_of(value: complex, best: complex, error: float) -> float:
    """Largest error of a value whose distance from another is known, which itself errs by so much."""
    apart = abs(value - best) / abs(best)
    return float(apart * (1 + error) + error) if np.isfinite(error) else float("inf")


def _cycles(spectrum: ComplexModulus, omega: float) -> int:
    """Cycles until what relaxes most slowly has done so: to e^-3; two are compared."""
    slowest = spectrum.tau_star if np.isfinite(spectrum.tau_star) else 0.0
    return 3 + int(np.ceil(min(3.0 * slowest * omega / (2 * np.pi), 17.0)))


def _least_drag(
    packing: Packing, law: Damping, linear: Damping, omega: float, best: complex, tolerance: float, way: str
) -> tuple[Damping, str]:
    """The simplest law that gives the same modulus, in linear response, and why."""
    if way == "static modulus":
        return linear, "no drag matters: Stokes or contact"
    other: Damping = ContactDamping(tau=law.tau) if isinstance(law, StokesDrag) else StokesDrag(0.0, law.tau)
    found = complex_modulus(packing, [omega], other)
    apart = abs(complex(found.storage[0], found.loss[0]) - best) / abs(best)
    name = "contact damping" if isinstance(law, StokesDrag) else "Stokes drag"
    if apart > tolerance:
        return (linear if way == "linear spectrum" else law), f"{name} instead would change G* by {_percent(apart)}"
    simpler = law if isinstance(law, StokesDrag) else other
    return simpler, f"Stokes or contact drag: G* differs by {_percent(apart)}"


def _inertia(packing: Packing, linear: Damping, omega: float, mass: float, tolerance: float) -> tuple[str, str]:
    """What inertia would change, and a warning if that is too much."""
    if mass == 0:
        return "no mass: inertia is left out", ""
    change = inertia_error(packing, linear, omega, mass)
    words = f"inertia of mass {mass:g} changes G* at {omega:g}/tau_1 by {_percent(change)}"
    if change <= tolerance:
        return f"{words}: irrelevant", ""
    return words, f"{words}: flow without mass is not enough, use LAMMPS' pair_style gran/hooke"


def _compare(way: str, others: dict[str, float], tolerance: float, condition: str, beta: float) -> str:
    simpler = list(others)[: list(others).index(way)]
    missed = ", ".join(f"{name} {_percent(others[name])}" for name in simpler)
    kept, checked_runs = kept_promises(part=CHECK if beta == 1 else SLIDING_CHECK)
    errs = f"errs by {_percent(others[way])} at most" if others[way] else "is exact"
    words = f"{way} {errs} ({condition}), {_percent(tolerance)} are allowed"
    words += f"; not enough: {missed}" if missed else ""
    low, high = SLIDING_BETAS
    if not low <= beta <= high:
        return f"{words}; beta = {beta:g}: errors were measured from {low:g} to {high:g}"
    at = "" if beta == 1 else f" at beta = {low:g} and {high:g}"
    return f"{words}; such promises held in {kept} of {checked_runs} checks{at}"


def _doubts(packing: Packing, law: Damping, heavy: str) -> str:
    found = [heavy] if heavy else []
    if not SLIDING_BETAS[0] <= _beta(law) <= SLIDING_BETAS[1]:
        found.append(f"errors were measured at beta from {SLIDING_BETAS[0]:g} to {SLIDING_BETAS[1]:g}")
    if packing.model == "dp":
        found.append("errors were measured on disks")
    return "; ".join(found)


def _call(way: str, law: Damping, omega: float, amplitude: float, modulus: complex, cycles: int) -> str:
    if way == "static modulus":
        return "jamlab.shear_modulus(p)"
    if way == "linear spectrum":
        return f"jamlab.complex_modulus(p, [{omega:g}], {_spell(_linear(law))})"
    if way == "oscillation":
        return f"jamlab.oscillate(p, {omega:g}, {amplitude:g}, {_spell(law)}, cycles={cycles})"
    assert isinstance(law, ContactDamping)
    if law == ContactDamping(alpha=law.alpha):
        return f"jamlab.nonlinear_modulus(p, [{omega:g}], {law.alpha:.4g}, stress={abs(modulus) * amplitude:.4g})"
    return f"jamlab.rheology.nonlinear_drag.modulus_at_strain(p, {omega:g}, {amplitude:g}, {_spell(law)})"


def _spell(law: Damping) -> str:
    """The law as it is called, defaults left out."""
    given = (f"{f.name}={getattr(law, f.name)!r}" for f in fields(law) if getattr(law, f.name) != f.default)
    return f"jamlab.{type(law).__name__}({', '.join(given)})"


def _percent(part: float) -> str:
    return "an unknown part" if not np.isfinite(part) else f"{100 * part:.2g} %"
