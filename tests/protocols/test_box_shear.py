"""Packings without residual shear stress: stable in every direction, two contacts more, the same area."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.engine.deck_defaults import defaults
from jamlab.packing.deformation import deformed
from jamlab.protocols.box_relaxation import minimizer

ANGLES = np.linspace(0, np.pi, 36, endpoint=False)
STATES = Path(__file__).with_name("states")


def residue(p):
    """Residual shear stress over pressure, as LAMMPS gives them."""
    (xx, xy), (_, yy) = jamlab.evaluate(p).stress
    return np.hypot(0.5 * (xx - yy), xy) / (0.5 * (xx + yy))


ENSEMBLES = ("fixed-box", "shear-stabilized")


@pytest.fixture(scope="module")
def twins():
    """Four random starts, each packed in both ensembles."""
    return [[jamlab.pack(16, 1e-3, seed, ensemble=name) for name in ENSEMBLES] for seed in range(1, 5)]


@pytest.fixture(scope="module", params=[(16, 5), (12, 1)], ids=str)
def onsets(request):
    """One random start at onset in both ensembles; the second has a rattler."""
    n, seed = request.param
    return [jamlab.jam(n, "sp", seed, ensemble=name) for name in ENSEMBLES]


@pytest.fixture(scope="module")
def sheared_once():
    """A packing of a fixed box before and after its box was relaxed; and what the relaxation told."""
    before = jamlab.pack(16, 1e-2, 3)
    with jamlab.Session(before) as session:
        found = minimizer("shear-stabilized")(session, near=True)
        return before, session.packing(), found


def test_box_shear_relaxes_the_shear_stress_at_constant_area(sheared_once):
    """Energy falls, work against pressure is none: the area is the same to rounding; the box is no square any more."""
    before, after, found = sheared_once
    assert residue(before) > 1e-2
    assert found.converged and residue(after) < 1e-8
    assert after.area == pytest.approx(before.area, rel=1e-13)
    assert abs(after.box[1, 0]) + abs(after.box[0, 0] - after.box[1, 1]) > 1e-4
    was, now = jamlab.evaluate(before), jamlab.evaluate(after)
    assert now.energy < was.energy
    assert now.max_force <= 1e-12
    assert np.array_equal(after.diameters, before.diameters)


def test_minimum_is_one_against_finite_shears_of_the_box(sheared_once):
    """Any small shear of the box, sites relaxed, costs A (E C E/2 - p tr(E E)/2), which is positive.

    C is the curvature in the displacement gradient; exp(E) has E E/2 beyond E, which takes back work of the pressure.
    """
    _, p, _ = sheared_once
    state = jamlab.evaluate(p)
    c = jamlab.elastic_tensor(p).relaxed

    def cost(size, axes):
        moved, _ = deformed(p, np.cosh(size) * np.eye(2) + np.sinh(size) * axes)
        with jamlab.Session(moved) as session:
            return session.minimize(5e-13, minimizer="cg", steps=20_000).energy - state.energy

    for angle in np.linspace(0, np.pi, 5, endpoint=False):
        axes = np.array([[np.cos(2 * angle), np.sin(2 * angle)], [np.sin(2 * angle), -np.cos(2 * angle)]])
        both_ways = 0.5 * (cost(1e-5, axes) + cost(-1e-5, axes))  # the cubic part cancels
        quadratic = p.area * 1e-10 * (0.5 * np.einsum("ij,ijkl,kl->", axes, c, axes) - state.pressure)
        assert both_ways == pytest.approx(quadratic, rel=1e-3) and quadratic > 0


def test_packings_in_a_fixed_box_may_have_negative_g_and_their_twins_have_not(twins):
    """Of an ensemble some are unstable in some of 36 directions; no twin of same start and pressure is in any."""
    weakest = np.array([[jamlab.shear_modulus(p, direction=ANGLES).min() for p in pair] for pair in twins])
    assert weakest[:, 0].min() < 0 < weakest[:, 1].min()
    for fixed, stabilized in twins:
        assert residue(fixed) > 1e-2 and residue(stabilized) < 1e-8
        assert fixed.box[1, 0] == 0 and fixed.box[0, 0] == fixed.box[1, 1]
        for p, name in zip((fixed, stabilized), ENSEMBLES, strict=True):
            assert p.ensemble == name and p.converged is True
            e = jamlab.evaluate(p)
            assert e.pressure == pytest.approx(1e-3, rel=1e-6) and e.max_force <= 1e-12


@pytest.mark.slow
def test_two_shears_of_the_box_make_two_contacts_more(onsets):
    """2 N' - 1 balance 2 N' - 2 forces and the pressure; with S_xy = 0 and S_xx = S_yy besides, 2 N' + 1."""
    for p, extra in zip(onsets, (0, 2), strict=True):
        c = jamlab.contacts(p)
        assert c.n_contacts == 2 * c.n_backbone - 1 + extra
    fixed, stabilized = onsets
    assert residue(fixed) > 1e-2 and residue(stabilized) < 1e-8
    assert jamlab.shear_modulus(stabilized, direction=ANGLES).min() > 1e-4  # far above a pressure of 1e-7
    e = jamlab.evaluate(stabilized)
    assert 1e-16 <= e.contact_energy / stabilized.n <= 1e-13 and e.max_force <= 1e-12
    assert stabilized.ensemble == "shear-stabilized" and stabilized.phi_J == stabilized.phi


def test_droplets_on_corners_shear_loose():
    """Their minimum has no Hessian; Newton steps shear it all the same, which takes the contacts of this onset."""
    packing = jamlab.read(STATES / "droplets_on_corners.h5")
    with pytest.raises(jamlab.ConvergenceError):
        jamlab.elastic_tensor(packing)
    assert residue(packing) > 0.1
    touching = float(defaults("onset")["u_contact"]) * len(packing.positions)
    assert jamlab.evaluate(packing).contact_energy > touching
    with jamlab.Session(packing) as session:
        found = minimizer("shear-stabilized")(session)
    assert found.evaluation.contact_energy < 1e-3 * touching
