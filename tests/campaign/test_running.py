"""Runs in the background, as in a notebook: they do not block, say how far they are, and end when they are told to."""

import asyncio
import fcntl
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future

import psutil
import pytest
from campaigns import written

import jamlab
from jamlab.campaign import workers
from jamlab.errors import InputError, StorageError
from jamlab.processes.child import child_environment

KEYS = {"n": 8, "compress": None, "phi": [0.7], "seeds": 4}


class OnDemand(Executor):
    """Runs as many calls as it is allowed to, in the thread that allows them."""

    num_workers = 1

    def __init__(self):
        self.calls = []
        self.came = threading.Semaphore(0)

    def submit(self, function, /, *arguments):
        future = Future()
        self.calls.append((future, function, arguments))
        self.came.release()
        return future

    def run(self, count=1):
        for _ in range(count):
            assert self.came.acquire(timeout=20)
            future, function, arguments = self.calls.pop(0)
            if future.set_running_or_notify_cancel():
                future.set_result(function(*arguments))


@pytest.fixture
def campaign(tmp_path):
    return jamlab.open_campaign(written(tmp_path / "c.toml", **KEYS))


def until(holds):
    end = time.monotonic() + 20
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_run_does_not_block_and_says_how_far_it_is(campaign):
    crew, told = OnDemand(), []
    running = campaign.start(crew, done=lambda outcome: told.append(outcome.state))
    crew.run(2)
    until(lambda: running.status().finished == 2)
    standing = running.status()
    assert (standing.tasks, standing.failed, standing.workers, running.done) == (4, 0, 1, False)
    assert 0 < standing.share < 1 and standing.seconds_left > 0 and standing.rate > 0
    assert repr(running).startswith("campaign c, running: 2 of 4 tasks, ") and "1 worker" in repr(running)
    assert (
        f'value="{running.status().share:.4f}"' in running._repr_html_() and repr(running)[:30] in running._repr_html_()
    )
    with pytest.raises(TimeoutError):
        running.wait(0.01)
    crew.run(2)
    ran = running.wait()
    assert (ran.finished, ran.left, told) == (4, 0, ["finished"] * 4)
    assert running.done and repr(running).startswith("campaign c, finished: 4 of 4 tasks")
    assert running.status().share == 1 and running.stop() == running.status()
    assert "finished" in repr(running)  # to stop it afterwards changes nothing


