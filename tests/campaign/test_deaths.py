"""Deaths of workers: only a task that began is charged, the one to blame fails, and all others finish to equal bits."""

import errno
import json
import math
import os
import re
import signal
import subprocess
import threading
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from campaigns import assert_same, run_here, written
from dying_workers import BeganAgain, CutOff, KilledAtRandom, Worker, in_a_fork

import jamlab
from jamlab.campaign import deaths, driver, marks, workers
from jamlab.campaign.deaths import CUT, DEATH, INTERRUPTED, WALLTIME, counts, kind_of_end
from jamlab.campaign.marks import Mark, marked, marks_of, read_marks
from jamlab.campaign.observable import TaskStates
from jamlab.errors import EngineError, StorageError
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.scratch_folder import scratch_folder

POISON = 5
SLOW = pytest.mark.slow


@pytest.fixture(scope="module")
def onset():
    return jamlab.jam(8, "sp", 1)


@pytest.fixture
def cheap(monkeypatch, onset):
    """Make packings in no time, which differ from seed to seed; `cheap` is called with each seed before."""

    def nothing(seed):
        pass

    calls = [nothing]

    def make(parameters, ranks):
        calls[0](parameters.seed)
        positions = onset.positions + 1e-9 * np.random.default_rng(parameters.seed).random(onset.positions.shape)
        packing = replace(onset, positions=positions, provenance=onset.provenance | {"seed": parameters.seed})
        return TaskStates([packing], [math.nan], [True], [])

    monkeypatch.setattr(workers, "make_states", make)
    return lambda function: calls.__setitem__(0, function)


def campaign_of(folder, seeds, **keys):
    folder.mkdir(exist_ok=True)
    return jamlab.open_campaign(written(folder / "c.toml", n=8, seeds=seeds, compress=None, onset=True, **keys))


def kill(number=signal.SIGKILL):
    os.kill(os.getpid(), number)


def poison(seed):
    if seed == POISON:
        kill()


def ends(folder):
    """What the folder holds beside finished tasks: marks, and records of deaths by kind."""
    found = Counter()
    for each in counts(folder.path).values():
        found += each
    return len(read_marks(folder.path)), dict(found)


@pytest.mark.parametrize(
    ("count", "chunk"),
    [(8, 4), *(pytest.param(*each, marks=SLOW) for each in ((16, 1), (16, 8), (200, 1), (200, 25)))],
)
def test_random_kills_and_one_poisonous_task(tmp_path, cheap, count, chunk):
    """All tasks but one finish to the bits of an undisturbed run, and that one fails."""
    quiet = campaign_of(tmp_path / "quiet", [seed for seed in range(1, count + 1) if seed != POISON])
    run_here(quiet)
    cheap(poison)
    campaign = campaign_of(tmp_path / "killed", count, chunk=chunk)
    executor = KilledAtRandom(0.3, 0.02 * chunk, seed=chunk)
    ran = campaign.run(executor)
    assert (ran.finished, ran.failed, ran.left) == (count - 1, 1, 0) and executor.kills
    ((name, record),) = campaign.folder.failures().items()
    assert record["label"] == f"sp n=8 seed={POISON}" and record["reason"].startswith("its worker died ")
    assert ends(campaign.folder)[0] == 0 and counts(campaign.folder.path)[name][DEATH] >= 6
    assert_same(campaign, quiet, ["states"])


def test_what_never_began_charges_nobody(tmp_path, cheap):
    """Workers that die before they begin; many in a row end the run, since none can start."""
    campaign = campaign_of(tmp_path, 2)

    class Dead(Worker):
        left = 12

        def call(self, function, arguments):
            self.left -= 1
            return (9, None) if self.left >= 0 else (0, function(*arguments))

    assert campaign.run(Dead()).finished == 2 and ends(campaign.folder) == (0, {})
    more = campaign_of(tmp_path, 4)
    Dead.left = 14
    with pytest.raises(EngineError) as caught:
        more.run(Dead())
    assert "ended with 9" in str(caught.value) and more.status().left == 2 and ends(more.folder) == (0, {})


