"""Tasks of several threads: the same names, workers of as many cores, and a plan that counts them."""

import json

import numpy as np
import pytest
from campaigns import names, read_campaign_file, written
from commands import call

import jamlab
from jamlab.campaign import states
from jamlab.campaign.tasks import batches
from jamlab.campaign.workers import count_workers
from jamlab.errors import InputError
from jamlab.processes.cores import cores_given

PRESSED = {"compress": None, "pressures": [1e-2], "n": 32}


def test_ranks_do_not_enter_names_and_reach_the_protocols(tmp_path, monkeypatch):
    one, two = written(tmp_path / "one.toml", **PRESSED), written(tmp_path / "two.toml", **PRESSED, ranks=2)
    assert names(one) == names(two)
    given, onset = [], jamlab.jam(8, "sp", 1)
    monkeypatch.setattr(states, "make", lambda recipe: given.append(recipe.ranks) or onset)
    monkeypatch.setattr(states, "compress", lambda *_, **how: given.append(how["ranks"]) or [onset])
    for path in (two, written(tmp_path / "up.toml", ranks=3)):
        task, _ = batches(read_campaign_file(path))[0].tasks()
        states.make_states(task.parameters, task.ranks)
    assert given == [2, 3, 3]


def test_workers_hold_the_cores_of_their_ranks():
    with cores_given(8):
        assert [count_workers(None, ranks) for ranks in (1, 2, 3, 8)] == [8, 4, 2, 1]
        assert count_workers(2, 16) == 2
        with pytest.raises(InputError) as caught:
            count_workers(None, 9)
        assert "ranks = 9" in str(caught.value) and "8 cores" in str(caught.value)


@pytest.mark.slow
def test_sweeps_of_one_and_two_ranks_in_one_run(tmp_path):
    two = written(tmp_path / "c.toml", **PRESSED, ranks=2).read_text()
    one = two.replace('"disks"', '"other"').replace("ranks = 2", "").replace("seeds = 2", "seeds = [7]")
    (tmp_path / "c.toml").write_text(two + one.removeprefix('name = "c"\n'))
    campaign = jamlab.open_campaign(tmp_path / "c.toml")
    done = campaign.run(1)
    assert (done.finished, done.failed) == (3, 0)
    table = campaign.table("states")
    assert table["converged"].all() and np.allclose(table["pressure"], 1e-2, rtol=1e-5)
    assert np.isclose(table[table["seed"] == 7]["phi"].iloc[0], jamlab.pack(32, 1e-2, 7).phi, rtol=1e-12)


def test_a_table_of_numbers_is_json(tmp_path):
    written(tmp_path / "c.toml", **PRESSED, ranks=2)
    content = json.loads(call(tmp_path, "campaign", "plan", "c.toml", "--workers", "3", "--json").stdout)
    assert content["workers"] == 3 and content["sweeps"][0]["ranks"] == 2
