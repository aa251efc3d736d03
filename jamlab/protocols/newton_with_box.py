"""Newton steps over the sites and the box at once: strains of the box stand in the border of the Hessian.

With displacements u of the sites and amplitudes e of a few homogeneous strains M_a of box and sites, the enthalpy
H = U + p A has at a state with forces F the model

    H(u, e) = H - F u + g e + u K u/2 + u C e + e D e/2,   C_a = K_uE : M_a,   g_a = -A S : M_a + p A tr M_a,

so that one factorisation of K serves both: (D - C' K^-1 C) e = -g - C' K^-1 F and u = K^-1 (F - C e). Eigenvalues of
that Schur complement count by absolute value: a box that is unstable against shear goes downhill as well.

Reference: J. Nocedal & S. J. Wright, Numerical Optimization, sections 4.1 and 16.2; constant pressure by strains of the
cell: M. Parrinello & A. Rahman, J. Appl. Phys. 52, 7182 (1981).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.factors import PositiveSolver
from jamlab.mechanics.stiffness import stiffness
from jamlab.packing.box_strains import BoxStrains
from jamlab.packing.natural_units import mean_size, stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.protocols.descent import load
from jamlab.protocols.newton import NEWTON, factorise

if TYPE_CHECKING:
    from scipy import sparse


@dataclass(frozen=True)
class BoxNewton:
    """Newton steps of sites and box together."""

    most: int = 40  # at most: near a minimum 4 to 20 do; first-order steps come nearer for less
    reach: float = 0.1  # longest move of a coordinate in one step, mean particle size
    # of the Hessian's diagonal; of the strains' times the number of sites; at first, and at most
    first_shift: float = 1e-4
    last_shift: float = 1e3
    searches: int = 6  # lengths tried along one step at most
    slack: float = 0.5  # part of the slope at its start that may be left at the end of a step, uphill
    fallen: float = 0.2  # factor of the largest force that is good enough by itself: slopes lose their digits first
    softest: float = 1e-9  # least curvature over the largest that a strain is divided by
    digits: float = 1e-12  # of unbalanced stress over pressure, at the end
    rounding: float = 3e-16  # of a stress, over the stiffness of a contact


BOX = BoxNewton()

LONGEST_STRAIN = 0.02  # of the box in one step


@dataclass(frozen=True)
class Step:
    """Displacements (n_sites, 2) and strains (m,)."""

    u: Array
    e: Array

    def slope(self, state: Evaluation, gradient: Array) -> float:
        """-dH/dt along the step."""
        return float(np.vdot(state.forces, self.u) - gradient @ self.e)

    def within(self, reach: float, strain: float, part: float = 1.0) -> tuple[Step, float]:
        """A part of the step that moves no coordinate and strains the box no further, and which part that is."""
        limits = ((reach, np.abs(self.u).max()), (strain, np.abs(self.e).max()))
        # of loose disks the box alone moves
        part = min([part, *(most / moved for most, moved in limits if moved > 0)])
        return Step(part * self.u, part * self.e), part


@dataclass(frozen=True)
class EnthalpyModel:
    """Second derivatives at a state: sites, coupling (2 n_sites, m), strains (m, m)."""

    sites: sparse.csc_array
    coupling: Array
    strains: Array

    @classmethod
    def of(cls, packing: Packing, box_strains: BoxStrains, state: Evaluation) -> EnthalpyModel:
        """The model of the enthalpy at a packing."""
        k, m = stiffness(packing), box_strains.strains
        coupling = np.einsum("nij,aij->na", k.ue, m)
        both = np.einsum("aij,bjk->abik", m, m)  # exp(E) = 1 + E + E E/2: the second order works against the stress
        second = 0.5 * (both + both.transpose(1, 0, 2, 3))
        trace = np.einsum("aii->a", m)
        strains = np.einsum("aij,ijkl,bkl->ab", m, k.ee, m) - packing.area * np.einsum(
            "abij,ij->ab", second, state.stress
        )
        return cls(k.uu, coupling, strains + box_strains.pressure * packing.area * np.outer(trace, trace))

    def step(self, solver: PositiveSolver, forces: Array, gradient: Array, shift: float) -> tuple[Step, float]:
        """The Newton step, and the shift with which the Hessian of the sites is positive."""
        shift = factorise(self.sites, shift, solver)
        solution = solver.solve(np.column_stack([forces, self.coupling]))
        free, follow = solution[:, 0], solution[:, 1:]
        held = 0.5 * shift * self.sites.shape[0] * np.eye(len(gradient))
        values, vectors = np.linalg.eigh(self.strains + held - self.coupling.T @ follow)
        values = np.maximum(np.abs(values), BOX.softest * np.abs(values).max())
        e = vectors @ ((vectors.T @ (-gradient - self.coupling.T @ free)) / values)
        return Step((free - follow @ e).reshape(-1, 2), e), shift


def descend_with_box(session: Session, box_strains: BoxStrains, tolerance: float, steps: int = BOX.most) -> int:
    """Take Levenberg-Marquardt steps over sites and box until forces and stress are balanced.

    The length of a step follows from the slope of the enthalpy along it, F u - g e, at its start and end, whose mean is
    the work done: near a minimum enthalpies have no digits left. The shift grows where steps are cut short.

    Args:
        session: is left in the best state reached.
        box_strains: strains that the box may take.
        tolerance: on the largest force.
        steps: factorisations at most.

    Returns:
        The number of steps accepted.
    """
    packing, state = session.packing(), session.evaluate()
    solver, shift, taken = PositiveSolver(session.tally, "Newton steps with the box"), BOX.first_shift, 0
    model: EnthalpyModel | None = None
    size = mean_size(packing)
    for _ in range(steps):
        noise = stress_noise(packing, state)
        at_rest, excess = state.max_force <= tolerance, box_strains.excess(state.stress)
        if (at_rest and excess <= noise) or shift > BOX.last_shift:
            break
        gradient = box_strains.gradient(state.stress, packing.area)
        try:
            model = model or EnthalpyModel.of(packing, box_strains, state)
            whole, shift = model.step(solver, state.forces.ravel(), gradient, shift)
        except (InputError, ConvergenceError):  # nothing touches, or outlines of polygons cross
            break
        step, longest = whole.within(BOX.reach * size, LONGEST_STRAIN)
        found, length = _search(session, box_strains, packing, step, step.slope(state, gradient), state.max_force)
        if found is not None:
            (packing, state), model = found, None
            taken += 1
        elif at_rest and excess <= NEWTON.grow * noise:
            break
        if longest * length > NEWTON.good:
            shift = max(NEWTON.shrink * shift, NEWTON.least_shift)
        elif longest * length < NEWTON.poor:
            shift *= NEWTON.grow
    session.load(packing)
    return taken


def stress_noise(packing: Packing, state: Evaluation) -> float:
    """Unbalanced stress below which a packing counts as balanced: 1e-12 of its load, or what rounding leaves."""
    return max(BOX.digits * load(packing, state), BOX.rounding * stiffness_scale(packing))


def _search(
    session: Session,
    box_strains: BoxStrains,
    packing: Packing,
    step: Step,
    slope: float,
    max_force: float,
) -> tuple[tuple[Packing, Evaluation] | None, float]:
    """A state along the step where the slope has not turned far uphill, None if none is lower, and its part of it."""
    length, best, reached = 1.0, None, 0.0
    for _ in range(BOX.searches if slope > 0 else 0):
        try:
            moved = box_strains.move(packing, length * step.u, length * step.e)
            session.load(moved)
        except InputError:  # a polygon crosses itself
            length *= 0.5
            continue
        trial = session.evaluate()
        after = step.slope(trial, box_strains.gradient(trial.stress, moved.area))
        if slope + after > 0 or trial.max_force < BOX.fallen * max_force:
            best, reached = (moved, trial), length
        if after >= -BOX.slack * slope:
            break
        length *= slope / (slope - after)
    return best, reached
