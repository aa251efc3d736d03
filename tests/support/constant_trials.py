"""Every number of jamlab's modules halved and doubled, one at a time: what changes. A script: FOLDER [SECONDS [ROOMS]].

The folder keeps states, what the code as it is gives (base.jsonl) and a line for each number, factor and scenario that
reads it (trials.jsonl), so that a stopped run goes on. SECONDS bounds the CPU of a number and factor; cheap scenarios
come first. ROOMS, a list with commas, runs only numbers whose names begin so, in that order.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import resource
import sys
import time
import warnings
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import constant_battery
import numpy as np
from scaled_constants import Constant, Importer, Tree, scaled

for _runs in ("packings", "flow", "pictures", "files"):  # each fills the battery
    importlib.import_module(f"constant_runs_of_{_runs}")

FACTORS = (0.5, 2.0)
_JAMLAB = f"{os.sep}jamlab{os.sep}"


class Counter:
    """Counts starts of functions of jamlab, or keeps the lines that they run."""

    def __init__(self, lines: bool = False) -> None:
        self.calls, self.lines, self.keep_lines = 0, set(), lines

    def _start(self, code: Any, _: int) -> Any:
        if _JAMLAB not in code.co_filename:
            return sys.monitoring.DISABLE
        self.calls += 1
        return None

    def _line(self, code: Any, line: int) -> Any:
        if _JAMLAB in code.co_filename and code.co_name != "<module>":
            self.lines.add((code.co_filename, line))
        return sys.monitoring.DISABLE

    def __enter__(self) -> Counter:
        monitoring, event = sys.monitoring, sys.monitoring.events
        monitoring.use_tool_id(3, "jamlab constants")
        if self.keep_lines:
            monitoring.register_callback(3, event.LINE, self._line)
            monitoring.set_events(3, event.LINE)
        else:
            monitoring.register_callback(3, event.PY_START, self._start)
            monitoring.set_events(3, event.PY_START)
        monitoring.restart_events()
        return self

    def __exit__(self, *_: object) -> None:
        sys.monitoring.set_events(3, 0)
        sys.monitoring.free_tool_id(3)


def in_child(work: Any, seconds: float) -> list[dict[str, Any]]:
    """What a forked process reports, a line at a time, until it ends, dies, or has used so many seconds of CPU."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
        with os.fdopen(write, "w") as out, constant_battery.quiet(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                work(lambda row: print(json.dumps(row), file=out, flush=True))
            except BaseException as error:
                print(json.dumps({"failed": f"{type(error).__name__}: {error}"[:300]}), file=out, flush=True)
            out.flush()
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as lines:
        rows = [json.loads(line) for line in lines if line.endswith("\n")]
    _, status = os.waitpid(child, 0)
    if status:
        rows.append({"failed": f"ended by signal {status & 127}" if status & 127 else f"exit {status >> 8}"})
    return rows


def run(name: str, folder: Path, lines: bool = False) -> dict[str, Any]:
    """One scenario in this process: what it found, CPU seconds, calls."""
    began, counter = time.process_time(), Counter(lines)
    try:
        with counter:
            found = constant_battery.numbers(constant_battery.BATTERY[name](folder))
    except Exception as error:
        found = {"raised": f"{type(error).__name__}: {error}"[:300]}
    row = {"scenario": name, "cpu": round(time.process_time() - began, 4), "calls": counter.calls, "found": found}
    return row | ({"lines": sorted(counter.lines)} if lines else {})


def _warm(states: Path) -> None:
    """Loads LAMMPS, whose first start costs as much as many a scenario."""
    import jamlab

    jamlab.evaluate(jamlab.read(states / "sp16.h5"))


def import_all(modules: list[str]) -> None:
    for name in modules:
        with contextlib.suppress(Exception):
            __import__(name)


class Trials:
    """The runs of one folder.

    Args:
        folder: where results are kept.
        tree: sources of jamlab.
    """

    def __init__(self, folder: Path, tree: Tree) -> None:
        self.folder, self.states, self.tree = folder, folder / "states", tree
        self.folder.mkdir(parents=True, exist_ok=True)
        self.base: dict[str, dict[str, Any]] = {}
        self.others: dict[str, Any] = {}

    def prepare(self) -> None:
        """States, modules that all processes share, what the code as it is gives, lines that each scenario runs."""
        self.others = self._kept("modules.json", self._look)
        sys.meta_path.insert(0, Importer(self.tree))
        import_all([*self.others["modules"], *self.others["own"]])
        _warm(self.states)
        gc.freeze()  # what children share stays shared
        path = self.folder / "base.jsonl"
        rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
        self.base = {row["scenario"]: row for row in rows}
        with path.open("a") as out:
            for name in constant_battery.BATTERY:
                if name not in self.base:
                    self.base[name] = self._basis(name)
                    print(json.dumps(self.base[name]), file=out, flush=True)

    def _kept(self, name: str, make: Any) -> dict[str, Any]:
        path = self.folder / name
        if not path.exists():
            (row,) = in_child(make, 600)
            path.write_text(json.dumps(row))
        return json.loads(path.read_text())

    def _look(self, report: Any) -> None:
        sys.meta_path.insert(0, Importer(self.tree))
        constant_battery.prepare(self.states)
        import_all([name for name in self.tree.paths if not name.endswith(("__main__", "cli.start"))])
        kinds = {each.label: self.tree.kind(each) for each in self.tree.constants}
        known = sorted(set(sys.modules) - {"__main__"})
        others = [name for name in known if name.split(".")[0] != "jamlab"]
        report({"modules": others, "own": sorted(set(known) - set(others)), "kinds": kinds})

    def _basis(self, name: str) -> dict[str, Any]:
        def work(report: Any, lines: bool) -> None:
            self._start()
            report(run(name, self.states, lines))

        first, second = (in_child(partial(work, lines=lines), 600)[0] for lines in (False, True))
        noisy = [key for key, value in first["found"].items() if second["found"].get(key) != value]
        for key in noisy:
            first["found"].pop(key)
        return first | {"lines": second["lines"], "noisy": noisy}

    def _start(self, constant: Constant | None = None, factor: float = 1.0) -> None:
        """In a child: jamlab, with a number scaled where it is named, or imported again where others are made of it."""
        if constant is not None and not self.tree.is_plain(constant):
            for name in [each for each in sys.modules if each.split(".")[0] == "jamlab"]:
                del sys.modules[name]
            sys.meta_path[:] = [each for each in sys.meta_path if not isinstance(each, Importer)]
            sys.meta_path.insert(0, Importer(self.tree, constant, factor))
            import_all(self.others["own"])
        elif constant is not None and "." in constant.name:
            owner, field = constant.name.split(".")
            for each in vars(sys.modules[constant.module]).values():
                if type(each).__name__ == owner:
                    object.__setattr__(each, field, scaled(getattr(each, field), factor))
        elif constant is not None:
            module = sys.modules[constant.module]
            new = scaled(getattr(module, constant.name), factor)
            for holder, name in [(constant.module, constant.name), *self.tree.aliases(constant)]:
                if holder in sys.modules:
                    setattr(sys.modules[holder], name, new)

    def scenarios(self, constant: Constant) -> list[str]:
        """Those that run a line that reads it, cheap ones first."""
        wanted = {(str(self.tree.paths[module]), line) for module, line in self.tree.lines(constant)}
        found = [name for name, row in self.base.items() if wanted & {tuple(each) for each in row["lines"]}]
        return sorted(found, key=lambda name: self.base[name]["cpu"])

    def chosen(self, constant: Constant, seconds: float) -> list[str]:
        """The scenarios that fit into so many seconds of CPU, at least one."""
        found, spent = [], 0.0
        for name in self.scenarios(constant):
            spent += self.base[name]["cpu"]
            if found and spent > seconds:
                break
            found.append(name)
        return found

    def missing(self, constant: Constant, seconds: float, done: set[Any]) -> Iterator[dict[str, Any]]:
        """Rows of a number that are not yet done, which are added to those that are."""
        chosen = self.chosen(constant, seconds)
        for factor in FACTORS:
            names = [name for name in chosen if (constant.label, factor, name) not in done]
            rows = self.trial(constant, factor, names) if names else []
            if not chosen and (constant.label, factor, "none") not in done:
                rows = [{"constant": constant.label, "factor": factor, "scenario": "none"}]
            for row in rows:
                done.add((row["constant"], row["factor"], row["scenario"]))
                yield row

    def trial(self, constant: Constant, factor: float, names: list[str]) -> list[dict[str, Any]]:
        """Rows of one number and factor."""

        def work(report: Any) -> None:
            self._start(constant, factor)
            for name in names:
                report(self._compare(run(name, self.states)))

        limit = 30 + 10 * sum(self.base[name]["cpu"] for name in names)
        rows = in_child(work, limit)
        if rows and "failed" in rows[-1]:
            missing = [name for name in names if name not in {row.get("scenario") for row in rows[:-1]}]
            rows[-1] |= {"scenario": missing[0] if missing else "import"}
            if len(missing) > 1 and len(rows) > 1:
                rows += self.trial(constant, factor, missing[1:])
        head = {"constant": constant.label, "factor": factor}
        return [head | row for row in rows]

    def _compare(self, row: dict[str, Any]) -> dict[str, Any]:
        """A run beside that of the code as it is: largest relative change, texts that differ, converged, cost."""
        base = self.base[row["scenario"]]
        found, expected = row.pop("found"), base["found"]
        change, where, words = 0.0, "", []
        for name, value in expected.items():
            other = found.get(name)
            if isinstance(value, str) or isinstance(other, str):
                if other != value:
                    words.append(name)
            elif other != value and not name.endswith(("/bits", "/converged")):
                size = _change(value, other)
                if size > change:
                    change, where = size, name
        bits = all(json.dumps(found.get(name)) == json.dumps(value) for name, value in expected.items())  # nan is nan
        converged = [sum(bool(v) for k, v in each.items() if k.endswith("/converged")) for each in (expected, found)]
        cost = {"cpu_ratio": row["cpu"] / max(base["cpu"], 1e-3), "calls_ratio": row["calls"] / max(base["calls"], 1)}
        raised = {"raised": found["raised"]} if "raised" in found and "raised" not in expected else {}
        said = {"words": words[:5], "said": str(found.get(words[0]))[:200]} if words else {}
        kept = {"change": change, "where": where, "bits": bits, "converged": converged} | raised | said
        return {"scenario": row["scenario"], "cpu": row["cpu"]} | {k: round(v, 4) for k, v in cost.items()} | kept


def _change(value: Any, other: Any) -> float:
    """Largest difference over the largest size; inf where lengths or gaps differ."""
    a, b = (np.atleast_1d(np.array([np.nan] if each is None else each, float)) for each in (value, other))
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return float("inf")
    size = float(np.nanmax(np.abs(a), initial=0.0))
    return float(np.nanmax(np.abs(np.where(a == b, 0.0, a - b)), initial=0.0)) / (size or 1.0)


def main(folder: str, seconds: str = "4", rooms: str = "") -> None:
    tree = Tree(Path(os.environ.get("JAMLAB_TREE") or Path(__file__).parents[2]))
    trials = Trials(Path(folder), tree)
    trials.prepare()
    path = trials.folder / "trials.jsonl"
    kept = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {(row["constant"], row["factor"], row["scenario"]) for row in kept}
    with path.open("a") as out:
        for room in rooms.split(","):
            for constant in tree.constants:
                if constant.label.startswith(room) and tree.sort(constant, trials.others["kinds"]) == "tunable":
                    for row in trials.missing(constant, float(seconds), done):
                        print(json.dumps(row), file=out, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
