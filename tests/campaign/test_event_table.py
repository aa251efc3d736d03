"""Plastic events as a table of a campaign, and the distribution of their sizes."""

import numpy as np
import pandas as pd
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign.event_observable import PlasticEventsOfStates

HOW = {"strain": 0.1, "strain_step": 1e-2, "event_width": 2.5e-3}
SWEEP = {"n": 12, "seeds": 2, "compress": None, "pressures": [1e-2], "observables": ["plastic_events"]}


@pytest.mark.slow
def test_the_table_has_a_row_for_each_event(tmp_path):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP, plastic_events=HOW))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"] * 2
    table = campaign.table("plastic_events")
    assert len(table) and table["converged"].all() and (table["event_width"] <= 2.5e-3).all()
    for task, rows in table.groupby("task"):
        (packing,) = campaign.packings(str(task))
        events = jamlab.quasistatic_shear(packing, **HOW).events
        for name in ("strain", "energy", "participation", "contacts_lost", "t1"):
            assert rows[name].to_numpy() == pytest.approx(getattr(events, name), rel=1e-6), name
    with pytest.raises(jamlab.InputError, match="sizes from"):
        jamlab.event_sizes(campaign)
    several = pd.concat([table.assign(energy=table["energy"] * factor) for factor in np.linspace(1, 2, 12)])
    found = jamlab.event_sizes(several, least_size=table["energy"].min(), truncated=False)
    assert len(found.sizes) == 12 * len(table) and found.packings == table["task"].nunique()


@pytest.mark.parametrize(
    ("how", "words"),
    [({"event_width": 1e-2}, "event_width = 0.01"), ({"strain": 0.0}, "strain"), ({"width": 1e-6}, "width")],
)
def test_events_that_no_sweep_can_find_are_refused(tmp_path, how, words):
    with pytest.raises(jamlab.InputError, match=words):
        jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP, plastic_events=HOW | how))


def test_a_state_without_events_has_no_rows():
    assert (
        PlasticEventsOfStates(plastic_events=HOW | {"strain": 1e-3, "strain_step": 1e-3, "event_width": 1e-4}).one(
            jamlab.pack(8, 1e-2, seed=1)
        )
        == []
    )
