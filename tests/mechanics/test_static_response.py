"""Static response and moduli along directions, where they are easily wrong: floppy and equal modes, one particle."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

import jamlab
from jamlab.errors import ConvergenceError
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, modulus_along
from jamlab.mechanics.factors import FLOPPY, SOFT, UnstableError, response_and_looseness, static_response
from jamlab.mechanics.floppy_modes import floppy_modes
from jamlab.mechanics.stiffness import energy_terms

SIZES = (12, 500)  # coordinates: all eigenvalues at once, and a few by iteration


def _with_eigenvalues(values):
    """A matrix of known eigenvalues, and its eigenvectors, in pairs of coordinates that are turned by an angle."""
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    vectors = sparse.block_diag([sparse.csc_array(turn)] * (len(values) // 2), format="csc")
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


def _pushed(size, share):
    """A matrix with a floppy mode, its vector, and a load that pushes it: the mode takes a share of the energy."""
    values = _stiff(size)
    values[3] = 0.0
    matrix, vectors = _with_eigenvalues(values)
    along = np.where(np.arange(size) == 3, 0.0, 1.0)
    energy = np.sum(along[values > 0] / values[values > 0])
    return matrix, vectors[:, 3], vectors @ along + np.sqrt(share * energy * FLOPPY * 300) * vectors[:, 3]


@pytest.mark.parametrize("size", SIZES)
def test_a_floppy_mode_takes_no_part_in_the_response(size):
    """Pushed by less than what counts; its stiffness, which is rounding, would let it move a thousand times as far."""
    matrix, mode, load = _pushed(size, 0.1 * SOFT.hidden)
    moved, free = mode @ static_response(matrix, load[:, None])[:, 0], mode @ load / (FLOPPY * 300)
    assert abs(moved) < 0.03 * free and free > 100
    matrix, mode, load = _pushed(size, 1e-4)
    with pytest.raises(UnstableError):
        static_response(matrix, load[:, None])


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_a_floppy_mode_that_is_pushed_leaves_no_response(size, scale):
    values = _stiff(size)
    values[3] = 0.0
    matrix, vectors = _with_eigenvalues(scale * values)
    load = vectors @ (scale * np.where(np.arange(size) == 3, 1e-6, 1.0))
    with pytest.raises(UnstableError) as caught:
        static_response(matrix, load[:, None])
    assert caught.value.eigenvalue == 0.0
    (mode,) = caught.value.modes
    assert abs(mode @ vectors[:, 3]) == pytest.approx(np.linalg.norm(mode), rel=1e-6)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_negative_modes_are_handed_over_the_lowest_first(size, scale):
    values = _stiff(size)
    values[[3, 5]] = -100 * FLOPPY * 300, -400 * FLOPPY * 300
    matrix, vectors = _with_eigenvalues(scale * values)
    with pytest.raises(UnstableError) as caught:
        static_response(matrix, np.ones((size, 1)))
    assert caught.value.eigenvalue == pytest.approx(scale * values[5], rel=0.1)  # of which rounding takes some
    np.testing.assert_allclose(np.abs(caught.value.modes @ vectors[:, [5, 3]]), np.eye(2), atol=0.1)
    assert caught.value.count == 2


@pytest.mark.parametrize("size", SIZES)
def test_negative_modes_are_counted_and_as_many_named_as_are_asked_for(size):
    values = _stiff(size)
    values[:8] = -np.arange(1, 9)
    for asked, named in (({}, 6), ({"named": 7}, 7), ({"named": 20}, 8)):
        with pytest.raises(UnstableError) as caught:
            static_response(_with_eigenvalues(values)[0], np.ones((size, 1)), **asked)
        assert (caught.value.count, len(caught.value.modes)) == (8, named)


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
    with pytest.raises(jamlab.ConvergenceError):  # pushed, rows buckle
        jamlab.elastic_tensor(lattice)


def islands():
    """Thirty-six islands of a few disks that never touch each other, so that every mode is there many times."""
    rng = np.random.default_rng(0)
    base = rng.random((int(rng.integers(3, 9)), 2)) * 2
    places = [np.array([5.0 * a, 5.0 * b]) for a in range(6) for b in range(6)]
    centres = np.vstack([base + place for place in places[: int(np.ceil(220 / len(base)))]])
    return jamlab.Packing("sp", [[30.0, 0], [0, 30.0]], centres, {"k": 1.0}, "k", np.ones(len(centres)))


@pytest.mark.parametrize("count", [40, 70, 82, 88])
def test_modes_that_are_there_many_times_are_found_or_refused(count):
    packing = islands()
    wanted = np.linalg.eigvalsh(jamlab.hessian(packing).toarray())[:count]
    try:
        found = jamlab.lowest_modes(packing, count).eigenvalues
    except jamlab.ConvergenceError as error:
        assert "missed" in str(error)
    else:
        assert found == pytest.approx(wanted, abs=1e-8)


@pytest.mark.parametrize("measure", [jamlab.displacement_response, jamlab.displacement_correlation])
def test_response_of_states_that_are_no_minimum_is_refused(measure):
    packing = jamlab.pack(32, 1e-2, 1)
    moved = packing.positions + 1.5e-3 * np.sin(np.arange(64).reshape(32, 2))
    measure(packing, 1.0)
    with pytest.raises(jamlab.ConvergenceError):
        measure(packing.with_state(positions=moved), 1.0)


def test_an_imbalance_of_a_few_per_cent_of_the_pressure_is_none_of_a_minimum():
    packing = jamlab.pack(32, 1e-2, 1)
    jamlab.shear_modulus(packing, direction="simple")
    held = int(np.flatnonzero(~jamlab.contacts(packing).rattlers)[0])
    for part in (0.02, 0.05):
        moved = packing.positions.copy()
        moved[held, 0] += part * 1e-2  # stiffness of about two contacts
        with pytest.raises(jamlab.ConvergenceError):
            jamlab.shear_modulus(packing.with_state(positions=moved), direction="simple")


def test_one_particle_that_presses_on_its_images_has_moduli_but_no_motion():
    packing = jamlab.Packing("sp", [[0.95, 0], [0.475, 0.8227]], [[0.1, 0.2]], {"k": 1.0}, "k", [1.0])
    tensor = jamlab.elastic_tensor(packing)
    assert np.array_equal(tensor.affine, tensor.relaxed)
    assert jamlab.shear_modulus(packing) == jamlab.shear_modulus(packing, "affine") > 0
    assert not jamlab.nonaffine_response(packing).nonaffine.any()
    with pytest.raises(jamlab.InputError):
        jamlab.complex_modulus(packing, [1.0])


def test_two_disks_in_one_place_are_named():
    packing = jamlab.Packing("sp", [[4.0, 0], [0, 4.0]], [[1.0, 1], [2.5, 1], [1, 1]], {"k": 1.0}, "k", np.ones(3))
    with pytest.raises(jamlab.InputError, match="0 and 2"):
        energy_terms(packing)


def test_slow_shear_slides_as_the_displacements_say():
    """Two disks one above the other: shear to the right moves the upper one past the lower."""
    packing = jamlab.pack(32, 1e-2, 1)
    found, network = jamlab.nonaffine_response(packing), jamlab.contacts(packing)
    normal = network.r[network.bearing] / np.hypot(*network.r[network.bearing].T)[:, None]
    moved = np.zeros((packing.n, 2))
    moved[~network.rattlers] = found.nonaffine
    i, j = network.pairs[network.bearing].T
    relative = moved[j] - moved[i]
    relative[:, 0] += network.r[network.bearing][:, 1]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])  # counter-clockwise
    assert found.tangential == pytest.approx(np.einsum("ij,ij->i", relative, tangent), abs=1e-12)


def test_a_loose_droplet_that_just_touches_another_bears_nothing():
    """Neither with a vertex of its own nor with an edge; it is taken out with its meetings."""
    packing = jamlab.read(Path(__file__).parents[1] / "states" / "droplets_at_onset.h5")
    loose = int(np.flatnonzero(jamlab.contacts(packing).rattlers)[0])
    own = (packing.particle == loose)[:, None]

    def moved(length):
        return packing.with_state(positions=packing.positions + length * own * [1.0, 0.0])

    touches = [(jamlab.contacts(moved(length)).pairs == loose).any() for length in (0.00329, 0.0032905965)]
    assert touches == [False, True]
    assert jamlab.shear_modulus(moved(0.0032905965)) == pytest.approx(jamlab.shear_modulus(packing), rel=1e-9)


angles = st.floats(-10, 10)


@st.composite
def tensors(draw, rotations=True):
    """C of a random energy with major symmetry; without rotations it depends on the symmetric strain alone."""
    root = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).normal(size=(3, 2, 2))
    if not rotations:
        root = root + root.transpose(0, 2, 1)
    return np.einsum("aij,akl->ijkl", root, root)


@given(tensors(), angles)
def test_averaging_angles_average(c, start):
    many = np.linspace(0, np.pi, 360, endpoint=False)
    few = modulus_along(c, AVERAGING_ANGLES + start).mean()
    np.testing.assert_allclose(few, modulus_along(c, many).mean(), rtol=1e-9)


@pytest.mark.parametrize("patience", [1, 500])
def test_negative_modes_that_are_nearly_alike_end_in_an_error_of_ours(monkeypatch, patience):
    """Of 500 coordinates 40 have curvatures that differ in the seventh digit: one of them is named, or none."""
    monkeypatch.setattr("jamlab.mechanics.factors.SOFT", replace(SOFT, patient=patience))
    values = np.concatenate([-1e-3 * (1 + 1e-7 * np.arange(40)), np.linspace(0.1, 1.0, 460)])
    with pytest.raises(ConvergenceError) as caught:
        static_response(sparse.csc_array(sparse.diags_array(values)), np.ones((500, 1)))
    if isinstance(caught.value, UnstableError):
        mode = caught.value.modes[0]
        assert mode @ (values * mode) / (mode @ mode) == pytest.approx(-1e-3, rel=1e-4)
    else:
        assert patience == 1


@pytest.mark.parametrize(("size", "free"), [(60, 7), (450, 30), (450, 0)])
def test_floppy_modes_are_a_basis_of_what_costs_nothing(size, free):
    """Springs that are fewer than coordinates, few coordinates or many: as many modes as are left over."""
    rng = np.random.default_rng(1)
    springs = sparse.random_array((size - free, size), density=0.1, rng=rng) + sparse.eye_array(size - free, size)
    matrix = sparse.csc_array(springs.T @ springs)
    modes = floppy_modes(matrix, FLOPPY)
    assert modes.shape == (size, free)
    assert modes.T @ modes == pytest.approx(np.eye(free), abs=1e-12)
    assert np.abs(matrix @ modes).max(initial=0.0) < 1e-12 * matrix.diagonal().max()
    _, loose = response_and_looseness(matrix, matrix @ np.ones((size, 1)))
    assert loose == bool(free)
