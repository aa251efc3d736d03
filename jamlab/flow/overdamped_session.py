"""One LAMMPS in which a packing flows overdamped: at every instant drag balances the elastic forces.

`fix overdamped` of the plugin finds the velocities, moves disks or vertices, strains the box and chooses the steps; the
decks in.sp.startup, in.sp.oscillate, in.sp.creep and in.dp.startup do the same with the numbers of `parts/flow`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from jamlab.arguments.table import argument
from jamlab.arrays import Array
from jamlab.checks import check_range
from jamlab.engine.agreement import Carried, Comparison, key
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, EngineError, InputError, named
from jamlab.flow.agreement import Evaluated, agrees, compare
from jamlab.flow.flow_run import FLOW_ENERGY
from jamlab.geometry.walls import wall_stress
from jamlab.mechanics.stiffness import energy_terms, forces_of
from jamlab.packing.facts import law_of
from jamlab.packing.lammps_files import types
from jamlab.packing.natural_units import stiffness_scale, unit_scales
from jamlab.packing.packing import Packing
from jamlab.packing.strain_map import shapes_of_stress
from jamlab.registry import EXTENDING
from jamlab.rheology.drag_law import DragLaw, refuse_slip


@dataclass(frozen=True)
class FlowLimits:
    """Limits of flows in time."""

    # up to it 24 flows of disks balance energy to the tolerance; at 1e6 all lose 5 % and more
    largest_beta: float = 1e5


FLOW_LIMITS = FlowLimits()


@dataclass(frozen=True)
class FlowSteps:
    """How long steps of overdamped flow are."""

    # residual over tolerance: below, steps keep their length; above, they get shorter
    kept: float = 1e-4
    shortened: float = 1e-2
    # tolerance above which the residual grows faster than it, and by how much at most: steps end at contacts
    # there, with errors far below it
    coarse: tuple[float, float] = (1e-3, 10.0)
    least_residual: float = 1e-13  # that rounding leaves
    most: float = 1e8  # of a run: an hour of eight disks, days of some hundred
    look: int = 20_000  # steps between two looks at how long they are
    # mean step within a row, in tau_1 and in strain, below which a flow leads nowhere: a smooth one takes 1e4
    # times as long steps at the largest tolerance that is usual, and steps that go as the root of the tolerance
    crawl: tuple[float, float] = (5e-5, 2e-6)
    usual: float = 1e-2


STEPS = FlowSteps()


class FlowState(NamedTuple):
    """Numbers of `fix overdamped` at one instant, in its order; stresses are conjugate to the strain. `energy` is
    elastic, `work` and `dissipated` have gone in and out since the start; these and `dissipation`, a rate, are per
    area. `contacts` come from the plugin, after `drive` and `advance` pairs that press. `iterations` count all
    solutions so far, `ambiguous_contacts` as in `FlowRun`."""

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
    ambiguous_contacts: float
    lower_stress: float  # shear stress and pressure on the lower wall and on the upper one
    lower_pressure: float
    upper_stress: float
    upper_pressure: float
    marginal: float  # pairs of disks whose gap, zero but for an error of the step, does not tell whether they touch


ON_WALLS = ("lower_stress", "lower_pressure", "upper_stress", "upper_pressure")


def _places(*names: str) -> list[int]:
    return [FlowState._fields.index(name) for name in names]


_ON_WALLS = _places(*ON_WALLS)
_STRESSES = _ON_WALLS + _places(
    *("stress", "elastic_stress", "viscous_stress", "pressure", "normal_stress_difference"),
    *("dissipation", "energy", "work", "dissipated"),
)
_COUNTED = _places("time", "strain", "work", "dissipated", "iterations", "ambiguous_contacts")  # from the start


class End(NamedTuple):
    """Where a flow ends at the earliest: at a time, or at a strain if that comes first."""

    time: float
    shorter: str  # what to give for a shorter one
    strain: float = np.inf

    def left(self, state: FlowState) -> float:
        """Time that is left at the present rate."""
        strain = max(0.0, self.strain - abs(state.strain))
        return min(max(0.0, self.time - state.time), strain / abs(state.rate) if state.rate else np.inf)


class OverdampedSession:
    """A LAMMPS instance that holds one packing and shears it. `damping`: a law that the plugin carries; `tolerance`:
    relative error of velocities that a step may make; the residual of the solver follows; `background`: drag of every
    particle against the affine flow beside contact damping, over k tau_1; `residual`: of the solver of velocities, over
    the driving force; by default `solver_residual`; `end`: of the flow, which is given up if it would take too long."""

    def __init__(
        self,
        packing: Packing,
        damping: DragLaw,
        tolerance: float,
        background: float,
        *,
        residual: float | None = None,
        end: End | None = None,
    ) -> None:
        _check_start(packing, damping, tolerance, background)
        self._given, self._damping, self._tolerance, self._background = packing, damping, tolerance, background
        self._before: FlowState | None = None
        self._start, self._interval = 0.0, np.inf
        self._driven, self.end = False, end
        self._looked: tuple[int, float] = (0, 0.0)  # steps and time of the last look
        self._last = FlowState(*np.zeros(len(FlowState._fields)).tolist())  # where `advance` goes on
        given = defaults("flow")
        settings: dict[str, float | str] = {
            name: given[name] for name in ("beta", "alpha", "lever_arms", "even", "short_edge")
        }
        settings |= {"tolerance": tolerance, "solver": residual or solver_residual(damping, tolerance, background)}
        settings |= {"eta_f": 0.0, **carried(damping), "background_drag": background + _own_background(damping)}
        self._scales, self._outlines = unit_scales(packing), ""
        self._starts = True  # no step has been taken
        self._agrees = False  # the plugin with the analysis, as far as this flow has shown
        self._own: dict[str, float] = {}  # parameters that the packing has otherwise
        natural = self._scales.to_natural(packing)
        settings["even"] = float(settings["even"]) * stiffness_scale(natural)
        self._session = Session(natural)
        try:
            self._session.set_variables(settings)
            style = self._set_forces(natural, settings)
            if not natural.frame.all_free:  # the plugin holds them, and needs the forces on them
                self._session.command("unfix fixed")
                self._session.command("unfix on_fixed")
                self._outlines += f" {natural.frame.held_as} fixed"
            sizes = len(set(types(natural).values))  # few are those of types, many are those of disks
            law = repr(natural.law), repr(sorted(law_of(natural).items()))
            self._words = repr(settings), style, self._outlines, natural.model, *law, sizes
            self._forces = Comparison(key("plugin", natural))
            self._between = _between_walls(natural) if natural.frame.has_walls else np.zeros(4)
            self._session.command("thermo 0")  # sums of energy and virial at every step would cost a part of the time
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _set_forces(self, natural: Packing, settings: dict[str, float | str]) -> str:
        """Forces and drag at contacts; the pair style that carries them, of disks."""
        packing, damping = self._given, self._damping
        style, others = "", natural.law.pair_style
        self.forces = others.style if others else ""  # pair style of LAMMPS that moves disks, beside the plugin
        if packing.kind.carrier == "pairs":
            self._session.command(style := disk_style(damping))
            self._session.load(natural, anew=True)  # by the other pair style
        elif settings["lever_arms"] == "none" or settings["even"]:
            raise InputError(
                f"{damping}: the plugin carries the drag law {damping.name!r} for disks alone: between "
                f"{packing.kind.particles} its drag is in proportion to the stiffness of a contact, and rotations "
                "enter; use ContactDamping or StokesDrag"
            )
        else:  # an edge that has shrunk to a point would turn round in each step, and all of its tension with it
            self._outlines = " drag ${tau} ${beta} ${alpha}" if damping.at_contacts else ""
            faded = float(settings["short_edge"]) * self._tolerance * float(packing.params["delta"])
            eta = max(float(packing.params["eta"]), faded) / self._scales.length
            self._session.command(f"bond_coeff * ${{gamma}} {eta:.17g}")
            self._own["eta"] = eta
        return style

    def _compare(self) -> None:
        """Compare the plugin with the laws of the analysis, unless the two were found to agree before."""
        if self._agrees or agrees(self._words):
            self._agrees = True
            return
        now = self._session.strained()
        if self._own:
            now = now.with_state(params={**now.params, **self._own})
        state = FlowState(*map(float, self._session.fix_vector("flow", len(FlowState._fields))))
        numbers = state.energy, state.elastic_stress, state.dissipation, state.rate, state.marginal
        moved = self._session.kind.corrects_flow and not self._starts
        if self._session.kind.carrier != "pairs" and not moved:  # it flows by forces that no stress tells one by one
            self._forces.see(state.energy, lambda: (now, Carried(now.frame.hold(self._session.forces()))))
        found = Evaluated(*numbers, self._session.fix_rows("flow", 3), moved)
        self._agrees = compare(self._words, now, self._damping, self._background, found)

    def close(self) -> None:
        """End LAMMPS and free its memory."""
        self._session.close()

    def drive(self, drive: str, interval: float, *, longest: float = 0.0, before: FlowState | None = None) -> FlowState:
        """Drive the packing from its present state, which is returned; time, strain, work and iterations count from
        here, or from `before`, the last state of an earlier flow. `drive`: "rate value", "oscillate amplitude omega" or
        "stress value", as of `fix overdamped`; a stress as `stress_drive` says it. `interval`: of time, after which
        `advance` returns. `longest`: step, by default limited only by the tolerance."""
        if self._driven:
            self._session.command("unfix flow")
        words = drive + self._outlines + (f" longest {longest:.17g}" if longest else "")
        self._before, self._start, self._interval = before, before.time if before else 0.0, interval
        with self._flow_errors():
            self._session.command(
                f"fix flow all overdamped {words} tolerance ${{tolerance}} solver ${{solver}} stop {interval:.17g} "
                "fluid $(v_eta_f*v_strength:%.17g) background $(v_background_drag*v_tau*v_strength:%.17g)"
            )
            self._driven = True
            self._session.command("run 0 post no")
        self._starts = True
        self._compare()
        self._starts = False
        state = self._last = self.state()
        self._looked = self.steps(), state.time
        return self._counted(state)

    def stress_drive(self, stress: float) -> str:
        """Say for `drive` that a shear stress, in the unit of the packing, is held."""
        return f"stress {stress / self._scales.stress:.17g}"

    def advance(self, steps: int | None = None) -> FlowState:
        """Go on to the end of the interval, or by so many steps if that comes first."""
        state = self._last
        end = (np.floor((state.time - self._start) / self._interval + 1e-9) + 1.0) * self._interval + self._start
        while state.time < end * (1 - 1e-12) and (steps is None or steps > 0):
            now = min(STEPS.look, STEPS.look if steps is None else steps)
            with self._flow_errors():
                self._session.command(f"run {now} post no")
            state = self.state()
            if steps is not None:
                steps -= now
            self._watch(state, within_row=now == STEPS.look and state.time < end * (1 - 1e-12))
        self._last = state
        if self._session.kind.corrects_flow:
            state = self._corrected(state)
        self._compare()
        return self._counted(state)

    def _counted(self, state: FlowState) -> FlowState:
        """With the pairs that press; the plugin counts disks that rub without overlap, and vertices of droplets.
        Between walls with the pressure on them."""
        if self._given.frame.has_walls:
            state = state._replace(pressure=0.5 * (state.lower_pressure + state.upper_pressure))
        now = self._session.strained()
        shapes = now.frame.kept_shapes
        if shapes.any():  # as in `jamlab.mechanics.stiffness.stress`; the plugin squeezes fixed droplets
            push = forces_of(energy_terms(now), len(now.positions))
            less = 0.5 * self._scales.stress * shapes_of_stress(shapes, push) / now.area
            state = state._replace(pressure=state.pressure - less)
        return state._replace(contacts=float(len(now.kind.pairs(now).i)))

    def _corrected(self, state: FlowState) -> FlowState:
        """What droplets have at the end of the step: forces of their prediction are those of a moment before."""
        self._session.command("run 0 post no")
        now = self.state()
        of_positions = ("elastic_stress", "pressure", "normal_stress_difference", "energy")
        elastic = {name: getattr(now, name) for name in of_positions}
        return state._replace(**elastic, stress=now.elastic_stress + state.viscous_stress)

    def _watch(self, state: FlowState, *, within_row: bool) -> None:
        """Give up a flow that would never end: look every so many steps how long they are. `within_row`: whether they
        all lie between two rows, so that no row made them short."""
        taken = self.steps() - self._looked[0]
        if taken < STEPS.look:
            return
        step = (state.time - self._looked[1]) / taken
        self._looked = self.steps(), state.time
        left = self.end.left(state) / step if self.end else 0.0
        smooth = min(STEPS.crawl[0] * self._damping.tau, STEPS.crawl[1] / abs(state.rate) if state.rate else np.inf)
        crawls = within_row and step < smooth * min(1.0, (self._tolerance / STEPS.usual) ** 0.5)
        if not crawls and left <= STEPS.most:
            return
        remedies = [self.end.shorter if self.end else "a lower rate"]
        if crawls and self._damping.at_contacts:
            more = max(FLOW_ENERGY.background, 10 * self._background)
            remedies = [
                f"background_drag = {more:g} (now {self._background:g}) for motion without drag",
                *remedies,
            ]
        many = f"at least {left:.1g} more would be needed, and at most {STEPS.most:.0g} are allowed"
        short = f"a flow without sudden changes takes steps of {smooth:.2g}, so this one would hardly advance"
        raise ConvergenceError(
            f"at time {state.time:.4g}, strain {state.strain:.4g}, rate {state.rate:.3g} steps are {step:.2g} "
            f"long: {many if left > STEPS.most else short}. Use {', or '.join(remedies)}"
        )

    def state(self) -> FlowState:
        """Numbers of this instant, the fluid of Stokes drag included, Baumgarten & Tighe eq 8."""
        found = self._session.fix_vector("flow", len(FlowState._fields))
        found[_ON_WALLS] -= self._between
        found[_STRESSES] *= self._scales.stress
        if self._before is not None:
            found[_COUNTED] += np.array(self._before)[_COUNTED]
        return FlowState(*found.tolist())

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
            code = re.compile(r"(.*?)\[flow-[a-z]+\] (.*)", re.DOTALL)  # of the plugin: a flow that has no answer
            coded = code.fullmatch(text)
            if coded is None and self._session.is_whole():
                raise
            raise ConvergenceError("".join(coded.groups()) if coded else text) from error

    def steps(self) -> int:
        """Steps taken in this session."""
        return self._session.steps()


def _between_walls(packing: Packing) -> Array:
    """(4,) what either wall feels of the other across the edge of the box, as in `ON_WALLS`; it stays."""
    pushes = forces_of(energy_terms(packing), len(packing.positions)) * packing.frame.fixed_sites[:, None]
    upper = packing.positions[:, 1] % packing.box[1, 1] > 0.5 * packing.box[1, 1]
    low, high = pushes[~upper].sum(axis=0), pushes[upper].sum(axis=0)
    total = np.array([low[0], -low[1], -high[0], high[1]]) / packing.box[0, 0]
    return np.asarray(total - wall_stress(packing).ravel())


def check_flow_tolerance(tolerance: float, trajectory_error: bool = False) -> None:
    """Refuse tolerances out of range; with `trajectory_error` a run at a finer one follows."""
    check_range("tolerance", tolerance)
    line = argument("tolerance")
    if trajectory_error and not line.admits(FLOW_ENERGY.finer * tolerance):
        raise InputError(
            f"tolerance = {tolerance:g}: the run beside it, at a tenth of it, needs {line.allowed()}; use a larger one"
        )


# what a drag law says to the plugin
CARRIED = ("tau", "beta", "alpha", "lever_arms", "even", "background_drag", "eta_f")


def disk_style(damping: DragLaw) -> str:
    """Command by which parts/sp takes the pair style of the plugin, which has the drag of disks."""
    words = "${tau} ${beta} alpha ${alpha} arms ${lever_arms} even ${even}" if damping.at_contacts else "0 0"
    return f'variable disk_style string "disk/drag {words}"'


def carried(damping: DragLaw) -> dict[str, float | str]:
    """Variables of `lammps_inputs/parts/flow` by which the plugin carries a drag law."""
    variables = damping.lammps_variables()
    if variables is None:
        raise InputError(
            f"{damping}: the plugin, which simulates flow in time, does not carry the drag law {damping.name!r}; "
            f"jamlab.complex_modulus needs its matrix alone. How a law says that the plugin has it: {EXTENDING}"
        )
    if unknown := variables.keys() - CARRIED:
        raise InputError(
            f"{damping}: lammps_variables has {min(unknown)!r}, which the plugin does not know: it knows "
            f"{', '.join(CARRIED)}, see {EXTENDING}"
        )
    return variables


def _own_background(damping: DragLaw) -> float:
    """Background drag that a law has by itself, over k tau_1."""
    return float(carried(damping).get("background_drag", 0.0))


def check_flowing(damping: DragLaw, tolerance: float, background: float) -> None:
    """Refuse what cannot flow in time."""
    check_flow_tolerance(tolerance)
    carried(damping)
    check_range("background_drag", background)
    if damping.at_contacts and damping.contrast > FLOW_LIMITS.largest_beta:
        raise InputError(
            f"beta = {damping.contrast:g}: too large for flow in time (at most {FLOW_LIMITS.largest_beta:g}), since "
            "normal damping is lost to rounding; use a smaller beta, or complex_modulus"
        )
    if background and not damping.at_contacts:
        raise InputError(
            f"{named('background_drag', background, 'g')}: "
            f"{damping.name} drag is a background drag already; leave it out, or use "
            "a larger tau"
        )


def _check_start(packing: Packing, damping: DragLaw, tolerance: float, background: float) -> None:
    """Refuse a packing that cannot flow."""
    if not packing.kind.carrier:
        packing.kind.lacks("carrier")
    check_flowing(damping, tolerance, background)
    refuse_slip(packing, damping, background)
    packing.kind.points(packing)  # refuses outlines that cross


def default_background(packing: Packing, damping: DragLaw, background: float | None) -> float:
    """Background drag of flow by large strains: what was asked for, or as much as keeps B from being singular."""
    if not packing.kind.carrier:
        packing.kind.lacks("carrier")
    if background is not None:
        return background
    if not damping.at_contacts or _own_background(damping):
        return 0.0
    return float(defaults(f"flow.{packing.model}")["background_drag"])


# Of small strains of a packing at rest: moduli are wanted better than stresses in flow, and need no background
SMALL_STRAIN_TOLERANCE = 1e-3
SMALL_STRAIN_BACKGROUND = float(defaults("flow.rest")["background_drag"])


def solver_residual(damping: DragLaw, tolerance: float, background: float) -> float:
    """Residual of the velocities over the driving force, so small that its noise stays below the error of a step. A
    residual r leaves errors up to r over the least eigenvalue of B, which is about the background drag."""
    softest = background if damping.at_contacts else 1.0
    least, most = STEPS.coarse
    linear = damping.linear() == damping  # a power law drags most what moves least, and small errors are large there
    looser = min(max(tolerance / least, 1.0), most) if linear else 1.0
    return max(STEPS.least_residual, tolerance * min(max(softest, STEPS.kept) * looser, STEPS.shortened))
