"""One measurement of a campaign of many small tasks, as a program: `python many_tasks.py STEP FILE [WORKERS]`.

It needs nothing but the public functions of jamlab, so that any version of jamlab can run it. It prints one line of
JSON: wall time, CPU time of this process and of its children, s, peak memory of this process, MB, and what the step
found. Steps: `plan`, `run`, `again` (a run that has nothing left), `status`, `table`, and `work`: CPU time of making
and of measuring a packing alone, ms.
"""

import itertools
import json
import resource
import statistics
import sys
import time
from pathlib import Path
from typing import Any

NO_WORK = '''
"""An observable whose module replaces all work of a task by one kept packing and its numbers."""

import sys
from functools import cache

import jamlab
from jamlab.campaign.observable import TaskStates
from jamlab.measure import numbers_of


@cache
def kept():
    packing = jamlab.pack({n}, 1e-2, seed=1)
    return TaskStates([packing], [1e-2], [True], []), numbers_of([packing])


def nothing(packing):
    return 0.0


def replace(name, function):
    modules = [m for key, m in list(sys.modules.items()) if key.startswith("jamlab.campaign") and hasattr(m, name)]
    if not modules:
        raise ImportError("no module of jamlab.campaign calls " + name)
    for module in modules:
        setattr(module, name, function)


import jamlab.campaign.workers

replace("make_states", lambda *given, **named: kept()[0])
replace("numbers_of", lambda packings, **_: dict(kept()[1]))
'''


def write_campaign(folder: Path, count: int, *, empty: bool, n: int = 16) -> Path:
    """Write a campaign of so many seeds of n disks at one pressure. `empty`: its tasks name, send, write and count, but
    make and measure nothing."""
    folder.mkdir(parents=True, exist_ok=True)
    observables = ""
    if empty:
        (folder / "no_work.py").write_text(NO_WORK.format(n=n), encoding="utf-8")
        observables = 'observables = ["no_work:nothing"]\n'
    sweep = f'[[sweep]]\nname = "disks"\nmodel = "sp"\nn = {n}\nseeds = {count}\npressures = [1e-2]\n{observables}'
    path = folder / "many.toml"
    path.write_text(f'name = "many"\n{sweep}', encoding="utf-8")
    return path


def _used() -> tuple[float, float]:
    """CPU time of this process, and of its children that have ended, s."""
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime, children.ru_utime + children.ru_stime


def _work(jamlab: Any, seeds: int) -> dict[str, float]:
    """Mean CPU time of making and of measuring the packings of a campaign, ms; the first ones warm up. The same seeds:
    those of one hundred cost up to a sixth less than those of one thousand."""
    spent = []
    for seed in range(1, seeds + 1):
        times = [time.process_time()]
        packing = jamlab.pack(16, 1e-2, seed=seed)
        times.append(time.process_time())
        jamlab.measure(packing)
        times.append(time.process_time())
        spent.append([1e3 * (after - before) for before, after in itertools.pairwise(times)])
    make, measure = zip(*spent[10:], strict=True)
    return {"make": statistics.fmean(make), "measure": statistics.fmean(measure)}


def take(step: str, file: str, workers: int) -> dict[str, float]:
    """Do one step, and say what it took."""
    import jamlab

    before, began = _used(), time.perf_counter()
    campaign = jamlab.open_campaign(file)
    found: dict[str, float] = {}
    if step in ("run", "again"):
        result = campaign.run(workers)
        found = {"finished": result.finished, "failed": result.failed, "left": result.left}
    elif step == "status":
        found = {"finished": campaign.status().finished}
    elif step == "plan":
        found = {"left": sum(line.left for line in campaign.plan())}
    elif step == "table":
        found = {"rows": len(campaign.table("states"))}
    elif step == "work":
        found = _work(jamlab, sum(line.left for line in campaign.plan()))
    else:
        raise SystemExit(f"unknown step {step}")
    wall, after = time.perf_counter() - began, _used()
    files = [path.stat() for path in (campaign.folder.path / "tasks").glob("*.h5")]
    found |= {"files": len(files), "kB": sum(s.st_size for s in files) / 1e3}
    found |= {"disk_kB": sum(512 * s.st_blocks for s in files) / 1e3}
    high = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    peak = int(high.split()[1]) / 1e3  # `getrusage` also counts what this process was before it became Python
    return {"wall": wall, "cpu": after[0] - before[0], "children": after[1] - before[1], "peak_MB": peak} | found


if __name__ == "__main__":
    print(json.dumps(take(sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 2)))
