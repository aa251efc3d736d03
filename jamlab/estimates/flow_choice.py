"""The least model that a flow needs: static modulus, linear spectrum, equivalent damping, or a run; and how long.

Errors come from a table of runs, see `flow_errors`, and from the packing itself, where linear response tells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.estimates.choice import Choice, Why, judge
from jamlab.estimates.flow_errors import CONDITIONS, FlowCondition, shipped_errors
from jamlab.flow.flow_curve import flow_curve
from jamlab.flow.oscillate import oscillate
from jamlab.flow.shear import EVENTS
from jamlab.mechanics.negative_moduli import warn_of_negative
from jamlab.packing.natural_units import stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.protocols.moduli import shear_modulus
from jamlab.rheology.complex_modulus import complex_modulus, linear_modulus
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.nonlinear_drag import effective_relaxation_time, equivalent_modulus
from jamlab.statistics.confidence import STANDARD_ERRORS, room


@dataclass(frozen=True)
class FlowPlan:
    """Runs that are estimated."""

    # of `oscillate` at its default tolerance, with room for cycles that still drift; taken for flow too, where
    # noise hides it
    error: float = 0.01
    strain: float = 1e3  # longest run of a flow
    cycles: int = 17  # that an oscillation is given to relax


FLOW_PLAN = FlowPlan()


@checked
def choose_flow(
    packing: Packing,
    damping: DragLaw | None = None,
    *,
    omega: float | None = None,
    amplitude: float | None = None,
    rate: float | None = None,
    error: float = 0.1,
) -> Choice:
    """Choose the cheapest model expected to give G* at a frequency, or the stress of steady flow at a rate.

    Give `omega` (with `amplitude`, unless the strain is infinitesimal) or `rate`. No simulation is run: the choice uses
    linear response of the packing and a table of errors (`python -m studies tables flow-errors`).

    The table was measured for 64 disks at pressures from 0.003 to 0.01 of the stiffness, contact damping with beta = 1
    and alpha from 0.5 to 1, steady flow at (tau_1 rate)^alpha from 0.01 to 0.1, and a background drag of 0.01
    for steady flow. Outside this range a simulation is chosen for oscillations, and `outside` gives the reason;
    steady flow is refused.

    Args:
        packing: SP or DP at a minimum.
        damping: `ContactDamping` (default, beta = 1) or `StokesDrag`.
        omega: angular frequency, 1/tau_1.
        amplitude: strain amplitude.
        rate: rate of steady shear, 1/tau_1.
        error: largest accepted relative error of |G*| or of the stress.

    Warns:
        JamlabWarning: the static modulus is negative, see `jamlab.complex_modulus`.

    Raises:
        InputError: neither or both of omega and rate, power-law drag without an amplitude, an error that cannot be
            met, steady flow outside the table, another drag law than those two, or a value out of range.
        ConvergenceError: the packing is not jammed, or not stable.

    Example:
        >>> p = jamlab.pack(n=64, pressure=1e-2, seed=1)
        >>> slow = jamlab.choose_flow(p, jamlab.ContactDamping(alpha=0.5), omega=1e-4, amplitude=1e-3)
        >>> slow.way, slow.options["why"].tolist()[-2:]
        ('oscillation', ['error too large', 'taken'])
    """
    law = damping or ContactDamping()
    if law.name not in CONDITIONS.laws:
        raise InputError(
            f"{law}: the table of errors was measured for ContactDamping and StokesDrag alone; run jamlab.oscillate or "
            "jamlab.flow_curve at two tolerances, or use jamlab.complex_modulus for small strains"
        )
    if (omega is None) == (rate is None):
        raise InputError(f"omega = {omega}, rate = {rate}: give one of them, a frequency or a rate of steady shear")
    check_number("error", error, 1.0)
    if error < FLOW_PLAN.error:
        raise InputError(f"error = {error:g}: errors below {FLOW_PLAN.error:g} were not measured; compare several runs")
    if rate is not None:
        return _for_flow(packing, law, rate, error)
    assert omega is not None
    check_number("omega", omega, 1e3)
    if amplitude is None and law.alpha < 1:
        raise InputError(f"{law}: the moduli depend on the amplitude, however small; give amplitude")
    return _for_oscillation(packing, law, omega, amplitude, error)


def _for_oscillation(packing: Packing, law: DragLaw, omega: float, amplitude: float | None, largest: float) -> Choice:
    linear, table = law.linear(), shipped_errors()
    spectrum = linear_modulus(packing, [omega], linear)
    warn_of_negative(packing, {"g0": spectrum.g0})
    plain = complex(spectrum.storage[0], spectrum.loss[0])
    best, error = plain, 0.0
    outside: tuple[str, ...] = ()  # infinitely small strains need no table
    if amplitude is not None:
        flow = FlowCondition.oscillating(packing, law, omega, amplitude)
        outside = table.outside(packing, flow)
        error = np.inf if outside else table.promise(flow)
        if law.alpha < 1:
            found, _ = equivalent_modulus(packing, [omega], law, amplitude=amplitude)
            best = complex(found.storage[0], found.loss[0])
    values = {"static modulus": complex(spectrum.g0), "linear spectrum": plain}
    off = {name: abs(value - best) / abs(best) for name, value in values.items()}
    # of the best, which itself errs; nothing is promised where its own error is infinite
    errors = {name: float(each * (1 + error) + error) if np.isfinite(error) else np.inf for name, each in off.items()}
    if law.alpha < 1:
        values["equivalent damping"], errors["equivalent damping"] = best, error
    # the slowest relaxes to e^-3, then two cycles are compared; where G_xy < 0 no time is known to be the slowest
    relaxing = 3.0 * spectrum.tau_star * omega / (2 * np.pi)
    cycles = 3 + int(np.ceil(min(relaxing, FLOW_PLAN.cycles))) if np.isfinite(relaxing) else 3 + FLOW_PLAN.cycles
    run = 4.0 * (amplitude or 0.0) * cycles
    errors["oscillation"] = FLOW_PLAN.error
    options, row = _options(errors, {name: run * (name == "oscillation") for name in errors}, largest)
    way = str(options.at[row, "way"])
    function: Callable[..., Any] = complex_modulus
    arguments: dict[str, Any] = {}
    strain = 0.0
    if way == "oscillation":
        function = oscillate
        arguments = {"omega": omega, "amplitude": amplitude, "damping": law, "cycles": cycles}
        strain = run
    elif way == "linear spectrum":
        arguments = {"omega": [omega], "damping": linear}
    elif way == "equivalent damping":  # linear drag that dissipates as much at this stress
        stress = abs(best) * (amplitude or 0.0)
        time = effective_relaxation_time(omega * law.tau, stress, law.alpha, stiffness=stiffness_scale(packing))[0]
        slower = replace(linear, tau=law.tau * float(time))  # type: ignore[type-var]  # laws are dataclasses
        arguments = {"omega": [omega], "damping": slower}
    else:
        function, arguments = shear_modulus, {"direction": "simple"}
    return Choice(
        way=way, bound={"G*": errors[way]}, options=options, function=function, arguments=arguments, strain=strain,
        modulus=values.get(way), outside=outside,
    )  # fmt: skip


def _for_flow(packing: Packing, law: DragLaw, rate: float, largest: float) -> Choice:
    table, linear = shipped_errors(), law.linear()
    flow = FlowCondition.steady(law, rate)
    if outside := table.outside(packing, flow):
        raise InputError(
            f"{'; '.join(outside)}: the scatter of steady flow was not measured there; run flow_curve and use its "
            "stress_stderr"
        )
    models = {"flow": FLOW_PLAN.error}
    if flow.alpha != 1.0:
        models = {"linear flow": table.promise(flow)} | models
    scatter = table.scatter_of_flow * np.sqrt(CONDITIONS.size / packing.n)
    noise = STANDARD_ERRORS * scatter  # half the 95 % interval of an average over unit strain
    average = {name: _average(noise, largest, error) for name, error in models.items()}
    errors = {name: float(np.hypot(error, noise / np.sqrt(average[name]))) for name, error in models.items()}
    options, row = _options(errors, {name: EVENTS.transient + each for name, each in average.items()}, largest)
    if row is None:
        reached = (
            f"{packing.n} particles at strain {EVENTS.transient + average['flow']:g} reach {100 * errors['flow']:.2g} %"
        )
        raise InputError(f"error = {largest:g}: {reached}; accept a larger error, or use a larger packing")
    way = str(options.at[row, "way"])
    used, at = (linear, flow.drag / law.tau) if way == "linear flow" else (law, rate)
    arguments = {"rates": [at], "damping": used, "strain": average[way], "background_drag": CONDITIONS.background}
    return Choice(
        way=way, bound={"stress": errors[way]}, options=options, function=flow_curve, arguments=arguments,
        strain=EVENTS.transient + average[way],
    )  # fmt: skip


def _options(errors: dict[str, float], strains: dict[str, float], largest: float) -> tuple[pd.DataFrame, int | None]:
    """Options in the order in which ways were considered, the cheapest first."""

    def why(error: float) -> Why | None:
        if not np.isfinite(error):
            return Why.UNKNOWN
        return Why.LARGE if error > largest else None

    return judge([{"way": k, "error": e, "strain": strains[k], "why": why(e)} for k, e in errors.items()])


def _average(noise: float, largest: float, model_error: float) -> float:
    """Strain of an average whose noise, known at unit strain, fills the room beside a model: upwards to three
    digits. Where that is more than `FLOW_PLAN.strain`, or a model leaves no room, the error that it reaches is larger
    than allowed."""
    strain = max(1.0, (noise / room(largest, model_error)) ** 2)
    digit = 10.0 ** (np.floor(np.log10(strain)) - 2)
    return float(min(np.ceil(strain / digit) * digit, FLOW_PLAN.strain - EVENTS.transient))
