"""Packings at which linear response is easily wrong: equal modes, one particle, two in one place, no minimum."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.mechanics.energy_terms import energy_terms


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


@pytest.mark.parametrize("measure", [jamlab.oscillating_displacements, jamlab.displacement_correlation])
def test_response_of_states_that_are_no_minimum_is_refused(measure):
    packing = jamlab.pack(32, 1e-2, 1)
    moved = packing.positions + 1.5e-3 * np.sin(np.arange(64).reshape(32, 2))
    measure(packing, 1.0)
    with pytest.raises(jamlab.ConvergenceError, match="not at an energy minimum"):
        measure(packing.with_state(positions=moved), 1.0)


@pytest.mark.parametrize("part", [0.02, 0.05])
def test_an_imbalance_of_a_few_per_cent_of_the_pressure_is_none_of_a_minimum(part):
    packing = jamlab.pack(32, 1e-2, 1)
    jamlab.shear_modulus(packing)
    held = int(np.flatnonzero(~jamlab.contacts(packing).rattlers)[0])
    moved = packing.positions.copy()
    moved[held, 0] += part * 1e-2  # stiffness of about two contacts
    with pytest.raises(jamlab.ConvergenceError, match="not at an energy minimum"):
        jamlab.shear_modulus(packing.with_state(positions=moved))


def crystal():
    return jamlab.Packing("sp", [[0.95, 0], [0.475, 0.8227]], [[0.1, 0.2]], {"k": 1.0}, "k", [1.0])


def test_one_particle_that_presses_on_its_images_has_moduli_but_no_motion():
    packing = crystal()
    tensor = jamlab.elastic_tensor(packing)
    assert np.array_equal(tensor.affine, tensor.relaxed)
    assert jamlab.shear_modulus(packing) == jamlab.shear_modulus(packing, "affine") > 0
    assert not jamlab.slow_shear(packing).nonaffine.any()
    with pytest.raises(jamlab.InputError, match="one particle that presses on its own images"):
        jamlab.complex_modulus(packing, [1.0])


def test_two_disks_in_one_place_are_named():
    packing = jamlab.Packing("sp", [[4.0, 0], [0, 4.0]], [[1.0, 1], [2.5, 1], [1, 1]], {"k": 1.0}, "k", np.ones(3))
    with pytest.raises(jamlab.InputError, match="disks 0 and 2 are in one place"):
        energy_terms(packing)


def test_slow_shear_slides_as_the_displacements_say():
    """Two disks one above the other: shear to the right moves the upper one past the lower."""
    packing = jamlab.pack(32, 1e-2, 1)
    found, network = jamlab.slow_shear(packing), jamlab.contacts(packing)
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
