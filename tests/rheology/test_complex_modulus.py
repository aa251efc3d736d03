"""Solvers of G*(omega) against each other, extended precision, limits, closed forms."""

import warnings
from functools import cache
from typing import get_args

import numpy as np
import pytest
from scipy import linalg

import jamlab
from jamlab import ContactDamping, StokesDrag
from jamlab.arguments.choices import SpectrumMethod
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.mechanics.force_network import force_network
from jamlab.rheology.equation_of_motion import equation_of_motion

OMEGA = np.logspace(-12, 4, 9)
METHODS = get_args(SpectrumMethod)
SOLVERS = METHODS[1:]
LAWS = [
    ContactDamping(beta=1.0),
    ContactDamping(beta=0.0),
    ContactDamping(beta=1e-4),
    ContactDamping(beta=100.0, tau=2.0),
    StokesDrag(eta_f=1.0),
    StokesDrag(eta_f=0.0),
]


@cache
def packed(n, pressure):
    return jamlab.pack(n=n, pressure=pressure, seed=1)


@pytest.fixture(scope="module")
def packings():
    """Disks from deep compression to near onset."""
    return {pressure: packed(32, pressure) for pressure in (1e-2, 1e-4, 1e-6)}


@pytest.fixture(params=[1e-2, 1e-4, 1e-6])
def packing(packings, request):
    return packings[request.param]


def relative(got, wanted):
    """Larger of the relative differences of G' and of G''."""
    return np.maximum(np.abs(got.real / wanted.real - 1), np.abs(got.imag / wanted.imag - 1))


def modulus(s):
    return s.storage + 1j * s.loss


