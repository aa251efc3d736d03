"""A rotation costs nothing: neither energy nor drag knows how a packing is turned."""

import numpy as np
import pytest

import jamlab
from jamlab import ContactDamping
from jamlab.rheology.damping import damping_matrix

LAW = ContactDamping(beta=50.0, arms="contact")


def pair_of_disks():
    """Two that overlap, in a box so wide that they meet no image."""
    places = np.array([[3.0, 3.0], [3.7, 3.5]])
    return jamlab.Packing("sp", 10 * np.eye(2), places, {"k": 1.7}, "k", np.array([0.8, 1.1]))


def pair_of_droplets(contact, slide):
    """Two polygons whose flats face each other: vertices meet edges, and corners at the ends."""
    turn = 2 * np.pi * (np.arange(7) + 0.5) / 7  # a flat to the right
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    gap = 2 * np.cos(np.pi / 7) + 0.1
    places = np.concatenate([ring, [gap, slide] - ring]) + 5.0
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.3, "delta": 0.3, "eta": 0.0, "contact": contact, "a0": [2.7, 2.7]}
    return jamlab.Packing("dp", 15 * np.eye(2), places, law, offsets=[0, 7, 14])


PAIRS = {"disks": pair_of_disks()} | {
    f"{form} {slide}": pair_of_droplets(form, slide)
    for form in ("outline", "segment", "segment/smooth")
    for slide in (0.0, 0.33)
}


def rigid_rotation(packing):
    """Rates of all coordinates in a rotation about a point outside."""
    x = packing.positions - [0.3, -0.7]
    spins = np.ones(packing.n if packing.model == "sp" else 0)
    return np.concatenate([np.column_stack([-x[:, 1], x[:, 0]]).ravel(), spins, [0.0]])


@pytest.mark.parametrize("packing", PAIRS.values(), ids=PAIRS.keys())
def test_a_pair_that_rotates_dissipates_nothing(packing):
    """While the same pair sheared does, and disks with the radii of the paper for arms do in a rotation."""
    drag = damping_matrix(packing, LAW)
    rates = rigid_rotation(packing)
    shear = np.eye(len(rates))[-1]
    assert np.abs(drag @ rates).max() < 1e-13 * abs(drag).max()
    assert shear @ drag @ shear > 1e-3
    if packing.model == "sp":
        printed = damping_matrix(packing, ContactDamping())
        assert rates @ printed @ rates > 1e-3


@pytest.mark.parametrize("packing", PAIRS.values(), ids=PAIRS.keys())
def test_shear_along_x_and_along_y_differ_by_a_rotation(packing):
    """So that the drag of x -> x + gamma y is that of y -> y + gamma x in disks that rotate with the difference."""
    drag = damping_matrix(packing, LAW)
    sheared = np.zeros(drag.shape[0])
    sheared[2 * len(packing.positions) : -1] = 1.0
    sheared[1 : 2 * len(packing.positions) : 2] = packing.positions[:, 0]
    np.testing.assert_allclose(drag @ np.eye(len(sheared))[-1], drag @ sheared, rtol=0, atol=1e-13 * abs(drag).max())
