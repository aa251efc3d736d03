"""Several finished tasks that differ only by the seed, in one HDF5 file: what 1e6 small packings need of a disk.

| name                  | type | content                                                        |
|-----------------------|------|----------------------------------------------------------------|
| / jamlab_campaign     | int  | 4, version of the campaign schema                              |
| / jamlab_chunk        | int  | 1, version of this layout; a newer one is refused              |
| /same, /each, /shapes |      | `jamlab.storage.stacked_records`, a record of each task        |

The places of a record are those of a file of the task alone (`jamlab.campaign.task_file`, `jamlab.packing.hdf5`), with
positions and boxes in two dimensions; and `campaign/seed`, which its `campaign/parameters` lack. The names of the
tasks stand at the start of the file (`jamlab.storage.verified_file`) in the order of the records, where
`CampaignFolder.finished` reads them; their digest is the name of the file.
"""

import json
from collections.abc import Hashable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from jamlab.campaign.observable import TableColumns
from jamlab.campaign.task_file import (
    TaskContent,
    TaskFile,
    TaskRows,
    is_in_table,
    own_record,
    table_of,
    task_of_record,
    text_column,
    write_whole,
)
from jamlab.campaign.tasks import TASK_VERSION, Parameters
from jamlab.errors import StorageError
from jamlab.packing.hdf5 import frames_of, image_of, observable_of, record_of
from jamlab.packing.packing import Packing
from jamlab.storage.stacked_records import StackedRecords, kind_of_record, write_records
from jamlab.storage.system_errors import system_said
from jamlab.storage.verified_file import CHUNK, add_names, label_and_names, label_of, opened

CHUNK_VERSION = 1  # of the layout
_SEED, _PARAMETERS, _UNITS = "campaign/seed", "campaign/parameters", "parameters/units"
_CONVERGED, _TARGET, _MISSING = "campaign/converged", "campaign/target_pressure", "campaign/missing"


class Kept(NamedTuple):
    """A finished task, and its record."""

    content: TaskContent
    record: dict[str, Any]


def alike(contents: Iterable[TaskContent]) -> list[list[Kept]]:
    """Sort tasks into those that one file can hold: equal but for the seed, with tables of the same columns."""
    found: dict[Hashable, list[Kept]] = {}
    for content in contents:
        parameters = content.task.parameters
        record = record_of(content.states.packings, content.measured) | own_record(content)
        record |= {_SEED: parameters.seed, _PARAMETERS: _shared_text(parameters)}
        same = (record[_PARAMETERS], record[_UNITS], kind_of_record(record))
        found.setdefault(same, []).append(Kept(content, record))
    return list(found.values())


def _shared_text(parameters: Parameters) -> str:
    """What tasks share that differ only by the seed, JSON."""
    shared = parameters.model_dump(mode="json")
    del shared["recipe"]["seed"]
    return json.dumps(shared)


def write_chunk_file(folder: Path, chunk: Sequence[Kept]) -> Path:
    """Write tasks, as `alike` sorts them, into one file of a folder, completely or not at all; return its path."""

    def write(file: Any) -> None:
        file.attrs.update(jamlab_campaign=TASK_VERSION, jamlab_chunk=CHUNK_VERSION)
        write_records(file, [kept.record for kept in chunk])

    names = [kept.content.task.name for kept in chunk]
    # since HDF5 1.10 a dataset in one piece has no table of pieces, which would take 2 kB
    image = add_names(image_of(write, libver=("v110", "v110")), names)
    path = folder / f"{stem_of(label_of(names))}.h5"
    write_whole(path, image)
    return path


def is_chunk(stem: str) -> bool:
    """Whether a file of this name, without its ending, is one of several tasks."""
    return stem.startswith(f"{CHUNK}-")


def stem_of(label: str) -> str:
    """Name of the file, without its ending, of a label."""
    return label.replace(" ", "-")


def label_of_stem(stem: str) -> str:
    """Label of the file of a name without its ending."""
    return stem.replace("-", " ")


def names_in_chunk(path: Path) -> list[str]:
    """Read the names of the tasks in a file of several, without opening its HDF5; none where they are damaged, or the
    file is another one, so that its tasks count as not finished."""
    label, names = label_and_names(path)
    return names if stem_of(label) == path.stem else []


