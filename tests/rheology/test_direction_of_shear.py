"""Shear in any direction: moduli and spectra of a packing that is turned, and of pure beside simple shear."""

import dataclasses

import numpy as np
import pytest

import jamlab
from jamlab.mechanics.stiffness import stress

OMEGA = np.logspace(-4, 2, 7)
ANGLES = np.array([0.0, 0.3, 1.0])
LAWS = [jamlab.ContactDamping(lever_arms="contact"), jamlab.StokesDrag(eta_f=0.5)]
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])  # by 90 degrees, counter-clockwise, for rows


@pytest.fixture(params=["sp", "dp"])
def packing(request, dp_dense):
    return jamlab.pack(n=16, pressure=1e-2, seed=1) if request.param == "sp" else dp_dense


def turned_by_45_degrees(packing):
    """The packing in a square box, turned clockwise, in the box of the same lattice whose first vector lies along x."""
    rotation = np.sqrt(0.5) * np.array([[1.0, 1.0], [-1.0, 1.0]])
    one, two = packing.box @ rotation.T
    box = np.array([one + two, two])
    assert abs(box[0, 1]) < 1e-12 * box[0, 0]
    box[0, 1] = 0.0
    return packing._trusted(box=box, positions=packing.positions @ rotation.T)


def modulus(packing, law, **how):
    return jamlab.complex_modulus(packing, OMEGA, law, method="dense", **how)


def test_a_quarter_turn_moves_directions(packing):
    """G' of shear along x becomes that along y, which differs by the difference of the normal stresses."""
    width, height = np.diag(packing.box)
    quarter = dataclasses.replace(packing, positions=packing.positions @ TURN, box=np.diag([height, width]))
    s, bulk, noise = stress(packing), jamlab.bulk_modulus(packing), 1e-9 * jamlab.bulk_modulus(packing)
    assert abs(s[1, 1] - s[0, 0]) > 1e-4 * bulk  # else the shift of G' would not be tested
    along, across = (
        jamlab.shear_modulus(p, direction=a) for p, a in ((packing, ANGLES), (quarter, ANGLES + np.pi / 2))
    )
    np.testing.assert_allclose(across, along, rtol=0, atol=noise)
    before, after = (modulus(p, LAWS[0]) for p in (packing, quarter))
    np.testing.assert_allclose(after.loss, before.loss, rtol=1e-9, atol=0.1 * noise)  # soft modes amplify rounding
    np.testing.assert_allclose(after.storage, before.storage + s[1, 1] - s[0, 0], rtol=1e-9, atol=0.1 * noise)
    there = modulus(quarter, LAWS[0], direction=np.pi / 2)
    np.testing.assert_allclose(there.storage, before.storage, rtol=1e-9, atol=0.1 * noise)
    one, two = (jamlab.complex_modulus(p, [1.0], LAWS[0]) for p in (packing, quarter))
    assert abs(one.eta_inf - two.eta_inf) <= one.eta_inf_bound + two.eta_inf_bound
    assert one.eta_inf_bound < 0.1 * one.eta_inf or one.eta_inf == 0


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("prestress", [True, False])
def test_pure_shear_of_what_is_turned_by_45_degrees_is_simple_shear(packing, law, prestress):
    """But for the rotation, on which the difference of the normal stresses does work."""
    if packing.model == "dp" and not prestress:
        return
    s = stress(packing) if prestress else np.zeros((2, 2))
    simple = modulus(packing, law, prestress=prestress)
    pure = modulus(turned_by_45_degrees(packing), law, prestress=prestress, direction="pure")
    noise = 1e-10 * jamlab.bulk_modulus(packing)  # soft modes of droplets amplify rounding
    assert simple.storage + 0.5 * (s[1, 1] - s[0, 0]) == pytest.approx(pure.storage, rel=1e-10, abs=noise)
    assert simple.loss == pytest.approx(pure.loss, rel=1e-10, abs=noise)


def test_isotropic_stress_makes_both_shears_one():
    packing = jamlab.pack(n=32, pressure=1e-2, seed=1, ensemble="shear-stabilized")
    for law in LAWS:
        simple, pure = modulus(packing, law), modulus(packing, law, direction="pure")
        oblique = modulus(packing, law, direction=-np.pi / 4)
        assert pure.loss == pytest.approx(oblique.loss, rel=1e-10) != pytest.approx(simple.loss, rel=1e-3)
        assert pure.storage == pytest.approx(oblique.storage, rel=1e-10)
        assert pure.g0 == pytest.approx(jamlab.shear_modulus(packing, direction=-np.pi / 4), rel=1e-10)
        assert pure.direction == "pure"


@pytest.mark.parametrize("way", ["pure", 0.4])
def test_finite_strains_have_the_modulus_of_linear_response(packing, way):
    linear, finite = (jamlab.shear_modulus(packing, m, direction=way) for m in ("linear-response", "finite-strain"))
    assert finite == pytest.approx(linear, rel=1e-4)
    turned = jamlab.shear_modulus(packing, direction=[0.4, 1.1, 2.2])
    assert (turned[0] == linear or way == "pure") and np.ptp(turned) > 0.01 * abs(linear)
