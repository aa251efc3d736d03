"""The least model that a flow needs: static modulus, linear spectrum, equivalent damping, or a run; and how long.

Errors come from a table of runs, see `flow_errors`, and from the packing itself, where linear response tells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.estimates.flow_errors import (
    BACKGROUND,
    LEAST_ERROR,
    SIZE,
    STOKES,
    law_number,
    promised_error,
    rearranging_error,
    relative_amplitude,
    relative_drag,
    scatter_of_flow,
    sliding_factor,
)
from jamlab.estimates.flow_reasons import (
    about_inertia,
    compare,
    doubts,
    doubts_of_flow,
    flow_call,
    linear_law,
    oscillation_call,
    percent,
)
from jamlab.flow.oscillate import LARGEST_AMPLITUDE
from jamlab.flow.shear import LARGEST_RATE
from jamlab.flow.shear_run import TRANSIENT
from jamlab.packing.packing import Packing
from jamlab.rheology.complex_modulus import ComplexModulus, complex_modulus
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.nonlinear_drag import modulus_at_strain
from jamlab.statistics.confidence import STANDARD_ERRORS, room

RUN_ERROR = (
    0.01  # of `oscillate` at its default tolerance, with room for cycles that still drift; taken for steady flow
)
# too, where noise hides it
MOST_STRAIN = 1e3


@dataclass(frozen=True)
class FlowChoice:
    """What a flow needs, and why.

    Attributes:
        way: "static modulus", "linear spectrum", "equivalent damping", "oscillation", "linear flow" or "flow".
        error: relative error of |G*| or of the stress that 95 % of new packings stay below. That of a stress includes
            its average over `strain`: root of the sum of squares of the way's own error and of half the 95 % interval
            of that average.
        others: way -> such an error of each that was considered, of steady flow with the average that it would get;
            infinite where nothing was measured.
        damping: least drag law that does: that asked for, linear drag in its place, or Stokes drag if both agree.
        strain: to shear in all: start-up and average of steady flow, or all cycles; 0 if nothing is run.
        modulus: G* by the way chosen, if nothing is run, else None.
        call: what to call, with `p` for the packing.
        reasons: one sentence each: way, drag law, inertia, length.
        warning: what makes errors doubtful here; empty if nothing does.

    Example:
        >>> p = jamlab.pack(n=64, pressure=1e-2, seed=1)
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
        return f"FlowChoice({self.way}, error {self.error:.2g}, {self.call}; {self.why}{doubt})"


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
    the packing and a table of errors, `jamlab chart flow-table`, tell. It was measured on 64 disks at pressures from
    0.003 to 0.01 of the stiffness, and is taken to hold for larger packings, which scatter less. Of contact damping it
    has beta from 0.1 to 10 and alpha from 0.5 to 1: beyond, the answer is a run. Steady flow was measured under contact
    damping alone, at linear rates (tau_1 rate)^alpha from 0.01 to 0.1, and so was the scatter of averages, which a run
    has too. `warning` names what lies outside: size, pressure, beta, drag law and rate of steady flow.
    Stresses are those under a background drag of 0.01 beside contact drag, with which errors were measured.

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
        >>> p = jamlab.pack(n=64, pressure=1e-2, seed=1)
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
    number, linear = law_number(law), linear_law(law)
    kind = "" if amplitude is None else "oscillation"  # infinitely small strains need no table
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
    about_mass, heavy = about_inertia(packing, linear, omega, mass, tolerance)
    length = f"{cycles} cycles, until slow relaxation is over" if cycles else "nothing is run"
    return FlowChoice(
        way,
        others[way],
        others,
        least,
        4.0 * strain * cycles,
        values.get(way),
        oscillation_call(way, law, omega, strain, best, cycles),
        (compare(way, others, tolerance, condition, kind, _beta(law)), about_drag, about_mass, length),
        _warning(heavy, *(doubts(packing, kind, _beta(law)) if kind else ())),
    )


def _for_flow(packing: Packing, law: Damping, rate: float, tolerance: float, mass: float) -> FlowChoice:
    beta, linear = _beta(law), linear_law(law)
    slow = relative_drag(law, rate, 1.0)  # rate at which linear drag gives the same stress
    models = {"flow": RUN_ERROR}
    if law_number(law) not in (STOKES, 1.0):
        models = {"linear flow": promised_error("flow", law_number(law), slow, 1.0, beta=beta)} | models
    scatter = float(scatter_of_flow(beta=beta) * np.sqrt(SIZE / packing.n))
    noise = STANDARD_ERRORS * scatter  # half the 95 % interval of an average over unit strain
    average = {name: _average(noise, tolerance, error) for name, error in models.items()}
    others = {name: float(np.hypot(error, noise / np.sqrt(average[name]))) for name, error in models.items()}
    way = next((name for name, each in others.items() if each <= tolerance), None)
    if way is None:
        reached = f"{packing.n} particles sheared by {TRANSIENT + average['flow']:g} err by {percent(others['flow'])}"
        raise InputError(f"tolerance = {tolerance:g}: {reached}; give more, or a larger packing")
    used, at, what = (
        (linear, slow / law.tau, f"linear drag at rate {slow:.2g}") if way != "flow" else (law, rate, "run")
    )
    condition = f"{what} {percent(models[way])}, its average {percent(noise / np.sqrt(average[way]))}"
    length = f"strain {TRANSIENT:g} of start-up and {average[way]:.4g} of average"
    if not isinstance(used, StokesDrag):
        length += f", under a background drag of {BACKGROUND:g} as its errors were measured"
    about_mass, heavy = about_inertia(packing, linear, 1.0 / law.tau, mass, tolerance)
    return FlowChoice(
        way,
        others[way],
        others,
        used,
        TRANSIENT + average[way],
        None,
        flow_call(used, at, average[way]),
        (
            compare(way, others, tolerance, condition, "flow", beta),
            "no linear spectrum flows, and drag laws part at any rate",
            about_mass,
            length,
        ),
        _warning(heavy, *doubts(packing, "flow", beta), *doubts_of_flow(law, slow)),
    )


def _average(noise: float, tolerance: float, model_error: float) -> float:
    """Strain of an average whose noise, known at unit strain, fills the room beside a model: upwards to three digits.

    Where that is more than `MOST_STRAIN`, or a model leaves no room, the error that it reaches is larger than allowed.
    """
    strain = max(1.0, (noise / room(tolerance, model_error)) ** 2)
    digit = 10.0 ** (np.floor(np.log10(strain)) - 2)
    return float(min(np.ceil(strain / digit) * digit, MOST_STRAIN - TRANSIENT))


def _warning(*found: str) -> str:
    return "; ".join(each for each in found if each)


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
        return (linear if way == "linear spectrum" else law), f"{name} instead would change G* by {percent(apart)}"
    simpler = law if isinstance(law, StokesDrag) else other
    return simpler, f"Stokes or contact drag: G* differs by {percent(apart)}"
