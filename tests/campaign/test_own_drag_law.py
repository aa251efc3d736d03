"""Campaigns drive by any registered drag law: keys and columns are its declared parameters."""

import numpy as np
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign.observable import DampingLaws
from jamlab.campaign.tables import aggregate
from tests.support.bubble_drag import CarriedBubbleDrag

BUBBLES = {"carried_bubble": [{"tau": 2.0}, {"tau": 3.0}]}
OSCILLATION = {"omega": [1.0], "amplitudes": [1e-5], "cycles": 2}


def test_a_law_of_another_package_is_driven_and_told_apart(tmp_path):
    wanted = {"observables": ["spectra", "oscillation"], "omega": [0.1, 1.0], "oscillation": OSCILLATION}
    damping = {"contact": [1.0], **BUBBLES}
    file = written(tmp_path / "c.toml", n=16, seeds=1, compress=None, pressures=[1e-2], damping=damping, **wanted)
    run_here(campaign := jamlab.open_campaign(file))
    rows = campaign.table("spectra")
    packing = campaign.packings(campaign.finished()[0])[0]
    for tau in (2.0, 3.0):
        own = rows[rows["carried_bubble_tau"] == tau]
        assert set(own["damping"]) == {"carried_bubble"} and own["beta"].isna().all()
        expected = jamlab.complex_modulus(packing, [0.1, 1.0], CarriedBubbleDrag(tau))
        np.testing.assert_allclose(own["loss"], expected.loss, rtol=1e-9)
    assert set(rows[rows["damping"] == "contact"]["beta"]) == {1.0}
    driven = campaign.table("oscillation")
    assert driven["carried_bubble_tau"].dropna().tolist() == [2.0, 3.0] and driven["loss"].notna().all()
    with pytest.raises(jamlab.InputError, match="mixes rows of damping"):
        aggregate(rows, ["loss"], by=["omega"])
    with pytest.raises(jamlab.InputError, match="mixes rows of carried_bubble_tau"):
        aggregate(rows, ["loss"], by=["omega", "damping"])


@pytest.mark.parametrize(
    ("damping", "said"),
    [
        ({"froth": [{"tau": 1.0}]}, "unknown key"),
        ({"carried_bubble": [{"beta": 1.0}]}, "has no parameter 'beta': it has tau"),
        ({"carried_bubble": [{"tau": -1.0}]}, "tau = -1.0: must be a positive number"),
        ({"carried_bubble": [{"tau": 2.0}, {"tau": 2.0}]}, "is listed twice"),
    ],
)
def test_wrong_laws_are_refused_by_name(tmp_path, damping, said):
    file = written(tmp_path / "c.toml", n=16, seeds=1, observables=["spectra"], omega=[1.0], damping=damping)
    with pytest.raises(jamlab.InputError, match=said):
        jamlab.open_campaign(file)


def test_tasks_without_other_laws_keep_their_names():
    """Names are made from what is written here."""
    assert DampingLaws(contact=[1.0]).model_dump(mode="json") == {"contact": [1.0], "stokes": []}
    assert DampingLaws.model_validate(BUBBLES).model_dump(mode="json")["others"] == BUBBLES
