"""Relax the shear of the box as well: packings without residual shear stress at fixed area.

Compressed in a fixed square box, a small packing keeps a shear stress and may be unstable against shear: its G can be
negative. At a minimum over both shears of the box as well, G is positive in every direction.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_choice
from jamlab.engine.box_border import SHEARS, BoxStrains
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.factors import PositiveSolver
from jamlab.packing.law_parameters import ENSEMBLES
from jamlab.packing.natural_units import mean_size
from jamlab.protocols.border_newton import LONGEST_STRAIN, Model
from jamlab.protocols.box_relaxation import relax_at_pressure, relax_disks_and_box
from jamlab.protocols.newton import REACH
from jamlab.protocols.relaxation import USUAL, Effort, Relaxed, force_tolerance, relax

# of the shear of the box around droplets
_STRESS_TOLERANCE = 1e-8  # residual shear stress over pressure at the end
_SHIFT = 1e-8  # of the Hessian's diagonal: droplets that slide have no stiffness of their own
# factors of the part of a Newton step that is taken, after one downhill and after one uphill
_GROW, _REFUSED = 2.5, 0.25


@dataclass(frozen=True)
class Ensemble:
    """What the box of packings does while they are relaxed; called as `relax` is."""

    shears: Array  # (m, 2, 2) strains of no area that it takes
    pressure: float | None = None  # at which the area is free, in a box that does not shear; None: the area stays

    @property
    def may_shear(self) -> bool:
        """Whether the box is sheared until no shear stress is left."""
        return len(self.shears) > 0

    def __call__(
        self,
        session: Session,
        tolerance: float | None = None,
        *,
        near: bool = False,
        least_pressure: float = -np.inf,
        effort: Effort = USUAL,
    ) -> Relaxed:
        """Minimise the energy over positions, and over both shears of the box at fixed area where it shears.

        Disks: FIRE and Newton steps over positions and box at once, see `relax_disks_and_box`. Droplets, whose sites
        are relaxed for little at a fixed box: Newton steps in both strains alone, each with the response of the sites.

        Args:
            session: is left in the minimum; a box that shears is left where contacts were lost, if they are.
            tolerance, near, effort: see `relax`.
            least_pressure: give up a packing whose pressure falls below this while its box is sheared; the last digits
                of one that just loses its contacts cost most.

        Returns:
            The state reached. In a box that shears `converged` also means a residual shear stress below 1e-11 of the
            pressure or what rounding leaves; droplets: 1e-8, or as low as the forces left allow, largest force over
            particle size. A packing that unjams has no stress to relax: `converged` then refers to its forces only, and
            its pressure is rounding.
        """
        force = force_tolerance(session.kind.name) if tolerance is None else tolerance
        if self.pressure is not None:
            return relax_at_pressure(session, self.pressure, force)
        if not self.may_shear:
            return relax(session, force, near=near, effort=effort)
        border = BoxStrains(self.shears)
        if session.kind.deforms:
            return _shear_droplets(session, border, force, near, max(least_pressure, 0.0), effort)
        return relax_disks_and_box(session, border, force, near=near, least_pressure=least_pressure)


def minimizer(ensemble: str) -> Ensemble:
    """The ensemble of a name: "fixed-box", compressed without shear, or "shear-stabilized", the box sheared until no
    shear stress is left (Dagois-Bohy et al., Phys. Rev. Lett. 109, 095703 (2012))."""
    check_choice("ensemble", ensemble, ENSEMBLES)
    return Ensemble(SHEARS[:0] if ensemble == "fixed-box" else SHEARS)


def _shear_droplets(
    session: Session, border: BoxStrains, tolerance: float, near: bool, least_pressure: float, effort: Effort
) -> Relaxed:
    size = mean_size(session.packing())
    found, solver, part = relax(session, tolerance, near=near, effort=effort), PositiveSolver(), 1.0
    for _ in range(effort.box):
        state, packing = found.evaluation, session.packing()
        balanced = max(_STRESS_TOLERANCE * state.pressure, state.max_force / size)
        if not found.converged or state.pressure < least_pressure or border.excess(state.stress) <= balanced:
            return found
        gradient = border.gradient(state.stress, packing.area)
        try:
            model = Model.of(packing, border, state)
            whole, _ = model.step(solver, state.forces.ravel(), gradient, _SHIFT)
        except (InputError, ConvergenceError):  # outlines cross
            break
        step, _ = whole.within(REACH * size, LONGEST_STRAIN, part)
        session.load(border.move(packing, step.u, step.e))
        trial = relax(session, tolerance, near=True, effort=effort)
        if trial.evaluation.pressure < least_pressure:
            return trial
        work = -0.5 * (gradient + border.gradient(trial.evaluation.stress, packing.area)) @ step.e
        if trial.converged and (work > 0 or trial.evaluation.energy < state.energy):
            found, part = trial, min(1.0, _GROW * part)
        else:
            session.load(packing)
            part *= _REFUSED
    return Relaxed(session.evaluate(), tolerance, False)
