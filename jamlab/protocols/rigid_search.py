"""Search for the onset of droplets over rigid bodies; the droplets themselves judge its end.

Droplets that do not touch are regular polygons, so the last loose and the first jammed state on the way up are states
of rigid polygons, with three coordinates of each instead of two of every vertex. Rigid polygons are followed down until
they hold a contact energy with which droplets, which are softer than their rims, lie in the window of onset.
"""

from collections.abc import Mapping
from dataclasses import astuple, dataclass, replace
from functools import cached_property

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.rigid_droplets import RigidDroplets
from jamlab.errors import ConvergenceError, InputError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.predicted_motion import follow, unstable_directions
from jamlab.models.droplets import free_tension, vertex_counts
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.protocols.approach import BEARING, DECOMPRESSION, Approach, fell_too_often
from jamlab.protocols.descent import Effort
from jamlab.protocols.descent_of_droplets import DROPLET_STEPS, descend_droplets
from jamlab.protocols.newton import NEWTON
from jamlab.protocols.onset_search import OnsetSearch, SearchState
from jamlab.protocols.preconditioned_lbfgs import FAR, NEAR
from jamlab.protocols.relaxation import Relaxed
from jamlab.protocols.saddles import leave_saddles


@dataclass(frozen=True)
class RigidSteps:
    """Searches for onset over rigid droplets."""

    steps: int = 10_000  # at most, in one relaxation: 1 to 1600 are usual
    # of the Hessian's diagonal, over the stiffness of a contact, eps/delta^2
    first_shift: float = 6e-5
    least_shift: float = 6e-12
    rim: float = 0.2  # longest move of a coordinate in one step, over delta: outlines never jump over each other
    # largest force over that of contacts, to tell jammed from loose, and at the end
    settled: float = 1e-6
    ended: float = 1e-9
    rounding: float = 5e-13  # of forces, over eps/delta
    loose: float = 0.1  # contact energy over u_contact with which a relaxation ends
    balanced: float = 1e-4  # largest force over the largest contact force at the end of a decompression
    stiffness: float = 1.8  # of a droplet against a contact, over its line tension
    softest: float = 1e-3  # the same over that of a rim: with less the droplets themselves are searched
    # contact energy on the way down over that to come down to
    lowest: float = 0.05
    highest: float = 15.0
    # slides along modes that give way at most, length of one, mean particle size, and the part that nothing has
    # to stop
    slides: int = 20
    slide: float = 0.05
    moved: float = 0.2
    # how near in phi a state is the one before, and how often it is judged before the search resumes from
    # denser ones
    same: float = 1e-6
    repeats: int = 2
    # tries at most until a state of droplets is a minimum or unjams, and changes of phi for each
    judgements: int = 8
    corrections: int = 4
    farthest: float = 100.0  # change of the distance to onset at most, in one of them
    gone: float = 1e-22  # contact energy per vertex of droplets from which no extrapolation leads back
    # steps of droplets at most: from rigid ones, after a slide, and where that does not end; of the box around
    # droplets, each with as many of theirs
    droplet_steps: int = 600
    slide_steps: int = 150
    lbfgs_steps: int = 800
    box_steps: int = 12
    # largest force over pressure and mean size with which droplets that slid are worth these steps: with more they
    # have left their contacts
    slid: float = 3.0


RIGID = RigidSteps()


