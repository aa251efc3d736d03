"""Campaigns that are killed, run out of disk or find damaged files: what is there afterwards is whole and right."""

import json
import random
import subprocess
import sys
import time

import h5py
import numpy as np
import psutil
import pytest
from campaigns import compression

import jamlab
from jamlab.campaign.driver import remaining_tasks, run_task
from jamlab.campaign.tasks import batches


def write_file(folder, **changes):
    return compression(folder / "c.toml", **changes)


def start_driver(path, *options, workers=2):
    """A driver in a process of its own, as from the shell; what it says on stderr is in the file c.log."""
    line = [
        sys.executable,
        "-m",
        "jamlab.cli.main",
        "campaign",
        "resume",
        str(path),
        "--workers",
        str(workers),
        *options,
    ]
    with open(path.with_suffix(".log"), "w") as log:
        return subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=log)


def descendants(driver):
    try:
        return psutil.Process(driver.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


def workers_of(driver):
    found = []
    for process in descendants(driver):
        try:
            if "jamlab.processes.child" in " ".join(process.cmdline()):
                found.append(process)
        except psutil.Error:
            continue
    return found


def marks(folder):
    """Finished task -> what changes when its file is written again."""
    found = {}
    for file in folder.glob("tasks/*.h5"):
        stat = file.stat()
        found[file.name] = (stat.st_ino, stat.st_mtime_ns)
    return found


def contents(file):
    """Everything in a task file but the time it took and the machine."""
    found = {}
    with h5py.File(file) as opened:

        def take(name, item):
            for key, value in item.attrs.items():
                if name != "campaign" or key not in ("seconds", "cpu_seconds", "host"):
                    found[name, key] = np.asarray(value).tolist()
            if isinstance(item, h5py.Dataset):
                value = item[()]
                if name == "parameters/provenance":
                    value = [{k: v for k, v in json.loads(text).items() if k != "wall_time"} for text in value]
                    found[name] = json.dumps(value, sort_keys=True)
                elif h5py.check_string_dtype(item.dtype):
                    found[name] = value
                else:
                    found[name] = (value.dtype.str, np.shape(value), value.tobytes())

        opened.visititems(take)
    return found


def assert_same(folder, undisturbed):
    files = sorted(file.name for file in (undisturbed / "tasks").iterdir())
    assert sorted(file.name for file in (folder / "tasks").iterdir()) == files
    for name in files:
        ours, theirs = contents(folder / "tasks" / name), contents(undisturbed / "tasks" / name)
        assert ours == theirs, name
        assert len(ours) > 40  # frames, observables, tables and parameters are among them


def wait_until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.02)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The same tasks in this process."""
    campaign = jamlab.open_campaign(write_file(tmp_path_factory.mktemp("undisturbed")))
    campaign.folder.prepare()
    for task in remaining_tasks(batches(campaign.content), set()):
        assert run_task(str(campaign.folder.path), task)[0] == "finished"
    return campaign.folder.path


@pytest.mark.slow
def test_killed_worker_and_killed_driver(tmp_path, undisturbed):
    path = write_file(tmp_path)
    driver = start_driver(path)
    wait_until(lambda: len(workers_of(driver)) == 2)
    workers_of(driver)[0].kill()
    wait_until(lambda: marks(tmp_path / "c"))
    family = descendants(driver)
    assert family
    driver.kill()
    driver.wait()
    _, alive = psutil.wait_procs(family, timeout=30)
    assert not alive
    before = marks(tmp_path / "c")
    driver = start_driver(path)
    assert driver.wait() == 0, path.with_suffix(".log").read_text()
    assert marks(tmp_path / "c").items() >= before.items()  # what was finished was not done again
    assert jamlab.open_campaign(path).status(verify=True).damaged == {}
    assert_same(tmp_path / "c", undisturbed)


@pytest.mark.slow
def test_killed_at_twenty_random_moments(tmp_path):
    """60 tasks; a worker and the driver die in turn."""
    (tmp_path / "calm").mkdir()
    calm = jamlab.open_campaign(write_file(tmp_path / "calm", n=32, seeds=60, step=0.002))
    assert calm.run(2).finished == 60

    path = write_file(tmp_path, n=32, seeds=60, step=0.002)
    folder, rng = tmp_path / "c", random.Random(7)
    driver, before, again, in_flight = None, {}, [], []
    for kill in range(20):
        if driver is None or driver.poll() is not None:
            driver = start_driver(path)
            wait_until(lambda d=driver: len(workers_of(d)) == 2)
        time.sleep(rng.uniform(0.0, 4.0))
        assert driver.poll() is None, f"the campaign ended before kill {kill}: make its tasks longer"
        now = marks(folder)
        again += [name for name, mark in before.items() if now.get(name) != mark]
        before = now
        if kill % 2 == 0:
            victim = rng.choice(workers_of(driver))
            in_flight.append(1)
            victim.kill()
        else:
            family = descendants(driver)
            in_flight.append(2)
            driver.kill()
            driver.wait()
            _, alive = psutil.wait_procs(family, timeout=30)
            assert not alive, "orphans"
    driver = start_driver(path)
    assert driver.wait() == 0, path.with_suffix(".log").read_text()
    now = marks(folder)
    again += [name for name, mark in before.items() if now.get(name) != mark]
    assert not again
    status = jamlab.open_campaign(path).status(verify=True)
    assert (status.finished, status.failed, status.left, status.damaged) == (60, 0, 0, {})
    assert not list(folder.rglob(".jamlab-*.tmp"))
    assert_same(folder, calm.folder.path)
