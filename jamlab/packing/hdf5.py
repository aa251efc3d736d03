"""Packings of one sweep in one HDF5 file, float64, laid out after H5MD 1.1 (https://www.nongnu.org/h5md/h5md.html).

The layout, schema "jamlab", version 1, stands in docs/reference/files.md. Later versions only add names; a file of a
newer version is refused. HDF5 skips the first 512 bytes, a checksum (`jamlab.storage.verified_file`): a file that has
changed since it was written is refused.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import metadata
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
)


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
    check_names(observables or {})  # before packings are made by a generator
    frames = list(packings)
    check_one_sweep(frames)
    results = {name: _observable(name, values, len(frames)) for name, values in (observables or {}).items()}
    onsets = [np.nan if packing.onset is None else float(packing.onset) for packing in frames]
    histories = [history_text(p.provenance, f"provenance of frame {k}") for k, p in enumerate(frames)]
    states = [history_text(p.known, f"state of frame {k}") for k, p in enumerate(frames)]

    with _memory_file() as file:
        _write_header(file)
        series: dict[str, Sequence[Any]] = {"onset": onsets, "provenance": histories, "state": states}
        _write_parameters(file.create_group("parameters"), frames[0], series)
        particles = file.create_group("particles/all")
        _write_particles(particles, frames)
        group = file.create_group("observables")
        for name, values in results.items():
            _write_element(group, name, values, clock=particles["position"])
            if name in MEASURED:
                group[name].attrs["description"] = MEASURED[name].words
        if extend is not None:
            extend(file)
        file.flush()
        return bytes(file.id.get_file_image())


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
        return _packing(path, file, int(frame) % count)


@checked
def read_all_hdf5(path: FilePath) -> list[Packing]:
    """Read every frame, in the order written. Errors as in `read_hdf5`."""
    with opened(path) as file:
        if not (count := _count(file)):
            raise StorageError(f"{path} has no frames: write packings into it again")
        return [_packing(path, file, frame) for frame in range(count)]


def read_observables(path: FilePath) -> dict[str, Array]:
    """Read the results: name -> (frames,) or (frames, ...) float64. Errors as in `read_hdf5`."""
    with opened(path) as file:
        return {name: dataset(element, "value", "f")[()] for name, element in file["observables"].items()}


# writing --------------------------------------------------------------------------------------------------------------


def _memory_file() -> Any:
    """HDF5 file in memory. A disk that fills up while HDF5 itself writes to it crashes the process later on."""
    return h5py.File(f"jamlab-{os.urandom(8).hex()}", "w", driver="core", backing_store=False)


def _write_header(file: Any) -> None:
    file.attrs.update(schema=SCHEMA, schema_version=SCHEMA_VERSION)
    h5md = file.create_group("h5md")
    h5md.attrs["version"] = np.array([1, 1])
    h5md.create_group("author").attrs["name"] = "jamlab"
    h5md.create_group("creator").attrs.update(name="jamlab", version=metadata.version("jamlab"))


def _write_parameters(group: Any, first: Packing, series: Mapping[str, Sequence[Any]]) -> None:
    """What all frames share, and `series` with one entry a frame."""
    group.attrs.update(model=first.model, units=first.units)
    for name in ("diameters", "offsets"):
        if getattr(first, name) is not None:
            group[name] = getattr(first, name)
    law = group.create_group("force_law")
    for name, value in first.params.items():
        law[name] = value
    for name, entries in series.items():
        group[name] = entries


def _write_particles(group: Any, frames: list[Packing]) -> None:
    positions = np.zeros((len(frames), len(frames[0].positions), 3))
    positions[:, :, :2] = [packing.positions for packing in frames]
    edges = np.zeros((len(frames), 3, 3))
    edges[:, :2, :2] = [packing.box for packing in frames]
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
    return dataset(file, "particles/all/position/value", "f", (None, None, 3))


def _packing(path: FilePath, file: Any, frame: int) -> Packing:
    positions = _positions(file)
    frames = len(positions)
    parameters = file["parameters"]
    onset = float(dataset(parameters, "onset", "f", (frames,))[frame])
    history = _read_history(path, dataset(parameters, "provenance", "T", (frames,)).asstr()[frame], frame)
    known = _read_known(path, dataset(parameters, "state", "T", (frames,)).asstr()[frame])
    sizes = {
        name: dataset(parameters, name, kind, (None,)) if name in parameters else None
        for name, kind in (("diameters", "f"), ("offsets", "iu"))
    }
    law = {name: dataset(parameters["force_law"], name, NUMBERS + "T") for name in parameters["force_law"]}
    box = dataset(file, "particles/all/box/edges/value", "f", (frames, 3, 3))
    fields = {
        "model": parameters.attrs["model"],
        "units": parameters.attrs["units"],
        "box": box[frame, :2, :2],
        "positions": positions[frame, :, :2],
        "params": {name: _value(each) for name, each in law.items()},
        **{name: None if each is None else each[()] for name, each in sizes.items()},
        "onset": None if np.isnan(onset) else onset,
        **known,
        "provenance": history,
    }
    arrays = [positions, box, *(each for each in (*sizes.values(), *law.values()) if each is not None and each.shape)]
    short = [each for each in arrays if each.dtype.kind == "f" and each.dtype.itemsize < 8]  # which others wrote
    if error := sum(rounding_of(each.dtype, each[()]) for each in short):
        fields |= {name: MINIMUM[name] for name in OF_DIGITS}
        fields["rounding"] = max(error, known.get("rounding", 0.0))
    try:
        return Packing(**fields)
    except InputError as error:
        raise type(error)(f"{path}, frame {frame}: {error}") from error


def _read_history(path: FilePath, text: str, frame: int) -> dict[str, Any]:
    history = json.loads(text)
    if not isinstance(history, dict):
        raise StorageError(f"{path} is damaged (provenance of frame {frame} is {text[:40]}, not a table): {REMEDY}")
    return history


def _read_known(path: FilePath, text: str) -> dict[str, Any]:
    """What is known of a state."""
    known = json.loads(text)
    if not isinstance(known, dict) or not known.keys() <= KNOWN.keys():
        raise StorageError(f"{path} is damaged (the record of a state is {str(known)[:40]}): {REMEDY}")
    return known


def _value(dataset: Any) -> Any:
    if h5py.check_string_dtype(dataset.dtype):
        return dataset.asstr()[()]
    value = dataset[()]
    return value.item() if isinstance(value, np.generic) else value
