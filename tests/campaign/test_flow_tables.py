"""Flow as an observable of a campaign: tables, means over packings, and what its file refuses."""

import numpy as np
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign.file import read_campaign_file
from jamlab.campaign.tasks import batches, state_key

FLOW = {"rates": [0.5, 1.0], "strain": 1.0, "discard": 0.1, "background": 1e-2}
SWEEP = {
    **{"n": 16, "seeds": 2, "compress": None, "pressures": [2e-2], "observables": ["flow"], "flow": FLOW},
    "damping": {"contact": [1.0], "stokes": [0.5]},
}


def test_means_over_packings(tmp_path):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"] * 2
    table = campaign.table("flow")
    assert len(table) == 2 * 2 * 2 and set(table["law"]) == {"contact", "stokes"}  # seeds, laws, rates
    row = table.query("law == 'contact' and seed == 1 and rate == 0.5").iloc[0]
    packing = jamlab.pack(n=16, pressure=2e-2, seed=1)
    curve = jamlab.flow_curve(packing, [0.5], strain=1.0, discard=0.1, background=1e-2)
    assert row["stress"] == pytest.approx(curve.stress[0], rel=0.05)
    means = campaign.aggregate(["stress", "flow_pressure"], by=["law", "rate"], table="flow", converged=False)
    contact = table.query("law == 'contact' and rate == 1.0")["stress"]
    found = means.query("law == 'contact' and rate == 1.0").iloc[0]
    assert found["stress"] == pytest.approx(contact.mean()) and found["stress_packings"] == 2
    stokes = means.query("law == 'stokes'").sort_values("rate")["stress"].to_numpy()
    assert np.all(stokes > 0.5 * np.array([0.5, 1.0]))


def test_other_rates_need_no_other_packings(tmp_path):
    keys = []
    for flow in (FLOW, FLOW | {"rates": [0.1]}):
        path = written(tmp_path / "c.toml", **SWEEP | {"flow": flow})
        keys.append(
            [state_key(task.parameters) for batch in batches(read_campaign_file(path)) for task in batch.tasks()]
        )
    assert keys[0] == keys[1] and len(set(keys[0])) == 2


def test_flow_from_quenches_below_and_above_onset(tmp_path):
    """States at packing fractions, in units "k"; the loose one bears no pressure at rest, and flows under little."""
    changes = {"pressures": None, "phi": [0.9, 0.7], "seeds": 1, "damping": {"contact": [1.0]}}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"]
    states = campaign.table("states")
    assert states["phi"].to_numpy() == pytest.approx([0.7, 0.9]) and set(states["units"]) == {"k"}
    assert states["pressure"].iloc[0] < 1e-9 < 1e-3 < states["pressure"].iloc[1]
    stress = campaign.table("flow").query("rate == 0.5").set_index("state")["stress"]
    assert 0 < stress[0] < 0.5 * stress[1]
    assert campaign.table("onset").empty


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"flow": None}, r"observable 'flow' needs flow: give a table with rates"),
        ({"flow": {"rates": [1e4]}}, r"flow.rates.*10000 is above 1000"),
        ({"flow": {"rates": [1.0], "alpha": 0.1}}, r"flow.alpha"),
        ({"flow": {"rates": [1.0], "speed": 1}}, r"flow.speed"),
        ({"observables": ["states"]}, r"flow is given, but observable 'flow' is not"),
    ],
)
def test_refused(tmp_path, changes, message):
    with pytest.raises(jamlab.InputError, match=message):
        jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes))