@dataclass(frozen=True)
class RigidSearch(Approach[RigidDroplets]):
    """The search over rigid droplets. `droplets`: the search in the LAMMPS session that holds the droplets."""

    droplets: OnsetSearch
    protocol: Mapping[str, float]

    def run(self, packing: Packing, step: float) -> SearchState:
        """Onset above a loose packing, by steps of phi that begin with `step`."""
        low = RigidDroplets.of(packing)
        seen: list[float] = []  # packing fractions at which contacts appear
        for falls in range(DECOMPRESSION.most_falls + 1):
            self.droplets.work.attempt = falls + 1
            low, jammed = self.bracket(low, step)
            jammed = self._stabilize(jammed)
            low, step = jammed, self.protocol["step_fine"]
            if not self.jammed(jammed):
                continue
            try:
                end, gap = self.come_down(jammed.phi - step, jammed, float(np.sqrt(self._aim)))
            except ConvergenceError:  # the contact energy jumps over the window
                low = self._relax(jammed, jammed.phi + self.protocol["step_near"])
                continue
            if self.at_end(end):
                seen.append(end.phi - gap)
                repeats = sum(abs(seen[-1] - phi) < RIGID.same for phi in seen)
                if repeats > RIGID.repeats:  # it came back: from ever denser ones
                    low = self._relax(end, end.phi + (repeats - 1) * self.protocol["step_near"])
                    continue
                found = self._judge(end, gap, late=falls >= DECOMPRESSION.falls)
                if isinstance(found, SearchState):
                    return found
                end = found
            low = end
        raise fell_too_often(low.phi, DECOMPRESSION.most_falls + 1)

    @property
    def _shears(self) -> bool:
        return self.droplets.relax_state.may_shear

    @cached_property
    def _aim(self) -> float:
        """Contact energy per vertex of rigid droplets whose overlaps droplets would share with their own deformation,
        so that their contacts hold one in the middle of the window of onset."""
        middle = float(np.sqrt(self.protocol["u_contact"] * self.protocol["u_jammed"]))
        return middle * (1 + 1 / stiffness_of_droplets(self.droplets.session.packing())) ** 2

    def _relax(
        self, state: RigidDroplets, phi: float | None = None, *, to_the_end: bool = True, shears: bool | None = None
    ) -> RigidDroplets:
        eps, delta = (float(state.droplets.params[name]) for name in ("eps", "delta"))
        stiffness = eps / delta**2
        # relative to contact forces, absolute; energy at which nothing touches
        largest = (RIGID.ended if to_the_end else RIGID.settled, RIGID.rounding * eps / delta)
        loose = RIGID.loose * self.protocol["u_contact"] * len(state.droplets.positions)
        reach = min(NEWTON.reach, RIGID.rim * delta)  # of a coordinate in one step
        numbers = replace(FAR, reach=reach, least_shift=RIGID.least_shift * stiffness)
        descent = [*largest, loose, *astuple(numbers), RIGID.first_shift * stiffness, NEWTON.definite]
        saddles = RIGID.slides if to_the_end else 0
        found = state.relaxed(
            descent, RIGID.steps, phi=phi, shears=self._shears if shears is None else shears, saddles=saddles
        )
        self.droplets.work.reached(found.phi)
        return found

    def settle(self, start: RigidDroplets, phi: float) -> RigidDroplets:
        """At fixed box, in smaller steps where outlines would cross at once."""
        found = self._relax(start, phi, to_the_end=False, shears=False)
        while found.crossed:
            phi = 0.5 * (start.phi + phi)
            if abs(phi - start.phi) < self.protocol["increment_least"]:
                raise ConvergenceError(
                    f"no jamming onset near phi = {start.phi:.8f}: outlines of droplets cross; try another seed"
                )
            found = self._relax(start, phi, to_the_end=False, shears=False)
        return found

    def follow(self, start: RigidDroplets, phi: float) -> RigidDroplets:
        """In the ensemble of the search."""
        return self._relax(start, phi)

    def jammed(self, state: RigidDroplets) -> bool:
        """Whether some droplets are held by contacts whose forces balance."""
        bearing = BEARING * state.pressure * mean_size(state.droplets)
        if state.crossed or state.energy_per_vertex <= self.protocol["u_jammed"] or state.max_force >= bearing:
            return False
        try:
            return not contacts(state.packing()).unjammed
        except InputError:  # outlines cross
            return False

    def at_end(self, state: RigidDroplets) -> bool:
        """Whether droplets would be near the window of onset."""
        return (
            not state.crossed
            and RIGID.lowest * self._aim <= state.energy_per_vertex <= RIGID.highest * self._aim
            and state.max_force <= RIGID.balanced * state.contact_force
        )

    def fallen(self, state: RigidDroplets) -> bool:
        """Whether too little touches."""
        return not state.crossed and state.energy_per_vertex < RIGID.lowest * self._aim

    def root(self, state: RigidDroplets) -> float:
        """sqrt(U) of springs."""
        return float(np.sqrt(state.energy_per_vertex))

    def why_loose(self, state: RigidDroplets) -> str:
        """Energy and force."""
        crossed = ", where outlines cross" if state.crossed else ""
        return f"contact energy {state.energy_per_vertex:.2g} per vertex and max force {state.max_force:.2g}{crossed}"

    def _stabilize(self, jammed: RigidDroplets) -> RigidDroplets:
        """The jammed state, relaxed to the end; compressed by growing steps where the shear of the box unjams it."""
        state = self._relax(jammed)
        step = 0.5 * self.protocol["step_fine"]
        while self._shears and not self.jammed(state) and state.phi < 1.0:
            state = self._relax(state, state.phi + step)
            step = min(2 * step, self.protocol["step_near"])
        return state

    def _judge(self, end: RigidDroplets, gap: float, late: bool) -> SearchState | RigidDroplets:
        """Onset of droplets beside rigid ones that barely touch; or, where it is none, the rigid state to start from.

        A droplet that slides or rolls is followed along its mode as a rigid body, which costs little, and pushes
        rattlers aside. What cannot be pushed any further holds it: then droplets slide to the contacts that stop them.
        """
        session, stopped = self.droplets.session, late
        unsettled = False  # whether droplets did not come to rest
        for _ in range(RIGID.judgements):
            state = self._as_droplets(end, gap)
            if not self.droplets.at_end(state) and (unsettled or self._stalled(state.found)):
                state = self._relax_at_length()
            if not self.droplets.at_end(state):
                again = self._relax(RigidDroplets.of(state.packing))
                stuck = abs(again.energy - end.energy) < RIGID.same * end.energy
                end = again
                if stuck and unsettled:
                    break
                unsettled = stuck
                continue
            packing = state.packing
            unstable = None if stopped else unstable_directions(packing)
            if unstable is None:  # a minimum, or what was pushed as far as it goes
                left = leave_saddles(session, state.found, self._relax_again, stopped=stopped)
                found = self.droplets.measure(left)
                if self.droplets.at_end(found):
                    return found
                packing = found.packing
                unstable = unstable_directions(packing)
            if unstable is None:
                end = self._relax(RigidDroplets.of(packing))
            else:
                end, stopped = self._followed(packing, unstable[0][0])
            if not self.at_end(end):
                break
        return end

    def _followed(self, packing: Packing, mode: Array) -> tuple[RigidDroplets, bool]:
        """Rigid droplets that moved along a mode, downhill, until others stop them; rattlers are pushed aside. Whether
        they were stopped."""
        state = RigidDroplets.of(packing)
        downhill = np.vdot(self.droplets.session.forces_at(packing.positions)[1], mode)
        length = (RIGID.slide if downhill >= 0 else -RIGID.slide) * mean_size(packing)
        ahead = RigidDroplets.of(packing._trusted(positions=packing.positions + length * mode)).coordinates
        ahead = ahead - state.coordinates
        for _ in range(RIGID.slides):
            moved = self._relax(replace(state, coordinates=state.coordinates + ahead))
            part = np.vdot(moved.coordinates - state.coordinates, ahead) / np.vdot(ahead, ahead)
            state = moved
            if part < RIGID.moved or not self.at_end(state):
                return state, bool(part < RIGID.moved)
        return state, False

    def _as_droplets(self, end: RigidDroplets, gap: float) -> SearchState:
        """Droplets relaxed from rigid ones, compressed or decompressed until they lie in the window of onset."""
        aim = np.sqrt(self.protocol["u_contact"] * self.protocol["u_jammed"])
        self.droplets.session.load(end.packing())
        state = self._relax_droplets(RIGID.droplet_steps)
        for _ in range(RIGID.corrections):
            if self.droplets.at_end(state) or not state.found.converged or state.energy < RIGID.gone:
                break
            factor = float(np.clip(aim / np.sqrt(state.energy), 1 / RIGID.farthest, RIGID.farthest))
            target, gap = state.phi + gap * (factor - 1), gap * factor
            self.droplets.session.load(follow(state.packing, target))
            state = self._relax_droplets(RIGID.droplet_steps)
        return state

    def _relax_at_length(self) -> SearchState:
        """Droplets at greater effort, where steps that converge fast near a minimum do not bring them to rest."""
        effort = Effort(far=RIGID.lbfgs_steps, rounds=1, box=RIGID.box_steps, many=DROPLET_STEPS.many)
        session, tolerance = self.droplets.session, self.droplets.tolerance
        return self.droplets.measure(self.droplets.relax_state(session, tolerance, effort=effort))

    def _relax_again(self) -> Relaxed:
        """After a slide. Beside the usual minimum of 512 droplets and more short steps stall: the search would come
        back to it again and again."""
        found = self._relax_droplets(RIGID.slide_steps).found
        return self._relax_at_length().found if self._stalled(found) else found

    def _stalled(self, found: Relaxed) -> bool:
        """Whether droplets that many steps do not bring to rest are still held by their contacts, and many enough."""
        state = found.evaluation
        pressed = state.pressure * mean_size(self.droplets.session.packing())
        return not (found.converged or self._shears) and state.max_force <= RIGID.slid * pressed

    def _relax_droplets(self, steps: int) -> SearchState:
        """Droplets near a minimum, by a bounded number of steps."""
        session, tolerance = self.droplets.session, self.droplets.tolerance
        if self._shears:
            brief = Effort(near=steps, rounds=0, box=RIGID.box_steps)
            return self.droplets.measure(self.droplets.relax_state(session, tolerance, near=True, effort=brief))
        state = descend_droplets(session, tolerance, NEAR, steps)
        return self.droplets.measure(Relaxed(state, tolerance, state.max_force <= tolerance))


def may_be_rigid(packing: Packing) -> bool:
    """Whether the search over rigid bodies finds onsets of such particles: droplets whose outlines touch, of a tension
    that does not weaken along short edges, and not far softer than their rims."""
    if packing.params.get("contact") != "outline" or packing.params["eta"]:
        return False
    return stiffness_of_droplets(packing) >= RIGID.softest


def stiffness_of_droplets(packing: Packing) -> float:
    """Stiffness of a droplet against a contact over that of its rim, eps/delta^2, which the contact deforms as well."""
    params = packing.params
    droplets = ~packing.flat_walls
    tension = free_tension(vertex_counts(packing)[droplets], {**params, "a0": params["a0"][droplets]})
    return float(RIGID.stiffness * tension * params["delta"] ** 2 / params["eps"])
