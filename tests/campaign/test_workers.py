"""Where tasks run: schedulers, SLURM, workers that cannot live or are killed; nothing is left behind, all is whole."""

import os
import subprocess
import sys
import time
import tomllib

import psutil
import pytest
from campaigns import dask_worker
from commands import call

import jamlab
from jamlab.campaign import workers
from jamlab.campaign.file import CampaignTable
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.slurm import job_script
from jamlab.campaign.states import StoredStates
from jamlab.campaign.tasks import batches
from jamlab.campaign.workers import Workers
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


@pytest.mark.slow
def test_a_scheduler_that_is_there(campaign, scheduler):
    with dask_worker(scheduler) as worker:
        done = campaign.run(scheduler=scheduler)
        assert (done.finished, done.failed) == (4, 0)
        assert worker.poll() is None  # it is not ours


def test_tasks_of_two_folders_have_two_keys_at_a_scheduler(tmp_path):
    (task, *_) = batches(CampaignTable.model_validate(tomllib.loads(FILE)))[0].tasks()
    one, other, again = (CampaignFolder(tmp_path / name) for name in ("a", "b", "b/../a"))
    assert workers.task_key(one, task) == workers.task_key(again, task) != workers.task_key(other, task)


def test_a_task_whose_file_is_not_there_is_not_finished(campaign):
    """Workers that see another folder under the same name, as without a common disk."""

    class Elsewhere:
        width = 1

        def submit(self, key, call):
            self.key = key

        def wait(self):
            return self.key, workers.Outcome(workers.FINISHED, "done", 1.0)

    campaign.folder.prepare()
    chosen, nobody = batches(campaign.content), StoredStates(campaign.folder, [])
    with pytest.raises(EngineError) as caught:
        workers.drive(Elsewhere(), campaign.folder, chosen, nobody, [], print)
    assert ".h5 is not there" in str(caught.value)


def test_nobody_can_connect_to_workers_on_this_machine(campaign):
    """They are reached by pipes: no process of the run listens anywhere."""
    older = {p.pid for p in psutil.Process().children(recursive=True)}  # a browser of other tests among them
    seen, heard = set(), set()

    def listening(process):
        return {c.laddr for c in process.net_connections() if c.status == psutil.CONN_LISTEN}

    def listen(share, text):
        run = [p for p in psutil.Process().children(recursive=True) if p.pid not in older]
        seen.update(p.pid for p in run)
        heard.update(*(listening(p) for p in [psutil.Process(), *run]))

    before = listening(psutil.Process())
    assert campaign.run(1, progress=listen).finished == 4
    assert seen and heard <= before


def test_workers_with_threads_are_refused(campaign, scheduler):
    line = [sys.executable, "-m", "distributed.cli.dask_worker", scheduler, "--nthreads", "2", "--no-nanny"]
    with subprocess.Popen([*line, "--no-dashboard"], stderr=subprocess.DEVNULL) as process:
        try:
            with pytest.raises(InputError):
                for _ in range(200):  # until the worker is there
                    with Workers(scheduler=scheduler).crew():
                        time.sleep(0.1)
        finally:
            process.kill()


def test_workers_that_die_at_once_end_the_run(campaign, monkeypatch):
    monkeypatch.setattr(workers, "_EARLY_DEATHS", 2)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(EngineError) as caught:
        campaign.run(2)
    assert "exit code 1" in str(caught.value)
    assert campaign.status().left == 4


def test_a_task_that_kills_its_workers_is_recorded(tmp_path, monkeypatch):
    """Others go on: the observable ends the process at one seed only."""
    monkeypatch.setattr(workers, "_MOST_DEATHS", 1)
    (tmp_path / "deadly.py").write_text(
        "import os\n\ndef kill(packing):\n    return os._exit(9) if packing.provenance['seed'] == 1 else 1.0\n"
    )
    (tmp_path / "c.toml").write_text(FILE.replace("seeds = 4", "seeds = 2") + 'observables = ["deadly:kill"]\n')
    campaign = jamlab.open_campaign(tmp_path / "c.toml")
    done = campaign.run(1)
    assert (done.finished, done.failed) == (1, 1)
    (record,) = campaign.status().failures.values()
    assert "seed=1: its workers died again and again" in record["reason"]


def test_what_local_workers_raise_is_named_and_they_are_gone_afterwards():
    before = psutil.Process().children()  # other tests have a browser
    with Workers(1).crew() as crew:
        crew.submit("a", (os.getppid,))
        assert crew.wait() == ("a", os.getpid())
        crew.submit("b", (int, "three"))
        with pytest.raises(EngineError) as caught:
            crew.wait()
        assert "'three'" in str(caught.value)
        assert len(psutil.Process().children()) == len(before) + 1  # one and the same
    assert psutil.Process().children() == before


@pytest.mark.parametrize(
    ("sbatch", "options", "said"),
    [
        (None, "", "no command sbatch or scancel"),
        ("echo sbatch: error: invalid partition: a >&2; exit 1", 'queue = "a"', "invalid partition: a"),
    ],
    ids=["no sbatch", "refused"],
)
def test_slurm_says_at_once_what_is_wrong(tmp_path, monkeypatch, sbatch, options, said):
    pytest.importorskip("dask_jobqueue")
    pytest.importorskip("cryptography")
    for name in ("sbatch", "scancel") if sbatch else ():
        (tmp_path / name).write_text(f"#!/bin/sh\n{sbatch}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    (tmp_path / "c.toml").write_text(f"{FILE}\n[slurm]\n{options}\n")
    done = call(tmp_path, "campaign", "run", "c.toml", "--slurm")
    assert done.exit_code == 1 and said in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "options",
    [{"qeue": "short"}, {"memory": "lots"}, {"cores": 4}, {"protocol": "tcp://"}],
)
def test_options_of_slurm_that_cannot_be_are_named(options):
    """By dask_jobqueue, which knows its arguments, but for those that jamlab sets."""
    pytest.importorskip("dask_jobqueue")
    with pytest.raises(InputError) as caught:
        job_script(options, 1)
    ((key, value),) = options.items()
    assert key in str(caught.value) and str(value) in str(caught.value)


@pytest.mark.parametrize("address", ["nonsense", "tcp://", "tcp://127.0.0.1:9", "inproc://a:1"])
def test_no_scheduler_is_one_line_at_once(tmp_path, address):
    (tmp_path / "c.toml").write_text(FILE)
    done = call(tmp_path, "campaign", "run", "c.toml", "--scheduler", address)
    assert done.exit_code == 1
    assert done.stderr.count("\n") == 1 and f"no Dask scheduler answers at {address!r}: start one" in done.stderr


def test_workers_that_cannot_be_had():
    for wrong in ({"count": 0}, {"count": 2, "scheduler": "tcp://127.0.0.1:1"}):
        with pytest.raises(InputError):
            Workers(**wrong)
