"""Campaigns: seeds are added until means are known to a standard error."""

import numpy as np
import pytest
from campaigns import run_here, written
from commands import call

import jamlab
from jamlab.campaign.plan import FIRST_SEEDS

pytestmark = pytest.mark.usefixtures("here")

ONSET = {"n": 8, "compress": None, "onset": True}


def test_a_run_stops_at_the_error_and_goes_on_where_it_was(tmp_path):
    path = written(tmp_path / "c.toml", **ONSET, seeds=60, until={"rho": 0.01})
    campaign = jamlab.open_campaign(path)
    assert campaign.plan()[0].tasks == 60
    assert "rho 0.01" in call(tmp_path, "campaign", "plan", path).stdout
    assert campaign.status().tasks == FIRST_SEEDS
    assert len(run_here(campaign)) == FIRST_SEEDS  # a driver that dies after the first round
    done = campaign.run(1)
    (sweep,) = campaign.status().sweeps
    assert FIRST_SEEDS + done.finished == sweep.tasks == sweep.finished < sweep.most == 60
    assert sweep.until == {"rho": 0.01}
    rho = campaign.table("states")["rho"]
    assert sweep.errors["rho"] == pytest.approx(rho.std() / np.sqrt(len(rho)), rel=1e-12)
    assert sweep.errors["rho"] <= 0.01
    assert campaign.run(1).finished == 0
    shown = call(tmp_path, "campaign", "status", path).stdout
    error = f"error of mean rho {sweep.errors['rho']:.3g}, until 0.01: met"
    assert f"disks sp n=8: {error}; {sweep.tasks} of at most 60" in shown
    assert (campaign.plan()[0].tasks, campaign.plan()[0].left) == (sweep.tasks, 0)
