"""A campaign whose jobs all end before it does. pytest -m benchmark -s tests/campaign/benchmark_slurm.py."""

import json
import time

import pytest
from campaigns import on_slurm
from fake_slurm import sent, walltimes

import jamlab

pytest.importorskip("dask_jobqueue")
pytest.importorskip("cryptography")
TASKS, WORKERS, WALLTIME, SHORTEST = 200, 4, 25.0, 3.0  # s; a job carries up to 8 tasks, so at least 21 end by it


@pytest.mark.benchmark
def test_each_of_200_tasks_is_finished_once_through_the_ends_of_20_jobs(tmp_path):
    began = time.perf_counter()
    faults = {"refuse": [3, 9], "lose": [5, 11], "requeue": [7, 13]}
    done = on_slurm(tmp_path, TASKS, SHORTEST, WORKERS, walltime=WALLTIME, **faults)
    assert done.returncode == 0, done.stderr
    row = {"jobs": sent(tmp_path / "slurm"), "walltime_ends": walltimes(tmp_path / "slurm")}
    print(json.dumps(row | {"wall_s": time.perf_counter() - began}))
    found = json.loads(done.stdout)
    assert (found["finished"], found["failed"]) == (TASKS, 0)
    states = jamlab.open_campaign(tmp_path / "c.toml").table("states")
    assert sorted(states["seed"]) == list(range(1, TASKS + 1)) and (states["slow"] == 1).all()
    assert len(list((tmp_path / "c" / "tasks").glob("*.h5"))) == TASKS
    assert row["walltime_ends"] >= 20
    assert not list((tmp_path / "slurm" / "jobs").iterdir())
