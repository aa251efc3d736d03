"""The way to onset that every search takes: up from a loose packing, by ever smaller steps, and down again.

What a state is, and how it is relaxed and judged, is up to the search: packings in LAMMPS, or rigid droplets.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, TypeVar

from jamlab.errors import ConvergenceError

BEARING = 0.01  # largest force over pressure and mean size below which contacts carry a load


@dataclass(frozen=True)
class Decompression:
    """How a decompression comes near onset.

    Halved or doubled, each changes force evaluations by less than 1 % and factorisations by at most 3 %, and loses no
    state, over five sweeps of disks and droplets.
    """

    most: int = 80  # at most
    jump: float = 0.1  # contacts lost within this part of the way to the extrapolated onset are lost in one go
    least_root: float = 0.03  # part of sqrt(U) that remains at least in one decompression
    stride: float = 0.7  # factor of a decompression that did not converge: come from elsewhere
    # jammed states that unjam during decompression, or end on a saddle, until one counts that rests on rattlers
    falls: int = 8
    most_falls: int = 24  # at most: a box that shears may repeat itself for ever


DECOMPRESSION = Decompression()


class Dense(Protocol):
    """What has a packing fraction."""

    @property
    def phi(self) -> float: ...  # nominal


State = TypeVar("State", bound=Dense)


class Approach(Protocol[State]):
    """Steps of phi up to a jammed state and down to onset."""

    protocol: Mapping[str, float]  # numbers of the section `onset` of decks

    def settle(self, start: State, phi: float) -> State: ...  # at another phi, to tell jammed from loose
    def follow(self, start: State, phi: float) -> State: ...  # a jammed one to the end, from where response leads to
    def jammed(self, state: State) -> bool: ...  # whether it bears a load and lies above onset
    def at_end(self, state: State) -> bool: ...  # whether so little contact energy is left that decompression ends
    def fallen(self, state: State) -> bool: ...  # whether a state that is not jammed has lost its contacts
    def root(self, state: State) -> float: ...  # contact energy to the power that makes it grow as phi - phi_J
    def why_loose(self, state: State) -> str: ...  # what the last minimisation ended at, for the error

    def bracket(self, low: State, step: float) -> tuple[State, State]:
        """The last state without contacts and the first jammed one, no more than `step_fine` apart."""
        jammed: State | None = None
        longest = step
        while True:
            near = low.phi >= self.protocol["phi_near"]
            step = min(step, self.protocol["step_near"] if near else longest)
            phi = low.phi + step
            if jammed is not None:
                phi = min(phi, 0.5 * (low.phi + jammed.phi))
            trial = self.settle(low, phi)
            if self.jammed(trial):
                jammed = trial
            else:
                low, step = trial, 2 * step  # short after a fall, it grows again
            if jammed is not None and jammed.phi - low.phi <= self.protocol["step_fine"]:
                return low, jammed
            if low.phi >= 1.0:
                raise ConvergenceError(
                    f"no jammed state up to phi = {low.phi:.3f}: the last minimisation ended at {self.why_loose(trial)}"
                )

    def come_down(self, lowest: float, jammed: State, aim: float) -> tuple[State, float]:
        """Follow a jammed state down to onset.

        The root of the contact energy is extrapolated to zero from two jammed states; the first step goes half way to
        `lowest`, where the packing was not jammed when it was compressed. If all contacts are lost in one go, the loose
        state is returned instead. `aim`: root of the contact energy to end at. Returns the distance to the extrapolated
        onset as well.
        """
        gap, stride = 0.5 * (jammed.phi - lowest), 1.0
        fallen: State | None = None  # not jammed; compressed from below it may have jammed later than it unjams
        for _ in range(DECOMPRESSION.most):
            root = self.root(jammed)
            wanted = jammed.phi - gap * (1 - max(aim / root, DECOMPRESSION.least_root))
            if fallen is not None:
                if jammed.phi - fallen.phi < DECOMPRESSION.jump * gap:
                    return fallen, gap
                wanted = max(wanted, 0.5 * (fallen.phi + jammed.phi))
            state = self.follow(jammed, jammed.phi - stride * (jammed.phi - wanted))
            left = self.root(state)
            moved = jammed.phi - state.phi
            way = left * moved / (root - left) if (root - left) * moved > 0 else abs(moved)
            if self.at_end(state):
                return state, way
            if self.jammed(state):
                jammed, gap, stride = state, way, 1.0
            elif self.fallen(state):
                fallen = state
            else:
                stride *= DECOMPRESSION.stride
        raise ConvergenceError(
            f"no jamming onset near phi = {jammed.phi:.8f}: the contact energy does not decrease to its "
            "value at onset; use another seed or a smaller step"
        )


def fell_too_often(phi: float, falls: int) -> ConvergenceError:
    """The error of a search whose jammed states unjam again and again."""
    return ConvergenceError(
        f"no jamming onset near phi = {phi:.8f}: {falls} jammed states unjammed during decompression "
        "or ended at saddle points; use another seed or a smaller step"
    )
