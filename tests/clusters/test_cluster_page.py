"""The page on clusters: settings of batch systems that it shows are settings of jamlab's jobs."""

import json
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import dask
import pytest
import yaml
from campaigns import written
from fake_batch import FakeBatch

import jamlab
from jamlab.clusters.batch_system import SYSTEMS

PAGE = (Path(__file__).parents[2] / "docs" / "how_to" / "cluster.md").read_text(encoding="utf-8")
SETTINGS = [yaml.safe_load(block) for block in re.findall(r"^ *```yaml\n(.*?)^ *```$", PAGE, re.M | re.S)]
OF_A_SITE = [block["jobqueue"] for block in SETTINGS if "memory" in next(iter(block["jobqueue"].values()))]
BOOKED = {  # how 16 cores, the queue and 4 or 36 hours stand in the job
    "slurm": ("--cpus-per-task=16", "-p normal", "-A my-project", "-t 04:00:00"),
    "pbs": ("ncpus=16", "-q workq", "walltime=36:00:00"),
    "sge": ("-pe smp 16", "-q all.q", "h_rt=36:00:00"),
    "lsf": ("-n 16", "-q normal", "-W 36:00"),
    "htcondor": ("MY.DaskWorkerCores = 16",),
}


@pytest.fixture(scope="module", autouse=True)
def defaults():
    """Load the defaults of dask_jobqueue, which takes SIGINT for itself as it is imported."""
    kept = signal.getsignal(signal.SIGINT)
    import dask_jobqueue  # noqa: F401

    signal.signal(signal.SIGINT, kept)


def test_the_page_shows_five_batch_systems():
    assert {name for block in OF_A_SITE for name in block} == BOOKED.keys() <= SYSTEMS.keys()


@pytest.mark.parametrize("settings", OF_A_SITE, ids=lambda settings: next(iter(settings)))
def test_settings_of_the_page_make_a_job_of_sixteen_workers(tmp_path, settings):
    ((where, site),) = settings.items()
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml"))
    with dask.config.set({f"jobqueue.{where}": dask.config.get(f"jobqueue.{where}") | site}):
        script = campaign.job_script(where)
    assert "jamlab.clusters.batch_worker 16 " in script
    assert not [words for words in BOOKED[where] if words not in script], script


def test_jobs_in_a_container_start_the_python_of_the_image(tmp_path):
    (image,) = [block["jobqueue"]["slurm"] for block in SETTINGS if "python" in block["jobqueue"].get("slurm", {})]
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml"))
    with dask.config.set({"jobqueue.slurm": dask.config.get("jobqueue.slurm") | {"memory": "1GB"} | image}):
        lines = campaign.job_script("slurm").splitlines()
    assert any(line.startswith(f"{image['python']} -P -m jamlab.clusters.batch_worker") for line in lines), lines


@pytest.mark.slow
def test_the_steps_of_the_page_lead_to_slurm_and_back(tmp_path):
    """The commands of jamlab as they stand there; the cluster is this machine, whose folders are copied."""
    section = PAGE.partition("## From a laptop to SLURM and back")[2].partition("\n## ")[0]
    lines = [
        line.strip()
        for block in re.findall(r"^ *```text\n(.*?)^ *```$", section, re.M | re.S)
        for line in block.split("\n")
    ]
    laptop, cluster = tmp_path / "laptop", tmp_path / "cluster"
    cluster.mkdir()
    laptop.mkdir()
    written(laptop / "small.toml", name="small", seeds=6, compress=None, onset=True)
    place, said = laptop, {}
    with FakeBatch(tmp_path / "fake", walltime="00:02:00") as batch:
        environment = batch.environment() | {"OMP_NUM_THREADS": "1"}
        for line in lines:
            if line.startswith("rsync"):
                other = cluster if place == laptop else laptop
                place = shutil.copytree(place, other, dirs_exist_ok=True)
            if line.startswith("jamlab campaign"):
                words = [sys.executable, "-m", *shlex.split(line)]
                done = subprocess.run(words, cwd=place, env=environment, capture_output=True, text=True, check=False)
                assert done.returncode == 0, (line, done.stderr)
                said[line] = done.stdout
    assert said["jamlab campaign run small.toml --pilot"].startswith("1 tasks finished, 0 failed")
    assert said["jamlab campaign run small.toml --scheduler slurm --jobs 20"].startswith("5 tasks finished, 0 failed")
    assert json.loads(said["jamlab campaign status small.toml --json"])["left"] == 0
    assert (laptop / "tables" / "states.csv").read_text().count("\n") == 7
    assert len(said) == 8