@pytest.mark.parametrize("times", [5, 6])
def test_a_task_whose_worker_dies_more_than_five_times_fails(tmp_path, cheap, times):
    """Counted over runs: the driver ends after each; `retry_failed` forgets them."""
    campaign = campaign_of(tmp_path, 1)
    (tmp_path / "left").write_text(str(times))

    def die(seed):
        left = int((tmp_path / "left").read_text())
        if left:
            (tmp_path / "left").write_text(str(left - 1))
            kill(signal.SIGSEGV)

    cheap(die)
    ran = campaign.run(Worker())
    assert (ran.finished, ran.failed) == ((1, 0) if times == 5 else (0, 1))
    assert ends(campaign.folder) == (0, {} if times == 5 else {DEATH: 6})
    if times == 6:
        (record,) = campaign.status().failures.values()
        assert record["reason"].startswith("its worker died 6 times, ")
        assert "its process ended with -11, Segmentation fault, File " in record["reason"]  # where Python has a line
        assert "in kill" in record["reason"]
        assert campaign.run(Worker(), retry_failed=True).finished == 1 and ends(campaign.folder) == (0, {})


def test_kills_of_the_driver_fail_no_task(tmp_path, cheap):
    """Each leaves a mark, which is no death; from the third on a warning names the task."""
    campaign = campaign_of(tmp_path, 2)
    cheap(lambda seed: kill() if seed == 2 else None)
    for _ in range(7):
        assert in_a_fork(campaign.run, InProcess())[0] == -signal.SIGKILL
        assert len(read_marks(campaign.folder.path)) == 1
    cheap(lambda seed: None)
    with pytest.warns(jamlab.JamlabWarning, match="sp n=8 seed=2: 7 runs were killed while it was under way"):
        assert (campaign.run(InProcess()).finished, campaign.status().failed) == (1, 0)
    assert ends(campaign.folder) == (0, {}) and campaign.status().finished == 2


def test_workers_that_outlive_their_driver_for_a_moment_leave_nothing(tmp_path, cheap):
    """The next run waits for those of this machine, and removes what they were writing."""
    cheap(lambda seed: None)
    campaign = campaign_of(tmp_path, 1)
    campaign.folder.prepare()
    worker = subprocess.Popen(["sleep", "30"])
    said = {"task": "a" * 32, "began": time.time(), "host": os.uname().nodename, "pid": worker.pid}
    (campaign.folder.path / "running" / "1-of-1.ab.1.1").write_text(json.dumps(said))
    node = re.sub(r"\W", "_", os.uname().nodename)[:100]
    (campaign.folder.path / "tasks" / f".jamlab-{node}-{worker.pid}-0123456789abcdef.tmp").write_text("half")
    threading.Timer(0.4, lambda: (worker.kill(), worker.wait())).start()
    assert campaign.run(InProcess()).finished == 1
    assert not list(campaign.folder.path.rglob(".jamlab-*")) and not read_marks(campaign.folder.path)


class InProcess(Worker):
    """The driver is its own worker."""

    def call(self, function, arguments):
        return 0, function(*arguments)


def test_the_end_of_a_run_takes_its_marks_along(tmp_path, cheap):
    """By Ctrl-C: marks of other shares stay, and the lock says that nothing runs."""
    campaign = campaign_of(tmp_path, 3)
    campaign.folder.prepare()
    other = campaign.folder.path / "running" / "2-of-2.ab.1.1"
    seen = []

    def stop(seed):
        seen.append(len(read_marks(campaign.folder.path)))
        raise KeyboardInterrupt

    cheap(stop)
    other.write_text("")
    with pytest.raises(KeyboardInterrupt):
        campaign.run(InProcess(), share=(1, 2))
    assert seen == [2] and [mark.path for mark in read_marks(campaign.folder.path)] == [other]
    assert (campaign.folder.path / "lock.1-of-2").read_text() == ""
    cheap(lambda seed: None)
    assert campaign.run(InProcess()).finished == 3
    assert not other.exists()  # a whole run excludes all shares


def test_a_worker_that_was_cut_off_and_ends_late_harms_nothing(tmp_path, cheap, monkeypatch):
    """It writes the same file again, or sees that its run is over."""
    monkeypatch.setattr(workers, "_PAUSE", 0.0)
    campaign, late = campaign_of(tmp_path, 2), CutOff(1)
    assert campaign.run(late).finished == 2
    before = {path.name: path.stat().st_mtime_ns for path in (campaign.folder.path / "tasks").iterdir()}
    ((function, arguments),) = late.cut_off
    function(*arguments)
    assert before == {path.name: path.stat().st_mtime_ns for path in (campaign.folder.path / "tasks").iterdir()}
    assert ends(campaign.folder) == (0, {})


