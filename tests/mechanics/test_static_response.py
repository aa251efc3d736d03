"""Static response beside floppy modes, and the errors for packings that give way."""

import numpy as np
import pytest
from scipy import sparse

import jamlab
from jamlab.mechanics.static_response import FLOPPY, UnstableError, static_response

SIZES = (12, 500)  # coordinates: all eigenvalues at once, and a few by iteration


def _with_eigenvalues(values):
    """A matrix of known eigenvalues, and its eigenvectors, in pairs of coordinates that are turned by an angle."""
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    vectors = sparse.block_diag([turn] * (len(values) // 2), format="csc")
    return (vectors @ sparse.diags_array(values) @ vectors.T).tocsc(), vectors.toarray()


def _stiff(size):
    return np.linspace(1.0, 300.0, size)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("floppy", [0.0, 0.1, -0.1])
def test_a_floppy_mode_that_nothing_pushes_leaves_the_others_alone(size, scale, floppy):
    values = _stiff(size)
    values[3] = floppy * FLOPPY * 300
    matrix, vectors = _with_eigenvalues(scale * values)
    wanted = np.random.default_rng(1).standard_normal((size, 2))
    wanted[3] = 0.0
    found = static_response(matrix, vectors @ (scale * values[:, None] * wanted))
    stiff = np.arange(size) != 3  # along the floppy one the rounding of the load decides
    np.testing.assert_allclose((vectors.T @ found)[stiff], wanted[stiff], atol=1e-9)
    assert np.abs(matrix @ found - matrix @ (vectors @ wanted)).max() < 1e-11 * scale * 300


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_a_floppy_mode_that_is_pushed_leaves_no_response(size, scale):
    values = _stiff(size)
    values[3] = 0.0
    matrix, vectors = _with_eigenvalues(scale * values)
    load = vectors @ (scale * np.where(np.arange(size) == 3, 1e-6, 1.0))
    with pytest.raises(UnstableError, match="floppy mode") as caught:
        static_response(matrix, load[:, None])
    assert caught.value.eigenvalue == 0.0
    assert abs(caught.value.mode @ vectors[:, 3]) == pytest.approx(np.linalg.norm(caught.value.mode), rel=1e-6)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_a_negative_mode_is_named_and_handed_over(size, scale):
    values = _stiff(size)
    values[3] = -100 * FLOPPY * 300
    matrix, vectors = _with_eigenvalues(scale * values)
    with pytest.raises(UnstableError, match=r"1 negative mode\(s\)") as caught:
        static_response(matrix, np.ones((size, 1)))
    assert caught.value.eigenvalue == pytest.approx(scale * values[3], rel=0.1)  # of which rounding takes some
    assert abs(caught.value.mode @ vectors[:, 3]) == pytest.approx(1.0, abs=1e-6)


def test_a_soft_mode_above_rounding_counts_in_full():
    values = _stiff(12)
    values[3] = 1e4 * FLOPPY * 300
    matrix, vectors = _with_eigenvalues(values)
    load = vectors[:, 3] * values[3]
    np.testing.assert_allclose(static_response(matrix, load[:, None])[:, 0], vectors[:, 3], rtol=0, atol=1e-3)


def test_rows_of_a_square_lattice_slide_at_no_cost():
    """Springs along x and y: C_xxxx = C_yyyy = k, all else 0, though rows and columns slide (2 N - 2 floppy modes)."""
    m = 4
    x = np.stack(np.meshgrid(np.arange(m), np.arange(m)), axis=-1).reshape(-1, 2) * 0.99 + 0.3
    lattice = jamlab.Packing("sp", 0.99 * m * np.eye(2), x, {"k": 3.0}, "k", np.ones(m * m))
    tensor = jamlab.elastic_tensor(lattice, prestress=False).relaxed
    wanted = np.zeros((2, 2, 2, 2))
    wanted[0, 0, 0, 0] = wanted[1, 1, 1, 1] = 3.0
    np.testing.assert_allclose(tensor, wanted, atol=1e-9)
    with pytest.raises(jamlab.ConvergenceError, match="negative mode"):  # pushed, rows buckle
        jamlab.elastic_tensor(lattice)
