"""Energy terms of random disks and random simple polygons: derivatives, symmetries, plain loops beside them."""

import numpy as np
import pytest
import random_packings
import reference
from hypothesis import assume, given
from hypothesis import strategies as st

from jamlab.laws.rim import CONTACT_FORMS
from jamlab.mechanics.stiffness import energy_terms, forces

STEP = 1e-5


def every_model(test):
    """Run a test for disks and for polygons of each contact form."""
    cases = {"disks": random_packings.disks()} | {form: random_packings.polygons(form) for form in CONTACT_FORMS}
    return pytest.mark.parametrize("strategy", cases.values(), ids=cases.keys())(test)


def moved(packing, shift):
    return packing.with_state(positions=packing.positions + shift)


def sums(packing):
    """Name -> energy, gradient (sites, 2), Hessian (2 sites, 2 sites) of all terms of that name; and who takes part."""
    size, found, sites = 2 * len(packing.positions), {}, []
    for term in energy_terms(packing):
        energy, gradient, hessian = found.get(term.name, (0.0, np.zeros(size), np.zeros((size, size))))
        for k, members in enumerate(term.sites):
            rows = (2 * members[:, None] + [0, 1]).ravel()
            np.add.at(gradient, rows, term.gradient[k].ravel())
            np.add.at(hessian, (rows[:, None], rows), term.hessian[k].reshape(len(rows), -1))
            sites.append((term.name, *members))
        found[term.name] = (energy + term.energy.sum(), gradient, hessian)
    return found, sites


def total(packing):
    return sum(term.energy.sum() for term in energy_terms(packing))


@every_model
@given(data=st.data())
def test_gradient_and_hessian_are_derivatives(strategy, data):
    """Each term along a random direction, unless a contact opens, closes or slides off an edge on the way."""
    packing = data.draw(strategy)
    way = np.random.default_rng(data.draw(random_packings.seeds)).normal(size=packing.positions.shape)
    way /= np.linalg.norm(way)
    (here, sites), (ahead, one), (behind, two) = (sums(moved(packing, h * way)) for h in (0.0, STEP, -STEP))
    assume(sites == one == two)
    for name, (_, gradient, hessian) in here.items():
        slope = (ahead[name][0] - behind[name][0]) / (2 * STEP)
        assert gradient @ way.ravel() == pytest.approx(slope, abs=1e-6 * (1 + np.abs(hessian).max()))
        change = (ahead[name][1] - behind[name][1]) / (2 * STEP)
        np.testing.assert_allclose(hessian @ way.ravel(), change, rtol=0, atol=1e-4 * (1 + np.abs(hessian).max()))
        np.testing.assert_allclose(hessian, hessian.T, rtol=0, atol=1e-12 * (1 + np.abs(hessian).max()))


@every_model
@given(data=st.data())
def test_terms_are_those_of_plain_physics(strategy, data):
    packing = data.draw(strategy)
    wanted = reference.evaluate(packing)
    assert total(packing) == pytest.approx(wanted.energy, rel=1e-11, abs=1e-13)
    np.testing.assert_allclose(forces(packing), wanted.forces, rtol=0, atol=1e-9 * (1 + np.abs(wanted.forces).max()))
