"""Disks and box relaxed at once: the Newton model beside finite differences, and what the minimum meets."""

import numpy as np
import pytest
from scipy.linalg import expm

import jamlab
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.mechanics.factors import PositiveSolver
from jamlab.packing.box_strains import COMPRESSION, PURE_SHEARS, SHEARS, BoxStrains
from jamlab.packing.deformation import deformed
from jamlab.packing.shear_direction import shear_gradient
from jamlab.protocols.box_relaxation import shear_curvature
from jamlab.protocols.newton_with_box import BOX, EnthalpyModel, descend_with_box
from jamlab.protocols.relaxation import relax_session

ALL = np.concatenate([COMPRESSION, SHEARS])


@pytest.fixture(scope="module", params=["sp", "dp"])
def pushed(request, sp_jammed, dp_dense):
    """A packing away from its minimum, in a box that is no square, with strains of the box and its evaluation."""
    packing = {"sp": sp_jammed, "dp": dp_dense}[request.param]
    rng = np.random.default_rng(0)
    box_strains = BoxStrains(ALL, 0.7 * jamlab.evaluate(packing).pressure)
    push = 1e-3 * rng.standard_normal(packing.positions.shape)
    packing = box_strains.move(packing, push, np.array([-2e-3, 4e-3, 3e-2]))
    return packing, box_strains, jamlab.evaluate(packing)


def test_model_is_that_of_the_enthalpy(pushed):
    """First and second differences of U + p A along a displacement and all three strains."""
    packing, box_strains, state = pushed
    rng = np.random.default_rng(1)
    u, e = rng.standard_normal(packing.positions.shape), np.array([0.3, -0.2, 0.4])
    model, gradient = EnthalpyModel.of(packing, box_strains, state), box_strains.gradient(state.stress, packing.area)
    h = 2e-5

    def enthalpy(t):
        moved = box_strains.move(packing, t * u, t * e)
        return jamlab.evaluate(moved).energy + box_strains.pressure * moved.area

    low, middle, high = (enthalpy(t) for t in (-h, 0.0, h))
    slope = gradient @ e - np.vdot(state.forces, u)
    u = u.ravel()
    bent = u @ (model.sites @ u) + 2 * u @ (model.coupling @ e) + e @ model.strains @ e
    assert (high - low) / (2 * h) == pytest.approx(slope, rel=1e-4)
    assert (high + low - 2 * middle) / h**2 == pytest.approx(bent, rel=1e-3)


def test_step_solves_the_bordered_system(pushed):
    """Beside one dense matrix, where the Schur complement is positive; its pieces are shifted as the step says."""
    packing, box_strains, state = pushed
    model, gradient = EnthalpyModel.of(packing, box_strains, state), box_strains.gradient(state.stress, packing.area)
    sites = model.sites.toarray()
    size = len(sites)
    known = PositiveSolver(), state.forces.ravel(), gradient
    step, shift = model.step(*known, 1e-2)
    held = 0.5 * shift * size * np.eye(3)
    whole = np.block([[sites + shift * np.eye(size), model.coupling], [model.coupling.T, model.strains + held]])
    assert np.linalg.eigvalsh(whole)[0] > 0
    both = np.linalg.solve(whole, np.concatenate([state.forces.ravel(), -gradient]))
    assert np.allclose(np.concatenate([step.u.ravel(), step.e]), both, rtol=0, atol=1e-8 * np.abs(both).max())


def test_newton_steps_end_at_the_minimum(sp_jammed):
    """From the neighborhood of a packing: forces and stress to the last digits, area and shape of the box its own."""
    box_strains = BoxStrains(ALL, 1e-3)
    rng = np.random.default_rng(2)
    near = box_strains.move(sp_jammed, 1e-5 * rng.standard_normal((32, 2)), np.zeros(3))
    with jamlab.Session(near) as session:
        taken = descend_with_box(session, box_strains, 1e-13)
        state = session.evaluate()
    assert 0 < taken < BOX.most
    assert state.max_force <= 1e-13 and box_strains.excess(state.stress) < 1e-14


def test_deformation_is_the_matrix_exponential():
    """Of strains that do not commute, and of equal ones; pure shears are the simple ones without rotation."""
    symmetric = SHEARS + SHEARS.transpose(0, 2, 1)
    assert np.array_equal(symmetric / [[[2]], [[1]]], PURE_SHEARS)
    for strain in ([0.2, 0.1, -0.3], [0.1, 0.0, 0.5], [0.0, 0.0, 0.0]):
        whole = np.einsum("a,aij->ij", strain, ALL)
        assert np.allclose(BoxStrains(ALL).deformation(np.array(strain)), expm(whole), rtol=0, atol=1e-15)


def test_shear_curvature_is_the_second_difference_of_relaxed_energies():
    """Deep in compression, where the pressure takes a part of it that a wrong factor would show."""
    packing, h = jamlab.pack(32, 3e-2, 4), 1e-4
    found = shear_curvature(elastic_tensor(packing).relaxed, jamlab.evaluate(packing).pressure)
    for a, shear in enumerate(PURE_SHEARS):
        energies = []
        for strain in (h, 0.0, -h):
            with jamlab.Session(deformed(packing, shear_gradient(strain * shear))[0]) as session:
                energies.append(relax_session(session).evaluation.energy)
        difference = (energies[0] - 2 * energies[1] + energies[2]) / h**2 / packing.area
        assert found[a, a] == pytest.approx(difference, rel=1e-3)
