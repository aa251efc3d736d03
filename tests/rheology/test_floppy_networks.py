"""G*, its limits and the response to slow shear of networks with floppy modes, against plain numpy."""

from functools import cache
from typing import get_args

import numpy as np
import pytest

import jamlab
from jamlab import ContactDamping, StokesDrag
from jamlab.arguments.choices import SpectrumMethod
from jamlab.mechanics.force_network import force_network
from jamlab.rheology.equation_of_motion import equation_of_motion

METHODS = get_args(SpectrumMethod)
SOLVERS = METHODS[1:]
LAWS = [
    ContactDamping(),
    ContactDamping(beta=1e-3),
    ContactDamping(beta=0.0),
    ContactDamping(beta=30.0, lever_arms="contact"),
    StokesDrag(),
]


@cache
def network(name):
    """Sticky disks that bear no load or hang together by few contacts; springs without stress; flat walls."""
    if name == "floppy":
        return jamlab.pack(32, phi=0.6, seed=1, law={"stickiness": 0.1})
    if name == "loose":
        return jamlab.pack(24, phi=0.7, seed=4, law={"stickiness": 0.1})
    if name == "fixed":
        p = jamlab.pack(24, phi=0.66, seed=3, law={"stickiness": 0.1})
        return p.with_state(fixed=np.arange(24) % 7 == 0, converged=True, max_force=p.max_force)
    if name == "flat":
        return jamlab.relax(jamlab.with_walls(jamlab.pack(24, 1e-2, 1), 1.2, flat=True))
    return jamlab.pack(4, phi=0.7, seed=1, law={"stickiness": 0.1})


def least_drag(p, law):
    """eta0 of a packing by pseudo-inverses: of all responses of least energy, that of least dissipation."""
    motion = equation_of_motion(force_network(p), law)
    k, b, size = motion.k.toarray(), motion.b.toarray(), motion.size
    values, vectors = np.linalg.eigh(k[:size, :size])
    null = vectors[:, values < 1e-11]
    response = -np.linalg.pinv(k[:size, :size], rcond=1e-11, hermitian=True) @ k[:size, -1]
    q = np.append(response, 1.0)
    slopes = null.T @ (b[:size] @ q)
    dragged = null.T @ b[:size, :size] @ null
    q[:size] -= null @ (np.linalg.pinv(dragged, rcond=1e-11, hermitian=True) @ slopes)
    return q @ b @ q / motion.area


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("name", ["floppy", "loose", "fixed", "flat", "four"])
def test_limits_are_those_of_the_spectrum(name, law):
    """eta0 is the least drag, and G''/omega of every solver at 1e-8 of the slowest rate."""
    p = network(name)
    if name == "flat" and law == ContactDamping(beta=0.0):
        return  # refused: nothing drags along the walls
    s = jamlab.complex_modulus(p, 1.0, law)
    rates = s.spectrum.rates
    scale = s.eta_inf + np.sum(s.spectrum.strengths / rates) + 1e-9
    assert s.eta0 == pytest.approx(least_drag(p, law), rel=1e-8, abs=1e-12)
    assert s.spectrum.eta0 == pytest.approx(s.eta0, abs=1e-9 * scale)
    assert len(rates) == 0 or rates[0] > 1e-9  # motion without stiffness is no relaxation
    if not len(rates) or s.eta0 == 0:
        return
    for method in SOLVERS:
        slow = jamlab.complex_modulus(p, 1e-8 * rates[0], law, method=method)
        assert slow.loss / slow.omega == pytest.approx(s.eta0, rel=1e-6)
        assert slow.storage == pytest.approx(s.g0, abs=1e-9)


