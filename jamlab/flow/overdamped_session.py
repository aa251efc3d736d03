"""One LAMMPS in which a packing without mass flows: at every instant drag balances the elastic forces.

`fix overdamped` of the plugin finds the velocities, moves disks or vertices, strains the box and chooses the steps; the
decks in.sp.startup, in.sp.oscillate, in.sp.creep and in.dp.startup do the same with the numbers of `parts/flow`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple, Self

import numpy as np

from jamlab.checks import is_number
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, EngineError, InputError
from jamlab.geometry.contact_network import count_pressing
from jamlab.packing.natural_units import unit_scales
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import Damping

LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-9, 0.1
LARGEST_BACKGROUND = 1e3  # beyond, contacts count for nothing beside it
HELPFUL_BACKGROUND = 1e-2  # lets flows go on that find no step; moves the mean stress of disks by less than 3 %
LARGEST_BETA = 1e5  # up to it 24 flows of disks balance energy to the tolerance; at 1e6 all lose 5 % and more
LEAST_STRAIN, LEAST_TIME = 1e-12, 1e-9  # below, what moves is lost in the rounding of positions, 1e-16
_SOFTEST, _STIFFEST = 1e-4, 1e-2  # residual over tolerance: below, steps get no longer; above, they get shorter
_COARSE = 1e-3, 10.0  # tolerance above which the residual grows faster than it, and by how much at most: steps end at
# contacts there, with errors far below it
_LEAST_RESIDUAL = 1e-13  # that rounding leaves
MOST_STEPS = 1e8  # of a run: an hour of eight disks, days of some hundred
_LOOK = 20_000  # steps between two looks at how long they are
_CRAWL = 1e-4  # mean step over that of a smooth flow, below which no run would ever end, and at most
_FINE = 1e-6  # tolerance from which on it shrinks as the root of it, as the shortest step does; `FINE` of the plugin
_SMOOTH = (0.5, 0.02)  # that step: in tau_1, and in strain; `STRAIN` of the plugin
_STABLE = 2.0  # longest step of disks that touch, over the time in which a contact relaxes; of the plugin
_NEIGHBOURS = 12  # among which a disk shares its background drag, at most, in that time
_CODE = re.compile(r"(.*?)\[flow-[a-z]+\] (.*)", re.DOTALL)  # of the plugin: a flow that has no answer


class FlowState(NamedTuple):
    """Numbers of `fix overdamped` at one instant, in its order; stresses are conjugate to the strain. `energy` is
    elastic, `work` and `dissipated` have gone in and out since the start; these and `dissipation`, a rate, are per
    area. `contacts` are those of the plugin, after `drive` and `advance` pairs that press. `iterations` are those of
    all solutions so far, `unsettled` as in `FlowRun`."""

    time: float
    strain: float
    rate: float
    stress: float
    elastic_stress: float
    viscous_stress: float
    pressure: float
    normal_stress_difference: float
    dissipation: float
    energy: float
    work: float
    dissipated: float
    last_iterations: float
    step: float
    iterations: float
    contacts: float
    unsettled: float


_STRESSES = (
    *("stress", "elastic_stress", "viscous_stress", "pressure", "normal_stress_difference"),
    *("dissipation", "energy", "work", "dissipated"),
)
_OF_POSITIONS = ("elastic_stress", "pressure", "normal_stress_difference", "energy")
_COUNTED = ("time", "strain", "work", "dissipated", "iterations", "unsettled")  # from the start


class Length(NamedTuple):
    """How long a flow lasts at least: its time, or until a strain if that comes first; and what makes it shorter."""

    time: float
    shorter: str
    strain: float = np.inf

    def left(self, state: FlowState) -> float:
        """Time that is left at the present rate."""
        strain = max(0.0, self.strain - abs(state.strain))
        return min(self.time - state.time, strain / abs(state.rate) if state.rate else np.inf)

    def too_many(self, steps: float, step: float) -> str:
        """Say that a flow would never end."""
        return (
            f"time {self.time:.3g} takes about {steps:.1g} steps of {step:.2g}; at most {MOST_STEPS:.0g} are taken, to "
            f"time {MOST_STEPS * step:.1g}: give {self.shorter}"
        )


class OverdampedSession:
    """A LAMMPS instance that holds one packing and shears it. `damping`: `ContactDamping` or `StokesDrag`; `tolerance`:
    relative error of velocities that a step may make; the residual of the solver follows; `background`: drag of every
    particle against the affine flow beside contact damping, over k tau_1; `residual`: of the solver of velocities, over
    the driving force; by default `solver_residual`; `length`: of the flow, which is refused if it would never end."""

    def __init__(
        self,
        packing: Packing,
        damping: Damping,
        tolerance: float,
        background: float,
        *,
        residual: float | None = None,
        length: Length | None = None,
    ) -> None:
        check_flowing(damping, tolerance, background)
        if length is not None:
            _refuse_endless(packing, damping, background, length)
        packing.kind.points(packing)  # refuses outlines that cross
        self._given, self._damping, self._tolerance, self._background = packing, damping, tolerance, background
        self._before: FlowState | None = None
        self._start, self._interval = 0.0, np.inf
        self._driven, self._length = False, length
        self._looked: tuple[int, float] = (0, 0.0)  # steps and time of the last look
        given = defaults("flow")
        settings = {name: given[name] for name in ("beta", "alpha", "arms", "short_edge")}
        settings |= {"accuracy": tolerance, "solver": residual or solver_residual(damping, tolerance, background)}
        settings |= {"background": background, "fluid": 0.0}
        settings |= damping.lammps_variables()
        self._outlines = damping.outline_words() if packing.model == "dp" else ""
        self._scales = unit_scales(packing)
        natural = self._scales.to_natural(packing)
        self._session = Session(natural)
        try:
            self._session.set_variables(settings)
            if packing.model == "sp":
                self._take_disk_style()
                self._session.load(natural, anew=True)  # by the other pair style
            else:  # an edge that has shrunk to a point would turn round in each step, and all of its tension with it
                faded = float(given["short_edge"]) * tolerance * float(packing.params["delta"])
                eta = max(float(packing.params["eta"]), faded) / self._scales.length
                self._session.command(f"bond_coeff * ${{gamma}} {eta:.17g}")
            self._session.command("thermo 0")  # sums of energy and virial at every step would cost a part of the time
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _take_disk_style(self) -> None:
        style = "${tau} ${beta} alpha ${alpha} arms ${arms}" if self._damping.at_contacts else "0 0"
        self._session.command(f'variable disk_style string "disk/drag {style}"')

    def close(self) -> None:
        """End LAMMPS and free its memory."""
        self._session.close()

    def drive(self, drive: str, interval: float, *, longest: float = 0.0, before: FlowState | None = None) -> FlowState:
        """Drive the packing from its present state; time and strain count from here. `drive`: "rate value", "oscillate
        amplitude omega" or "stress value", as of `fix overdamped`; a stress as `stress_drive` says it; `interval`: of
        time, after which `advance` returns; `longest`: step, by default no limit but that of the tolerance; `before`:
        last state of an earlier flow, from which time, strain, work and iterations go on instead. Returns the state
        before the first step."""
        if self._driven:
            self._session.command("unfix flow")
        words = drive + self._outlines + (f" longest {longest:.17g}" if longest else "")
        self._before, self._start, self._interval = before, before.time if before else 0.0, interval
        with self._flow_errors():
            self._session.command(
                f"fix flow all overdamped {words} tolerance ${{accuracy}} solver ${{solver}} fluid ${{fluid}} "
                f"background $(v_background*v_tau*v_strength:%.17g) stop {interval:.17g}"
            )
            self._driven = True
            self._session.command("run 0 post no")
        state = self.state()
        self._looked = self.steps(), state.time
        return self._counted(state)

    def stress_drive(self, stress: float) -> str:
        """Say for `drive` that a shear stress, in the unit of the packing, is held."""
        return f"stress {stress / self._scales.stress:.17g}"

    def advance(self, steps: int | None = None) -> FlowState:
        """Go on to the end of the interval, or by so many steps if that comes first."""
        state = self.state()
        end = (np.floor((state.time - self._start) / self._interval + 1e-9) + 1.0) * self._interval + self._start
        while state.time < end * (1 - 1e-12) and (steps is None or steps > 0):
            now = min(_LOOK, _LOOK if steps is None else steps)
            with self._flow_errors():
                self._session.command(f"run {now} post no")
            before, state = state, self.state()
            if steps is not None:
                steps -= now
            if now == _LOOK and state.time < end * (1 - 1e-12):
                self._check_pace(before, state)
            self._check_length(state)
        return self._counted(self._corrected(state) if self._session.kind.deforms else state)

    def _counted(self, state: FlowState) -> FlowState:
        """With the pairs that press; the plugin counts disks that rub without overlap, and vertices of droplets."""
        return state._replace(contacts=float(count_pressing(self._session.strained())))

    def _corrected(self, state: FlowState) -> FlowState:
        """What droplets have at the end of the step: forces of their prediction are those of a moment before."""
        self._session.command("run 0 post no")
        now = self.state()
        elastic = {name: getattr(now, name) for name in _OF_POSITIONS}
        return state._replace(**elastic, stress=now.elastic_stress + state.viscous_stress)

    def _check_pace(self, before: FlowState, state: FlowState) -> None:
        step = (state.time - before.time) / _LOOK
        smooth = _SMOOTH[0] * self._damping.tau
        if state.rate:
            smooth = min(smooth, _SMOOTH[1] / abs(state.rate))
        if step < _CRAWL * smooth * min(1.0, (self._tolerance / _FINE) ** 0.5):
            raise ConvergenceError(
                f"at strain {state.strain:.4g}, rate {state.rate:.3g} contacts leave motion that costs hardly any "
                f"drag, and steps of {step:.1g} lead nowhere: {self._more_background()}a lower rate"
            )

    def _more_background(self) -> str:
        """Name the background drag and one that helps."""
        if not self._damping.at_contacts:
            return "give "
        more = max(HELPFUL_BACKGROUND, 10 * self._background)
        return f"with background = {self._background:g}; give background = {more:g}, or "

    def _check_length(self, state: FlowState) -> None:
        """Look after so many steps, over all rows, whether the flow would end at their pace."""
        steps = self.steps() - self._looked[0]
        if self._length is None or steps < _LOOK:
            return
        step, left = (state.time - self._looked[1]) / steps, self._length.left(state)
        self._looked = self.steps(), state.time
        if left > MOST_STEPS * step:
            many = self._length.too_many(left / step, step)
            raise ConvergenceError(f"at strain {state.strain:.4g}, rate {state.rate:.3g}: {many}")

    def state(self) -> FlowState:
        """Numbers of this instant, those of the fluid of Stokes drag included, Baumgarten & Tighe eq 8."""
        stress = self._scales.stress
        found = FlowState(*map(float, self._session.fix_vector("flow", len(FlowState._fields))))
        found = found._replace(**{name: stress * getattr(found, name) for name in _STRESSES})
        if self._before is None:
            return found
        return found._replace(**{name: getattr(found, name) + getattr(self._before, name) for name in _COUNTED})

    def packing(self) -> Packing:
        """The packing as it is now, in the box as it leans now."""
        now = self._scales.from_natural(self._session.strained())
        # it may lean with a stress from now on, and its sizes are those given, to the last digit
        return self._given.with_state(positions=now.positions, box=now.box, ensemble="fixed-box")

    @contextmanager
    def _flow_errors(self) -> Iterator[None]:
        try:
            yield
        except EngineError as error:
            text = str(error).partition("ERROR: ")[2].partition(" (/")[0].partition("\n")[0] or str(error)
            coded = _CODE.fullmatch(text)
            if coded is None and self._session.is_whole():
                raise
            raise ConvergenceError("".join(coded.groups()) if coded else text) from error

    def steps(self) -> int:
        """Steps taken in this session."""
        return self._session.steps()


def check_flowing(damping: Damping, tolerance: float, background: float) -> None:
    """Refuse what cannot flow in time."""
    if not (is_number(tolerance) and LEAST_TOLERANCE <= tolerance <= LARGEST_TOLERANCE):
        raise InputError(f"tolerance = {tolerance!r}: must lie between {LEAST_TOLERANCE:g} and {LARGEST_TOLERANCE:g}")
    if not (is_number(background) and 0 <= background <= LARGEST_BACKGROUND):
        raise InputError(
            f"background = {background!r}: must be a drag over k tau_1 from 0 to {LARGEST_BACKGROUND:g}, such as 1e-2"
        )
    if damping.at_contacts and damping.contrast > LARGEST_BETA:
        raise InputError(
            f"beta = {damping.contrast:g}: its drag drowns that of approach in rounding, and flow in time takes up to "
            f"{LARGEST_BETA:g}; complex_modulus takes more"
        )
    if background and not damping.at_contacts:
        raise InputError(f"background = {background:g}: Stokes drag is itself a background; leave it out, or raise tau")


def _refuse_endless(packing: Packing, damping: Damping, background: float, length: Length) -> None:
    """Refuse before the start what can be known to take too many steps: disks with linear drag, which touch."""
    drag = 1.0 + background / _NEIGHBOURS if damping.at_contacts else 1.0 / _NEIGHBOURS
    step = _STABLE * damping.tau * drag
    known = packing.model == "sp" and damping.linear() == damping and length.strain == np.inf
    if known and length.time > MOST_STEPS * step and count_pressing(packing):
        raise InputError(length.too_many(length.time / step, step))


def background_drag(packing: Packing, damping: Damping, background: float | None) -> float:
    """Background drag of flow by large strains: what was asked for, or as much as keeps B from being singular."""
    if background is not None:
        return background
    return 0.0 if not damping.at_contacts else float(defaults(f"flow.{packing.model}")["background"])


# Of small strains of a packing at rest: moduli are wanted better than stresses in flow, and need no background
SMALL_STRAIN_TOLERANCE = 1e-3
SMALL_STRAIN_BACKGROUND = float(defaults("flow.rest")["background"])


def solver_residual(damping: Damping, tolerance: float, background: float) -> float:
    """Residual of the velocities over the driving force, so small that its noise stays below the error of a step. A
    residual r leaves errors up to r over the least eigenvalue of B, which is about that of the background."""
    softest = background if damping.at_contacts else 1.0
    least, most = _COARSE
    linear = damping.linear() == damping  # a power law drags most what moves least, and small errors are large there
    looser = min(max(tolerance / least, 1.0), most) if linear else 1.0
    return max(_LEAST_RESIDUAL, tolerance * min(max(softest, _SOFTEST) * looser, _STIFFEST))