def extended_precision(motion, omega):
    """G* with sums in 64-bit mantissas: the equation of motion solved dense, refined until it is exact. Translation
    costs exactly nothing, neither in K nor in the residual: 1e-19 of a resultant force beside omega = 1e-12 would be a
    drift that costs G'' seven digits."""
    k, b = (m.toarray().astype(np.longdouble) for m in (motion.k, motion.b))
    axes = (0, 1) if motion.drifting else ()
    for axis in axes:
        sums = k[:, axis:-1:2].sum(axis=1)
        places = np.arange(motion.size) // 2 * 2 + axis
        k[np.arange(motion.size), places] -= sums[:-1]
        k[-1, axis:-1:2] -= sums[-1] / (motion.size // 2)
    if axes:
        k[:-1, -1] = k[-1, :-1]
    values = []
    for w in omega:
        m = k + np.clongdouble(1j * w) * b
        factors = linalg.lu_factor(m[:-1, :-1].astype(np.complex128))
        q = np.append(np.zeros(motion.size, dtype=np.clongdouble), 1)
        for _ in range(8):
            elastic = k[:-1] @ q
            for axis in axes:
                elastic[axis::2] -= elastic[axis::2].mean()
            q[:-1] -= linalg.lu_solve(factors, (elastic + np.clongdouble(1j * w) * (b[:-1] @ q)).astype(np.complex128))
        values.append(m[-1] @ q / motion.area)
    return np.array(values)


@pytest.mark.parametrize(
    ("law", "prestress"),
    [
        pytest.param(law, prestress, id=f"{prestress}-{law}", marks=[pytest.mark.slow] * (prestress != (k % 2 == 0)))
        for k, law in enumerate(LAWS)
        for prestress in (True, False)
    ],
)
def test_solvers_are_exact_and_know_their_error(packing, law, prestress):
    """Sixteen decades: G' and G'' to 1e-9; the estimate is never ten times too low, nor useless."""
    exact = extended_precision(equation_of_motion(force_network(packing), law, prestress=prestress), OMEGA)
    for method in SOLVERS:
        s = jamlab.complex_modulus(packing, OMEGA, law, prestress=prestress, method=method)
        error = relative(modulus(s), exact).astype(float)
        assert s.method == method
        assert error.max() < 1e-9
        assert np.all(error < 10 * s.error_bound) and s.error_bound.max() < 1e-8


def eliminated(motion, omega):
    """G* by Gaussian elimination in 64-bit mantissas, largest pivots first: no double takes part."""
    k, b = (m.toarray().astype(np.longdouble) for m in (motion.k, motion.b))
    values = []
    for w in omega:
        m = k + np.clongdouble(1j * w) * b
        for i in range(motion.size):
            pivot = i + np.argmax(np.abs(np.diag(m)[i:-1]))
            m[[i, pivot]] = m[[pivot, i]]
            m[:, [i, pivot]] = m[:, [pivot, i]]
            m[i + 1 :, i + 1 :] -= np.outer(m[i + 1 :, i], m[i, i + 1 :] / m[i, i])
        values.append(m[-1, -1] / motion.area)
    return np.array(values)


@pytest.mark.parametrize(
    ("case", "beta"),
    [
        pytest.param((n, p), beta, marks=() if n == 16 else pytest.mark.slow)
        for n, p in [(16, 1e-2), (16, 1e-6), (64, 1e-2), (64, 1e-6)]
        for beta in [1e-8, 1e-4, 1e2, 1e4, 1e6, 1e8]
    ],
)
def test_estimates_cover_the_error_of_uneven_drag(case, beta):
    """Disks, eighteen decades of frequency, sixteen of beta: 1e-7 at worst by the direct solver."""
    p, omega, law = packed(*case), np.logspace(-10, 8, 7), ContactDamping(beta=beta)
    exact = eliminated(equation_of_motion(force_network(p), law), omega)
    for method in SOLVERS:
        s = jamlab.complex_modulus(p, omega, law, method=method)
        error = relative(modulus(s), exact).astype(float)
        assert np.all(error < s.error_bound)
        assert error.max() < (1e-7 if method == "direct" else 1e-3)


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("prestress", [True, False])
def test_limits(packing, law, prestress):
    """Slow: static modulus and least rotation. Fast: least dissipation; eta_0 > eta_inf."""
    s = jamlab.complex_modulus(packing, [1e-12, 1e9], law, method="reduced", prestress=prestress)
    static = elastic_tensor(packing, prestress=prestress).relaxed[0, 1, 0, 1]
    assert s.storage[0] == pytest.approx(static, rel=1e-8) == s.g0
    assert s.loss[0] == pytest.approx(s.eta0 * 1e-12, rel=1e-8)
    assert s.eta_inf <= s.eta0 * (1 + 1e-8)  # equal, but for rounding, in some small packings
    assert s.spectrum.eta0 == pytest.approx(s.eta0, rel=1e-8)
    if isinstance(law, StokesDrag):  # affine
        assert s.eta_inf == pytest.approx(law.eta_f, rel=1e-12, abs=1e-20)
        affine = elastic_tensor(packing, prestress=prestress).affine[0, 1, 0, 1]
        assert s.storage[1] == pytest.approx(affine, rel=1e-8)
    else:
        assert s.loss[1] == pytest.approx(s.eta_inf * 1e9, rel=1e-8)


@pytest.mark.parametrize("method", SOLVERS)
def test_eq_18_is_exact(packing, method, tau=3.0):
    """Without damping of sliding and pre-stress: G* = G_0 (1 + i omega tau)."""
    s = jamlab.complex_modulus(packing, OMEGA, ContactDamping(beta=0.0, tau=tau), prestress=False, method=method)
    assert s.storage == pytest.approx(s.g0, rel=1e-10)
    assert s.loss == pytest.approx(s.g0 * OMEGA * tau, rel=1e-10)
    assert s.tau_star == pytest.approx(tau, rel=1e-10)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_spectrum_is_positive(packing, law):
    """Every Maxwell element stores and dissipates; their sum is G*."""
    for method in ("dense", "reduced"):
        s = jamlab.complex_modulus(packing, OMEGA, law, method=method)
        assert np.all(s.spectrum.rates > 0) and np.all(s.spectrum.strengths > 0)
        assert np.all(np.diff(s.spectrum.rates) >= 0)
        assert modulus(s) == pytest.approx(s.spectrum.modulus(OMEGA), rel=1e-14)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_droplets(dp_dense, law):
    """B is singular where vertices touch nothing; the solvers agree to 1e-6 or to what their estimates admit."""
    omega = OMEGA[OMEGA <= 10]
    dense, direct, reduced = (jamlab.complex_modulus(dp_dense, omega, law, method=m) for m in SOLVERS)
    for s in (direct, reduced):
        error = np.abs(modulus(s) / modulus(dense) - 1)  # G' of a fixed box may change sign: no error of its own
        assert (
            np.all(error < np.maximum(1e-6, s.error_bound + dense.error_bound))
            and (s.error_bound + dense.error_bound).max() < 1e-3
        )
    assert reduced.storage[0] == pytest.approx(jamlab.shear_modulus(dp_dense, direction="simple"), rel=1e-8)
    assert reduced.loss[0] == pytest.approx(reduced.eta0 * omega[0], rel=1e-8)


def test_droplets_relax_in_their_films(dp_dense):
    """No viscosity is left at infinite frequency under contact damping; under Stokes drag that of the fluid is."""
    film, fluid = (jamlab.complex_modulus(dp_dense, [1e8], law) for law in (LAWS[0], LAWS[4]))
    assert film.eta_inf == 0.0 < film.eta0
    assert fluid.eta_inf == pytest.approx(1.0, rel=1e-12)
    assert fluid.storage[0] == pytest.approx(jamlab.shear_modulus(dp_dense, "affine", direction="simple"), rel=1e-6)
    relaxed, affine = (jamlab.shear_modulus(dp_dense, m, direction="simple") for m in ("linear-response", "affine"))
    assert relaxed < film.storage[0] < affine


@pytest.mark.parametrize("method", METHODS)
def test_unstable_packings_are_refused_with_their_eigenvalue(method):
    """A square crystal in balance that buckles, since every contact pushes."""
    places = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    p = jamlab.Packing("sp", 4 * np.eye(2), places, {"k": 1.0}, "k", np.full(16, 1.1))
    with pytest.raises(jamlab.ConvergenceError, match=r"-0\.\d+"):
        jamlab.complex_modulus(p, [1.0], method=method)


def test_large_packings_are_refused_by_the_dense_solver():
    with pytest.raises(jamlab.InputError, match="2048"):
        jamlab.complex_modulus(jamlab.pack(n=1200, pressure=1e-2, seed=1), [1.0], method="dense")


@pytest.mark.parametrize("method", METHODS)
def test_frequencies_that_overflow_are_refused(packings, method):
    """1e30 is none of them for disks."""
    for omega, named in ((1e-300, "1e-300"), (1e150, r"1e\+150")):
        with pytest.raises(jamlab.InputError, match=named):
            jamlab.complex_modulus(packings[1e-4], [omega], method=method)
    s = jamlab.complex_modulus(packings[1e-4], [1e30], method=method)
    assert s.loss[0] == pytest.approx(1e30 * s.eta_inf, rel=1e-9)


def test_direct_solver_refuses_what_rounding_has_taken(dp_dense):
    """Droplets have ways to flow without drag, which K alone holds: beside 1e30 B it is lost."""
    with pytest.raises(jamlab.ConvergenceError, match=r"omega = 1e\+30"):
        jamlab.complex_modulus(dp_dense, [1.0, 1e30], method="direct")


@pytest.mark.parametrize(
    "call",
    [
        lambda p: jamlab.complex_modulus(p, [1.0]),
        lambda p: jamlab.nonlinear_modulus(p, [1.0], jamlab.ContactDamping(alpha=0.5), stress=1e-5),
        lambda p: jamlab.choose_flow(p, omega=1.0),
    ],
)
def test_a_negative_modulus_is_warned_of_once_and_where_it_was_asked_for(call):
    with pytest.warns(jamlab.JamlabWarning) as warned:
        call(jamlab.pack(n=16, pressure=5e-3, seed=1))
    assert [one.filename for one in warned] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        call(jamlab.pack(n=16, pressure=5e-3, seed=3))
