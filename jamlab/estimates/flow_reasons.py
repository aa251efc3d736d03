"""The words of a choice of flow: how ways compare, what makes errors doubtful, what to call."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from jamlab.estimates.flow_errors import (
    BACKGROUND,
    CHECK,
    SLIDING_BETAS,
    SLIDING_CHECK,
    STOKES,
    kept_promises,
    law_number,
    mean_overlap,
    measured_range,
)
from jamlab.estimates.inertia import inertia_error
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag

_DIGITS = 1e-4  # relative: the table has five digits


def compare(way: str, others: dict[str, float], tolerance: float, condition: str, kind: str, beta: float) -> str:
    """One sentence on the way chosen, beside those that do not do.

    Args:
        way: that was chosen.
        others: way -> relative error, in the order in which they were considered.
        tolerance: relative error that is allowed.
        condition: at which errors hold.
        kind: "oscillation" or "flow", the rows of the table that errors come from; "" if they come from none.
        beta: of contact drag.

    Example:
        >>> from jamlab.estimates.flow_reasons import compare
        >>> compare("linear spectrum", {"linear spectrum": 0.0}, 0.1, "small strain", "", 1.0)
        'linear spectrum is exact (small strain), 10 % are allowed'
    """
    simpler = list(others)[: list(others).index(way)]
    missed = ", ".join(f"{name} {percent(others[name])}" for name in simpler)
    if way == "oscillation":
        errs = f" is run, to {percent(others[way])}"
    elif kind:
        errs = f": 95 % err by less than {percent(others[way])}"
    else:
        errs = f" errs by {percent(others[way])}" if others[way] else " is exact"
    words = f"{way}{errs} ({condition}), {percent(tolerance)} are allowed"
    words += f"; not enough: {missed}" if missed else ""
    low, high = SLIDING_BETAS
    if kind and not low <= beta <= high:
        return f"{words}; beta = {beta:g}: errors were measured from {low:g} to {high:g}"
    return words + (_checked(kind, beta) if kind and way not in ("oscillation", "flow") else "")


def _checked(kind: str, beta: float) -> str:
    """How often checks of this kind, at this beta, kept what was promised: runs are their truth, and not checked."""
    end = beta if beta in SLIDING_BETAS else None
    kept, of = kept_promises(part=CHECK if beta == 1 else SLIDING_CHECK, kind=kind, beta=end)
    ends = " and ".join(f"{each:g}" for each in ([end] if end else SLIDING_BETAS))
    what = "such promises" if kind == "oscillation" else "promises of linear drag"  # the average is no part of them
    return f"; {what} held in {kept} of {of} checks{'' if beta == 1 else f' at beta = {ends}'}" if of else ""


def doubts(packing: Packing, kind: str, beta: float) -> list[str]:
    """What of a packing and its drag lies outside the rows of one kind, or outside all if it is not of disks."""
    fewest, (low, high) = int(measured_range(kind, "n")[0]), measured_range(kind, "pressure")
    found = []
    if not SLIDING_BETAS[0] <= beta <= SLIDING_BETAS[1]:
        found.append(f"errors were measured at beta from {SLIDING_BETAS[0]:g} to {SLIDING_BETAS[1]:g}")
    if packing.n < fewest:
        found.append(f"errors were measured on {fewest} particles or more, not {packing.n}")
    overlap = mean_overlap(packing)
    if not _within(overlap, low, high):
        found.append(
            f"errors were measured at pressures from {low:.2g} to {high:.2g} of the stiffness, not {overlap:.2g}"
        )
    if packing.model == "dp":
        found.append("errors were measured on disks")
    return found


def doubts_of_flow(law: Damping, drag: float) -> list[str]:
    """What of a drag law and of a linear rate, `relative_drag`, lies outside the rows of steady flow.

    How far averages scatter was measured there alone, so this holds for a run as well.
    """
    alpha, found = law_number(law), []
    low, high = measured_range("flow", "alpha")
    if not _within(alpha, low, high):
        unlike = f"at alpha from {low:g} to {high:g}, not {alpha:g}"
        found.append(f"errors were measured {'under contact drag, not Stokes drag' if alpha == STOKES else unlike}")
    low, high = measured_range("flow", "drag")
    if not _within(drag, low, high):
        found.append(
            f"errors were measured at linear rates (tau rate)^alpha from {low:.2g} to {high:.2g}, not {drag:.2g}"
        )
    return found


def _within(value: float, low: float, high: float) -> bool:
    return low * (1 - _DIGITS) <= value <= high * (1 + _DIGITS)


def about_inertia(packing: Packing, linear: Damping, omega: float, mass: float, tolerance: float) -> tuple[str, str]:
    """What inertia would change, and a warning if that is too much."""
    if mass == 0:
        return "no mass: inertia is left out", ""
    change = inertia_error(packing, linear, omega, mass)
    words = f"inertia of mass {mass:g} changes G* at {omega:g}/tau_1 by {percent(change)}"
    if change <= tolerance:
        return f"{words}: irrelevant", ""
    return words, f"{words}: flow without mass is not enough, use LAMMPS' pair_style gran/hooke"


def oscillation_call(way: str, law: Damping, omega: float, amplitude: float, modulus: complex, cycles: int) -> str:
    """What to call for G* by some way, with `p` for the packing."""
    if way == "static modulus":
        return "jamlab.shear_modulus(p)"
    if way == "linear spectrum":
        return f"jamlab.complex_modulus(p, [{omega:g}], {_spell(linear_law(law))})"
    if way == "oscillation":
        return f"jamlab.oscillate(p, {omega:g}, {amplitude:g}, {_spell(law)}, cycles={cycles})"
    assert isinstance(law, ContactDamping)
    if law == ContactDamping(alpha=law.alpha):
        return f"jamlab.nonlinear_modulus(p, [{omega:g}], {law.alpha:.4g}, stress={abs(modulus) * amplitude:.4g})"
    return f"jamlab.rheology.nonlinear_drag.modulus_at_strain(p, {omega:g}, {amplitude:g}, {_spell(law)})"


def flow_call(law: Damping, rate: float, average: float) -> str:
    """Steady flow under the background drag of the table, if the law is not itself one."""
    background = "" if isinstance(law, StokesDrag) else f", background={BACKGROUND:g}"
    return f"jamlab.flow_curve(p, [{rate:.4g}], {_spell(law)}, strain={average:.4g}{background})"


def linear_law(law: Damping) -> Damping:
    """Linear drag in the place of a law."""
    return law if isinstance(law, StokesDrag) else ContactDamping(beta=law.beta, tau=law.tau, arms=law.arms)


def _spell(law: Damping) -> str:
    """The law as it is called, defaults left out."""
    given = (f"{f.name}={getattr(law, f.name)!r}" for f in fields(law) if getattr(law, f.name) != f.default)
    return f"jamlab.{type(law).__name__}({', '.join(given)})"


def percent(part: float) -> str:
    """A part in two digits, or that it is unknown if it is infinite."""
    return "an unknown part" if not np.isfinite(part) else f"{100 * part:.2g} %"
