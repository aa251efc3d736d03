"""Where tasks run: a scheduler that is there, SLURM, workers that cannot live; nothing is left behind."""

import json
import os
import subprocess
import sys
import time
import tomllib

import psutil
import pytest
from commands import call

import jamlab
from jamlab.campaign import driver, workers
from jamlab.campaign.file import CampaignTable
from jamlab.campaign.tasks import batches
from jamlab.campaign.workers import Workers, WorkerSupply
from jamlab.errors import EngineError, InputError

FILE = """
name = "c"
[[sweep]]
name = "disks"
model = "sp"
n = 8
seeds = 4
onset = true
"""


@pytest.fixture
def campaign(tmp_path):
    (tmp_path / "c.toml").write_text(FILE)
    return jamlab.open_campaign(tmp_path / "c.toml")


@pytest.fixture
def scheduler():
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, processes=True, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster.scheduler_address


def die(*_):
    os._exit(9)


die.__module__ = "__main__"  # so that it is sent by value: workers cannot import this file


@pytest.mark.slow
def test_a_scheduler_that_is_there(campaign, scheduler):
    with WorkerSupply(scheduler, 1, pytest.fail):
        while not psutil.Process().children():
            time.sleep(0.01)
        (worker,) = psutil.Process().children()
        done = campaign.run(scheduler=scheduler)
        assert (done.finished, done.failed) == (4, 0)
        assert worker.is_running()  # it is not ours
        assert worker.environ()["OMP_NUM_THREADS"] == "1"
    assert not worker.is_running()


@pytest.mark.slow
def test_only_a_few_tasks_wait_at_once(campaign, scheduler, tmp_path):
    """200 tasks that are done already; the client knows no more of them than two for each worker."""
    campaign.folder.prepare()
    content = CampaignTable.model_validate(tomllib.loads(FILE.replace("seeds = 4", "seeds = 200")))
    for name in batches(content)[0].names():
        campaign.folder.task_file(name).touch()
    known = []
    with WorkerSupply(scheduler, 1, pytest.fail), Workers(scheduler=scheduler).client() as client:
        tasks = driver.remaining_tasks(batches(content), set())
        done = driver.drive(client, campaign.folder, tasks, lambda *_: known.append(len(client.futures)))
    assert (done.finished, len(known)) == (200, 200)
    assert max(known) <= 2


def test_workers_with_threads_are_refused(campaign, scheduler):
    line = [sys.executable, "-m", "distributed.cli.dask_worker", scheduler, "--nthreads", "2", "--no-nanny"]
    with subprocess.Popen([*line, "--no-dashboard"], stderr=subprocess.DEVNULL) as process:
        try:
            with pytest.raises(InputError, match=r"2 tasks.*--nthreads 1"):
                for _ in range(200):  # until the worker is there
                    with Workers(scheduler=scheduler).client():
                        time.sleep(0.1)
        finally:
            process.kill()


def test_workers_that_die_at_once_end_the_run(campaign, monkeypatch):
    monkeypatch.setattr(workers, "_EARLY_DEATHS", 2)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(EngineError, match="workers die as soon as they start, the last with exit code 1"):
        campaign.run(2)
    assert campaign.status().left == 4


@pytest.mark.slow
def test_a_task_that_kills_its_workers_is_recorded(campaign, monkeypatch):
    monkeypatch.setattr(driver, "run_task", die)
    done = campaign.run(1)
    assert (done.finished, done.failed) == (0, 4)
    assert all("workers died again and again" in r["reason"] for r in campaign.status().failures.values())


@pytest.mark.slow
def test_slurm_with_the_same_file(tmp_path, monkeypatch):
    """With sbatch and scancel that run jobs here; the real sbatch keeps a copy of the script too."""
    pytest.importorskip("dask_jobqueue")
    bin_ = tmp_path / "bin"
    bin_.mkdir()
    job = '#!/bin/bash\n[ "$1" = --test-only ] && exit 0\ncp "$1" {0}/job.sh\n'
    job += "setsid bash {0}/job.sh > {0}/job.log 2>&1 &\n"
    job += 'echo $! >> {0}/jobs\necho "job $!"\n'
    (bin_ / "sbatch").write_text(job.format(tmp_path))
    (bin_ / "scancel").write_text('#!/bin/bash\nfor j in "$@"; do kill -- -$j; done\n')
    for program in bin_.iterdir():
        program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{bin_}:{os.environ['PATH']}")
    (tmp_path / "c.toml").write_text(FILE + '\n[slurm]\nqueue = "short"\nwalltime = "00:10:00"\nmemory = "1 GB"\n')
    line = [
        sys.executable,
        "-m",
        "jamlab.cli.main",
        "campaign",
        "run",
        tmp_path / "c.toml",
        "--slurm",
        "--workers",
        "1",
    ]
    done = subprocess.run([*line, "--json"], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert json.loads(done.stdout)["finished"] == 4
    script = (tmp_path / "job.sh").read_text()
    assert "#SBATCH -p short" in script
    assert "--nthreads 1" in script
    jobs = [int(line) for line in (tmp_path / "jobs").read_text().split()]
    _, alive = psutil.wait_procs([psutil.Process(j) for j in jobs if psutil.pid_exists(j)], timeout=20)
    assert not alive


@pytest.mark.parametrize(
    ("sbatch", "options", "said"),
    [
        (None, "", "no command sbatch or scancel"),
        (
            "echo sbatch: error: invalid partition: nowhere >&2; exit 1",
            'queue = "nowhere"',
            "invalid partition: nowhere",
        ),
        ("exit 0", 'qeue = "short"', "unknown key qeue;"),
    ],
    ids=["no sbatch", "refused", "unknown key"],
)
def test_slurm_says_at_once_what_is_wrong(tmp_path, monkeypatch, sbatch, options, said):
    pytest.importorskip("dask_jobqueue")
    for name in ("sbatch", "scancel") if sbatch else ():
        (tmp_path / name).write_text(f"#!/bin/sh\n{sbatch}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    (tmp_path / "c.toml").write_text(f"{FILE}\n[slurm]\n{options}\n")
    done = call(tmp_path, "campaign", "run", "c.toml", "--slurm")
    assert done.exit_code == 1 and said in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "address", ["nonsense", "", "tcp://", "tcp://127.0.0.1:9", "tcp://host.invalid:8786", "inproc://a:1"]
)
def test_no_scheduler_is_one_line_at_once(tmp_path, address):
    (tmp_path / "c.toml").write_text(FILE)
    done = call(tmp_path, "campaign", "run", "c.toml", "--scheduler", address)
    assert done.exit_code == 1
    assert done.stderr.count("\n") == 1 and f"no Dask scheduler answers at {address!r}: start one" in done.stderr
