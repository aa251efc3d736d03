"""Search for jamming onset in one LAMMPS session, by the steps of Boromand et al. or by bisection."""

from dataclasses import dataclass, replace

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import follow
from jamlab.packing.deformation import at_phi
from jamlab.packing.force_laws import disk_law, root_energy
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import Minimizer, Relaxed, relax, settle
from jamlab.protocols.saddles import leave_saddles, rests_on_rattlers
from jamlab.protocols.solver_settings import SolverSettings
from jamlab.protocols.work_done import OnsetWork


@dataclass(frozen=True)
class SearchState:
    """A minimum on the way to onset, and its contact energy per disk or vertex."""

    packing: Packing
    found: Relaxed
    energy: float

    @property
    def phi(self) -> float:
        return self.packing.phi

    def bears_load(self, bearing: float) -> bool:
        """Whether contact forces, of order pressure times particle size, stand far above the force imbalance."""
        state = self.found.evaluation
        return state.max_force < bearing * state.pressure * mean_size(self.packing)

    @property
    def has_backbone(self) -> bool:
        """Whether some particles are held; in tiny boxes a row of two may press on its own images and rattle."""
        try:
            return not contacts(self.packing).loose
        except InputError:  # outlines cross: no minimum yet that could be judged
            return True


@dataclass(frozen=True)
class OnsetSearch:
    """The search for onset in one LAMMPS session."""

    session: Session
    protocol: dict[str, float]
    relax_state: Minimizer
    tolerance: float
    work: OnsetWork
    settings: SolverSettings

    def by_paper(self, packing: Packing, increment: float) -> SearchState:
        """Compress while nothing touches, decompress when compressed too far, halve the increment at every turn."""
        direction = 1.0
        while True:
            self.session.load(at_phi(packing, packing.phi + direction * increment))
            state = self._leave_saddles(self._measure(relax(self.session, self.tolerance, settings=self.settings)))
            if self._at_onset(state):
                return state
            turn = -1.0 if state.energy > self.protocol["u_contact"] else 1.0
            if turn != direction:
                direction, increment = turn, 0.5 * increment
            packing = state.packing
            if increment < self.protocol["increment_least"] or packing.phi >= 1.0:
                raise ConvergenceError(
                    f"no jamming onset near phi = {packing.phi:.8f}: contact energy per site, {state.energy:.2g}, "
                    f"jumps over {self.protocol['u_contact']:g} .. {self.protocol['u_jammed']:g}; try another seed or "
                    "search='bisection'"
                )

    def by_bisection(self, packing: Packing, step: float) -> SearchState:
        """Compress until jammed, by ever smaller steps from the last state without contacts; then decompress."""
        jammed: SearchState | None = None
        longest, falls = step, 0
        while True:
            near = packing.phi >= self.protocol["phi_near"]
            step = min(step, self.protocol["step_near"] if near else longest)
            phi = packing.phi + step
            if jammed is not None:
                phi = min(phi, 0.5 * (packing.phi + jammed.phi))
            trial = self._settle(packing, phi)
            if self._jammed(trial):
                jammed = trial
            else:
                packing, step = trial.packing, 2 * step  # short after a fall, it grows again
            if jammed is not None and jammed.phi - packing.phi <= self.protocol["step_fine"]:
                end = self._stabilize(jammed)
                if self._jammed(end):
                    late = falls >= self.settings.onset.falls
                    end = self._leave_saddles(self._decompress(packing.phi, end), on_rattlers=late)
                if self._at_onset(end):
                    return end
                # it fell apart in one go and found a denser basin, or ended on a saddle: compress what is left
                falls += 1
                packing, jammed, step = end.packing, None, self.protocol["step_fine"]
            if falls > self.settings.onset.most_falls:
                raise ConvergenceError(
                    f"no jamming onset near phi = {packing.phi:.8f}: {falls} jammed states came loose on the way down "
                    "to it, or ended on saddles; try another seed or a smaller step"
                )
            if packing.phi >= 1.0:
                raise ConvergenceError(
                    f"no jammed state up to phi = {packing.phi:.3f}: the last minimisation ended at contact energy "
                    f"{trial.energy:.2g} per site and max force {trial.found.evaluation.max_force:.2g}"
                )

    def _stabilize(self, jammed: SearchState) -> SearchState:
        """The jammed state, relaxed to the end; compressed by growing steps where the shear of the box unjams it."""
        state = self._follow(jammed.packing, jammed.phi)
        step = 0.5 * self.protocol["step_fine"]
        while not self._jammed(state) and state.phi < 1.0 and self.relax_state is not relax:
            self.session.load(at_phi(state.packing, state.phi + step))
            state = self._measure(self._relax())
            step = min(2 * step, self.protocol["step_near"])
        return state

    def _decompress(self, lowest: float, jammed: SearchState) -> SearchState:
        """Follow a jammed state down to the window of contact energy that defines onset.

        The power of U that grows as phi - phi_J (`root_energy`) is extrapolated to zero from two jammed states; the
        first step down goes half way to `lowest`, where the packing was not jammed when it was compressed. If all
        contacts are lost in one go, the loose state is returned instead.
        """
        aim = root_energy(jammed.packing, np.sqrt(self.protocol["u_contact"] * self.protocol["u_jammed"]))
        gap = 0.5 * (jammed.phi - lowest)
        fallen: SearchState | None = None  # not jammed; compressed from below it may have jammed later than it unjams
        stride = 1.0
        for _ in range(self.settings.onset.decompressions):
            root = root_energy(jammed.packing, jammed.energy)
            wanted = jammed.phi - gap * (1 - max(aim / root, self.settings.onset.least_root))
            if fallen is not None:
                if jammed.phi - fallen.phi < self.settings.onset.jump * gap:
                    return fallen
                wanted = max(wanted, 0.5 * (fallen.phi + jammed.phi))
            state = self._follow(jammed.packing, jammed.phi - stride * (jammed.phi - wanted))
            if self._at_onset(state):
                return state
            if self._jammed(state):
                left = root_energy(state.packing, state.energy)
                fall = root - left
                gap = left * (jammed.phi - state.phi) / fall if fall > 0 else jammed.phi - state.phi
                jammed, stride = state, 1.0
            elif state.energy < self.protocol["u_contact"] or not state.has_backbone:
                fallen = state
            else:
                stride *= self.settings.onset.stride  # did not converge: come from elsewhere
        raise ConvergenceError(
            f"no jamming onset near phi = {jammed.phi:.8f}: the contact energy per site, {jammed.energy:.2g}, does not "
            f"come down to {self.protocol['u_contact']:g} .. {self.protocol['u_jammed']:g}; try another seed or a "
            "smaller step"
        )

    def _leave_saddles(self, state: SearchState, on_rattlers: bool = False) -> SearchState:
        """The minimum beside a state at onset, see `jamlab.protocols.saddles`; with `on_rattlers` also a state that is
        none by its Hessian alone."""
        if not self._at_onset(state):
            return state
        found = leave_saddles(self.session, state.found, lambda: self._relax(near=True), self.settings)
        if on_rattlers and found.evaluation.max_force <= found.tolerance and not found.converged:
            found = replace(found, converged=rests_on_rattlers(self.session, self.settings))
        return self._measure(found)

    def _settle(self, start: Packing, phi: float) -> SearchState:
        self.session.load(at_phi(start, phi))
        tolerance = self.tolerance if start.model == "sp" else max(self.tolerance, self.settings.onset.search_tolerance)
        if not self.session.springs:  # softer and softer, loose disks need ever longer to part altogether
            tolerance = max(
                tolerance, disk_law(start).force_at(self.settings.onset.loose_energy * self.protocol["u_contact"])
            )
        found = settle(self.session, tolerance, loose=self.protocol["u_jammed"], settings=self.settings)
        return self._measure(Relaxed(found, tolerance, found.max_force <= tolerance, 0))

    def _follow(self, start: Packing, phi: float) -> SearchState:
        """The minimum that linear response leads to; a loose state is not relaxed to the end."""
        self.session.load(follow(start, phi))
        if start.model == "dp" and self.relax_state is relax:
            found = settle(self.session, self.settings.onset.loose_tolerance, settings=self.settings)
            if found.contact_energy < self.protocol["u_contact"] * self.session.size:
                return self._measure(Relaxed(found, self.settings.onset.loose_tolerance, False, 0))
        return self._measure(self._relax(near=True))

    def _relax(self, near: bool = False) -> Relaxed:
        """A minimum of the ensemble; droplets that shear until they bear no load are not sheared any further."""
        start = self.session.packing()
        sheared = start.model == "dp" and self.relax_state is not relax
        least = self.tolerance / (self.settings.onset.bearing * mean_size(start)) if sheared else 0.0
        return self.relax_state(self.session, self.tolerance, near=near, least_pressure=least, settings=self.settings)

    def _measure(self, found: Relaxed) -> SearchState:
        reached = self.session.packing()
        self.work.reached(reached.phi)
        return SearchState(reached, found, found.evaluation.contact_energy / len(reached.positions))

    def _jammed(self, state: SearchState) -> bool:
        return (
            state.energy > self.protocol["u_jammed"]
            and state.bears_load(self.settings.onset.bearing)
            and state.has_backbone
        )

    def _at_onset(self, state: SearchState) -> bool:
        in_window = self.protocol["u_contact"] <= state.energy <= self.protocol["u_jammed"]
        return in_window and state.found.converged and state.has_backbone
