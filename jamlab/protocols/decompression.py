"""Decompress a packing to a lower pressure, in steps, with a minimum of the enthalpy U + p A at each."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from jamlab.checks import check_number, checked
from jamlab.engine.deck_defaults import numbers
from jamlab.engine.ranks import check_ranks
from jamlab.engine.session import Session, evaluate
from jamlab.errors import ConvergenceError, InputError, named
from jamlab.geometry.contact_network import contacts
from jamlab.laws.pair_law import HIGHEST_OVERLAP
from jamlab.packing.box_strains import BoxStrains
from jamlab.packing.natural_units import in_natural_units, natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import STRESS
from jamlab.packing.recipe import changed
from jamlab.processes.progress import Progress, told
from jamlab.protocols.box_relaxation import Ensemble, minimizer, relax_disks_and_box
from jamlab.protocols.descent import load
from jamlab.protocols.relaxation import Relaxed, check_tolerance, usual_force_tolerance
from jamlab.protocols.saddles import record, relax_off_saddles
from jamlab.storage.verified_file import versions

PRESSURE_PROTOCOL = 2  # version of `pack` and `decompress`, see jamlab.campaign.tasks: 1 and 2 differ by rounding
LEAST_NOISE = 1e-4  # force tolerance over p d at most: z and G have few digits else
_KEPT = ("seed", "source", "sizes")  # of a provenance, on the way down
_ANOTHER = "start from a packing at a lower pressure, or from another seed"


@checked
def decompress(
    packing: Packing,
    pressure: float,
    *,
    ranks: int = 1,
    force_tolerance: float | None = None,
    progress: Progress | None = None,
) -> Packing:
    """Decompress a jammed packing to a lower pressure, in steps.

    The enthalpy U + p A is minimised over positions and the area of the box at every pressure, and over its shear in
    the shear-stabilized ensemble. Between walls only the height of the box changes, and p is the normal stress on
    the walls. Use it for large packings of disks near onset, where random starts may not converge, and for droplets at
    a pressure. The result depends on the initial pressure.

    Args:
        packing: SP or DP, without attraction; jammed and relaxed, at a higher pressure.
        pressure: target pressure in the units of the packing, at least 10^4 times the force tolerance over the particle
            size: by default 1e-8 k for disks, 1e-6 eps/l^2 for droplets.
        ranks: SP: threads of FIRE; useful above 10 000 disks.
        force_tolerance: largest force at the minimum, as in `compress`; at most 1e-4 p d.
        progress: called after each pressure with (fraction done, text); True: print it.

    Returns:
        Packing with p met to 1e-6 relative and `converged` True, of the same ensemble and without `phi_J`, because it
        was not compressed from an onset. `provenance["pressure"]` holds the value, and `provenance["from_pressure"]`
        the pressure of the given packing.

    Raises:
        InputError: particles that attract, a packing that is not jammed or not relaxed, or a pressure that is not below
            its own.
        ConvergenceError: the pressure was not reached, or the packing unjammed.

    Example:
        >>> p = jamlab.decompress(jamlab.pack(n=32, pressure=1e-2, seed=1), 1e-4)
        >>> p.converged, p.provenance["protocol"], round(p.provenance["from_pressure"], 8)
        (True, 'decompress', 0.01)
    """
    check_ranks(ranks, packing.kind)
    if packing.law.range:
        raise InputError(
            f"{packing.law} attract, so their pressure does not say how far they are from onset; use "
            "compress(packing, to) with a lower rho or phi"
        )
    check_number("pressure", pressure, np.inf)
    force = check_force(pressure, force_tolerance, packing.model, natural_scales(packing).stress)
    found = come_down(packing, pressure, force, ranks, progress)
    how = {"pressure": pressure, "ranks": ranks, "force_tolerance": force_tolerance}
    return changed(packing, found, "decompress", **how)


def come_down(packing: Packing, pressure: float, force: float, ranks: int, progress: Progress | None = None) -> Packing:
    """`decompress` to a pressure that has been checked, with a force tolerance."""
    began = time.perf_counter()
    found, reached, start = _decompressed(packing, pressure, force, ranks, progress)
    entries: dict[str, Any] = {name: packing.provenance[name] for name in _KEPT if name in packing.provenance}
    entries |= {"protocol": "decompress", "protocol_version": PRESSURE_PROTOCOL, "pressure": reached}
    entries |= {"from_pressure": start, "wall_time": time.perf_counter() - began, **versions()}
    return found._trusted(provenance=entries, phi_J=None)  # earlier provenance is void


@in_natural_units(STRESS, pressure=STRESS)
def _decompressed(
    packing: Packing, pressure: float, force: float, ranks: int, progress: Progress | None
) -> tuple[Packing, float, float]:
    """The packing at the lower pressure, the pressure met, and that where it came from."""
    start, search = _check_start(packing, pressure), numbers("pressure")
    steps = int(np.ceil(np.log(pressure / start) / np.log(1 - search["fall"])))
    with Session(packing, ranks=ranks) as session:
        for step, target in enumerate(np.geomspace(start, pressure, steps + 1)[1:], 1):
            noise = force if step == steps else max(force, LEAST_NOISE * target)
            least = search["loose"] * target
            found = _relaxed_at(session, target, noise, least, last=step == steps)
            reached = session.packing()
            if progress is not None:
                told(progress)(step / steps, f"packing fraction {reached.phi:.4f}")
            if found.evaluation.pressure < least:
                raise ConvergenceError(
                    f"pressure not reached with n = {packing.n}: the packing unjammed at {target / pressure:.3g} "
                    f"times the requested pressure; {_ANOTHER}"
                )
    check_met(reached, found, pressure, _ANOTHER)
    return record(session, reached, found), found.evaluation.pressure, start


def _relaxed_at(session: Session, pressure: float, force: float, least: float, *, last: bool) -> Relaxed:
    """A minimum of the enthalpy: of disks over positions and box at once, else by steps of the box, of which the last
    pressure is left no saddle."""
    frame, ensemble = session.packing().frame, minimizer(session.packing().ensemble)
    if session.kind.compiled_fire and (frame.all_free or ensemble.may_shear):
        box_strains = BoxStrains(ensemble.strains, pressure)
        return relax_disks_and_box(session, box_strains, force, near=True, least_pressure=least)
    held = Ensemble(may_shear=ensemble.may_shear, pressure=pressure)
    return relax_off_saddles(session, force, near=True, ensemble=held) if last else held(session, force, near=True)


def _check_start(packing: Packing, pressure: float) -> float:
    """Give the pressure of a packing; refuse one that cannot come down to `pressure`."""
    state = evaluate(packing)
    if contacts(packing).unjammed:
        what, remedy = "not jammed", "give one jammed at a higher pressure"
    elif state.max_force > LEAST_NOISE * load(packing, state):
        what, remedy = f"not relaxed (residual force {state.max_force:.2g})", "give `jamlab.relax` of it"
    elif pressure >= state.pressure:
        what = f"at {state.pressure / pressure:.6g} times this pressure"
        remedy = "give a lower pressure, or a packing jammed at a higher one"
    else:
        return state.pressure
    raise InputError(f"pressure: the packing is {what}: {remedy}")


def check_met(packing: Packing, found: Relaxed, pressure: float, remedy: str) -> None:
    """Refuse a state whose pressure is not that asked for."""
    reached, force = found.evaluation.pressure, found.evaluation.max_force
    most = numbers("pressure")["miss"] * load(packing, found.evaluation)
    if not (found.converged and abs(reached - pressure) <= most):
        raise ConvergenceError(
            f"pressure not reached with n = {packing.n}: the search for {pressure:g} (natural units) ended "
            f"at {reached:g} (residual force {force:.2g}, tolerance {found.tolerance:.2g}); {remedy}"
        )


def check_force(pressure: float, tolerance: float | None, model: str, unit: float) -> float:
    """Give the force tolerance, small beside the pressure; `unit`: natural unit of the pressure."""
    force = usual_force_tolerance(model) if tolerance is None else tolerance
    check_tolerance(force, LEAST_NOISE * HIGHEST_OVERLAP)
    if force * unit > LEAST_NOISE * pressure:
        raise InputError(
            f"{named('pressure', pressure, 'g')}: the force tolerance {force:g} is too large for this pressure: use a "
            f"pressure of {force * unit / LEAST_NOISE:g} or more, or a smaller force tolerance"
        )
    return force
