"""Keep the result of a flow in an HDF5 file, with its packings; an interrupted run resumes from it.

The file is one of packings, laid out as in `jamlab.packing.hdf5`: `jamlab.read`, `jamlab explore` and MDAnalysis open
it, and its frames are the packings of the run. Beside them stands the group /flow: a dataset for each array of the
result, and as attributes `kind`, the name of its class, `facts`, all else in JSON, `damping`, and `task`, what was
asked for, by which a run is known again.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from jamlab.errors import StorageError
from jamlab.geometry.contact_network import CONTACTS_DEFINITION
from jamlab.packing.hdf5 import file_image, read_all
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress
from jamlab.rheology.damping import Damping, law_of_record
from jamlab.storage.atomic_file import atomic_file, check_ending, check_target
from jamlab.storage.verified_file import REMEDY, add_checksum, dataset, opened

FilePath = str | os.PathLike[str]
R = TypeVar("R")

_EVERY = 10.0  # s between two versions of a file
_NO_DRAG = {"law": "none"}  # of runs without time
_APART = ("frames", "damping")  # fields of a result that have a place of their own


class OtherRunError(StorageError):
    """The file of a run holds something else."""


class RunFile(Generic[R]):
    """Where a run is kept, or nowhere. `path`: of the file, or None; `kind`: class of the result: a dataclass with
    `frames` and `damping`; `packing`: where the run starts; `damping`: drag law; None for a run without time; `task`:
    what else makes it this run, in plain numbers and text; `progress`: that is told of it. `before`: what the file
    holds of the same run, or None."""

    def __init__(
        self,
        path: FilePath | None,
        kind: type[R],
        packing: Packing,
        damping: Damping | None,
        task: dict[str, Any],
        progress: Progress | None = None,
    ) -> None:
        self._path = None if path is None else Path(path)
        self._task = json.dumps({**task, **_describe(damping)}, sort_keys=True)
        self._saved, self._progress = time.monotonic(), progress
        self.before: R | None = None
        if self._path is None:
            return
        check_target(self._path)
        if not self._path.exists():
            check_ending(self._path, "packings")
        else:
            self.before = self._read_same(self._path, kind, packing)
            if self.before is None:
                raise OtherRunError(
                    f"{path} exists and belongs to another run: choose another name, or remove it (--force)"
                )

    def save(self, result: Callable[[], R], *, now: bool = False) -> None:
        """Write the run as it is, `now` or if the file has not been brought up to date for a while."""
        if self._path is None or not (now or time.monotonic() - self._saved > _EVERY):
            return
        write_result(self._path, result(), self._task)
        self._saved = time.monotonic()

    def report(self, result: Callable[[], R], share: float, words: str) -> None:
        """Bring the file up to date, and tell the share of the work that is done."""
        self.save(result)
        if self._progress is not None:
            self._progress(share, words)

    def finish(self, result: Callable[[], R]) -> R:
        """Write the run as it ends, and give it."""
        last = result()
        self.save(lambda: last, now=True)
        return last

    def _read_same(self, path: Path, kind: type[R], packing: Packing) -> R | None:
        try:
            with opened(path) as file:
                group = file.get("flow")
                if group is None or group.attrs.get("kind") != kind.__name__:
                    return None
                if json.loads(group.attrs.get("task", "null")) != json.loads(self._task):  # 0 is 0.0
                    return None
            found = read_result(path, kind)
        except StorageError:  # damaged, or no file of jamlab
            return None
        first: Packing = found.frames[0]  # type: ignore[attr-defined]
        # LAMMPS wraps positions into its box and back, and has units of its own, which rounds
        near = 1e-9 * float(np.sqrt(packing.area / packing.n))
        same = first.difference(packing) is None and np.allclose(first.box, packing.box, rtol=1e-12, atol=near)
        return found if same and np.allclose(first.positions, packing.positions, rtol=0, atol=near) else None


_OF_0_2 = {"unsettled": "ambiguous_contacts", "imbalance": "energy_error"}  # names in files of version 0.2


def write_result(path: FilePath, result: Any, task: str = "{}") -> None:
    """Write a result of this room to a file, all or nothing.

    Args:
        path: to create or replace.
        result: dataclass with `frames` and `damping`.
        task: see `RunFile`.
    """
    entries = {f.name: getattr(result, f.name) for f in fields(result) if f.name not in _APART}

    def add_group(file: Any) -> None:
        group = file.create_group("flow")
        rest = {name: value for name, value in entries.items() if not isinstance(value, np.ndarray)}
        for name in entries.keys() - rest.keys():
            group[name] = entries[name]
        group.attrs["kind"] = type(result).__name__
        group.attrs["contacts"] = CONTACTS_DEFINITION
        group.attrs["facts"] = json.dumps(rest)
        group.attrs["damping"] = json.dumps(_describe(result.damping))
        group.attrs["task"] = task

    marks = {name: [p.provenance.get(name, 0.0) for p in result.frames] for name in ("flow_time", "flow_strain")}
    content = add_checksum(file_image(result.frames, marks, add_group))
    with atomic_file(path) as temporary:
        temporary.write_bytes(content)


def read_result(path: FilePath, kind: type[R]) -> R:
    """Read a result of a known class."""
    with opened(path) as file:
        group = file.get("flow")
        if group is None or group.attrs["kind"] != kind.__name__:
            raise StorageError(f"{path} contains no {kind.__name__}: give a file that contains a {kind.__name__}")
        known = {f.name for f in fields(kind)}  # type: ignore[arg-type]
        names = {
            name: name if name in known else _OF_0_2.get(name, name.replace("_error", "_stderr")) for name in group
        }
        arrays = {names[name]: dataset(group, name, "biufc")[()] for name in group}
        if "contacts" in arrays and group.attrs.get("contacts") != CONTACTS_DEFINITION:
            arrays["contacts"] = np.full(len(arrays["contacts"]), np.nan)  # counted by another definition
        facts = {_OF_0_2.get(name, name): value for name, value in json.loads(group.attrs["facts"]).items()}
        law = json.loads(group.attrs["damping"])
    try:
        damping = None if law == _NO_DRAG else law_of_record(law)
        return kind(**arrays | facts | {"frames": tuple(read_all(path)), "damping": damping})
    except (KeyError, TypeError, ValueError) as error:
        raise StorageError(f"{path} is damaged (its {kind.__name__} is incomplete: {error}): {REMEDY}") from error


def _describe(damping: Damping | None) -> dict[str, Any]:
    return _NO_DRAG if damping is None else damping.record()
