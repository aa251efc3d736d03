"""A packing turned by 90 degrees: moduli and spectra follow the directions; `tests/test_invariances.py` has more."""

import dataclasses

import numpy as np
import pytest

import jamlab
from jamlab.mechanics.stiffness import stress

OMEGA = np.logspace(-4, 2, 7)
ANGLES = np.array([0.0, 0.3, 1.0])
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])  # by 90 degrees, counter-clockwise, for rows


@pytest.mark.parametrize("model", ["sp", "dp"])
def test_a_quarter_turn_moves_directions(model, dp_dense):
    """G' of shear along x becomes that along y, which differs by the difference of the normal stresses."""
    packing = jamlab.pack(n=16, pressure=1e-2, seed=1) if model == "sp" else dp_dense
    width, height = np.diag(packing.box)
    turned = dataclasses.replace(packing, positions=packing.positions @ TURN, box=np.diag([height, width]))
    s, bulk, noise = stress(packing), jamlab.bulk_modulus(packing), 1e-9 * jamlab.bulk_modulus(packing)
    assert abs(s[1, 1] - s[0, 0]) > 1e-4 * bulk  # else the shift of G' would not be tested
    along, across = (jamlab.shear_modulus(p, angle=a) for p, a in ((packing, ANGLES), (turned, ANGLES + np.pi / 2)))
    np.testing.assert_allclose(across, along, rtol=0, atol=noise)
    law = jamlab.ContactDamping(arms="contact")
    before, after = (jamlab.complex_modulus(p, OMEGA, law, method="dense") for p in (packing, turned))
    np.testing.assert_allclose(after.loss, before.loss, rtol=1e-9, atol=0.1 * noise)  # soft modes amplify rounding
    np.testing.assert_allclose(after.storage, before.storage + s[1, 1] - s[0, 0], rtol=1e-9, atol=0.1 * noise)
    one, two = (jamlab.complex_modulus(p, [1.0], law) for p in (packing, turned))
    assert abs(one.eta_inf - two.eta_inf) <= one.eta_inf_error + two.eta_inf_error
    assert one.eta_inf_error < 0.1 * one.eta_inf or one.eta_inf == 0
