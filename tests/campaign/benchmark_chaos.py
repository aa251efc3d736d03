"""Campaigns whose workers and drivers are killed at random moments, on every engine: what is lost, and what is left.

    pytest -m benchmark -s tests/campaign/benchmark_chaos.py -k "workers and pool"

JAMLAB_CHAOS_SEED sets the random moments (printed; default: the clock), JAMLAB_CHAOS_MOMENTS how many drivers each
signal ends (20), JAMLAB_CHAOS_TASKS how many tasks run while workers are killed (200). Two cores suffice; a row takes
a minute or two. With JAMLAB_RESULTS, each row is appended there to `workers.jsonl` or `drivers.jsonl`, and the serial
run to which all are compared is kept there.
"""

import json
import os
import pickle
import random
import shutil
import signal
import time
from pathlib import Path

import pytest
from chaos import Killer, Place, content_of, engine, gone, serial, short_root, start, unequal

import jamlab

pytestmark = pytest.mark.benchmark
SEED = int(os.environ.get("JAMLAB_CHAOS_SEED") or time.time())
MOMENTS = int(os.environ.get("JAMLAB_CHAOS_MOMENTS", "20"))
TASKS = int(os.environ.get("JAMLAB_CHAOS_TASKS", "200"))
POISON = 13
ENGINES = {
    "pool": {},
    "dask": {},
    "scheduler": {},
    "slurm": {"walltime": "00:00:20"},
    "slurm, unreliable": {"walltime": "00:00:20", "refuse": 0.3, "requeue": 0.3, "lose": 0.3, "queue_wait": (0.0, 3.0)},
    "loky": {},
    "processes": {},
}
# codes of a process; a shell shows 128 + signal for the negative ones, which come from signals during imports
ENDS = {signal.SIGKILL: (-9,), signal.SIGTERM: (143, -15), signal.SIGINT: (130, -2)}


@pytest.fixture(scope="module")
def reference(tmp_path_factory, kept_folder):
    """The serial run, which is kept for this state of the code."""
    changed = max(path.stat().st_mtime_ns for path in Path(jamlab.__file__).parent.rglob("*.py"))
    kept = kept_folder / f"serial-{TASKS}-{changed}.pickle"
    if not kept.exists():
        kept.write_bytes(pickle.dumps(serial(tmp_path_factory.mktemp("serial"), TASKS)))
    return pickle.loads(kept.read_bytes())


@pytest.fixture
def root():
    """A folder with a short name."""
    with short_root() as path:
        yield path


def tell(kept_folder, name, row):
    """Print a row, and keep it."""
    print("\n" + ", ".join(f"{key}: {value}" for key, value in row.items()))
    with (kept_folder / f"{name}.jsonl").open("a") as file:
        file.write(json.dumps(row, default=str) + "\n")


