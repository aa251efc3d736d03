"""Search for jamming onset of packings in one LAMMPS session, by the steps of Boromand et al. or by bisection."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError, typed
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.predicted_motion import follow
from jamlab.packing.deformation import at_phi
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress, told
from jamlab.protocols.approach import BEARING, DECOMPRESSION, Approach, fell_too_often
from jamlab.protocols.box_relaxation import Ensemble
from jamlab.protocols.minimising import Minimising, minimising_of
from jamlab.protocols.relaxation import Relaxed, relax_session, settle
from jamlab.protocols.saddles import leave_saddles

_LOOSE_ENERGY = 0.01  # contact energy over u_contact that forces left in loose disks may hold


@dataclass(frozen=True)
class SearchState:
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
        state = self.found.evaluation
        return state.max_force < BEARING * state.pressure * mean_size(self.packing)

    @property
    def has_backbone(self) -> bool:
        """Whether some particles are held; in tiny boxes a row of two may press on its own images and rattle."""
        try:
            return not contacts(self.packing).unjammed
        except InputError:  # outlines cross: no minimum yet that could be judged
            return True


class OnsetWork:
    """Reports how far a search for jamming onset is. The share of the work that is done is known on the way up, and
    rises; near onset nobody knows it, and the try is told instead. `way`: see `Making`;
    `progress`: where to report to."""

    def __init__(self, way: tuple[tuple[float, ...], tuple[float, ...]], progress: Progress | None) -> None:
        self._way, self._tell = way, told(progress)
        self._highest, self._near = 0.0, False
        self.attempt = 1  # to come down to onset

    def reached(self, phi: float) -> None:
        """Report a minimum at a packing fraction."""
        self._near = self._near or phi <= self._highest
        self._highest = max(self._highest, phi)
        if self._near:
            self._tell(float("nan"), f"near onset, {phi:.4f}, try {self.attempt}")
        else:
            self._tell(float(np.interp(phi, *self._way)), f"onset {phi:.4f}")


@dataclass(frozen=True)
class OnsetSearch(Approach[SearchState]):
    """The search for onset in one LAMMPS session."""

    session: Session
    protocol: Mapping[str, float]
    relax_state: Ensemble
    tolerance: float
    work: OnsetWork

    @property
    def _minimising(self) -> Minimising:
        return minimising_of(self.session.kind.name)

    def by_paper(self, packing: Packing, increment: float) -> SearchState:
        """Compress while nothing touches, decompress when compressed too far, halve the increment at every turn."""
        direction = 1.0
        while True:
            self.session.load(at_phi(packing, packing.phi + direction * increment))
            state = self._leave_saddles(self.measure(relax_session(self.session, self.tolerance)))
            if self.at_end(state):
                return state
            turn = -1.0 if state.energy > self.protocol["u_contact"] else 1.0
            if turn != direction:
                direction, increment = turn, 0.5 * increment
            packing = state.packing
            if increment < self.protocol["increment_least"] or packing.phi >= 1.0:
                raise ConvergenceError(
                    f"no jamming onset near phi = {packing.phi:.8f}: contact energy per site, {state.energy:.2g}, "
                    f"jumps over {self.protocol['u_contact']:g} .. {self.protocol['u_jammed']:g}; try another seed or "
                    + typed("search='bisection'", "--search bisection")
                )

    def by_bisection(self, packing: Packing, step: float) -> SearchState:
        """Compress until jammed, by ever smaller steps from the last state without contacts; then decompress."""
        low = SearchState(packing, Relaxed(self.session.evaluate(), self.tolerance, False), 0.0)
        for falls in range(DECOMPRESSION.most_falls + 1):
            self.work.attempt = falls + 1
            low, jammed = self.bracket(low, step)
            end = self._stabilize(jammed)
            if self.jammed(end):
                aim = packing.law.root_energy(np.sqrt(self.protocol["u_contact"] * self.protocol["u_jammed"]))
                end, _ = self.come_down(low.phi, end, aim)
                end = self._leave_saddles(end, late=falls >= DECOMPRESSION.falls)
            if self.at_end(end):
                return end
            # it fell apart in one go and found a denser minimum, or ended on a saddle: compress what is left
            low, step = end, self.protocol["step_fine"]
        raise fell_too_often(low.phi, DECOMPRESSION.most_falls + 1)

    def _stabilize(self, jammed: SearchState) -> SearchState:
        """The jammed state, relaxed to the end; compressed by growing steps where the shear of the box unjams it."""
        state = self.follow(jammed, jammed.phi)
        step = 0.5 * self.protocol["step_fine"]
        while not self.jammed(state) and state.phi < 1.0 and self.relax_state.may_shear:
            self.session.load(at_phi(state.packing, state.phi + step))
            state = self.measure(self._relax())
            step = min(2 * step, self.protocol["step_near"])
        return state

    def _leave_saddles(self, state: SearchState, late: bool = False) -> SearchState:
        """The minimum beside a state at onset, see `jamlab.protocols.saddles`; after many tries also a state that is
        none by its Hessian alone, since rattlers hold what would slide."""
        if not self.at_end(state):
            return state
        again = partial(self._relax, near=True)
        return self.measure(leave_saddles(self.session, state.found, again, stopped=late))

    def settle(self, start: SearchState, phi: float) -> SearchState:
        """A bounded effort at another packing fraction."""
        self.session.load(at_phi(start.packing, phi))
        tolerance = max(self.tolerance, self._minimising.settled)
        if not self.session.law.springs:  # softer and softer, loose disks need ever longer to part altogether
            loose = self.session.law.force_at(_LOOSE_ENERGY * self.protocol["u_contact"])
            tolerance = max(tolerance, loose)
        found = settle(self.session, tolerance, loose=self.protocol["u_jammed"])
        return self.measure(Relaxed(found, tolerance, found.max_force <= tolerance))

    def follow(self, start: SearchState, phi: float) -> SearchState:
        """The minimum that linear response leads to; a loose state is not relaxed to the end."""
        self.session.load(follow(start.packing, phi))
        if (loose := self._minimising.loose) is not None and not self.relax_state.may_shear:
            found = settle(self.session, loose)
            if found.contact_energy < self.protocol["u_contact"] * self.session.size:
                return self.measure(Relaxed(found, loose, False))
        return self.measure(self._relax(near=True))

    def _relax(self, near: bool = False) -> Relaxed:
        """A minimum of the ensemble; droplets that shear until they bear no load are not sheared any further."""
        start = self.session.packing()
        sheared = self.relax_state.may_shear and not start.kind.compiled_fire
        least = self.tolerance / (BEARING * mean_size(start)) if sheared else -np.inf
        return self.relax_state(self.session, self.tolerance, near=near, least_pressure=least)

    def measure(self, found: Relaxed) -> SearchState:
        """The state that the session holds."""
        reached = self.session.packing()
        self.work.reached(reached.phi)
        return SearchState(reached, found, found.evaluation.contact_energy / len(reached.positions))

    def jammed(self, state: SearchState) -> bool:
        """Whether a state bears a load above the window of contact energy."""
        return state.energy > self.protocol["u_jammed"] and state.bears_load and state.has_backbone

    def at_end(self, state: SearchState) -> bool:
        """Whether a state is at onset."""
        in_window = self.protocol["u_contact"] <= state.energy <= self.protocol["u_jammed"]
        return in_window and state.found.converged and state.has_backbone

    def fallen(self, state: SearchState) -> bool:
        """Whether nothing holds a load."""
        return state.energy < self.protocol["u_contact"] or not state.has_backbone

    def root(self, state: SearchState) -> float:
        """sqrt(U) of springs."""
        return state.packing.law.root_energy(state.energy)

    def why_loose(self, state: SearchState) -> str:
        """Energy and force."""
        return f"contact energy {state.energy:.2g} per site and max force {state.found.evaluation.max_force:.2g}"
