"""The batch system of the tests does to jobs what real ones do; what it promises other tests is checked here."""

import os
import signal
import subprocess
import time

import psutil
import pytest
from batch_jobs import seconds
from fake_batch import PROGRAMS, FakeBatch

STUBBORN = """#!/bin/bash
#SBATCH -t 00:00:01
trap 'echo told >> told' TERM
(trap '' TERM; sleep 60) &
while :; do sleep 0.1; done
"""


def until(condition, most=20.0):
    """Wait for what must come."""
    end = time.monotonic() + most
    while not (found := condition()):
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.02)
    return found


def run(batch, folder, *words, **how):
    how = {"text": True, "capture_output": True} | how
    return subprocess.run(words, cwd=folder, env=batch.environment(), check=False, **how)


@pytest.mark.parametrize(
    ("text", "system", "expected"),
    [("20", "slurm", 1200), ("1:20", "slurm", 80), ("1-00:00:01", "slurm", 86401), ("00:30", "lsf", 1800)],
)
def test_lengths_of_walltimes(text, system, expected):
    assert seconds(text, system) == expected


def test_a_job_ends_at_its_walltime_with_all_its_processes(tmp_path):
    """SIGTERM to all of them, and SIGKILL to those that do not end."""
    (tmp_path / "job.sh").write_text(STUBBORN)
    with FakeBatch(tmp_path / "batch", kill_wait=0.3) as batch:
        assert run(batch, tmp_path, "sbatch", "job.sh").stdout == "Submitted batch job 1\n"
        assert len(until(lambda: batch.processes(1))) >= 1
        assert " R " in run(batch, tmp_path, "squeue").stdout
        until(lambda: batch.log("ended"))
        assert [entry["event"] for entry in batch.log()][:3] == ["submitted", "started", "walltime"]
        assert not batch.processes() and (tmp_path / "told").read_text() == "told\n"
        assert (tmp_path / "slurm-1.out").exists() and " R " not in run(batch, tmp_path, "squeue").stdout


def test_no_job_outlives_the_test(tmp_path):
    with FakeBatch(tmp_path / "batch") as batch:
        run(batch, tmp_path, "sbatch", "--wrap", "trap '' TERM; (sleep 600 &); sleep 600")
        pids = until(lambda: len(batch.processes()) >= 3 and batch.processes())
        batch._server.send_signal(signal.SIGINT)  # Ctrl-C is not for it
    left = [psutil.Process(pid).status() for pid in pids if psutil.pid_exists(pid)]
    assert set(left) <= {psutil.STATUS_ZOMBIE}


def test_jobs_wait_for_slots_and_are_cancelled(tmp_path):
    with FakeBatch(tmp_path / "batch", slots=2, kill_wait=0.3) as batch:
        for _ in range(3):
            run(batch, tmp_path, "sbatch", "--wrap", "sleep 600")
        assert run(batch, tmp_path, "sbatch", "-c", "3", "--wrap", "sleep 600").returncode == 1
        until(lambda: len(batch.log("started")) == 2)
        time.sleep(0.2)
        assert len(batch.log("started")) == 2
        run(batch, tmp_path, "scancel", "1")
        until(lambda: {entry["job"] for entry in batch.log("started")} == {1, 2, 3})
        assert run(batch, tmp_path, "scancel", "77").returncode == 1


def test_jobs_that_are_refused_requeued_and_lost(tmp_path):
    line = ["sbatch", "--wrap", "echo $SLURM_JOB_ID ${SLURM_RESTART_COUNT-0} >> ran; sleep 1"]
    with FakeBatch(tmp_path / "batch", slots=9, refuse=1.0) as batch:
        done = run(batch, tmp_path, *line)
        assert done.returncode == 1 and done.stderr.startswith("sbatch: error: QOSMaxSubmitJobPerUserLimit\n")
        batch.change(refuse=0.0, requeue=1.0, within=0.5)
        run(batch, tmp_path, *line)
        until(lambda: batch.log("ended"))
        assert (tmp_path / "ran").read_text() == "1 0\n1 1\n" and len(batch.log("requeued")) == 1
        batch.change(lose=1.0)
        for _ in range(6):
            run(batch, tmp_path, *line)
        lost = until(lambda: len(batch.log("lost")) == 6 and {entry["job"] for entry in batch.log("lost")})
        began = {entry["job"] for entry in batch.log("started")} & lost
        assert began and began != lost and not batch.processes()


@pytest.mark.slow
@pytest.mark.parametrize("system", PROGRAMS)
def test_every_system_runs_and_cancels_the_jobs_of_dask(tmp_path, system, monkeypatch):
    jobqueue = pytest.importorskip("dask_jobqueue")
    import dask
    from distributed import Client

    kind = {name.lower(): name for name in ("HTCondor", "LSF", "Moab", "OAR", "PBS", "SGE", "SLURM")}[system]
    with FakeBatch(tmp_path / "batch") as batch, monkeypatch.context() as patched:
        for name, value in batch.environment().items():
            patched.setenv(name, value)
        patched.chdir(tmp_path)
        dask.config.refresh(paths=[tmp_path / "batch/home/.config/dask"])
        how = {"cores": 1, "processes": 1, "scheduler_options": {"dashboard": False, "host": "127.0.0.1"}}
        with getattr(jobqueue, f"{kind}Cluster")(**how) as cluster, Client(cluster) as client:
            cluster.scale(jobs=1)
            assert client.submit(os.getpid, pure=False).result(timeout=60) in batch.processes(1)
        until(lambda: batch.log("ended") and not batch.processes())
        assert batch.log("cancelled")
