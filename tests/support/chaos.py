"""Campaigns whose workers or drivers are killed at random moments, on any engine, and what is to be seen afterwards.

A `Place` is a folder with a campaign file and an observable that notes each of its calls, sleeps, and kills its own
process at one seed. Everything a driver starts carries a mark in its environment, by which what survives it is found.
"""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import psutil
from fake_batch import FakeBatch

import jamlab
from jamlab.campaign.tasks import batches

MARK = "JAMLAB_CHAOS"
SWEEP = """
name = "c"
[[sweep]]
name = "disks"
model = "sp"
n = 8
seeds = {count}
onset = true
observables = ["wild:call"]
{more}
"""
OBSERVABLE = """
import os
import time
from pathlib import Path

CALLS = Path(__file__).with_name("calls")


def note(word, seed):
    with open(CALLS, "a") as file:
        file.write(f"{{word}} {{seed}} {{os.getpid()}}\\n")


def call(packing):
    seed = packing.provenance["seed"]
    note("begin", seed)
    if seed == {poison}:
        time.sleep(1.0)  # a nanny of Dask whose worker dies while it starts starts no other one
        os.kill(os.getpid(), 9)
    time.sleep({long} if seed % 10 == 0 else {short})
    note("end", seed)
    return float(seed)
"""


@dataclass
class Place:
    """A campaign of disks in a folder; `poison`: seed whose observable kills its process; seconds of its sleep."""

    root: Path
    count: int = 200
    poison: int = 13
    short: float = 0.1
    long: float = 1.5
    more: str = ""  # further lines of the sweep
    apart: int = 0  # pid of a scheduler
    batch: FakeBatch | None = None

    def __post_init__(self):
        for part in ("work", "home", "tmp"):
            (self.root / part).mkdir(parents=True, exist_ok=True)
        self.file = self.root / "work" / "c.toml"
        self.file.write_text(SWEEP.format(count=self.count, more=self.more))
        content = OBSERVABLE.format(poison=self.poison, long=self.long, short=self.short)
        (self.root / "work" / "wild.py").write_text(content)

    @property
    def campaign(self):
        return jamlab.open_campaign(self.file)

    def environment(self):
        """Variables of a driver: HOME and the folder of temporary files are here, and it is marked."""
        own = {"HOME": str(self.root / "home"), "TMPDIR": str(self.root / "tmp"), MARK: str(self.root)}
        return os.environ | own | {"OMP_NUM_THREADS": "1"}

    def calls(self):
        """Begun and ended calls of the observable, each (word, seed, pid)."""
        with suppress(FileNotFoundError):
            lines = [line.split() for line in (self.root / "work" / "calls").read_text().splitlines()]
            return [(word, int(seed), int(pid)) for word, seed, pid in lines]
        return []

    def repeated(self):
        """Calls beyond the first: of all seeds but the poisonous one, and of that one."""
        begun = Counter(seed for word, seed, _ in self.calls() if word == "begin")
        again = {seed: times - 1 for seed, times in begun.items() if times > 1}
        return sum(v for seed, v in again.items() if seed != self.poison), again.get(self.poison, 0)

    def processes(self):
        """Pids of all that drivers here have started, and their own; not those of a scheduler that runs apart."""
        found = marked_processes(self.root)
        with suppress(psutil.NoSuchProcess):
            if self.apart:
                apart = psutil.Process(self.apart)
                found -= {self.apart, *(child.pid for child in apart.children(recursive=True))}
        return found

    def workers(self):
        """Pids of living workers: those that marks name or that have called the observable."""
        known = {pid for _, _, pid in self.calls()}
        for mark in (self.file.parent / "c" / "running").glob("*"):
            with suppress(OSError, ValueError, KeyError, IndexError, TypeError):
                known.add(json.loads(mark.read_text(errors="replace").splitlines()[0])["pid"])
        return sorted(known & marked_processes(self.root))

    def strangers(self):
        """Files that are neither the user's own, nor finished tasks, marks, records of runs that were killed, locks and
        copies of the campaign file."""
        usual = ("work/c.toml", "work/wild.py", "work/calls", "work/__pycache__/", "work/c/campaign.toml")
        usual += ("work/c/tasks/", "work/c/failed/", "work/c/running/", "work/c/lock.", "work/c/jobs/", "batch/")
        usual += ("home/.cache/matplotlib", "home/.config/dask")
        found = [str(path.relative_to(self.root)) for path in self.root.rglob("*") if not path.is_dir()]
        usual += tuple(f"work/c/deaths/{name}." for name in self.campaign.folder.failed())
        found = [name for name in found if not (name.startswith("work/c/deaths/") and ".interrupted." in name)]
        odd = [name for name in found if not name.startswith(usual) or "/." in name.removeprefix("home/.c")]
        return sorted(name for name in odd if not name.startswith("batch/") or name.startswith("batch/tmp/"))

    def marks(self):
        """How many marks of attempts that have not ended stand in the folder."""
        return len(list((self.file.parent / "c" / "running").glob("*")))


def content_of(campaign):
    """A digest of the packings of each finished task, and the rows of its states, times left out."""
    packings = {}
    for name in campaign.finished():
        digest = hashlib.sha256()
        for p in campaign.packings(name):
            for part in (p.positions, p.box, p.diameters):
                digest.update(part.tobytes())
            told = {key: value for key, value in p.provenance.items() if key != "wall_time"}
            digest.update(json.dumps(told, sort_keys=True, default=str).encode())
        packings[name] = digest.hexdigest()
    frame = campaign.table("states").drop(columns="seconds", errors="ignore")
    return packings, frame.sort_values(["task", "state"]).reset_index(drop=True)