def test_a_run_that_is_stopped_resumes(campaign, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    crew = OnDemand()
    running = jamlab.open_campaign("c.toml").start(crew)
    monkeypatch.chdir(tmp_path.parent)  # as another cell may
    crew.run(1)
    until(lambda: running.status().finished == 1)
    assert running.stop().finished == 1
    assert all(future.cancelled() for future, *_ in crew.calls)
    assert (running.wait().finished, running.wait().left) == (1, 3)
    assert repr(running).startswith("campaign c, stopped: 1 of 4 tasks")
    assert not list((campaign.folder.path / "running").iterdir())
    again = OnDemand()
    running = campaign.start(again)  # the lock is free
    again.run(3)
    assert running.wait().finished == 3
    assert running.status().finished == 4


def test_a_run_is_awaited_beside_others(campaign, tmp_path):
    other = jamlab.open_campaign(written(tmp_path / "d.toml", name="d", **KEYS | {"seeds": 2}))
    first, second = OnDemand(), OnDemand()

    async def work():
        runs = [campaign.start(first), other.start(second)]
        assert await asyncio.sleep(0, "not blocked") == "not blocked"
        second.run(2)
        first.run(4)
        return await asyncio.gather(*runs)

    assert [ran.finished for ran in asyncio.run(work())] == [4, 2]


@pytest.mark.skipif(threading.current_thread() is not threading.main_thread(), reason="signals come to the main thread")
def test_a_cell_that_is_interrupted_stops_its_run(campaign):
    """Jupyter cancels the cell, by a call that does not wake its loop."""
    crew = OnDemand()

    async def work():
        loop, cell = asyncio.get_running_loop(), asyncio.ensure_future(asyncio.wait_for(running, None))
        usual = signal.signal(signal.SIGINT, lambda *_: loop.call_soon(cell.cancel))
        late = loop.call_later(10, crew.run, 3)
        threading.Timer(0.2, signal.pthread_kill, (threading.main_thread().ident, signal.SIGINT)).start()
        try:
            with pytest.raises(asyncio.CancelledError):
                await cell
        finally:
            signal.signal(signal.SIGINT, usual)
            late.cancel()

    running = campaign.start(crew)
    crew.run(1)
    until(lambda: running.status().finished == 1)
    asyncio.run(work())
    assert running.done and running.wait().left == 3


@pytest.mark.skipif(threading.current_thread() is not threading.main_thread(), reason="signals come to the main thread")
def test_an_interrupt_while_it_waits_stops_the_run(campaign):
    crew = OnDemand()
    running = campaign.start(crew)
    crew.run(1)
    timer = threading.Timer(0.2, signal.pthread_kill, (threading.main_thread().ident, signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        running.wait()
    assert running.done and running.wait().left == 3


def test_errors_are_raised_where_the_run_is_awaited(campaign):
    with pytest.raises(InputError, match="share"):
        campaign.start(share=(2, 1))
    with pytest.raises(InputError, match="no sweep"):
        campaign.start(only=["none"])
    crew = OnDemand()
    first = campaign.start(crew)
    assert crew.came.acquire(timeout=20)
    crew.came.release()
    second = campaign.start(OnDemand())
    with pytest.raises(StorageError, match="another process"):
        second.wait()
    with pytest.raises(StorageError, match="another process"):
        asyncio.run(asyncio.wait_for(second, 5))
    assert repr(second).startswith("campaign c, failed: StorageError: another process")
    first.stop()


def test_status_counts_what_workers_are_at(campaign, here, monkeypatch):
    seen, make = [], workers.make_states
    monkeypatch.setattr(workers, "make_states", lambda *how: [seen.append(campaign.status().running), make(*how)][1])
    campaign.run(1)
    assert seen == [1] * 4 and campaign.status().running == 0


def test_status_does_not_count_the_marks_of_a_run_that_was_killed(campaign):
    folder = campaign.folder.path
    (folder / "running").mkdir(parents=True)
    (folder / "running" / "1-of-1.0a.7.1").write_bytes(b"")
    (folder / "lock.1-of-1").write_text("1-of-1.0a")
    assert campaign.status().running == 0
    with open(folder / "lock.1-of-1") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert campaign.status().running == 1
    (folder / "lock.1-of-1").write_text("1-of-1.0b")
    with open(folder / "lock.1-of-1") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert campaign.status().running == 0


@pytest.mark.slow
@pytest.mark.parametrize("end", ["exit", "SIGINT", "SIGTERM", "SIGKILL"])
def test_a_process_that_ends_leaves_no_worker(tmp_path, end):
    written(tmp_path / "c.toml", **KEYS | {"n": 512, "phi": None, "onset": True, "seeds": 20})
    script = f"""
import jamlab, os, time
running = jamlab.open_campaign("c.toml").start(2)
while not (os.path.isdir("c/running") and len(os.listdir("c/running")) == 2):
    time.sleep(0.05)
print("up", flush=True)
time.sleep(2)
if {end!r} != "exit":
    running.wait()
"""
    how = {"cwd": tmp_path, "env": child_environment(), "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", script], text=True, **how)
    assert process.stdout.readline() == "up\n"
    workers = psutil.Process(process.pid).children(recursive=True)
    assert len(workers) == 2
    if end != "exit":
        process.send_signal(signal.Signals[end])
    said = process.communicate(timeout=60)[1]
    assert not psutil.wait_procs(workers, timeout=10)[1]
    assert (end == "exit") == (process.returncode == 0) and "Fatal" not in said
    if end in ("exit", "SIGINT"):  # the others end Python at once
        assert not os.listdir(tmp_path / "c" / "running") and not os.listdir(tmp_path / "c" / "failed")
