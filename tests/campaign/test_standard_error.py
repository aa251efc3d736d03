"""Campaigns: seeds are added until means are known to a standard error."""

from itertools import pairwise

import numpy as np
import pytest
from campaigns import read_campaign_file, run_here, written
from commands import call

import jamlab
from jamlab.campaign import plan as status
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.plan import FIRST_SEEDS, precision
from jamlab.campaign.tasks import batches

pytestmark = pytest.mark.usefixtures("here")

ONSET = {"n": 8, "compress": None, "onset": True}


@pytest.fixture
def spread(tmp_path, monkeypatch):
    """Function that says how a campaign goes whose packings have the given values of z: precision, round by round."""

    def follow(values, until, most=100, failing=(), loose=()):
        path = written(tmp_path / "c.toml", **ONSET, seeds=most, until={"z": until})
        (batch,) = batches(read_campaign_file(path))
        names = list(batch.names())
        rows = dict(zip(names, values, strict=False))

        def state(file):
            name = file.name.removesuffix(".h5")
            return {"converged": float(names.index(name) not in loose), "z": rows[name]}

        monkeypatch.setattr(status, "read_last_state", state)
        found, finished, failed = [], set(), {names[k] for k in failing}
        while not found or not found[-1].met:
            found.append(precision(batch, CampaignFolder(tmp_path / "c"), finished, failed))
            wanted = set(names[: found[-1].seeds]) - failed
            if wanted == finished:
                break
            finished = wanted
        return found

    return follow


def test_seeds_are_added_until_the_error_is_met(spread):
    values = np.tile([3.0, 5.0], 50)
    found = spread(values, 0.2)
    last = found[-1]
    assert [p.met for p in found] == [False] * (len(found) - 1) + [True]
    assert last.errors["z"] == np.std(values[: last.seeds], ddof=1) / np.sqrt(last.seeds) <= 0.2
    counts = [p.seeds for p in found]
    assert counts[0] == FIRST_SEEDS
    assert 25 <= last.seeds <= 31  # (1 / 0.2)^2 = 25, and a quarter more
    steps = [(a, b) for a, b in pairwise(counts) if a != b]
    assert steps and all(1.25 * a <= b <= 2 * a for a, b in steps)


def test_packings_without_a_value_are_left_out(spread):
    values = np.random.default_rng(2).normal(4.0, 0.1, 100)
    values[3] = np.nan
    first = spread(values, 0.2, failing=[5], loose=[0])[-1]  # nor one that did not converge
    kept = np.delete(values[:FIRST_SEEDS], [0, 3, 5])
    assert first.errors["z"] == pytest.approx(np.std(kept, ddof=1) / np.sqrt(5), rel=1e-12)
    assert np.isnan(spread([np.nan] * 16, 0.2, most=16)[-1].errors["z"])


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
