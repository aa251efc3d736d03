"""Many records of the same kind in one HDF5 group: a dataset for each place instead of one for each place and record.

A record has a value at each of its places, names such as "parameters/onset": text, a list of texts, a number or an
array. Records can be stacked if they have the same places with values of the same kind. Every value comes back to the
last bit. Layout, for M records:

| name           | shape           | content                                                                         |
|----------------|-----------------|---------------------------------------------------------------------------------|
| same/<place>   | of the value    | the value of all records, if they are equal                                     |
| each/<place>   | (M, ...)        | the values, if they have one shape; else all of their numbers, one after another |
| shapes/<place> | (M, dimensions) | the shapes of the values, if they differ                                        |

Text is stored as its bytes in UTF-8, a list of texts as JSON; the attribute `text` of such a dataset is 1 and 2.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Record = Mapping[str, Any]

_NUMBERS, _TEXT, _TEXTS = 0, 1, 2
_LEAST = 1024  # bytes from which a dataset is compressed; below, what HDF5 needs for it is more than what it saves
_PIECE = 1 << 18  # bytes of a piece that is read and unpacked at once


def kind_of_record(record: Record) -> Hashable:
    """What two records have in common that can be stacked: places, and the types and dimensions of the values."""
    return tuple(sorted((place, _kind(value)) for place, value in record.items()))


def _kind(value: Any) -> tuple[str, int]:
    if isinstance(value, str | list):
        return type(value).__name__, 0
    array = np.asarray(value)
    return ("S" if array.dtype.kind == "S" else array.dtype.str), array.ndim


def write_records(group: Any, records: Sequence[Record]) -> None:
    """Write records of one kind, see `kind_of_record`."""
    for place, first in records[0].items():
        text = _TEXT if isinstance(first, str) else _TEXTS if isinstance(first, list) else _NUMBERS
        values = [_array(record[place]) for record in records]
        if all(_alike(values[0], value) for value in values[1:]):
            stored = group.create_dataset(f"same/{place}", data=values[0], **_packed(values[0]))
        else:
            shapes = {value.shape for value in values}
            joined = np.stack(values) if len(shapes) == 1 else np.concatenate([value.ravel() for value in values])
            stored = group.create_dataset(f"each/{place}", data=joined, **_packed(joined))
            if len(shapes) > 1:
                counts = np.array([value.shape for value in values], dtype=np.int64)
                group.create_dataset(f"shapes/{place}", data=counts, **_packed(counts))
        if text:
            stored.attrs["text"] = text


def _array(value: Any) -> NDArray[Any]:
    if isinstance(value, str | list):
        text = value if isinstance(value, str) else json.dumps(value)
        return np.frombuffer(text.encode(), dtype=np.uint8)
    return np.asarray(value)


def _alike(one: NDArray[Any], other: NDArray[Any]) -> bool:
    return one.shape == other.shape and one.dtype == other.dtype and one.tobytes() == other.tobytes()


def _packed(values: NDArray[Any]) -> dict[str, Any]:
    """How h5py stores an array."""
    if values.nbytes < _LEAST or not values.ndim:
        return {}
    rows = max(1, min(len(values), _PIECE // (values.nbytes // len(values))))
    return {"chunks": (rows, *values.shape[1:]), "compression": "gzip", "compression_opts": 1, "shuffle": True}


class _Stored(NamedTuple):
    """What is stored of a place."""

    content: NDArray[Any]
    text: int
    shapes: NDArray[np.int64] | None  # of the values, if they differ
    ends: list[int]  # where they begin and end then

    def value(self, k: int) -> Any:
        """The value of one record, if they are not the same."""
        if self.shapes is None:
            return self.decoded(self.content[k])
        return self.decoded(self.content[self.ends[k] : self.ends[k + 1]].reshape(self.shapes[k]))

    def decoded(self, content: Any) -> Any:
        """A value from its array."""
        if self.text == _NUMBERS:
            return content
        found = content.tobytes().decode()
        return json.loads(found) if self.text == _TEXTS else found


class StackedRecords:
    """Records that `write_records` wrote. What has been asked for once stays in memory."""

    def __init__(self, group: Any, count: int):
        self._group = group
        self._count = count  # of records
        self._same: dict[str, Any] = {}  # place -> value of all records
        self._each: dict[str, _Stored] = {}

    @cached_property
    def places(self) -> list[str]:
        """Where the records have values."""
        found: list[str] = []
        for part in ("same", "each"):
            if part in self._group:
                self._group[part].visititems(lambda name, node: found.append(name) if hasattr(node, "shape") else None)
        return found

    def load(self) -> None:
        """Read everything, so that the file may be closed."""
        for place in self.places:
            self._read(place)

    def record(self, k: int) -> dict[str, Any]:
        """One record."""
        return {place: self.value(place, k) for place in self.places}

    def value(self, place: str, k: int) -> Any:
        """The value of one record."""
        self._read(place)
        return self._same[place] if place in self._same else self._each[place].value(k)

    def values(self, place: str) -> list[Any]:
        """The values of all records."""
        return [self.value(place, k) for k in range(self._count)]

    def joined(self, place: str) -> tuple[NDArray[Any], NDArray[np.int64]]:
        """Columns of all records, one after another, and their lengths."""
        self._read(place)
        if place in self._same:
            same = self._same[place]
            return np.tile(same, self._count), np.full(self._count, len(same))
        stored = self._each[place]
        if stored.shapes is None:
            return stored.content.reshape(-1), np.full(self._count, stored.content.shape[1])
        return stored.content, stored.shapes[:, 0]

    def _read(self, place: str) -> None:
        """Read the dataset of a place."""
        if place in self._same or place in self._each:
            return
        same = self._group.get(f"same/{place}")
        dataset = self._group[f"each/{place}"] if same is None else same
        shapes = self._group.get(f"shapes/{place}")
        counts = None if shapes is None else shapes[()]
        ends = [] if counts is None else [0, *np.cumsum(counts.prod(axis=1)).tolist()]
        stored = _Stored(dataset[()], int(dataset.attrs.get("text", _NUMBERS)), counts, ends)
        if same is None:
            self._each[place] = stored
        else:
            self._same[place] = stored.decoded(stored.content)
