"""The file of a sweep that a command makes: saved as the sweep runs, and resumed by the same command.

Beside the packings stands the group /sweep, whose attribute `task` is what was asked for, in JSON.
"""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jamlab.cli.interruption import NOTHING, describe_kept
from jamlab.errors import InputError, StorageError
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing

INTERVAL = 10.0  # s between two versions of the file, of which a killed command leaves the last


class SweepFile:
    """The states of a sweep that are made so far, and their file.

    Args:
        path: of the file.
        task: options of the command by which the sweep is known again, each with its value.
        replace: begin again if the file is there.

    Raises:
        StorageError: the file is there, and is no sweep of a command.
        InputError: it is a sweep of other options.
    """

    def __init__(self, path: Path, task: Mapping[str, Any], *, replace: bool) -> None:
        self.path, self._task, self._saved = path, dict(task), time.monotonic()
        self.states: list[Packing] = []
        self._before = 0  # states that the file held
        describe_kept(self._describe)
        check_target(path)
        if path.exists() and not replace:
            self._read()

    def begin(self, start: "Packing") -> None:
        """Set the first state; it must be the first state of the file."""
        if not self.states:
            self.states = [start]
        elif start != self.states[0]:
            raise InputError(f"{self.path} holds a sweep from another packing: {_REMEDY}")

    def make(self, rest: "Callable[[Packing, Packing, int], Iterator[Packing]]") -> None:
        """Add the states that are left: `rest` yields them, given the last state, the first, and how many there are
        beside it. The file has all of them in the end, whatever ends this; the start alone is not written."""
        try:
            for state in rest(self.states[-1], self.states[0], len(self.states) - 1):
                self.states.append(state)
                if time.monotonic() - self._saved > INTERVAL:
                    self.write()
                    self._saved = time.monotonic()
        finally:  # also where a signal ends it: to measure them may take longer than to make them
            if len(self.states) > max(1, self._before):
                self.write()

    def write(self, measured: Mapping[str, Any] | None = None) -> None:
        """Write the states, with what was measured of them."""
        from jamlab.packing.hdf5 import write_sweep

        def add_group(file: Any) -> None:
            file.create_group("sweep").attrs["task"] = json.dumps(self._task)

        write_sweep(self.path, self.states, measured, add_group)

    def _read(self) -> None:
        from jamlab.packing.hdf5 import read_all_hdf5

        found = _task_of(self.path)
        if found is None:
            check_target(self.path, replace=False)  # which refuses it
            return
        wanted = json.loads(json.dumps(self._task))
        if other := [name for name in wanted | found if found.get(name) != wanted.get(name)]:
            said = ", ".join(f"{name} {_told(found.get(name))}, not {_told(wanted.get(name))}" for name in other)
            raise InputError(f"{self.path} holds a sweep with {said}: {_REMEDY}")
        self.states = read_all_hdf5(self.path)
        self._before = len(self.states)

    def _describe(self) -> str:
        if len(self.states) < 2 or not self.path.exists():
            return f"{NOTHING}; {self.path} is as it was before" if self.path.exists() else NOTHING
        last = self.states[-1].provenance
        at = f" up to {last['by']} = {last['target']:.5g}" if "target" in last else ""
        return f"kept {len(self.states)} states{at} in {self.path}; the same command resumes it"


_REMEDY = "give the same options to go on with it, or name another file by --out"


def _told(value: Any) -> str:
    return "left out" if value is None else str(value)


def _task_of(path: Path) -> dict[str, Any] | None:
    """The task of the command that made a file; None if no command for sweeps made it."""
    from jamlab.storage.verified_file import is_hdf5, opened

    if not is_hdf5(path):
        return None
    try:
        with opened(path) as file:
            group = file.get("sweep")
            found = None if group is None else json.loads(group.attrs["task"])
    except StorageError:  # no file of jamlab, or damaged
        return None
    return found if isinstance(found, dict) else None
