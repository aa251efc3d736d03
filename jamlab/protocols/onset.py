"""Jamming onset: from a random start to a packing that barely touches; one search for both models.

Boromand et al. 2.3: start at phi = 0.20, compress in steps, minimise the energy after each, and search for the packing
fraction at which the contact energy per disk or vertex is barely above zero. `search="paper"` does that with the steps
of 1e-4. `search="bisection"` takes larger steps, `step_near` from `phi_near` on, and goes back to the last state
without contacts when one jams; only the last `step_fine` is decompressed. Steps of 1e-2 all the way would raise the
mean phi_J by a quarter of its spread; with 2e-3 its distribution is that of the paper (benchmark_onset.py).
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.checks import check_bidisperse, check_choice, check_number
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.elasticity import follow
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import MODELS, Packing
from jamlab.packing.versions import versions
from jamlab.protocols.box_shear import minimizer
from jamlab.protocols.provenance import record
from jamlab.protocols.random_start import (
    droplet_cell,
    droplet_params,
    free_diameters,
    place_droplets,
    random_disks,
)
from jamlab.protocols.relaxation import Relaxed, relax, settle

Progress = Callable[[str, float], None]  # stage and packing fraction reached

SEARCHES = ("bisection", "paper")
STARTS = ("carried", "scratch")

_SEARCH_TOLERANCE = {"sp": 1e-12, "dp": 1e-6}  # enough to tell a state jammed by step_fine from a loose one
_LOOSE_TOLERANCE = 5e-8  # DP: forces that are left could not make up u_contact, F^2 delta^2/(2 eps)
_DECOMPRESSIONS = 80
_JUMP = 0.1  # contacts lost within this part of the way to the extrapolated onset are lost in one go
_SMALLEST_INCREMENT = 1e-12  # of phi, in the paper's search
_LARGEST_FALL = 0.03  # of sqrt(U) in one decompression, as a fraction of what it was


def jam(
    model: str = "sp",
    n: int = 64,
    seed: int = 1,
    *,
    search: str = "bisection",
    step: float | None = None,
    ensemble: str = "fixed-box",
    start: str = "carried",
    progress: Progress | None = None,
    **parameters: Any,
) -> Packing:
    """A packing at jamming onset, Boromand et al. 2.3, in units "eps".

    Args:
        model: "sp" or "dp".
        n: even number of particles.
        seed: of the random start; the same seed gives the same positions, bit for bit.
        search: "bisection", or "paper": by the letter of Boromand et al. 2.3, some forty times slower.
        step: first increment of phi, by default `step` or `step_paper` of `protocol.parameters`, halved at every turn;
            "bisection" takes no more than `step_near` from `phi_near` on.
        ensemble: "fixed-box": compressed in a square box. "shear-stabilized": from the onset at fixed box on, the box
            is sheared until no shear stress is left.
        start: DP: "carried": disks carry the droplets to `phi_carried` or until the disks jam, which costs less and
            leads to the same distribution of onsets. "scratch": the droplets are compressed from `phi_start` on.
        progress: called with the stage and phi after each minimisation.
        parameters: for "dp": values that replace those of `dp.parameters`, e.g. `contact="segment"`.

    Returns:
        Packing with `onset` = its own phi, contact energy per disk (SP) or vertex (DP) between `u_contact` and
        `u_jammed`, and `provenance` with `max_force` and `converged`.

    Raises:
        InputError: a value that no run can start from.
        ConvergenceError: no onset was found.
    """
    check_choice("model", model, MODELS)
    protocol = {name: float(value) for name, value in defaults("protocol").items()}
    check_choice("search", search, SEARCHES)
    first_step = protocol["step" if search == "bisection" else "step_paper"] if step is None else step
    check_number("step", first_step, 0.5)
    relax_state = minimizer(ensemble)
    if search == "paper" and ensemble != "fixed-box":
        raise InputError(f"ensemble = {ensemble!r}: the paper's search has a fixed box, use search='bisection'")
    check_choice("start", start, STARTS)
    if model == "sp" and start != "carried":
        raise InputError(f"start = {start!r}: disks have one start, leave it out")
    if model == "sp" and parameters:
        raise InputError(f"model sp has no parameter {sorted(parameters)[0]!r}: eps and the mean diameter are 1")
    check_bidisperse(n, seed, protocol["phi_start"])
    began = time.perf_counter()
    highest = protocol["phi_carried" if start == "carried" else "phi_start"]
    loose = _start(model, n, seed, protocol, highest, parameters)
    with Session(loose) as session:
        searched = _Search(session, protocol, relax_state, progress)
        onset = searched.by_paper(loose, first_step) if search == "paper" else searched.by_bisection(loose, first_step)
    return record(
        onset.packing.with_state(onset=onset.phi),
        onset.found,
        protocol="boromand-2.3",
        search=search,
        ensemble=ensemble,
        start=start,
        seed=seed,
        step=first_step,
        wall_time=time.perf_counter() - began,
        **versions(),
    )


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


@dataclass(frozen=True)
class _Search:
    """The search for onset in one LAMMPS session."""

    session: Session
    protocol: dict[str, float]
    relax_state: Callable[..., Relaxed]
    progress: Progress | None

    def by_paper(self, packing: Packing, increment: float) -> _State:
        """Compress while nothing touches, decompress when compressed too far, halve the increment at every turn."""
        direction = 1.0
        while increment > _SMALLEST_INCREMENT and packing.phi < 1.0:
            self.session.load(at_phi(packing, packing.phi + direction * increment))
            state = self._state(relax(self.session))
            if self._at_onset(state):
                return state
            turn = -1.0 if state.energy > self.protocol["u_contact"] else 1.0
            if turn != direction:
                direction, increment = turn, 0.5 * increment
            packing = state.packing
        raise ConvergenceError(
            f"no jamming onset near phi = {packing.phi:.8f}: contact energy per site, {state.energy:.2g}, jumps over "
            f"{self.protocol['u_contact']:g} .. {self.protocol['u_jammed']:g}; try another seed or search='bisection'"
        )

    def by_bisection(self, packing: Packing, step: float) -> _State:
        """Compress until jammed, by ever smaller steps from the last state without contacts; then decompress."""
        jammed: _State | None = None
        longest = step
        while packing.phi < 1.0:
            near = packing.phi >= self.protocol["phi_near"]
            step = min(step, self.protocol["step_near"] if near else longest)
            phi = packing.phi + step
            if jammed is not None:
                phi = min(phi, 0.5 * (packing.phi + jammed.phi))
            trial = self._settled(packing, phi)
            if self._jammed(trial):
                jammed = trial
            else:
                packing, step = trial.packing, 2 * step  # short after a fall, it grows again
            if jammed is not None and jammed.phi - packing.phi <= self.protocol["step_fine"]:
                end = self._stabilized(jammed)
                if self._jammed(end):
                    end = self._decompressed(packing.phi, end)
                if self._at_onset(end):
                    return end
                # it fell apart in one go and found a denser basin: compress that one
                packing, jammed, step = end.packing, None, self.protocol["step_fine"]
        raise ConvergenceError(
            f"no jammed state up to phi = {packing.phi:.3f}: the last minimisation ended at contact energy "
            f"{trial.energy:.2g} per site and max force {trial.found.evaluation.max_force:.2g}"
        )

    def _stabilized(self, jammed: _State) -> _State:
        """The jammed state, relaxed to the end; compressed on where relaxing the box's shear takes its contacts."""
        state = self._followed(jammed.packing, jammed.phi)
        while not self._jammed(state) and state.phi < 1.0 and self.relax_state is not relax:
            self.session.load(at_phi(state.packing, state.phi + 0.5 * self.protocol["step_fine"]))
            state = self._state(self.relax_state(self.session))
        return state

    def _decompressed(self, lowest: float, jammed: _State) -> _State:
        """Follow a jammed state down to the window of contact energy that defines onset.

        U ~ (phi - phi_J)^2 above onset, so sqrt(U) is extrapolated to zero from two jammed states; the first step down
        goes half way to `lowest`, where the packing was not jammed when it was compressed. If all contacts are
        lost in one go, the loose state is returned instead.
        """
        aim = np.sqrt(np.sqrt(self.protocol["u_contact"] * self.protocol["u_jammed"]))
        gap = 0.5 * (jammed.phi - lowest)
        fallen: _State | None = None  # not jammed; compressed from below it may have jammed later than it unjams
        stride = 1.0
        for _ in range(_DECOMPRESSIONS):
            root = np.sqrt(jammed.energy)
            wanted = jammed.phi - gap * (1 - max(aim / root, _LARGEST_FALL))
            if fallen is not None:
                if jammed.phi - fallen.phi < _JUMP * gap:
                    return fallen
                wanted = max(wanted, 0.5 * (fallen.phi + jammed.phi))
            state = self._followed(jammed.packing, jammed.phi - stride * (jammed.phi - wanted))
            if self._at_onset(state):
                return state
            if self._jammed(state):
                fall = root - np.sqrt(state.energy)
                gap = np.sqrt(state.energy) * (jammed.phi - state.phi) / fall if fall > 0 else jammed.phi - state.phi
                jammed, stride = state, 1.0
            elif state.energy < self.protocol["u_contact"]:
                fallen = state
            else:
                stride *= 0.7  # did not converge: come from elsewhere
        raise ConvergenceError(
            f"no jamming onset near phi = {jammed.phi:.8f}: the contact energy per site, {jammed.energy:.2g}, does not "
            f"come down to {self.protocol['u_contact']:g} .. {self.protocol['u_jammed']:g}; try another seed or a "
            "smaller step"
        )

    def _settled(self, start: Packing, phi: float) -> _State:
        self.session.load(at_phi(start, phi))
        tolerance = _SEARCH_TOLERANCE[start.model]
        found = settle(self.session, tolerance, loose=self.protocol["u_jammed"])
        return self._state(Relaxed(found, found.max_force <= tolerance, 0))

    def _followed(self, start: Packing, phi: float) -> _State:
        """The minimum that linear response leads to; a loose state is not relaxed to the end."""
        self.session.load(follow(start, phi))
        if start.model == "dp" and self.relax_state is relax:
            found = settle(self.session, _LOOSE_TOLERANCE)
            if found.contact_energy < self.protocol["u_contact"] * self.session.size:
                return self._state(Relaxed(found, False, 0))
        return self._state(self.relax_state(self.session, near=True))

    def _state(self, found: Relaxed) -> _State:
        reached = self.session.packing()
        if self.progress is not None:
            self.progress("onset", reached.phi)
        return _State(reached, found, found.evaluation.contact_energy / len(reached.positions))

    def _jammed(self, state: _State) -> bool:
        return state.energy > self.protocol["u_jammed"] and state.bears_load

    def _at_onset(self, state: _State) -> bool:
        return self.protocol["u_contact"] <= state.energy <= self.protocol["u_jammed"] and state.found.converged


def _start(
    model: str, n: int, seed: int, protocol: dict[str, float], highest: float, parameters: dict[str, Any]
) -> Packing:
    """Random particles without contacts: disks at phi_start, droplets at `highest` or where their disks jam.

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
    steps = max(0, int(np.ceil((highest - phi) / protocol["step"] - 1e-9)))
    loose: Packing | None = None
    with Session(holders) as session:
        for reached in np.linspace(phi, max(phi, highest), steps + 1):
            session.load(at_phi(loose or holders, holders.phi * reached / phi))
            if relax(session).evaluation.energy > 1e-12 * n:
                break
            loose = session.packing()
    if loose is None:
        raise ConvergenceError(f"droplets could not be placed without overlap at phi = {phi:.3f}: lower phi_start")
    return place_droplets(loose.positions, loose.box, nv, params, seed)