def unequal(found, expected):
    """How many tasks of a campaign differ from those of another, and whether its table does."""
    packings, frame = found
    other, table = expected
    wrong = sum(other.get(name) != digest for name, digest in packings.items())
    table = table[table["task"].isin(packings)].reset_index(drop=True)
    try:
        pd.testing.assert_frame_equal(frame, table, check_exact=True)
    except AssertionError as error:
        return wrong, str(error)
    return wrong, ""


def serial(root, count, **how):
    """The same campaign, undisturbed by one worker, and its name -> seed."""
    place = Place(root, count, poison=-1, short=0.0, long=0.0, **how)
    campaign = place.campaign
    assert campaign.run(1).finished == count
    seeds = {task.name: task.parameters.seed for batch in batches(campaign.content) for task in batch.tasks()}
    return content_of(campaign), seeds


class Killer(threading.Thread):
    """Kills a worker of a place whenever some more calls have ended, up to `between` of them, until it is stopped: so
    often that each worker is hit, and that no innocent task is hit six times on a slow machine."""

    def __init__(self, place, seed, between):
        super().__init__(daemon=True)
        self.place, self.chance, self.between, self.kills = place, random.Random(seed), between, 0
        self.stopped = threading.Event()

    def _ended(self):
        return sum(word == "end" for word, _, _ in self.place.calls())

    def _settled(self, pid):
        """Whether it has begun long enough ago for a nanny of Dask to know it, which would start no other one."""
        with suppress(psutil.NoSuchProcess):
            return time.time() - psutil.Process(pid).create_time() > 4.0
        return False

    def run(self):
        following = self.chance.randint(1, self.between)
        while not self.stopped.wait(self.chance.uniform(0.0, 0.3)):
            if self._ended() >= following and (workers := [pid for pid in self.place.workers() if self._settled(pid)]):
                with suppress(ProcessLookupError):
                    os.kill(self.chance.choice(workers), signal.SIGKILL)
                    self.kills += 1
                following = self._ended() + self.chance.randint(2, self.between)


@contextmanager
def engine(name, place, **batch):
    """Words and environment of a driver on an engine: "pool", "scheduler" (Dask's, which runs already), "slurm" or
    another batch system, or one of `chaos_drivers.py`."""
    command = [sys.executable, "-m", "jamlab.cli", "campaign", "run", "c.toml", "--json"]
    if name == "pool":
        yield [*command, "--workers", "2"], place.environment()
    elif name == "scheduler":
        with running_scheduler(place) as address:
            yield [*command, "--scheduler", address], place.environment()
    elif name in ("slurm", "pbs", "sge", "lsf", "oar", "moab", "htcondor"):
        with FakeBatch(place.root / "batch", **batch) as system:
            own = place.environment()
            path = system.environment()["PATH"]
            own |= {"PATH": path, "DASK_CONFIG": str(place.root / "batch/home/.config/dask")}
            place.batch = system
            yield [*command, "--scheduler", name, "--jobs", "2"], own
    else:
        driver = str(Path(__file__).with_name("chaos_drivers.py"))
        yield [sys.executable, driver, name, "c.toml"], place.environment()


@contextmanager
def running_scheduler(place):
    """Address of a Dask scheduler with two workers, in processes that are no part of the place."""
    code = (
        "import dask, sys\n"
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        "    dask.config.set({'distributed.deploy.lost-worker-timeout': '1h'})\n"  # else two deaths in 15 s end it
        "    cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)\n"
        "    print(cluster.scheduler_address, flush=True)\n"
        "    sys.stdin.read()\n"
        "    cluster.close()\n"
    )
    folder = place.root.with_name(place.root.name + "-cluster")
    folder.mkdir(exist_ok=True)
    script = folder / "cluster.py"
    script.write_text(code)
    how = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    own = os.environ | {"TMPDIR": str(folder), MARK: str(place.root)}
    process = subprocess.Popen([sys.executable, str(script)], cwd=folder, env=own, **how)
    try:
        address = process.stdout.readline().strip()
        place.apart = process.pid
        yield address
    finally:
        process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            process.wait(20)
        process.kill()
        process.wait()
        process.stdout.close()
        place.apart = 0
        for pid in place.processes():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


@contextmanager
def short_root():
    """A folder with a short name, since sockets stand in folders of temporary files; nothing there outlives the
    block."""
    path = Path(tempfile.mkdtemp(prefix="chaos-", dir="/tmp")) / "p"
    try:
        yield path
    finally:
        for pid in marked_processes(path):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        shutil.rmtree(path.parent, ignore_errors=True)


def marked_processes(root):
    """Pids of all that drivers with a place there have started, and their own."""
    mark, found = f"{MARK}={root}".encode(), set()
    for entry in filter(str.isdecimal, os.listdir("/proc")):
        with suppress(OSError):
            if mark in Path(f"/proc/{entry}/environ").read_bytes().split(b"\0"):
                found.add(int(entry))
    return found


def start(words, environment, place):
    """Start a driver; its output goes to files outside the place."""
    folder = place.root.with_name(place.root.name + "-said")
    folder.mkdir(exist_ok=True)
    said = [open(folder / name, "w") for name in ("out", "err")]
    how = {"stdin": subprocess.DEVNULL, "stdout": said[0], "stderr": said[1], "start_new_session": True}
    process = subprocess.Popen(words, cwd=place.file.parent, env=environment, **how)
    for file in said:
        file.close()
    return process, lambda: [(folder / name).read_text() for name in ("out", "err")]


def gone(condition, most):
    """Seconds until a condition holds; None if it does not within `most`."""
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > most:
            return None
        time.sleep(0.1)
    return time.monotonic() - began
