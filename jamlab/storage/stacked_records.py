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
from typing import Any

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


class StackedRecords:
    """Records that `write_records` wrote, read as far as they are asked for."""

    def __init__(self, group: Any, count: int):
        self._group = group
        self._count = count  # of records

    @cached_property
    def places(self) -> list[str]:
        """Where the records have values."""
        found: list[str] = []
        for part in ("same", "each"):
            if part in self._group:
                self._group[part].visititems(lambda name, node: found.append(name) if hasattr(node, "shape") else None)
        return found

    def record(self, k: int) -> dict[str, Any]:
        """One record."""
        return {place: self.value(place, k) for place in self.places}

    def value(self, place: str, k: int) -> Any:
        """The value of one record."""
        stored, same = self._stored(place)
        if same:
            return _value(stored, stored[()])
        ends = self._ends(place)
        if ends is None:
            return _value(stored, stored[k])
        shape = self._shapes(place)[k]
        return _value(stored, stored[ends[k] : ends[k + 1]].reshape(shape))

    def values(self, place: str) -> list[Any]:
        """The values of all records."""
        stored, same = self._stored(place)
        content = stored[()]
        if same:
            return [_value(stored, content)] * self._count
        ends = self._ends(place)
        if ends is None:
            return [_value(stored, each) for each in content]
        parts = zip(ends[:-1], ends[1:], self._shapes(place), strict=True)
        return [_value(stored, content[start:end].reshape(shape)) for start, end, shape in parts]

    def joined(self, place: str) -> tuple[NDArray[Any], NDArray[np.int64]]:
        """Columns of all records, one after another, and their lengths."""
        stored, same = self._stored(place)
        content = stored[()]
        if same:
            return np.tile(content, self._count), np.full(self._count, len(content))
        if self._ends(place) is None:
            return content.reshape(-1), np.full(self._count, content.shape[1])
        return content, self._shapes(place)[:, 0]

    def _stored(self, place: str) -> tuple[Any, bool]:
        """The dataset of a place, and whether it holds the value of all records."""
        same = self._group.get(f"same/{place}")
        return (self._group[f"each/{place}"], False) if same is None else (same, True)

    def _shapes(self, place: str) -> NDArray[np.int64]:
        shapes: NDArray[np.int64] = self._group[f"shapes/{place}"][()]
        return shapes

    def _ends(self, place: str) -> NDArray[np.int64] | None:
        """Where the values begin and end whose shapes differ; None if they have one shape."""
        if f"shapes/{place}" not in self._group:
            return None
        return np.append(0, np.cumsum(self._shapes(place).prod(axis=1)))


def _value(stored: Any, content: Any) -> Any:
    """The value of a record from its array in a dataset."""
    text = stored.attrs.get("text", _NUMBERS)
    if text == _NUMBERS:
        return content
    found = content.tobytes().decode()
    return json.loads(found) if text == _TEXTS else found