class Chunk:
    """A file of several tasks; it is read as far as asked for."""

    def __init__(self, path: Path, names: list[str], records: StackedRecords, parameters: Parameters):
        self._path = path
        self.names = names
        self._records = records
        self._parameters = parameters
        self._places = {name: k for k, name in enumerate(names)}

    def load(self) -> None:
        """Read everything, so that the file may be closed."""
        self._records.load()

    def task(self, name: str, table: str | None = None) -> TaskFile:
        """One task without its packings; `table` as in `read_task_file`."""
        k, parameters = self._places[name], self._parameters
        record = {place: self._records.value(place, k) for place in self._of_table(table)}
        return task_of_record(name, parameters.with_seed(int(record[_SEED])), record)

    def packings(self, name: str) -> list[Packing]:
        """The packings of a task, frame by frame."""
        return frames_of(f"{self._path}, task {name}", self._records.record(self._places[name]))

    def rows(self, table: str) -> TaskRows:
        """What a table needs of all tasks."""
        converged, frames = self._records.joined(_CONVERGED)
        tables: dict[str, TableColumns] = {}
        counts: dict[str, NDArray[np.int64]] = {}
        observables = {}
        for place in self._of_table(table):
            if (name := observable_of(place)) is not None:
                observables[name], _ = self._records.joined(place)
            elif (found := table_of(place)) is not None:
                values, counts[found[0]] = self._records.joined(place)
                tables.setdefault(found[0], {})[found[1]] = text_column(values)
        return TaskRows(
            tasks=self.names,
            seeds=[int(seed) for seed in self._records.values(_SEED)],
            parameters=self._parameters,
            units=self._records.value(_UNITS, 0),
            frames=frames,
            observables=observables,
            converged=converged,
            target_pressure=self._records.joined(_TARGET)[0],
            tables=tables,
            rows=counts,
        )

    def lacking(self) -> list[str]:
        """Names of the tasks that lack states."""
        found = zip(self.names, self._records.values(_MISSING), strict=True)
        return [name for name, missing in found if json.loads(missing)]

    def _of_table(self, table: str | None) -> Iterator[str]:
        """Places of what is no packing; of tables the one of this name alone."""
        for place in self._records.places:
            found = table_of(place)
            wanted = found is not None and is_in_table(found[0], table, self._parameters)
            if wanted or observable_of(place) is not None or place.startswith("campaign/") or place == _UNITS:
                yield place


def read_chunk(path: Path) -> Chunk:
    """Read a whole file of several tasks; the last one stays in memory, for tasks that are asked for one by one.

    Raises:
        StorageError: see `opened_chunk`.
    """
    try:
        found = path.stat()
    except OSError as error:
        raise StorageError(f"cannot read {path}: {system_said(error, 'check its permissions')}") from error
    return _read_chunk(path, found.st_ino, found.st_size, found.st_mtime_ns)


@lru_cache(maxsize=1)
def _read_chunk(path: Path, *stamp: int) -> Chunk:
    """`stamp`: what changes with the file."""
    with opened_chunk(path) as chunk:
        chunk.load()
    return chunk


@contextmanager
def opened_chunk(path: Path) -> Iterator[Chunk]:
    """Open a file of several tasks.

    Raises:
        StorageError: it cannot be read, is damaged, no such file, or of a newer version.
    """
    with opened(path, tasks=True) as file:
        if not (names := names_in_chunk(path)):
            raise StorageError(f"{path} does not hold the tasks that its name says: `run` repairs it")
        if (version := int(file.attrs["jamlab_chunk"])) > CHUNK_VERSION:
            needed = file["h5md/creator"].attrs["version"]
            raise StorageError(
                f"{path} has layout {version}, this jamlab reads {CHUNK_VERSION}: install jamlab {needed}"
            )
        records = StackedRecords(file, len(names))
        shared = json.loads(records.value(_PARAMETERS, 0))
        try:
            shared["recipe"]["seed"] = int(records.value(_SEED, 0))
            parameters = Parameters.model_validate_json(json.dumps(shared))
        except ValidationError as error:
            raise StorageError(f"{path} has parameters of another version of jamlab: {error!s:.200}") from error
        yield Chunk(path, names, records, parameters)