@pytest.mark.parametrize("chunk", [1, 10])
@pytest.mark.parametrize("name", ENGINES)
def test_workers_are_killed(name, chunk, root, reference, kept_folder):
    """And one task kills its own: all others finish, to the bits of the serial run."""
    expected, seeds = reference
    place = Place(root, TASKS, POISON, more=f"chunk = {chunk}" if chunk > 1 else "")
    began = time.monotonic()
    with engine(name.partition(",")[0], place, **ENGINES[name]) as (words, environment):
        killer = Killer(place, SEED, max(8, TASKS // 10))
        process, said = start(words, environment, place)
        killer.start()
        process.wait(1800)
        killer.stopped.set()
        seconds = time.monotonic() - began
        out, err = said()
        orphans = gone(lambda: not place.processes(), 30)
        jobs = len(place.batch.log("started")) if place.batch else 0
        events = {e: len(place.batch.log(e)) for e in ("refused", "requeued", "lost", "walltime")} if jobs else {}
    campaign = place.campaign
    status = campaign.status()
    wrongly = [r["reason"] for task, r in status.failures.items() if seeds[task] != POISON]
    reason = [r["reason"] for task, r in status.failures.items() if seeds[task] == POISON]
    others_again, poison_again = place.repeated()
    different, table = unequal(content_of(campaign), expected)
    row = {"engine": name, "chunk": chunk, "seed": SEED, "seconds": round(seconds, 1), "kills": killer.kills}
    row |= {"finished": status.finished, "failed": status.failed, "left": status.left, "wrongly": wrongly}
    row |= {"again": others_again, "poison again": poison_again, "unequal": different, "table": table}
    row |= {"orphans gone": orphans, "strangers": place.strangers(), "marks": place.marks(), "code": process.returncode}
    row |= {"jobs": jobs, **events, "said": err.splitlines()[-3:], "reason": reason}
    tell(kept_folder, "workers", row)
    assert (status.finished, status.failed, status.left, wrongly) == (TASKS - 1, 1, 0, []), (out, err)
    assert (different, table, orphans is None, row["strangers"], row["marks"]) == (0, "", False, [], 0)
    assert process.returncode == 1 and not campaign.folder.damages(campaign.folder.finished())


@pytest.mark.parametrize("number", ENDS, ids=lambda number: number.name)
@pytest.mark.parametrize("name", ["pool", "scheduler", "slurm"])
def test_drivers_are_ended(name, number, root, reference, kept_folder):
    """At random moments, one after the other in one folder: nothing survives or is left, and the bits are the same."""
    chance = random.Random(f"{SEED}-{name}-{number.name}")
    place = Place(root, TASKS, poison=-1, short=0.2, long=1.0)
    rows, most = [], {"pool": 8.0, "scheduler": 10.0, "slurm": 18.0}[name]
    with engine(name, place, walltime="00:01:00") as (words, environment):
        for _ in range(MOMENTS):
            early = chance.random() < 0.3  # else when tasks run
            how = {"after": not early, "moment": chance.uniform(0.2, most if early else 4.0)}
            rows.append(ended(place, words, environment, number, **how) | {"engine": name})
            tell(kept_folder, "drivers", {"seed": SEED, "signal": number.name, **rows[-1]})
            if rows[-1]["code"] == 0:  # all is done: begin again
                shutil.rmtree(place.file.parent / "c")
        process, said = start(words, environment, place)
        process.wait(600)
    status = place.campaign.status()
    different, table = unequal(content_of(place.campaign), reference[0])
    last = {"engine": name, "signal": number.name, "resumed": process.returncode, "finished": status.finished}
    last |= {"failed": status.failed, "unequal": different, "table": table, "strangers": place.strangers()}
    tell(kept_folder, "drivers", {"seed": SEED, **last})
    assert (process.returncode, status.finished, different, table) == (0, TASKS, 0, ""), said()
    assert not [row for row in rows if row["wrong"]] and not place.strangers()


def ended(place, words, environment, number, *, after, moment):
    """End a driver so many seconds after its start, or after its first task began, and look at what is left after half
    a minute at most."""
    before, calls = len(place.campaign.finished()), len(place.calls())
    process, said = start(words, environment, place)
    while after and len(place.calls()) == calls and process.poll() is None:
        time.sleep(0.02)
    time.sleep(moment)
    process.send_signal(number)
    at = time.monotonic()
    process.wait(60)
    took = time.monotonic() - at
    alive = gone(lambda: not place.processes(), 30)
    _, err = said()
    lines = [line for line in err.splitlines() if not line.startswith(("c: ", "dashboard of Dask: ", "note: "))]
    status = place.campaign.status()
    row = {
        "after": after,
        "moment": round(moment, 2),
        "code": process.returncode,
        "took": round(took, 1),
        "alive": alive,
    }
    row |= {"new": status.finished - before, "failed": status.failed, "strangers": place.strangers()}
    row |= {"marks": place.marks(), "lines": lines[-4:]}
    wrong = [] if process.returncode in (0, *ENDS[number]) else ["code"]
    wrong += ["orphan"] if alive is None else []
    told = 1 if process.returncode > 0 else 0
    wrong += ["lines"] if len(lines) not in (told, int(process.returncode in (-2, -15))) else []
    wrong += ["failed"] if status.failed else []
    wrong += ["files"] if row["strangers"] else []
    wrong += ["marks"] if row["marks"] and number != signal.SIGKILL else []
    return row | {"wrong": wrong}
