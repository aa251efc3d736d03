"""Relax the shear of the box as well: packings without residual shear stress at fixed area.

Compressed in a fixed square box, a small packing keeps a shear stress and may be unstable against shear: its G can be
negative. At a minimum over both shears of the box as well, G is positive in every direction.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_choice
from jamlab.engine.box_border import PURE_SHEARS, SHEARS, BoxStrains
from jamlab.engine.session import Evaluation, Session
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import ElasticTensor, compression_modulus, elastic_tensor, follow_shear
from jamlab.packing.deformation import deformed, shear_gradient
from jamlab.packing.law_parameters import ENSEMBLES
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.protocols.box_relaxation import relax_disks_and_box, shear_curvature
from jamlab.protocols.relaxation import Relaxed, force_tolerance, relax
from jamlab.protocols.solver_settings import SOLVERS, BoxShearSettings, SolverSettings


@dataclass(frozen=True)
class Ensemble:
    """What the box of packings does while they are relaxed at a packing fraction; called as `relax` is."""

    shears: Array  # (m, 2, 2) strains of no area that it takes

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
        settings: SolverSettings = SOLVERS,
    ) -> Relaxed:
        """Relax the packing in a session; one that shears is given up where its pressure falls below the least."""
        if not self.may_shear:
            return relax(session, tolerance, near=near, settings=settings)
        return relax_with_box_shear(session, tolerance, near=near, least_pressure=least_pressure, settings=settings)


def minimizer(ensemble: str) -> Ensemble:
    """The ensemble of a name: "fixed-box", compressed without shear, or "shear-stabilized", the box sheared until no
    shear stress is left (Dagois-Bohy et al., Phys. Rev. Lett. 109, 095703 (2012))."""
    check_choice("ensemble", ensemble, ENSEMBLES)
    return Ensemble(SHEARS[:0] if ensemble == "fixed-box" else SHEARS)


def shear_stress(state: Evaluation) -> float:
    """Residual shear stress, sqrt(((S_xx - S_yy)/2)^2 + S_xy^2): its largest value over all directions."""
    return float(np.hypot(0.5 * (state.stress[0, 0] - state.stress[1, 1]), state.stress[0, 1]))


def relax_with_box_shear(
    session: Session,
    tolerance: float | None = None,
    *,
    near: bool = False,
    least_pressure: float = -np.inf,
    settings: SolverSettings = SOLVERS,
) -> Relaxed:
    """Minimise the energy over positions and over both shears of the box, at fixed area.

    Disks: FIRE and Newton steps over positions and box at once, see `relax_disks_and_box`. Droplets, which may rest on
    corners, where a minimum has no Hessian: Newton steps in the two shear strains alone, eigenvalues of the 2 x 2
    curvature taken by absolute value, with a trust radius; the sites follow by linear response and are relaxed at each
    new box. The work of the shear stress along the step stands for the fall of the energy, which has no digits left
    near the end.

    Args:
        session: is left in the minimum; without contacts it is left where contacts were lost.
        tolerance: see `relax`.
        near: see `relax`.
        least_pressure: give up a packing whose pressure falls below this on the way; the last digits of one that just
            loses its contacts cost most.
        settings: settings of the solvers.

    Returns:
        The state reached; `converged` also means a residual shear stress below 1e-11 of the pressure or what rounding
        leaves; droplets: 1e-8, or as low as the forces left allow, largest force over particle size. A packing that
        unjams has no stress to relax: `converged` then refers to its forces only, and its pressure is rounding.
    """
    if not session.kind.deforms:
        force = force_tolerance(session.kind.name) if tolerance is None else tolerance
        return relax_disks_and_box(
            session, BoxStrains(SHEARS), force, near=near, least_pressure=least_pressure, settings=settings
        )
    return _shear_droplets(session, tolerance, near, max(least_pressure, 0.0), settings)


def _shear_droplets(
    session: Session, tolerance: float | None, near: bool, least_pressure: float, settings: SolverSettings
) -> Relaxed:
    numbers = settings.box_shear
    found = relax(session, tolerance, near=near, settings=settings)
    radius = curvature = None
    last = np.inf
    for _ in range(numbers.steps):
        state, packing = found.evaluation, session.packing()
        if (
            _settled(state, packing, last, numbers.stress_tolerance)
            or not found.converged
            or state.pressure < least_pressure
        ):
            return found
        tensor = _tensor(packing)
        if tensor is not None:
            curvature = shear_curvature(tensor.relaxed, state.pressure)
            stiffness = compression_modulus(tensor.relaxed, state.pressure)
        elif contacts(packing).unjammed:
            return found  # nothing is held, so there is no stress to relax
        elif curvature is None:
            stiffness = numbers.first_curvature * packing.params["eps"]
            curvature = stiffness * np.eye(2)
        work = shear_work(state)
        if radius is None:
            radius = numbers.reach * state.pressure / stiffness
        step, length = _step(work, curvature, radius, numbers)
        session.load(follow_box(packing, np.einsum("a,aij->ij", step, PURE_SHEARS), tensor))
        trial = relax(session, tolerance, near=True, settings=settings)
        gained = 0.5 * (work + shear_work(trial.evaluation)) @ step
        predicted = work @ step - 0.5 * step @ curvature @ step
        curvature = _secant(curvature, step, work - shear_work(trial.evaluation), numbers.softest)
        if trial.evaluation.pressure < least_pressure:
            return trial
        last = shear_stress(state)
        if trial.converged and (gained > 0 or trial.evaluation.energy < state.energy):
            found = trial
            if gained > numbers.good * predicted:
                radius *= numbers.grow
            elif gained < numbers.poor * predicted:
                radius *= numbers.shrink
        else:
            session.load(packing)
            radius = numbers.refused * min(radius, length)
    return Relaxed(session.evaluate(), found.tolerance, False)


def _settled(state: Evaluation, packing: Packing, last: float, stress_tolerance: float) -> bool:
    """Whether no shear stress is left, or what is left falls no further in the noise of forces that end at 1e-10."""
    stress = shear_stress(state)
    noise = state.max_force / mean_size(packing)
    return stress <= stress_tolerance * state.pressure or last <= stress <= noise


def _tensor(packing: Packing) -> ElasticTensor | None:
    """Linear response; None where droplets rest on corners, where a minimum has no Hessian, or nothing is held."""
    try:
        return elastic_tensor(packing)
    except ConvergenceError:
        return None


def shear_work(state: Evaluation) -> Array:
    """(2,) stress conjugate to either shear, per area."""
    return np.asarray(np.einsum("aij,ij->a", PURE_SHEARS, state.stress))


def _step(work: Array, curvature: Array, radius: float, numbers: BoxShearSettings) -> tuple[Array, float]:
    """(2,) Newton step within the trust radius, and the length it would have without."""
    values, vectors = np.linalg.eigh(curvature)
    step = vectors @ ((vectors.T @ work) / np.maximum(np.abs(values), numbers.softest * np.abs(values).max()))
    length = float(np.hypot(*step))
    return step * min(1.0, min(radius, numbers.longest_strain) / length), length


def _secant(curvature: Array, step: Array, fall: Array, softest: float) -> Array:
    """Curvature that explains the fall of the stress along the step: symmetric update of rank one."""
    missed = fall - curvature @ step
    along = missed @ step
    if abs(along) <= softest * np.hypot(*missed) * np.hypot(*step):
        return curvature
    return np.asarray(curvature + np.outer(missed, missed) / along)


def follow_box(packing: Packing, strain: Array, tensor: ElasticTensor | None) -> Packing:
    """The packing in the sheared box: sites by linear response, or affinely where there is none."""
    return deformed(packing, shear_gradient(strain))[0] if tensor is None else follow_shear(packing, strain, tensor)
