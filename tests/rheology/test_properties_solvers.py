"""Solvers of G*(omega) on random matrices: reduced, dense, direct and plain numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

from jamlab.rheology.equation_of_motion import EquationOfMotion
from jamlab.rheology.reduced_model import reduce
from jamlab.rheology.relaxation_spectrum import build_spectrum, find_all_modes
from jamlab.rheology.rounding_error import solve_frequency
from jamlab.rheology.slow_and_fast_limits import find_limits

OMEGA = np.logspace(-4, 4, 9)


@st.composite
def motions(draw):
    """K positive definite, B semi-definite of any rank, a strain that couples to both; no rotations."""
    size = draw(st.integers(1, 12))
    rank = draw(st.integers(1, size + 1))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    stiff = rng.normal(size=(size + 1, 2 * size + 2)) * np.logspace(0, draw(st.floats(-1.5, 0)), size + 1)[:, None]
    slip = rng.normal(size=(size + 1, rank))
    k, b = (sparse.csc_array(root @ root.T) for root in (stiff, slip))
    return EquationOfMotion(
        k_qq=k[:-1][:, :-1].tocsc(),
        b_qq=b[:-1][:, :-1].tocsc(),
        k_qg=k[:-1][:, [-1]].toarray()[:, 0],
        b_qg=b[:-1][:, [-1]].toarray()[:, 0],
        k_gg=float(k[-1, -1]),
        b_gg=float(b[-1, -1]),
        moving=size,
        drifting=False,
        area=draw(st.floats(0.5, 10.0)),
    )


def plain(motion, omega):
    """G* by elimination of everything but the strain."""
    m = motion.k.toarray() + 1j * omega * motion.b.toarray()
    return (m[-1, -1] - m[-1, :-1] @ np.linalg.solve(m[:-1, :-1], m[:-1, -1])) / motion.area


@given(motions())
def test_reduced_is_dense_is_direct(motion):
    wanted = np.array([plain(motion, w) for w in OMEGA])
    ends = find_limits(motion)
    dense = build_spectrum(find_all_modes(motion, ends)[0], ends, motion.area).modulus(OMEGA)
    reduced = reduce(motion, ends, OMEGA).spectrum.modulus(OMEGA)
    direct = np.array([solve_frequency(motion, w)[1] for w in OMEGA])
    for got in (dense, reduced, direct):
        np.testing.assert_allclose(np.abs(got - wanted) / np.abs(wanted), 0, atol=1e-8)


@given(motions())
def test_limits_bound_every_modulus(motion):
    """G' rises from G_0; G''/omega falls from eta_0 to eta_inf."""
    ends = find_limits(motion)
    model = build_spectrum(find_all_modes(motion, ends)[0], ends, motion.area)
    found = model.modulus(OMEGA)
    k, b = motion.k.toarray(), motion.b.toarray()
    slow = np.append(-np.linalg.solve(k[:-1, :-1], k[:-1, -1]), 1.0)
    assert ends.g0 == pytest.approx(slow @ k @ slow / motion.area, rel=1e-9)
    assert ends.eta0 == pytest.approx(slow @ b @ slow / motion.area, rel=1e-8)
    assert model.eta0 == pytest.approx(ends.eta0, rel=1e-7)
    assert np.all(np.diff(found.real) > -1e-9 * found.real[1:]) and found.real[0] >= ends.g0 * (1 - 1e-9)
    assert np.all(np.diff(found.imag / OMEGA) < 1e-9 * ends.eta0)
