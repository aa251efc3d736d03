"""Relax packings and their box together: at a pressure, without shear stress, or both.

Compressed in a fixed square box, a small packing keeps a shear stress and may be unstable against shear: its G can be
negative. At a minimum over both shears of the box as well, G is positive in every direction.

Disks: FIRE takes the strains of the box for coordinates beside the positions, so that rearrangements of thousands
of disks cost only its cheap steps; Newton steps with the same strains in the border end the minimisation. Droplets:
Newton steps in the strains alone.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.arguments.choices import Ensemble as EnsembleName
from jamlab.arrays import Array
from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, EngineError, InputError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import linear_response
from jamlab.mechanics.factors import PositiveSolver
from jamlab.mechanics.predicted_motion import follow
from jamlab.packing.area_change import compression
from jamlab.packing.box_strains import COMPRESSION, PURE_SHEARS, SHEARS, BoxStrains
from jamlab.packing.deformation import at_phi, deformed
from jamlab.packing.natural_units import mean_size, stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.packing.shear_direction import shear_gradient
from jamlab.protocols.descent import USUAL, Effort, entangled, load, quench
from jamlab.protocols.newton import NEWTON
from jamlab.protocols.newton_with_box import LONGEST_STRAIN, EnthalpyModel, descend_with_box, stress_noise
from jamlab.protocols.relaxation import Relaxed, relax_session, settle, usual_force_tolerance


@dataclass(frozen=True)
class FreeBox:
    """How a box is set free, and a pressure is met."""

    # largest force over pressure at which a packing at fixed box shows whether anything holds the box
    jammed: float = 1e-2
    noise: float = 1e-6  # the same at which Newton steps take over; started at 1e-4 many fail
    finer: float = 0.1  # its factor where they fail
    # from here on FIRE alone meets a pressure: 40 Newton steps ended at 1e-10 with 32768 disks
    fire_only_disks: int = 10_000
    rounds: int = 12  # of FIRE and Newton steps at most
    near: int = 10  # Newton steps from a guess of the minimum, before anything else
    leave: float = 1e-3  # shear of a box that rests on a saddle, as symmetric packings of few disks do
    balanced: float = 10.0  # unbalanced stress at the end, over that of rounding or of 1e-12 of the pressure
    areas: int = 40  # of a box at a pressure that are tried at most, behind all this
    widest: float = 0.02  # change of the area in one step
    narrowest: float = 1e-9  # the same where outlines cross in wider steps: given up
    held: float = 1e-9  # error of a pressure over the load of the packing, at the end
    # a packing that unjams is compressed until it jams above the pressure, at most so often, each time above so
    # many times the pressure before; by steps that begin at this part of the area or more and double, so many
    # at most
    returns: int = 4
    above: float = 10.0
    least_rise: float = 1e-8
    rises: int = 40
    fall: float = 0.5  # of the pressure of particles that only push, in one step of the area
    lost: float = 0.1  # pressure over the pressure that is held, below which a packing counts as unjammed on the way
    met: float = 1e-7  # error of a pressure over the pressure that is good enough where FIRE has reached it by itself
    # residual shear stress over pressure at the end of the shear of the box around droplets
    stress_tolerance: float = 1e-8
    # factor of the unbalanced stress that is good enough by itself at a pressure, where enthalpies lose their digits
    fallen: float = 0.2
    shift: float = 1e-8  # of the Hessian's diagonal there: droplets that slide have no stiffness of their own
    # factors of the part of a Newton step that is taken, after one downhill and after one uphill
    grow: float = 2.5
    refused: float = 0.25


FREE_BOX = FreeBox()


@dataclass(frozen=True)
class Ensemble:
    """What the box of packings does while they are relaxed; called as `relax_session` is."""

    may_shear: bool = False  # whether the box is relaxed to zero shear stress
    pressure: float | None = None  # at which the area is free; None: the area stays

    @property
    def strains(self) -> Array:
        """(m, 2, 2) strains that the box may take at a pressure."""
        return np.concatenate([COMPRESSION, SHEARS]) if self.may_shear else COMPRESSION

    def __call__(
        self,
        session: Session,
        tolerance: float | None = None,
        *,
        near: bool = False,
        least_pressure: float = -np.inf,
        effort: Effort = USUAL,
    ) -> Relaxed:
        """Minimise the energy over positions, and over both shears of the box at fixed area where it shears; at a
        pressure the enthalpy, over the area as well.

        Disks: FIRE and Newton steps over positions and box at once, see `relax_disks_and_box`. Droplets, whose sites
        are relaxed for little at a fixed box: Newton steps in both strains alone, each with the response of the sites.

        Args:
            session: is left in the minimum; a box that shears is left where contacts were lost, if they are.
            tolerance, near, effort: see `relax_session`.
            least_pressure: give up a packing whose pressure falls below this while its box is sheared; the last digits
                of one that just loses its contacts cost most.

        Returns:
            The state reached. In a box that shears `converged` also means a residual shear stress below 1e-11 of the
            pressure or what rounding leaves; droplets: 1e-8, or as low as the forces left allow, largest force over
            particle size. A packing that unjams has no stress to relax: `converged` then refers to its forces only, and
            its pressure is rounding.
        """
        force = usual_force_tolerance(session.kind.name) if tolerance is None else tolerance
        if self.pressure is not None:
            meet = shear_at_pressure if self.may_shear else relax_at_pressure
            return meet(session, self.pressure, force)
        if not self.may_shear:
            return relax_session(session, force, near=near, effort=effort)
        box_strains = BoxStrains(SHEARS)
        if not session.kind.compiled_fire:
            return _shear_box(session, box_strains, force, near, max(least_pressure, 0.0), effort)
        return relax_disks_and_box(session, box_strains, force, near=near, least_pressure=least_pressure)


_ENSEMBLES: dict[EnsembleName, Ensemble] = {"fixed-box": Ensemble(), "shear-stabilized": Ensemble(may_shear=True)}


def minimizer(ensemble: EnsembleName) -> Ensemble:
    """The ensemble of a name, as of a packing: "fixed-box", compressed without shear, or "shear-stabilized", the box
    relaxed to zero shear stress (Dagois-Bohy et al., Phys. Rev. Lett. 109, 095703 (2012))."""
    return _ENSEMBLES[ensemble]


def _shear_box(
    session: Session,
    box_strains: BoxStrains,
    tolerance: float,
    near: bool,
    least_pressure: float,
    effort: Effort,
    fallen: float = 0.0,
) -> Relaxed:
    """Newton steps in strains of the box around droplets, see `Ensemble`. `fallen`: factor of the unbalanced stress
    that is good enough by itself, where enthalpies have no digits left."""
    size = mean_size(session.packing())
    solver, part = PositiveSolver(session.tally, "Newton steps of the box"), 1.0
    found = relax_session(session, tolerance, near=near, effort=effort)
    for _ in range(effort.box):
        state, packing = found.evaluation, session.packing()
        balanced = box_strains.excess(state.stress) <= _balanced(session, found)
        if not found.converged or state.pressure < least_pressure or balanced:
            return found
        gradient = box_strains.gradient(state.stress, packing.area)
        try:
            model = EnthalpyModel.of(packing, box_strains, state)
            whole, _ = model.step(solver, state.forces.ravel(), gradient, FREE_BOX.shift)
        except (InputError, ConvergenceError):  # outlines cross
            break
        step, _ = whole.within(NEWTON.reach * size, LONGEST_STRAIN, part)
        session.load(moved := box_strains.move(packing, step.u, step.e))
        trial = relax_session(session, tolerance, near=True, effort=effort)
        if trial.evaluation.pressure < least_pressure:
            return trial
        work = -0.5 * (gradient + box_strains.gradient(trial.evaluation.stress, packing.area)) @ step.e
        lower = state.energy - trial.evaluation.energy + box_strains.pressure * (packing.area - moved.area) > 0
        nearer = box_strains.excess(trial.evaluation.stress) < fallen * box_strains.excess(state.stress)
        if trial.converged and (work > 0 or lower or nearer):
            found, part = trial, min(1.0, FREE_BOX.grow * part)
        else:
            session.load(packing)
            part *= FREE_BOX.refused
    return Relaxed(session.evaluate(), tolerance, False)


def relax_disks_and_box(
    session: Session,
    box_strains: BoxStrains,
    tolerance: float,
    *,
    near: bool = False,
    least_pressure: float = -np.inf,
) -> Relaxed:
    """Minimise the energy of disks, or their enthalpy, over their positions and strains of the box.

    Args:
        session: SP; is left in the minimum.
        box_strains: strains that the box may take.
        tolerance: on the largest force.
        near: the state is a good guess of the minimum: try Newton steps before anything else.
        least_pressure: give up a packing whose pressure falls below this; it has unjammed.

    Returns:
        The state reached; `converged` also means that no strain of the box finds stress to relax, to 1e-11 of the
        pressure or to rounding, and that shear costs energy where the box may shear; from `fire_only_disks` on, that a
        pressure alone is met to 1e-7. For an unjammed packing it refers to forces alone.
    """
    if near:
        descend_with_box(session, box_strains, tolerance, FREE_BOX.near)
    state = session.evaluate()
    ended = near and _ends(session.packing(), state, box_strains, tolerance)
    if ended and not (box_strains.may_shear and _leave_saddle(session, state)):
        return _judge(session.packing(), state, box_strains, tolerance)
    floor = max(least_pressure, tolerance / FREE_BOX.jammed)
    state = quench(session, FREE_BOX.jammed, floor=floor)
    if state.pressure < least_pressure or contacts(session.packing()).unjammed:
        return Relaxed(state, tolerance, state.max_force <= tolerance)
    for noise in FREE_BOX.noise * FREE_BOX.finer ** np.arange(FREE_BOX.rounds):
        floor = max(least_pressure, tolerance / noise)
        state = quench(session, noise, floor=floor, box_strains=box_strains, lively=True)
        if state.pressure < least_pressure:
            return Relaxed(state, tolerance, state.max_force <= tolerance)
        borne = load(session, state)
        if state.max_force > noise * max(borne, floor):
            continue  # the packing flows on, slide by slide: still too far for Newton steps
        met = box_strains.excess(state.stress) <= FREE_BOX.met * borne
        if not box_strains.may_shear and met and state.max_force <= tolerance:
            return Relaxed(state, tolerance, True)
        if not box_strains.may_shear and session.size >= FREE_BOX.fire_only_disks:
            continue
        descend_with_box(session, box_strains, tolerance)
        state = session.evaluate()
        ended = _ends(session.packing(), state, box_strains, tolerance)
        if ended and not (box_strains.may_shear and _leave_saddle(session, state)):
            break
    else:
        state = session.evaluate()
    return _judge(session.packing(), state, box_strains, tolerance)


def relax_at_pressure(session: Session, pressure: float, tolerance: float) -> Relaxed:
    """Minimise the enthalpy U + p A over sites and the area of the box, see `compression`.

    Disks first go by `relax_disks_and_box`. What is left, and all of droplets, goes by Newton steps in the area with
    the bulk modulus of linear response; the sites follow by it and are relaxed at each area. A packing that unjams on
    the way is compressed until it jams above the pressure, and comes down from there.

    Args:
        session: near a minimum at best; is left in the state reached.
        pressure: outside.
        tolerance: on the largest force.

    Returns:
        The state reached; `converged` also means that the pressure is met to 1e-9 of its load, or to rounding.
    """
    quick = session.has_kernel
    pushes = pressure > 0 and not session.law.range
    for attempt in range(FREE_BOX.returns + 1):
        if quick:
            relax_disks_and_box(session, BoxStrains(COMPRESSION, pressure), tolerance, near=not attempt)
        found = _meet_by_area(session, pressure, tolerance, least=FREE_BOX.lost * pressure if pushes else -np.inf)
        if found.converged or not pushes or attempt == FREE_BOX.returns:
            break
        if not _jam_above(session, FREE_BOX.above**attempt * pressure):
            break
    return found


def shear_at_pressure(session: Session, pressure: float, tolerance: float) -> Relaxed:
    """Minimise the enthalpy over sites, area and both shears of the box: as `relax_at_pressure`, then by Newton steps
    in all strains, and by the area again, which meets a pressure more closely than these do a shear stress."""
    box_strains = BoxStrains(minimizer("shear-stabilized").strains, pressure)
    for _ in range(FREE_BOX.rounds):
        found = relax_at_pressure(session, pressure, tolerance)
        if not found.converged or BoxStrains(SHEARS).excess(found.evaluation.stress) <= _balanced(session, found):
            return found
        found = _shear_box(session, box_strains, tolerance, True, FREE_BOX.lost * pressure, USUAL, FREE_BOX.fallen)
        if not found.converged:
            return found
    return Relaxed(found.evaluation, tolerance, False)


def _balanced(session: Session, found: Relaxed) -> float:
    """Shear stress around droplets that counts as none: a part of the pressure, or what the forces left may add."""
    size = mean_size(session.packing())
    return max(FREE_BOX.stress_tolerance * found.evaluation.pressure, found.evaluation.max_force / size)


def _meet_by_area(session: Session, pressure: float, tolerance: float, least: float) -> Relaxed:
    """Newton steps in the area, each relaxed; given up below a pressure, where contacts are lost."""
    found, widest = relax_session(session, tolerance, near=True), FREE_BOX.widest
    before: tuple[float, float] | None = None
    for _ in range(FREE_BOX.areas):
        state, packing = found.evaluation, session.packing()
        excess = state.pressure - pressure
        if abs(excess) <= max(FREE_BOX.held * load(packing, state), FREE_BOX.balanced * stress_noise(packing, state)):
            return found
        if state.pressure < least or widest < FREE_BOX.narrowest:
            break
        try:
            session.tally.update(("factorisations", "Newton steps of the area"))
            modulus = compression(packing).modulus(linear_response(packing).relaxed, state.stress)
        except ConvergenceError:  # droplets on corners, or loose: by the last two states
            modulus = 0.0 if before is None else (state.pressure - before[1]) / np.log(before[0] / packing.area)
        if not modulus > 0:
            modulus = stiffness_scale(packing)
        fall = excess if least < 0 else min(excess, FREE_BOX.fall * state.pressure)  # moduli fall near onset
        wider = np.clip(fall / modulus, -widest, widest)
        try:
            session.load(follow(packing, packing.phi * np.exp(-wider)))
            trial = relax_session(session, tolerance, near=True)
            apart = not entangled(session)
        except (EngineError, InputError):  # vertices run together, or outlines cross
            apart = False
        if not apart:
            session.load(packing, anew=True)
            widest = 0.25 * abs(wider)
            continue
        found, before, widest = trial, (packing.area, state.pressure), min(FREE_BOX.widest, 2 * widest)
    return Relaxed(found.evaluation, tolerance, False)


def _jam_above(session: Session, pressure: float) -> bool:
    """Compress a packing by growing steps until it jams above a pressure; False where it does not."""
    rise = max(FREE_BOX.least_rise, pressure / stiffness_scale(session.packing()))
    floor = FREE_BOX.jammed * pressure
    for _ in range(FREE_BOX.rises):
        packing = session.packing()
        try:
            session.load(at_phi(packing, packing.phi * (1 + rise)))
            state = settle(session, floor)
            if state.pressure >= pressure and not contacts(session.packing()).unjammed:
                return True
            rise = min(2 * rise, FREE_BOX.widest)
        except (EngineError, InputError):  # as in `_meet_by_area`
            session.load(packing, anew=True)
            rise *= 0.25
    return False


def _softest_shear(packing: Packing, pressure: float) -> tuple[float, Array] | None:
    """The lowest curvature of the energy in shears of the box, and its strain (2, 2); None where nothing is held."""
    try:
        relaxed = linear_response(packing).relaxed
    except ConvergenceError:
        return None
    values, vectors = np.linalg.eigh(shear_curvature(relaxed, pressure))
    return float(values[0]), np.einsum("a,aij->ij", vectors[:, 0], PURE_SHEARS)


def _leave_saddle(session: Session, state: Evaluation) -> bool:
    """Shear the box a little where that lowers the energy, which a box without shear stress does not find by itself."""
    softest = _softest_shear(session.packing(), state.pressure)
    if softest is None or softest[0] > 0:
        return False
    session.load(deformed(session.packing(), shear_gradient(FREE_BOX.leave * softest[1]))[0])
    return True


def _ends(packing: Packing, state: Evaluation, box_strains: BoxStrains, tolerance: float) -> bool:
    """Whether forces are balanced, and stress as well where anything is held."""
    balanced = box_strains.excess(state.stress) <= FREE_BOX.balanced * stress_noise(packing, state)
    return state.max_force <= tolerance and (balanced or contacts(packing).unjammed)


def _judge(packing: Packing, state: Evaluation, box_strains: BoxStrains, tolerance: float) -> Relaxed:
    """Few contacts that balance by symmetry alone are a saddle, where a shear of the box lowers the energy."""
    minimum = _ends(packing, state, box_strains, tolerance)
    if minimum and box_strains.may_shear and not contacts(packing).unjammed:
        softest = _softest_shear(packing, state.pressure)
        minimum = softest is not None and softest[0] > 0
    return Relaxed(state, tolerance, minimum)


def shear_curvature(relaxed: Array, pressure: float) -> Array:
    """(2, 2) second derivatives of the energy per area in both pure shears of the box at constant area.

    Args:
        relaxed: (2, 2, 2, 2) elastic tensor, `ElasticTensor.relaxed`.
        pressure: exp(E) has E E/2 beyond E, which takes back work of the pressure.
    """
    return np.asarray(np.einsum("aij,ijkl,bkl->ab", PURE_SHEARS, relaxed, PURE_SHEARS) - 2 * pressure * np.eye(2))
