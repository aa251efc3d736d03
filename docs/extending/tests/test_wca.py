"""The law against LAMMPS, its derivatives against differences, and the modulus against a sheared box."""

import jamlab_example.wca
import numpy as np
import pytest

import jamlab
from jamlab.mechanics.stiffness import forces, pressure, stress


@pytest.fixture(scope="module")
def packing() -> jamlab.Packing:
    return jamlab.pack(16, 0.1, seed=1, law="wca", ensemble="shear-stabilized")


def test_slope_and_curvature_are_derivatives() -> None:
    law, s = jamlab_example.wca.Wca("eps", 2.0), np.full(3, 1.2)
    r, h = s - np.array([0.3, 0.1, 1e-3]), 1e-6
    (below, slope_below, _), (above, slope_above, _) = law(s, r - h), law(s, r + h)
    _, slope, curvature = law(s, r)
    assert np.allclose((above - below) / (2 * h), slope, rtol=1e-6, atol=1e-8)
    assert np.allclose((slope_above - slope_below) / (2 * h), curvature, rtol=1e-6)
    assert np.allclose(law(s, s)[:2], 0)  # no energy and no force where the disks just touch


def test_lammps_evaluates_the_same(packing: jamlab.Packing) -> None:
    moved = packing.with_state(positions=packing.positions + 0.01 * np.sin(37 * packing.positions))
    found = jamlab.evaluate(moved)
    assert np.abs(found.forces - forces(moved)).max() < 1e-12 * np.abs(found.forces).max()
    assert np.allclose(found.stress, stress(moved), rtol=1e-12)


def test_modulus_is_that_of_a_strained_box(packing: jamlab.Packing) -> None:
    linear, strained = (jamlab.shear_modulus(packing, method) for method in ("linear-response", "finite-strain"))
    assert packing.converged and 0 < linear == pytest.approx(strained, rel=1e-6)


def test_flow_has_its_forces(packing: jamlab.Packing) -> None:
    run = jamlab.shear(packing, 1e-3, 1e-3, jamlab.StokesDrag(), rows=3)  # a drag without a pressure of its own
    assert run.pressure[-1] == pytest.approx(pressure(run.packing), rel=1e-8)
