"""Compiled factors of sparse symmetric matrices against dense numpy: blocks of 1 to 3 numbers, definite or not."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

import jamlab
from jamlab.kernels.library import library
from jamlab.mechanics.factors import PositiveSolver, SymmetricFactors

PLUGIN = Path(__file__).parents[2] / "plugin"


def symmetric(rng, sites, width, neighbours):
    """(n, n) matrix of full blocks of `width` numbers, of either sign, on a random graph; connected or not."""
    n = sites * width
    pairs = np.vstack([rng.integers(0, sites, (int(neighbours * sites), 2)), np.column_stack(2 * [np.arange(sites)])])
    dense = np.zeros((n, n))
    for i, j in pairs:
        block = rng.normal(size=(width, width))
        dense[width * i : width * (i + 1), width * j : width * (j + 1)] += block
        dense[width * j : width * (j + 1), width * i : width * (i + 1)] += block.T
    return dense


def cases(seed, count):
    """Sizes from 1 to some hundred, from diagonal to dense."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield symmetric(rng, int(rng.integers(1, 60)), int(rng.integers(1, 4)), rng.choice([0, 0.3, 1, 3, 30])), rng


def backward_error(matrix, x, right):
    """Residual over what rounding of the matrix may change."""
    return np.abs(matrix @ x - right).max() / (np.abs(matrix).max() * np.abs(x).max() + np.abs(right).max())


def test_definite_matrices_are_solved_to_rounding():
    for dense, rng in cases(1, 30):
        definite = dense @ dense + 0.1 * np.eye(len(dense))
        solver, right = PositiveSolver(), rng.normal(size=(len(dense), int(rng.integers(1, 10))))
        solver.factorise(sparse.csc_array(definite))
        x = solver.solve(right)
        assert backward_error(definite, x, right) < 1e-14
        assert backward_error(definite, solver.solve(right[:, 0]), right[:, 0]) < 1e-14


def test_negative_eigenvalues_are_counted_and_right_hand_sides_solved():
    for dense, rng in cases(2, 60):
        shift = float(rng.normal())
        shifted, right = dense + shift * np.eye(len(dense)), rng.normal(size=(len(dense), 3))
        factors = SymmetricFactors(sparse.csc_array(dense), shift)
        assert factors.negative == int((np.linalg.eigvalsh(shifted) < 0).sum())
        assert backward_error(shifted, factors.solve(right), right) < 1e-8  # half of the digits at worst
        assert factors.solve(right[:, 0]) == pytest.approx(factors.solve(right)[:, 0], rel=1e-6)


def test_the_first_row_without_a_positive_pivot_is_named():
    """A matrix of pairs: the fault lies in the pair that is not positive definite."""
    dense = np.kron(np.eye(9), [[2.0, 1.0], [1.0, 2.0]])
    dense[11, 11] = 0.3  # pivots 2 and 0.3 - 1/2, or 0.3 and 2 - 1/0.3
    with pytest.raises(jamlab.ConvergenceError, match=r"row 1[01] is not positive"):
        PositiveSolver().factorise(sparse.csc_array(dense))


def test_a_ring_whose_first_pivot_vanishes_is_taken_in_another_order():
    """Ties of minimum degree go by number, so that row 0 comes first; where no element of the diagonal differs from
    zero, no order helps."""
    rng, ring = np.random.default_rng(7), np.roll(np.eye(12), 1, axis=0)
    dense = ring + ring.T + np.diag(rng.normal(size=12))
    dense[0, 0] = 1e-15
    factors, right = SymmetricFactors(sparse.csc_array(dense)), rng.normal(size=12)
    assert factors.negative == int((np.linalg.eigvalsh(dense) < 0).sum())
    assert backward_error(dense, factors.solve(right), right) < 1e-8
    with pytest.raises(jamlab.ConvergenceError, match="pivot vanishes"):
        SymmetricFactors(sparse.csc_array([[0.0, 1.0], [1.0, 0.0]]))


