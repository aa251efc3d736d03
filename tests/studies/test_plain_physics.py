"""The physics that judges maps of failure, against analytic cases, its own slopes and jamlab's own."""

import numpy as np
import pytest

import jamlab
from jamlab.laws.rim import CONTACT_FORMS
from jamlab.models.droplets import regular_polygon
from jamlab.protocols.random_start import droplet_params
from studies.stability import plain_physics as plain


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(12, 1e-2, 1)


@pytest.fixture(scope="module")
def droplets():
    """Two droplets of 5 and 7 vertices in a leaning box, into whose images they press."""
    shapes = [c + regular_polygon(count, 0.8) for count, c in ((5, [0.3, 0.3]), (7, [1.25, 0.5]))]
    _, params = droplet_params(2, nv_small=5, nv_large=7)
    box = np.array([[2.0, 0.0], [0.3, 1.3]])
    return jamlab.Packing("dp", box, np.concatenate(shapes), params, offsets=np.array([0, 5, 12]))


@pytest.mark.parametrize("units", ["eps", "k"])
def test_disks_that_touch_several_images(units):
    """Four disks, many of whose contacts are with images, beside the same disks in a cell of two rows and columns."""
    x, box = np.random.default_rng(2).random((4, 2)) * 1.7, np.array([[1.7, 0.0], [0.4, 1.6]])
    one = jamlab.Packing("sp", box, x, {units: 1.3}, units, np.array([0.9, 0.9, 1.2, 1.2]))
    cells = np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) @ box
    positions, diameters = (cells[:, None] + x).reshape(-1, 2), np.tile(one.diameters, 4)
    four = one.with_state(box=2 * box, positions=positions, diameters=diameters)
    (energy, forces), (of_four, more) = plain.plain_forces(one), plain.plain_forces(four)
    assert of_four == pytest.approx(4 * energy, rel=1e-13)
    np.testing.assert_allclose(more, np.tile(forces, (4, 1)), atol=1e-13)
    np.testing.assert_allclose(plain.plain_stress(four), plain.plain_stress(one), atol=1e-13)


@pytest.mark.parametrize("contact", CONTACT_FORMS)
def test_forces_of_droplets_are_slopes_of_their_energy(droplets, contact):
    """By complex steps of the energy itself; what LAMMPS gives is held against these in tests/engine."""
    packing = droplets.with_state(params={**droplets.params, "contact": contact, "eta": 0.01})
    _, forces = plain.plain_forces(packing)
    for site, k in np.ndindex(forces.shape):
        moved = packing.positions.astype(complex)
        moved[site, k] += 1j * plain.STEP
        slope = plain.energy_and_forces(packing, moved, packing.box)[0].imag / plain.STEP
        assert -slope == pytest.approx(forces[site, k], abs=1e-12 * np.abs(forces).max())


def test_moduli_of_disks(packing):
    """The relaxed tensor is that of jamlab, which shares no code with it; without relaxation it is far larger."""
    tensor = jamlab.elastic_tensor(packing)
    np.testing.assert_allclose(plain.plain_moduli(packing), tensor.relaxed, atol=1e-12)
    assert np.abs(tensor.affine - tensor.relaxed).max() > 0.1


@pytest.mark.parametrize("beta", [0.0, 1.0])
def test_complex_modulus_of_disks(packing, beta):
    s = jamlab.complex_modulus(packing, [1e-8, 0.3, 1e8], jamlab.ContactDamping(beta=beta), method="direct")
    found = np.array([plain.plain_complex_modulus(packing, w, beta) for w in s.omega])
    np.testing.assert_allclose(found.real, s.storage, rtol=1e-7)
    np.testing.assert_allclose(found.imag, s.loss, rtol=1e-7)


def test_packing_fraction():
    """Two disks that overlap across the border of a leaning cell: the lens counts once."""
    box, d, apart = np.array([[3.0, 0.0], [0.5, 2.5]]), 1.0, 0.6
    p = jamlab.Packing("sp", box, [[0.1, 0.1], [0.1 - apart, 0.1]], {"k": 1.0}, "k", [d, d])
    lens = 0.5 * d**2 * np.arccos(apart / d) - 0.5 * apart * np.sqrt(d**2 - apart**2)
    assert plain.plain_packing_fraction(p) == pytest.approx((np.pi / 2 * d**2 - lens) / p.area, rel=1e-4)


def test_packing_fraction_of_droplets_with_rims(droplets):
    assert plain.plain_packing_fraction(droplets) == pytest.approx(jamlab.packing_fraction(droplets), rel=1e-4)