@pytest.mark.parametrize("law", LAWS[1:], ids=str)
def test_bounds_hold_beside_floppy_modes(law):
    """Elimination with 64-bit mantissas: no trace of drag that a solver adds remains in G*."""
    p, omega = jamlab.pack(12, phi=0.66, seed=3, law={"stickiness": 0.1}), np.array([1e-3, 1e0, 1e3])
    motion = equation_of_motion(force_network(p), law)
    k, b = (m.toarray().astype(np.longdouble) for m in (motion.k, motion.b))
    b += np.diag(np.where(np.arange(motion.size + 1) < motion.size, 1e-18, 0.0))  # of motion that nothing resists
    exact = []
    for w in omega:
        m = k + np.clongdouble(1j * w) * b
        for i in range(motion.size):
            m[i + 1 :, i + 1 :] -= np.outer(m[i + 1 :, i], m[i, i + 1 :] / m[i, i])
        exact.append(m[-1, -1] / motion.area)
    exact = np.array(exact)
    for method in SOLVERS:
        s = jamlab.complex_modulus(p, omega, law, method=method)
        error = np.maximum(abs(s.storage / exact.real - 1), abs(s.loss / exact.imag - 1))
        assert np.all(error < s.error_bound) and s.error_bound.max() < 1e-9


def permuted(p):
    order = np.random.default_rng(2).permutation(p.n)
    again = jamlab.Packing("sp", p.box, p.positions[order], p.params, p.units, p.diameters[order])
    return again.with_state(converged=True, max_force=p.max_force)


@pytest.mark.parametrize("name", ["floppy", "loose"])
def test_order_of_disks_changes_no_answer(name):
    p = network(name)
    other = permuted(p)
    for law in (LAWS[0], LAWS[-1]):
        one, two = (jamlab.complex_modulus(each, [1e-6, 1.0], law) for each in (p, other))
        assert two.eta0 == pytest.approx(one.eta0, rel=1e-9, abs=1e-14)
        assert two.loss == pytest.approx(one.loss, rel=1e-9, abs=1e-18)
    one, two = (jamlab.nonaffine_response(each) for each in (p, other))
    assert two.median_nonaffine == pytest.approx(one.median_nonaffine, rel=1e-8)
    assert np.sort(two.normal) == pytest.approx(np.sort(one.normal), abs=1e-8)


def test_floppy_modes_leave_displacements_as_short_as_can_be():
    """The pseudo-inverse of the Hessian gives the shortest response."""
    p = network("loose")
    backbone = force_network(p)
    k, _ = jamlab.dynamical_matrices(backbone.packing, ContactDamping(beta=0.0))
    sites = 2 * backbone.packing.n
    k = k.toarray()
    shortest = -np.linalg.pinv(k[:sites, :sites], rcond=1e-11, hermitian=True) @ k[:sites, -1]
    found = jamlab.nonaffine_response(p).nonaffine
    assert found.ravel() == pytest.approx(shortest, abs=1e-8 * np.abs(shortest).max())


@pytest.mark.parametrize("law", [ContactDamping(), ContactDamping(beta=0.0)], ids=str)
def test_clusters_that_follow_the_flow_have_no_displacement_per_stress(law):
    """No cluster spans the box: neither energy nor drag resists, and G* is 0."""
    p = jamlab.pack(24, phi=0.66, seed=5, law={"stickiness": 0.05})
    for function in (jamlab.displacement_response, jamlab.displacement_correlation):
        with pytest.raises(jamlab.ConvergenceError, match="bears no shear stress"):
            function(p, 0.1, law)
    with pytest.raises(jamlab.ConvergenceError, match="neither energy nor drag"):
        jamlab.complex_modulus(p, 0.1, law, method="direct")
    with pytest.warns(jamlab.JamlabWarning, match="neither energy nor drag"):
        found = jamlab.complex_modulus(p, 0.1, law)
    assert found.g0 == found.eta0 == 0 and abs(found.storage[0]) + abs(found.loss[0]) < 1e-15
    assert np.isfinite(jamlab.displacement_correlation(p, 0.1, StokesDrag()).correlation).all()
