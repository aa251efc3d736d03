"""Dense equations of marginal contacts, against numpy."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

PLUGIN = Path(__file__).parents[2] / "plugin"
CALL = """
#include "dense_solver.h"
#include <algorithm>

using Numbers = std::vector<double>;

extern "C" double solve(const double *matrix, std::size_t m, double singular, double *solution, int *undetermined,
                        const double *rights, std::size_t columns, const std::size_t *asked, std::size_t count,
                        double *found)
{
  LAMMPS_NS::DenseSolver solver(Numbers(matrix, matrix + m * (m + 1)), m, singular);
  std::vector<bool> marks(m, false);
  solver.mark_undetermined(marks);
  std::copy(marks.begin(), marks.end(), undetermined);
  std::copy(solver.solution().begin(), solver.solution().end(), solution);
  const Numbers later = solver.solve(Numbers(rights, rights + m * columns), columns, {asked, asked + count});
  std::copy(later.begin(), later.end(), found);
  return solver.determinant();
}
"""


@pytest.fixture(scope="module")
def solve(tmp_path_factory):
    """Function of a matrix, a right-hand side, others, the unknowns asked for in those, and the least pivot."""
    if not (compiler := shutil.which("c++")):
        pytest.skip("no C++ compiler")
    folder = tmp_path_factory.mktemp("dense")
    (folder / "call.cpp").write_text(CALL)
    sources = [folder / "call.cpp", PLUGIN / "dense_solver.cpp"]
    options = ["-std=c++17", "-O1", "-fopenmp-simd", "-shared", "-fPIC", f"-I{PLUGIN}", "-o", folder / "dense.so"]
    subprocess.run([compiler, *sources, *options], check=True, timeout=300)
    compiled = ctypes.CDLL(str(folder / "dense.so")).solve
    reals, integers, size = (np.ctypeslib.ndpointer(dtype) for dtype in (float, np.int32, np.uintp))
    compiled.argtypes = [reals, ctypes.c_size_t, ctypes.c_double, reals, integers]
    compiled.argtypes += [reals, ctypes.c_size_t, size, ctypes.c_size_t, reals]
    compiled.restype = ctypes.c_double

    def call(a, b, rights, asked, singular=0.0):
        m, solution, marks = len(a), np.empty(len(a)), np.empty(len(a), np.int32)
        found = np.empty((len(asked), rights.shape[1]))
        matrix, later = np.column_stack([a, b]), np.ascontiguousarray(rights)
        numbers = np.array(asked, np.uintp)
        product = compiled(matrix, m, singular, solution, marks, later, rights.shape[1], numbers, len(asked), found)
        return product, solution, found, marks.astype(bool)

    return call


@pytest.mark.parametrize("m", [1, 2, 7, 40])
def test_solutions_and_determinant_are_those_of_numpy(solve, m):
    rng = np.random.default_rng(m)
    a, b, rights = rng.normal(size=(m, m)), rng.normal(size=m), rng.normal(size=(m, 3))
    asked = rng.permutation(m)[: (m + 1) // 2]
    determinant, x, later, undetermined = solve(a, b, rights, asked)
    assert determinant == pytest.approx(np.linalg.det(a), rel=1e-10)
    np.testing.assert_allclose(x, np.linalg.solve(a, b), rtol=1e-9)
    np.testing.assert_allclose(later, np.linalg.solve(a, rights)[asked], rtol=1e-9)
    assert not undetermined.any()


def test_right_hand_sides_that_come_later_have_the_same_bits(solve):
    rng = np.random.default_rng(5)
    a, b = rng.normal(size=(30, 30)), rng.normal(size=30)
    a[rng.random(a.shape) < 0.5] = 0.0
    asked = [3, 29, 0]
    _, x, later, _ = solve(a, b, np.column_stack([b, -b]), asked)
    np.testing.assert_array_equal(later, np.column_stack([x, -x])[asked])


def test_what_small_pivots_leave_open_is_zero(solve):
    a = np.diag([1.0, 1e-3, 2.0])
    determinant, x, later, undetermined = solve(a, np.ones(3), np.ones((3, 1)), [0, 1, 2], singular=1e-2)
    assert determinant == 2.0
    assert x.tolist() == later[:, 0].tolist() == [1.0, 0.0, 0.5]
    assert undetermined.tolist() == [False, True, False]
