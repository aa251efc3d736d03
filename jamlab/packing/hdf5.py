"""Packings of one sweep in one HDF5 file, float64, laid out after H5MD 1.1 (https://www.nongnu.org/h5md/h5md.html).

The layout, schema "jamlab", version 2, stands in docs/reference/files.md; a file of another version is refused. HDF5
skips the first 512 bytes, a checksum (`jamlab.storage.verified_file`): a file that has changed since it was written is
refused.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import h5py
import numpy as np

from jamlab.arrays import Array, ArrayLike
from jamlab.checks import checked
from jamlab.errors import InputError, StorageError
from jamlab.packing.facts import OF_DIGITS, history_text, rounding_of
from jamlab.packing.packing import KNOWN, MINIMUM, Packing
from jamlab.packing.quantities import MEASURED
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.formats import check_ending
from jamlab.storage.verified_file import (
    NUMBERS,
    REMEDY,
    SCHEMA,
    SCHEMA_VERSION,
    FilePath,
    add_checksum,
    dataset,
    opened,
    version_of,
)

# places in the layout
_PARAMETERS, _LAW = "parameters/", "force_law/"
_POSITIONS, _EDGES = "particles/all/position/value", "particles/all/box/edges/value"
_OBSERVABLES = ("observables/", "/value")  # around a name
_OF_SWEEP = ("model", "units")  # attributes
_SIZES = {"diameters": "f", "offsets": "iu"}  # with kinds of numpy


def write_sweep(
    path: FilePath,
    packings: Iterable[Packing],
    observables: Mapping[str, ArrayLike] | None = None,
    extend: Callable[[Any], None] | None = None,
) -> None:
    """Write the packings of one sweep as frames, see `jamlab.write`; the file is written completely or not at all.
    `extend`: see `file_image`.

    Provenance is stored as JSON: numpy numbers come back as plain numbers, arrays and tuples as lists, keys as text.
    """
    check_ending(path, "packings")
    content = add_checksum(file_image(packings, observables, extend))
    with atomic_file(path) as temporary:
        temporary.write_bytes(content)


def file_image(
    packings: Iterable[Packing],
    observables: Mapping[str, ArrayLike] | None = None,
    extend: Callable[[Any], None] | None = None,
) -> bytes:
    """The bytes of such a file, without checksum; `extend` is called with the open h5py.File before it is closed, to
    add groups of its own. Other arguments and errors as in `jamlab.write`."""
    record = record_of(packings, observables)

    def write(file: Any) -> None:
        _write_parameters(file.create_group("parameters"), record)
        particles = file.create_group("particles/all")
        _write_particles(particles, record)
        group = file.create_group("observables")
        for name in observables or {}:
            _write_element(group, name, record[observable_place(name)], clock=particles["position"])
            if name in MEASURED:
                group[name].attrs["description"] = MEASURED[name].words
        if extend is not None:
            extend(file)

    return image_of(write)


def image_of(write: Callable[[Any], None], **how: Any) -> bytes:
    """The bytes of a file of this schema, without checksum, into which `write` writes; `how`: of `h5py.File`."""
    # in memory: a disk that fills up while HDF5 itself writes to it crashes the process later on
    with h5py.File(f"jamlab-{os.urandom(8).hex()}", "w", driver="core", backing_store=False, **how) as file:
        _write_header(file)
        write(file)
        file.flush()
        return bytes(file.id.get_file_image())


def record_of(packings: Iterable[Packing], observables: Mapping[str, ArrayLike] | None = None) -> dict[str, Any]:
    """What a file holds of the packings of one sweep, by its place in the layout: text, numbers and arrays; positions
    and boxes in two dimensions. Arguments and errors as in `jamlab.write`; see `frames_of`."""
    check_names(observables or {})  # before packings are made by a generator
    frames = list(packings)
    check_one_sweep(frames)
    results = {observable_place(k): _observable(k, values, len(frames)) for k, values in (observables or {}).items()}
    first = frames[0]
    parameters = {
        **{name: getattr(first, name) for name in _OF_SWEEP},
        **{name: value for name in _SIZES if (value := getattr(first, name)) is not None},
        **{f"{_LAW}{name}": value for name, value in first.params.items()},
        "phi_J": np.array([np.nan if packing.phi_J is None else float(packing.phi_J) for packing in frames]),
        "provenance": [history_text(p.provenance, f"provenance of frame {k}") for k, p in enumerate(frames)],
        "state": [history_text(p.known, f"state of frame {k}") for k, p in enumerate(frames)],
    }
    record: dict[str, Any] = {f"{_PARAMETERS}{name}": value for name, value in parameters.items()}
    record[_POSITIONS] = np.array([packing.positions for packing in frames])
    record[_EDGES] = np.array([packing.box for packing in frames])
    return record | results


def observable_place(name: str) -> str:
    """Where a record holds an observable."""
    return f"{_OBSERVABLES[0]}{name}{_OBSERVABLES[1]}"


def observable_of(place: str) -> str | None:
    """The observable that a record holds at a place; None if there is none."""
    before, after = _OBSERVABLES
    return place[len(before) : -len(after)] if place.startswith(before) and place.endswith(after) else None


@checked
def read_hdf5(path: FilePath, frame: int = -1) -> Packing:
    """Read one frame of a file, by default the last; negative numbers count from the end."""
    if not isinstance(frame, int | np.integer):
        raise InputError(f"frame is {frame!r}: must be a whole number")
    with opened(path) as file:
        count = _count(file)
        if not -count <= frame < count:
            frames = f"it holds {count}, 0 to {count - 1} or -1 for the last" if count else "it holds none"
            raise StorageError(f"{path} has no frame {frame}: {frames}")
        return _packing(f"{path}", _record(file), int(frame) % count)


@checked
def read_all_hdf5(path: FilePath) -> list[Packing]:
    """Read every frame, in the order written. Errors as in `read_hdf5`."""
    with opened(path) as file:
        if not _count(file):
            raise StorageError(f"{path} has no frames: write packings into it again")
        return frames_of(f"{path}", _record(file))


def read_observables(path: FilePath) -> dict[str, Array]:
    """Read the results: name -> (frames,) or (frames, ...) float64. Errors as in `read_hdf5`."""
    with opened(path) as file:
        return {name: dataset(element, "value", "f")[()] for name, element in file["observables"].items()}


# writing --------------------------------------------------------------------------------------------------------------


def _write_header(file: Any) -> None:
    file.attrs.update(schema=SCHEMA, schema_version=SCHEMA_VERSION)
    h5md = file.create_group("h5md")
    h5md.attrs["version"] = np.array([1, 1])
    h5md.create_group("author").attrs["name"] = "jamlab"
    h5md.create_group("creator").attrs.update(name="jamlab", version=version_of("jamlab"))


def _write_parameters(group: Any, record: Mapping[str, Any]) -> None:
    group.attrs.update({name: record[f"{_PARAMETERS}{name}"] for name in _OF_SWEEP})
    places = [place.removeprefix(_PARAMETERS) for place in record if place.startswith(_PARAMETERS)]
    for name in (name for name in places if name in _SIZES):
        group[name] = record[f"{_PARAMETERS}{name}"]
    group.create_group("force_law")
    for name in (name for name in places if name not in (*_OF_SWEEP, *_SIZES)):
        group[name] = record[f"{_PARAMETERS}{name}"]


def _write_particles(group: Any, record: Mapping[str, Any]) -> None:
    in_plane, boxes = record[_POSITIONS], record[_EDGES]
    positions = np.zeros((*in_plane.shape[:2], 3))
    positions[:, :, :2] = in_plane
    edges = np.zeros((len(boxes), 3, 3))
    edges[:, :2, :2] = boxes
    edges[:, 2, 2] = 1.0
    _write_element(group, "position", positions)
    box = group.create_group("box")
    box.attrs.update(dimension=3, boundary=["periodic"] * 3)
    _write_element(box, "edges", edges, clock=group["position"])


def _write_element(group: Any, name: str, values: Array, clock: Any = None) -> None:
    """One H5MD element; `clock` is an element of the same frames, whose step and time it shares by hard link."""
    element = group.create_group(name)
    element["value"] = values
    element["step"] = np.arange(len(values), dtype=np.int64) if clock is None else clock["step"]
    element["time"] = np.arange(len(values), dtype=np.float64) if clock is None else clock["time"]


def check_one_sweep(frames: Sequence[Packing]) -> None:
    """Refuse packings that are not the same particles with the same law."""
    if not frames:
        raise InputError("no packings: give one or more")
    for k, packing in enumerate(frames):
        name = frames[0].difference(packing)
        if name is not None:
            raise InputError(f"frame {k} differs from frame 0 in {name}: these are several sweeps, take one at a time")


def check_names(observables: Iterable[str]) -> None:
    """Refuse names that HDF5 would take for others, or cannot hold."""
    for name in observables:
        surrogates = any("\ud800" <= letter <= "\udfff" for letter in name)
        if not name or name == "." or "/" in name or "\0" in name or surrogates:
            said = "a name must be text of UTF-8, not empty, and contain no slash and no null character"
            raise InputError(f"an observable cannot be named {name!r}: {said}")


def _observable(name: str, values: ArrayLike, frames: int) -> Array:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"observable {name!r} is no array of numbers: {error}") from error
    if array.ndim == 0 or len(array) != frames:
        raise InputError(f"observable {name!r} has shape {array.shape}: the first axis must count the {frames} frames")
    return array


# reading --------------------------------------------------------------------------------------------------------------


def _count(file: Any) -> int:
    return int(_positions(file).shape[0])


def _positions(file: Any) -> Any:
    return dataset(file, _POSITIONS, "f", (None, None, 3))


def _record(file: Any) -> dict[str, Any]:
    """The record of a file, see `record_of`; positions and boxes are not read yet, and have three dimensions."""
    positions = _positions(file)
    frames = len(positions)
    parameters = file["parameters"]
    record: dict[str, Any] = {"phi_J": dataset(parameters, "phi_J", "f", (frames,))[()]}
    for name in ("provenance", "state"):
        record[name] = dataset(parameters, name, "T", (frames,)).asstr()[()]
    for name, kind in _SIZES.items():
        if name in parameters:
            record[name] = dataset(parameters, name, kind, (None,))[()]
    for name in parameters["force_law"]:
        record[f"{_LAW}{name}"] = _value(dataset(parameters["force_law"], name, NUMBERS + "T"))
    record |= {name: parameters.attrs[name] for name in _OF_SWEEP}
    edges = dataset(file, _EDGES, "f", (frames, 3, 3))
    return {f"{_PARAMETERS}{name}": value for name, value in record.items()} | {_POSITIONS: positions, _EDGES: edges}


def frames_of(where: str, record: Mapping[str, Any]) -> list[Packing]:
    """The packings of a record, see `record_of`; `where`: what an error names."""
    return [_packing(where, record, frame) for frame in range(len(record[_EDGES]))]


def _packing(where: str, record: Mapping[str, Any], frame: int) -> Packing:
    parts = {place.removeprefix(_PARAMETERS): value for place, value in record.items() if place.startswith(_PARAMETERS)}
    positions, box, onset = record[_POSITIONS], record[_EDGES], float(parts["phi_J"][frame])
    history = _read_history(where, parts["provenance"][frame], frame)
    known = _read_known(where, parts["state"][frame])
    sizes = {name: parts.get(name) for name in _SIZES}
    law = {name.removeprefix(_LAW): value for name, value in parts.items() if name.startswith(_LAW)}
    fields = {
        **{name: parts[name] for name in _OF_SWEEP},
        "box": box[frame, :2, :2],
        "positions": positions[frame, :, :2],
        "params": {name: value.item() if isinstance(value, np.generic) else value for name, value in law.items()},
        **sizes,
        "phi_J": None if np.isnan(onset) else onset,
        **known,
        "provenance": history,
    }
    arrays = [positions, box, *(each for each in (*sizes.values(), *law.values()) if np.ndim(each))]
    short = [each for each in arrays if each.dtype.kind == "f" and each.dtype.itemsize < 8]  # which others wrote
    if error := sum(rounding_of(each.dtype, each[()]) for each in short):
        fields |= {name: MINIMUM[name] for name in OF_DIGITS}
        fields["rounding"] = max(error, known.get("rounding", 0.0))
    try:
        return Packing(**fields)
    except InputError as error:
        raise type(error)(f"{where}, frame {frame}: {error}") from error


def _read_history(path: str, text: str, frame: int) -> dict[str, Any]:
    history = json.loads(text)
    if not isinstance(history, dict):
        raise StorageError(f"{path} is damaged (provenance of frame {frame} is {text[:40]}, not a table): {REMEDY}")
    return history


def _read_known(path: str, text: str) -> dict[str, Any]:
    """What is known of a state."""
    known = json.loads(text)
    if not isinstance(known, dict) or not known.keys() <= KNOWN.keys():
        raise StorageError(f"{path} is damaged (the record of a state is {str(known)[:40]}): {REMEDY}")
    return known


def _value(dataset: Any) -> Any:
    return dataset.asstr()[()] if h5py.check_string_dtype(dataset.dtype) else dataset[()]