def test_a_mark_of_a_live_worker_may_go_and_it_ends_all_the_same(tmp_path):
    """Its driver took it for dead."""
    (tmp_path / "running").mkdir()
    with marked(tmp_path, "1-of-1.ab.1") as (at, earlier):
        at("a" * 32)
        (mark,) = marks_of(tmp_path, "1-of-1.ab.1")
        assert (mark.task, earlier) == ("a" * 32, [])
        marks.remove([mark.path])
        at("b" * 32)
    assert not read_marks(tmp_path)


def test_what_a_dead_worker_was_writing_is_removed(tmp_path, cheap, monkeypatch):
    """Half of a file, and a folder of LAMMPS; the files of living workers stay."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)

    def die(seed):
        if seed == 2:
            with atomic_file(tmp_path / "c" / "tasks" / "a.h5"), scratch_folder():
                kill()

    cheap(die)
    campaign = campaign_of(tmp_path, 2)
    with scratch_folder() as living:
        assert campaign.run(Worker()).failed == 1 and living.exists()
        assert [path.name for path in tmp_path.glob("jamlab-*")] == [living.name]
    assert not list(tmp_path.rglob(".jamlab-*")) and ends(campaign.folder) == (0, {DEATH: 6})


def test_an_engine_that_begins_calls_again_by_itself_charges_each_death(tmp_path, cheap):
    cheap(lambda seed: kill() if seed == 2 else None)
    campaign = campaign_of(tmp_path, 3)
    ran = campaign.run(BeganAgain())
    assert (ran.finished, ran.failed) == (2, 1)
    assert ends(campaign.folder) == (0, {DEATH: 6})  # four times in a call, then twice, which are enough


def test_a_failure_that_was_recorded_before_the_worker_died_is_told_once(tmp_path, cheap, monkeypatch):
    begun = []

    def fail(seed):
        (tmp_path / f"begun.{seed}.{len(list(tmp_path.glob('begun.*')))}").touch()
        raise EngineError("no minimum")

    def die(paths):
        kill()

    cheap(fail)
    campaign = campaign_of(tmp_path, 2)
    monkeypatch.setattr(marks, "remove", die)
    outcomes = []
    campaign.run(Worker(), done=outcomes.append)
    assert [outcome.line for outcome in outcomes] == [f"sp n=8 seed={seed}: no minimum" for seed in (1, 2)]
    assert len(list(tmp_path.glob("begun.*"))) == 2 and not begun and ends(campaign.folder) == (0, {})


@pytest.mark.parametrize("where", ["open", "pwrite"])
def test_a_folder_that_is_full_as_a_mark_is_made_ends_the_run(tmp_path, cheap, monkeypatch, where):
    usual = os.open

    def full(path, *arguments):
        if where == "pwrite" or "running" in str(path):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return usual(path, *arguments)

    campaign = campaign_of(tmp_path, 2)
    with monkeypatch.context() as patch, pytest.raises(StorageError) as caught:
        patch.setattr(os, where, full)
        campaign.run(InProcess())
    assert "No space left" in str(caught.value) and "resume" in str(caught.value)
    assert ends(campaign.folder) == (0, {}) and not campaign.folder.failed()
    assert campaign.run(InProcess()).finished == 2


HALVES = [b'{"task": "abc', b"\xff\0" * 200, *(pytest.param(each, marks=SLOW) for each in (b"", b"[1]" + b" " * 317))]


@pytest.mark.parametrize("content", HALVES)
def test_a_mark_that_was_half_written_is_still_a_beginning(tmp_path, cheap, monkeypatch, content):
    """Of a task alone it says who died; of a chunk that it is to be cut, until it is known."""
    campaign = campaign_of(tmp_path, 4, chunk=4)

    def die(seed):
        if seed == 3:
            (path,) = (campaign.folder.path / "running").iterdir()
            path.write_bytes(content)
            kill()

    cheap(die)
    ran = campaign.run(Worker())
    assert (ran.finished, ran.failed) == (3, 1) and ends(campaign.folder) == (0, {DEATH: 6})


def test_a_worker_that_sees_another_folder_ends_the_run(tmp_path, cheap, monkeypatch):
    monkeypatch.setattr(workers, "_PAUSE", 0.0)
    campaign, other = campaign_of(tmp_path, 2), tmp_path / "other"
    monkeypatch.setattr(driver, "Call", lambda place, *rest: workers.Call(str(other), *rest))
    for _ in range(2):
        with pytest.raises(StorageError) as caught:
            campaign.run(InProcess())
        assert f"sees another folder as {other}" in str(caught.value) and str(caught.value).count("\n") == 0
        (other / "running").mkdir(exist_ok=True, parents=True)
        (other / "lock.1-of-1").write_text("1-of-1.0123456789abcdef")
    assert not list((other / "running").iterdir()) and campaign.status().left == 2


def test_a_worker_of_another_version_ends_the_run(tmp_path, cheap, monkeypatch):
    """It would give tasks other names."""
    campaign = campaign_of(tmp_path, 1)
    monkeypatch.setattr(driver, "Call", lambda place, chunk, first, *rest: workers.Call(place, chunk, "0" * 32, *rest))
    with pytest.raises(StorageError) as caught:
        campaign.run(InProcess())
    assert "another version of jamlab" in str(caught.value) and campaign.status().left == 1


def test_a_function_that_exits_fails_its_task_alone(tmp_path, cheap):
    def leave(seed):
        if seed == 2:
            raise SystemExit(3)

    cheap(leave)
    campaign = campaign_of(tmp_path, 3, chunk=3)
    ran = campaign.run(Worker())
    assert (ran.finished, ran.failed) == (2, 1) and ends(campaign.folder) == (0, {})
    (record,) = campaign.status().failures.values()
    assert record["reason"] == "a called function exited: sys.exit(3)"


def test_nobody_is_charged_where_an_engine_breaks_as_a_whole(tmp_path, cheap, monkeypatch):
    """Each call under way comes back, and nobody knows whose fault it is."""
    cheap(lambda seed: kill() if (breaks := tmp_path / "left").exists() and not breaks.unlink() else None)
    charged = []
    monkeypatch.setattr(driver, "record_death", lambda *arguments: charged.append(arguments))

    class Breaks(Worker):
        def submit(self, function, /, *arguments):
            future = super().submit(function, *arguments)
            if future.exception() is not None:
                future = type(future)()
                future.cancel()
                future.set_running_or_notify_cancel()
            return future

    campaign = campaign_of(tmp_path, 1)
    (tmp_path / "left").touch()
    assert campaign.run(Breaks()).finished == 1 and not (tmp_path / "left").exists()
    assert not charged and ends(campaign.folder) == (0, {})


def ended(began, job_ends, trace="", process_began=0.0):
    return Mark(Path("mark"), "a" * 32, "elsewhere", 1, began, process_began, job_ends, trace, 0.0)


STACK = 'Stack (most recent call first):\n  File "x.py", line 3 in f'
CRASH = f"Fatal Python error: Segmentation fault\n\n{STACK}"


@pytest.mark.parametrize(
    ("mark", "now", "kind"),
    [
        (ended(5.0, None), 10.0, DEATH),
        (ended(5.0, None, CRASH), 10.0, DEATH),
        (ended(5.0, None, STACK), 10.0, CUT),  # SIGTERM of a job whose end is not known, or of a user
        (ended(5.0, 1000.0), 900.0, DEATH),
        (ended(5.0, 1000.0, STACK), 900.0, CUT),  # preempted
        (ended(5.0, 1000.0), 950.0, WALLTIME),
        (ended(5.0, 1000.0, STACK), 1100.0, WALLTIME),
        (ended(500.0, 1000.0), 999.0, CUT),
        (ended(500.0, 1000.0, process_began=480.0), 999.0, WALLTIME),
        (ended(5.0, 1000.0, CRASH), 999.0, DEATH),
        (ended(math.nan, 1000.0), 999.0, CUT),
        (ended(1.0, 20.0), 17.0, DEATH),  # short jobs, such as of a test
        (ended(1.0, 20.0), 19.5, WALLTIME),
        (ended(1.0, 20.0, STACK), 20.0, WALLTIME),
    ],
)
def test_the_end_of_a_job_is_told_from_a_death(mark, now, kind):
    assert kind_of_end(mark, now) == kind


@pytest.mark.parametrize(("kind", "most"), [(DEATH, 5), (WALLTIME, 1), (CUT, 20), (INTERRUPTED, None)])
def test_how_often_a_task_survives(tmp_path, kind, most):
    for k in range(1, 30):
        mark = (
            ended(0.0, 3600.0)._replace(path=tmp_path / f"1-of-1.ab.{k}.1")
            if False
            else replace(ended(0.0, 3600.0), path=tmp_path / f"1-of-1.ab.{k}.1")
        )
        deaths.record_death(tmp_path, "a" * 32, kind, mark, "signal 9 (Killed)")
        deaths.record_death(tmp_path, "a" * 32, kind, mark, "signal 9 (Killed)")  # whoever else hears of it
        why = deaths.why_it_fails(tmp_path, "a" * 32, 0.0)
        assert (why is not None) == (most is not None and k > most)
    assert why is None or "29 times, by signal 9 (Killed)" in why
    assert kind != WALLTIME or "longer than the walltime (3600 s)" in why
    deaths.forget_deaths(tmp_path, ["a" * 32])
    assert not counts(tmp_path)


def test_deaths_that_chance_explains_are_no_fault(tmp_path):
    """Where a worker is killed in a hundred seconds of work, a task of ten minutes may die six times, and one of six
    seconds does not."""

    def why(seconds, rate, times=6, crash=""):
        for k in range(times):
            mark = replace(ended(time.time() - seconds, None, crash), path=Path(f"1-of-1.ab.{seconds}{crash[:1]}{k}.1"))
            deaths.record_death(tmp_path, f"{seconds:032}{crash[:1]}", DEATH, mark)
        return deaths.why_it_fails(tmp_path, f"{seconds:032}{crash[:1]}", rate)

    assert why(6, 0.01) and not why(600, 0.01)
    assert why(6, 0.0) and why(600, 0.0)
    assert not why(6, math.inf) and why(601, math.inf, times=31)
    assert why(602, math.inf, crash=CRASH)


def test_many_kills_fail_no_task_but_the_one_to_blame(tmp_path, cheap, monkeypatch):
    """Each worker is killed as often as not, by the clock of a task that takes an hour."""
    clock = [1e9]
    chance = np.random.default_rng(3)
    monkeypatch.setattr(marks.time, "time", lambda: clock[0])

    class Hostile(InProcess):
        """Dies in the course of a call, of which it leaves the mark."""

        def call(self, function, arguments):
            try:
                answer = function(*arguments)
            except Killed:
                return 1, None
            return 0, answer

    class Killed(BaseException):
        pass

    def work(seed):
        moment = chance.exponential(2500.0)
        clock[0] += min(moment, 3600.0 if seed != POISON else 60.0)
        if moment < 3600.0 or seed == POISON:
            raise Killed

    monkeypatch.setattr(
        driver.Kills,
        "end",
        lambda self, task, seconds, end=driver.Kills.end: end(self, task, 3600.0 if seconds == seconds else seconds),
    )
    cheap(work)
    campaign = campaign_of(tmp_path, 20)
    ran = campaign.run(Hostile())
    assert (ran.finished, ran.failed) == (19, 1)
    (record,) = campaign.status().failures.values()
    assert record["label"].endswith(f"seed={POISON}")


def test_a_task_longer_than_the_job_fails_at_its_second_job(tmp_path, cheap, monkeypatch):
    """The driver of a share ends with its job, in order, and so does the count."""
    now = time.time()
    monkeypatch.setenv("JAMLAB_JOB_ENDS", str(now + 30.0))
    monkeypatch.setattr(marks, "_process_began", lambda: now - 970.0)
    monkeypatch.setattr(marks.time, "time", lambda: now - 960.0)
    campaign = campaign_of(tmp_path, 1)

    def interrupt(seed):
        monkeypatch.setattr(marks.time, "time", lambda: now)
        raise KeyboardInterrupt

    cheap(interrupt)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            campaign.run(InProcess())
        assert ends(campaign.folder)[0] == 0
        monkeypatch.setattr(marks.time, "time", lambda: now - 960.0)
    ran = campaign.run(InProcess())
    assert (ran.finished, ran.failed) == (0, 1)
    (record,) = campaign.status().failures.values()
    assert record["reason"].startswith("it takes longer than the walltime (1000 s): ")


def test_tasks_of_the_same_packings_make_them_once(tmp_path, cheap):
    """One runs first; the others find what it stored."""
    made = []
    cheap(made.append)
    text = written(tmp_path / "c.toml", n=8, seeds=3, compress=None, onset=True).read_text()
    (tmp_path / "c.toml").write_text(
        text
        + text.partition("\n")[2]
        .replace("disks", "more")
        .replace("onset = true", 'onset = true\nobservables = ["voids"]')
    )
    assert jamlab.open_campaign(tmp_path / "c.toml").run(InProcess()).finished == 6
    assert sorted(made) == [1, 2, 3]