def test_singular_matrices():
    """A free chain has one zero mode, which a shift of either sign counts; rows without any element are refused."""
    chain = np.diag(np.r_[1.0, np.full(28, 2.0), 1.0]) - np.eye(30, k=1) - np.eye(30, k=-1)
    matrix = sparse.csc_array(np.kron(chain, np.eye(2)))
    below, above = SymmetricFactors(matrix, 1e-9), SymmetricFactors(matrix, -1e-9)
    assert above.negative - below.negative == 2
    alone = sparse.csc_array(np.diag([1.0, 0.0, 3.0]))
    with pytest.raises(jamlab.ConvergenceError):
        PositiveSolver().factorise(alone)
    with pytest.raises(jamlab.ConvergenceError):
        SymmetricFactors(alone)
    nothing = sparse.csc_array((3, 3))
    assert [SymmetricFactors(nothing, shift).negative for shift in (1e-13, -1e-13)] == [0, 3]
    solver = PositiveSolver()
    solver.factorise(alone, 1.0)  # the diagonal need not be in the pattern
    assert solver.solve(np.ones(3)) == pytest.approx([0.5, 1.0, 0.25])


def test_an_order_is_kept_while_patterns_change():
    """As contacts open and close; also where blocks become wider or narrower."""
    rng, solver = np.random.default_rng(3), PositiveSolver()
    for width in (2, 2, 2, 1, 3, 2, 2):
        dense = symmetric(rng, 48 // width, width, 2)
        definite = dense + (1 + np.abs(dense).sum(axis=0).max()) * np.eye(48)
        for factor in (1.0, 3.0):
            solver.factorise(sparse.csc_array(factor * definite))
            right = rng.normal(size=48)
            assert solver.solve(right) == pytest.approx(np.linalg.solve(factor * definite, right), rel=1e-11)


def test_wide_panels():
    """A dense matrix is one panel of several hundred columns, an arrow one below many."""
    rng = np.random.default_rng(4)
    dense = rng.normal(size=(402, 402))
    dense += dense.T
    arrow = np.diag(rng.normal(size=402))
    arrow[-90:], arrow[:, -90:] = dense[-90:], dense[:, -90:]
    for matrix in (dense, arrow):
        factors, right = SymmetricFactors(sparse.csc_array(matrix)), rng.normal(size=(402, 5))
        assert factors.negative == int((np.linalg.eigvalsh(matrix) < 0).sum())
        assert backward_error(matrix, factors.solve(right), right) < 1e-8
        definite = matrix @ matrix + np.eye(402)
        solver = PositiveSolver()
        solver.factorise(sparse.csc_array(definite))
        assert backward_error(definite, solver.solve(right), right) < 1e-13


def test_a_right_hand_side_of_another_length_is_refused():
    solver = PositiveSolver()
    solver.factorise(sparse.csc_array(np.eye(4)))
    with pytest.raises(ValueError, match="3 numbers of a right-hand side for factors of 4 rows"):
        solver.solve(np.ones(3))


_ROUGHLY = """
#include "block_cholesky.h"

extern "C" void solve_roughly(int width, int size, const int *first, const int *rows, const double *numbers, double *r)
{
  const auto solve = [&](auto factors) {
    std::vector<double> right(size);
    for (const double shift : {1.0, 0.0}) {    // factors of a second matrix, from the same pattern
      factors.set_pattern(size / width, first, rows);
      factors.set(numbers);
      factors.factorise(shift);
      right.assign(r, r + size);
      factors.solve_roughly(right);
    }
    std::copy(right.begin(), right.end(), r);
  };
  if (width == 1) solve(LAMMPS_NS::BlockCholesky<1>());
  if (width == 2) solve(LAMMPS_NS::BlockCholesky<2>());
  if (width == 3) solve(LAMMPS_NS::BlockCholesky<3>());
}
"""


def pointers(*arrays):
    return [a.ctypes.data_as(ctypes.c_void_p) for a in arrays]


def compiled(kind, folder):
    """The sources for a kind of processor: "avx2", "any" or this one, "own"."""
    if not (compiler := shutil.which("g++")):
        pytest.skip("no g++")
    names = ("block_cholesky", "block_solutions", "dense_panel", "elimination_order")
    sources = [PLUGIN / f"{name}.cpp" for name in names]
    has = {"avx2": '__builtin_strcmp(x,"avx2")==0', "any": "0"}
    options = ["-std=c++17", "-O3", "-fopenmp-simd", "-ffp-contract=off", "-fno-math-errno", "-fno-signed-zeros"]
    if kind in has:
        options += [f"-D__builtin_cpu_supports(x)=({has[kind]})"]
    roughly, made = folder / f"roughly_{kind}.cpp", folder / f"factors_{kind}.so"
    roughly.write_text(_ROUGHLY)
    options += ["-I", PLUGIN, "-shared", "-fPIC", "-o", made]
    subprocess.run(
        [compiler, *sources, roughly, PLUGIN / "kernels" / "sparse_factors.cpp", *options], check=True, timeout=600
    )
    return ctypes.CDLL(str(made))


@pytest.mark.slow
def test_digits_do_not_depend_on_the_processor(tmp_path):
    """The same solution, bit for bit, by the functions for older processors."""
    rng = np.random.default_rng(6)
    dense = symmetric(rng, 300, 2, 3)
    definite = sparse.csc_array(dense @ dense + 0.1 * np.eye(600))
    right = rng.normal(size=(600, 5))
    kinds = [compiled(kind, tmp_path) for kind in ("own", "avx2", "any")]

    def solved(compiled, indefinite):
        compiled.sparse_factors_make.restype = ctypes.c_int64
        handle, x = ctypes.c_int64(compiled.sparse_factors_make()), right.copy()
        arrays = pointers(definite.indptr, definite.indices, definite.data)
        shift, sign = ctypes.c_double(-5.0 * indefinite), ctypes.c_int64(indefinite)
        assert compiled.sparse_factors_factorise(handle, ctypes.c_int64(600), *arrays, shift, sign) == 600
        compiled.sparse_factors_solve(handle, ctypes.c_int64(5), *pointers(x))
        compiled.sparse_factors_free(handle)
        return x

    for indefinite in (0, 1):
        for kind in kinds:
            np.testing.assert_array_equal(solved(kind, indefinite), solved(library(), indefinite))
    assert_solved_roughly(kinds, rng)


def assert_solved_roughly(kinds, rng):
    """In single precision, with panels of any width: the same digits by all kinds of processors."""
    graphs = [(1, 1, 0), (1, 3, 0), (7, 3, 1), (40, 2, 0.5), (120, 1, 1), (90, 3, 2), (200, 2, 3)]
    for sites, width, neighbours in graphs:
        dense = symmetric(rng, sites, width, neighbours)
        size, largest = len(dense), np.abs(dense).sum(axis=0).max()
        definite = dense + (largest + 1.0) * np.eye(size)
        full, right = sparse.csc_array(definite), rng.normal(size=size)
        found = []
        for kind in kinds:
            found.append(right.copy())
            kind.solve_roughly(width, size, *pointers(full.indptr, full.indices, full.data, found[-1]))
        np.testing.assert_array_equal(found[1], found[0])
        np.testing.assert_array_equal(found[2], found[0])
        assert backward_error(definite, found[0], right) < 1e-6


def test_an_element_of_one_triangle_alone():
    """A sum of matrices drops a zero that is rounding in the other triangle."""
    for dense, rng in cases(4, 20):
        definite = dense @ dense + np.eye(len(dense))
        rounding = np.where((rng.random(dense.shape) < 0.02) & (definite == 0), 1e-17, 0.0)
        matrix, right = sparse.csc_array(definite + rounding), rng.normal(size=len(dense))
        solver = PositiveSolver()
        solver.factorise(matrix)
        assert backward_error(definite, solver.solve(right), right) < 1e-14
        assert SymmetricFactors(matrix, -1.5).negative == int((np.linalg.eigvalsh(definite) < 1.5).sum())


@pytest.mark.parametrize("element, shift", [(np.nan, 0.0), (np.inf, 0.0), (1.0, np.inf), (1.0, np.nan)])
def test_what_is_not_finite_is_refused(element, shift):
    with pytest.raises(jamlab.ConvergenceError, match="not finite"):
        PositiveSolver().factorise(sparse.csc_array([[2.0, element], [element, 3.0]]), shift)


def test_a_matrix_that_has_no_factors_solves_nothing():
    solver, matrix = PositiveSolver(), sparse.csc_array(np.diag([2.0, 4.0]))
    solver.factorise(matrix)
    with pytest.raises(jamlab.ConvergenceError, match="not positive definite"):
        solver.factorise(-matrix)
    with pytest.raises(ValueError, match="factors of 0 rows"):
        solver.solve(np.ones(2))
