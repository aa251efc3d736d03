"""What many small tasks cost beyond their packings: files, calls, tables; and the start of a command.

    pytest -m benchmark -s tests/campaign/benchmark_many_tasks.py

JAMLAB_OTHER_PYTHON names the Python of another installation of jamlab, such as of an older version: it is measured by
turns with this one. JAMLAB_EMPTY_TASKS (10 000), JAMLAB_PACKINGS (1000) and JAMLAB_PAIRS (5) set the numbers. CPU times
are those to compare: other programs run beside. The cost of a task is the difference to a campaign of ten tasks, which
takes out imports and the start of workers.
"""

import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

import pytest
from many_tasks import write_campaign

pytestmark = pytest.mark.benchmark
EMPTY, PACKINGS, PAIRS = (
    int(os.environ.get(f"JAMLAB_{name}", default))
    for name, default in (("EMPTY_TASKS", 10_000), ("PACKINGS", 1000), ("PAIRS", 5))
)
PYTHONS = {"this": sys.executable} | (
    {"other": os.environ["JAMLAB_OTHER_PYTHON"]} if os.environ.get("JAMLAB_OTHER_PYTHON") else {}
)
# both keep the bytecode of their modules, as they do for users
ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | {"OMP_NUM_THREADS": "1"}
PROGRAM = Path(__file__).parents[1] / "support" / "many_tasks.py"
STEPS = ("plan", "run", "again", "status", "table")
WORKERS = 2


def taken(python, *words):
    """What a step prints."""
    line = [python, "-P", "-W", "ignore", str(PROGRAM), *map(str, words)]
    done = subprocess.run(line, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def steps(python, folder, count, *, empty):
    """What each step of a campaign of so many tasks takes, and of one of ten tasks."""
    few, many = (write_campaign(folder / str(n), n, empty=empty) for n in (10, count))
    found = {step: (taken(python, step, few, WORKERS), taken(python, step, many, WORKERS)) for step in STEPS}
    assert found["run"][1]["finished"] == found["table"][1]["rows"] == count
    return found


def tell(title, found, count):
    """Print a row for each step, and the cost of a task."""
    print(f"\n{title}\n{'step':8s}{'wall s':>9s}{'CPU s':>9s}{'workers s':>11s}{'MB':>7s}{'ms a task':>11s}")
    for step, (few, many) in found.items():
        each = sum(many[key] - few[key] for key in ("cpu", "children")) / (count - 10) * 1e3
        numbers = f"{many['wall']:9.1f}{many['cpu']:9.2f}{many['children']:11.2f}{many['peak_MB']:7.0f}{each:11.3f}"
        print(f"{step:8s}{numbers}")
    last = found["table"][1]
    print(f"{last['files']} files, {last['kB'] / count:.2f} kB a task, {last['disk_kB'] / count:.2f} kB on disk")


@pytest.mark.parametrize("which", PYTHONS)
def test_empty_tasks(which, tmp_path):
    """Naming, sending, writing and counting; no packing is made."""
    found = steps(PYTHONS[which], tmp_path, EMPTY, empty=True)
    tell(f"{EMPTY} empty tasks, {which}", found, EMPTY)


@pytest.mark.parametrize("which", PYTHONS)
def test_packings_of_sixteen_disks(which, tmp_path):
    """In files of several, at most 6 kB and 5 ms a packing beyond making and measuring."""
    python = PYTHONS[which]
    found = steps(python, tmp_path, PACKINGS, empty=False)
    work = taken(python, "work", write_campaign(tmp_path / "work", PACKINGS, empty=False))
    tell(f"{PACKINGS} packings of 16 disks, {which}", found, PACKINGS)
    few, many = found["run"]
    each = (many["children"] - few["children"]) / (PACKINGS - 10) * 1e3
    print(f"making {work['make']:.1f} ms, measuring {work['measure']:.1f} ms, in workers {each:.1f} ms a packing")
    if which == "this" and PACKINGS >= 1000:  # fewer have a file each
        assert many["kB"] / PACKINGS < 6
        assert each - work["make"] - work["measure"] < 5


@pytest.mark.skipif("other" not in PYTHONS, reason="JAMLAB_OTHER_PYTHON names none")
@pytest.mark.parametrize("what", ["import", "plan", "status", "run"])
def test_start_in_pairs(what, tmp_path):
    """A short command of this installation and of the other one, by turns."""
    ratios, seconds = [], []
    for pair in range(PAIRS + 1):
        both = {}
        for which in sorted(PYTHONS, reverse=pair % 2 == 0):
            path = write_campaign(tmp_path / f"{pair}-{which}", 4, empty=False)
            line = [PYTHONS[which], "-P", "-m", "jamlab", "campaign", what, str(path)]
            line += ["--workers", "1"] if what == "run" else []
            both[which] = cpu_of([PYTHONS[which], "-P", "-c", "import jamlab"] if what == "import" else line)
        if pair:  # the first one fills the caches
            ratios.append(both["this"] / both["other"])
            seconds.append(both["this"])
    low, middle, high = min(ratios), statistics.median(ratios), max(ratios)
    print(f"\n{what}: {statistics.median(seconds):.2f} CPU s, this / other {middle:.3f} ({low:.3f} to {high:.3f})")


def cpu_of(line):
    """CPU time of a command and its children, s."""
    before = os.times()
    done = subprocess.run(line, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system
