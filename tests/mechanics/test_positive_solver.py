"""Sparse matrices: sums of blocks against plain loops, factorisations against dense numpy."""

import numpy as np
import pytest
from scipy import sparse

import jamlab
from jamlab.mechanics.factors import PositiveSolver
from jamlab.mechanics.stiffness import assemble
from jamlab.packing.terms import Terms


@pytest.fixture
def solver():
    return PositiveSolver()


def matrices():
    """Positive definite, of two patterns, each twice with other values."""
    rng = np.random.default_rng(3)
    for density in (0.02, 0.05):
        half = sparse.random_array((150, 150), density=density, rng=rng)
        whole = (half + half.T + 12 * sparse.eye_array(150)).tocsc()
        yield whole
        yield (2 * whole + sparse.eye_array(150)).tocsc()


def test_solutions_are_those_of_dense_numpy(solver):
    """One right side and several, in either memory layout, while values and patterns change."""
    rng = np.random.default_rng(4)
    for matrix in matrices():
        solver.factorise(matrix)
        for right in (rng.normal(size=150), rng.normal(size=(150, 3)), np.asfortranarray(rng.normal(size=(150, 3)))):
            assert solver.solve(right) == pytest.approx(np.linalg.solve(matrix.toarray(), right), rel=1e-12, abs=1e-13)


def test_what_has_a_negative_mode_is_refused_and_the_next_is_not(solver):
    """The shift of Newton steps is found by failing."""
    matrix = next(matrices())
    solver.factorise(matrix)
    with pytest.raises(jamlab.ConvergenceError):
        solver.factorise((matrix - 13 * sparse.eye_array(150)).tocsc())
    solver.factorise((matrix + sparse.eye_array(150)).tocsc())
    dense = matrix.toarray() + np.eye(150)
    assert solver.solve(np.ones(150)) == pytest.approx(np.linalg.solve(dense, np.ones(150)), rel=1e-12)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(solver, value):
    matrix = next(matrices())
    matrix[3, 3] = value
    with pytest.raises(jamlab.ConvergenceError):
        solver.factorise(matrix)


def test_blocks_sum_as_in_plain_loops():
    """Groups of different width, one of no term, a site twice in one term, terms between the same sites, sites without
    any term."""
    rng = np.random.default_rng(5)
    size = 9
    sites = [rng.integers(0, size - 1, (terms, m)) for terms, m in ((6, 2), (6, 3), (0, 4), (6, 5))]
    blocks = [rng.normal(size=(len(s), s.shape[1], 2, s.shape[1], 2)) for s in sites]
    blocks = [block + block.transpose(0, 3, 4, 1, 2) for block in blocks]
    dense = np.zeros((2 * size, 2 * size))
    for group, block in zip(sites, blocks, strict=True):
        for own, values in zip(group, block, strict=True):
            for a, i in enumerate(own):
                for b, j in enumerate(own):
                    dense[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] += values[a, :, b]
    found = assemble([Terms("", s, *3 * [np.zeros(0)], b) for s, b in zip(sites, blocks, strict=True)], size)
    assert found.has_canonical_format
    np.testing.assert_allclose(found.toarray(), dense, rtol=1e-13, atol=1e-14)
    assert not found.toarray()[-2:].any()
