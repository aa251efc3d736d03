"""Packings of one sweep in one HDF5 file, float64, laid out after H5MD 1.1 (https://www.nongnu.org/h5md/h5md.html).

Layout, schema "jamlab", version 1 (F frames, P positions: disks or vertices, n particles):

| name                           | shape     | type           | content                                                |
|--------------------------------|-----------|----------------|--------------------------------------------------------|
| / schema, schema_version       | attribute | str, int       | "jamlab", 1                                            |
| /h5md, /h5md/{author,creator}  | attribute | int, str       | version [1, 1]; author; program that wrote it, version |
| /particles/all/position/value  | (F, P, 3) | float64        | positions with z = 0, not wrapped; lengths of `units`  |
| /particles/all/box             | attribute | int, str       | dimension 3, boundary: three times "periodic"          |
| /particles/all/box/edges/value | (F, 3, 3) | float64        | rows are lattice vectors; the third is (0, 0, 1)       |
| /observables/<name>/value      | (F, ...)  | float64        | a scalar or a vector per frame                         |
| .../step, .../time             | (F,)      | int64, float64 | beside every value: number of the frame, twice         |
| /parameters model, units       | attribute | str            | as in `Packing`                                        |
| /parameters/diameters          | (n,)      | float64        | SP only                                                |
| /parameters/offsets            | (n + 1,)  | int64          | DP only                                                |
| /parameters/force_law/<name>   | () or any | number, str    | `Packing.params`                                       |
| /parameters/onset              | (F,)      | float64        | NaN: none                                              |
| /parameters/provenance         | (F,)      | str            | JSON; `_known`: what is known of the state             |

The packings are quasi-static, so time has no unit: it is the number of the frame. Later versions only add names; a file
of a newer version is refused. HDF5 skips the first 512 bytes, a checksum (`jamlab.storage.verified_file`): a file that
has changed since it was written is refused; files of jamlab 0.1.0 have no checksum and are read. `jamlab.universe`
makes a Universe of MDAnalysis of it. MDAnalysis itself opens the file (in float32) with a topology of as many atoms as
positions:
    MDAnalysis.Universe("run.dump", "run.h5", topology_format="LAMMPSDUMP", format="H5MD", convert_units=False)
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError, StorageError
from jamlab.packing.packing import KNOWN, Packing
from jamlab.packing.quantities import MEASURED
from jamlab.storage.atomic_file import atomic_file, check_ending
from jamlab.storage.verified_file import (
    NUMBERS,
    REMEDY,
    SCHEMA,
    SCHEMA_VERSION,
    FilePath,
    add_checksum,
    dataset,
    jamlab_version,
    opened,
)

_KNOWN = "_known"  # entry beside the provenance that holds `Packing.known`


@checked
def write_sweep(
    path: FilePath, packings: Iterable[Packing], observables: Mapping[str, ArrayLike] | None = None
) -> None:
    """Write the packings of one sweep as frames; the file appears whole or not at all.

    Args:
        path: file to create or replace, .h5. On any failure the old file stays and nothing is left behind.
        packings: frames, which share model, units, diameters or offsets, and params.
        observables: name -> numbers, (frames,) or (frames, ...): results that belong to the frames.

    Raises:
        InputError: no packings, packings of different sweeps, or values that the file cannot hold.
        StorageError: the file cannot be written.

    Provenance is stored as JSON: numpy numbers come back as plain numbers, arrays and tuples as lists, keys as text.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> sweep = [onset, *jamlab.compress(onset, to=0.88, step=0.02)]
        >>> jamlab.write("sweep.h5", sweep, {"rho": [jamlab.packing_fraction(p) for p in sweep]})
        >>> len(jamlab.read_all("sweep.h5")) == len(sweep)
        True
    """
    check_ending(path, "packings")
    content = add_checksum(file_image(packings, observables))
    with atomic_file(path) as temporary:
        temporary.write_bytes(content)


def file_image(
    packings: Iterable[Packing],
    observables: Mapping[str, ArrayLike] | None = None,
    extend: Callable[[Any], None] | None = None,
) -> bytes:
    """The bytes of such a file, without checksum; arguments and errors as in `write`.

    Args:
        packings: see `write`.
        observables: see `write`.
        extend: called with the open h5py.File before it is closed, to add groups of its own.
    """
    frames = list(packings)
    _check_one_sweep(frames)
    results = {name: _observable(name, values, len(frames)) for name, values in (observables or {}).items()}
    params = {name: _param(name, value) for name, value in frames[0].params.items()}
    onsets = [_onset(k, packing.onset) for k, packing in enumerate(frames)]
    histories = [_history(k, {**p.provenance, _KNOWN: p.known}) for k, p in enumerate(frames)]

    with _memory_file() as file:
        _write_header(file)
        _write_parameters(file.create_group("parameters"), frames[0], params, onsets, histories)
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
def read(path: FilePath, frame: int = -1) -> Packing:
    """Read one frame, by default the last; negative numbers count from the end."""
    if not isinstance(frame, int | np.integer):
        raise InputError(f"frame is {frame!r}: must be a whole number")
    with opened(path) as file:
        count = _count(file)
        if not -count <= frame < count:
            raise StorageError(f"{path} has no frame {frame}: it holds {count}, 0 to {count - 1} or -1 for the last")
        return _packing(path, file, int(frame) % count)


@checked
def read_all(path: FilePath) -> list[Packing]:
    """Read every frame, in the order written. Errors as in `read`."""
    with opened(path) as file:
        return [_packing(path, file, frame) for frame in range(_count(file))]


def read_observables(path: FilePath) -> dict[str, Array]:
    """Read the results: name -> (frames,) or (frames, ...) float64. Errors as in `read`."""
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
    h5md.create_group("creator").attrs.update(name="jamlab", version=jamlab_version())


def _write_parameters(
    group: Any, first: Packing, params: dict[str, Any], onsets: list[float], histories: list[str]
) -> None:
    group.attrs.update(model=first.model, units=first.units)
    for name in ("diameters", "offsets"):
        if getattr(first, name) is not None:
            group[name] = getattr(first, name)
    law = group.create_group("force_law")
    for name, value in params.items():
        law[name] = value
    group["onset"] = onsets
    group["provenance"] = histories


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


def _check_one_sweep(frames: list[Packing]) -> None:
    if not frames:
        raise InputError("no packings to write: a file needs at least one")
    for k, packing in enumerate(frames):
        name = frames[0].difference(packing)
        if name is not None:
            raise InputError(f"frame {k} differs from frame 0 in {name}: a file holds one sweep, use several files")


def _check_name(kind: str, name: str) -> None:
    if not name or "/" in name or name == ".":
        raise InputError(f"{kind} cannot be named {name!r}: a name in an HDF5 file is not empty and has no slash")


def _observable(name: str, values: ArrayLike, frames: int) -> Array:
    _check_name("an observable", name)
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"observable {name!r} is no array of numbers: {error}") from error
    if array.ndim == 0 or len(array) != frames:
        raise InputError(f"observable {name!r} has shape {array.shape}: the first axis must count the {frames} frames")
    return array


def _param(name: str, value: Any) -> Any:
    _check_name("a parameter", name)
    if isinstance(value, str):
        return value
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        raise InputError(f"params[{name!r}] is {value!r}: only numbers, arrays of numbers and text can be stored")
    return array


def _onset(frame: int, onset: float | None) -> float:
    if onset is not None and not np.isfinite(onset):
        raise InputError(f"onset of frame {frame} is {onset}: must be a finite number or None")
    return np.nan if onset is None else float(onset)


def _history(frame: int, provenance: dict[str, Any]) -> str:
    def plain(value: Any) -> Any:
        if isinstance(value, np.generic | np.ndarray):
            return value.tolist()
        raise TypeError(f"{value!r} is a {type(value).__name__}")

    try:
        return json.dumps(provenance, default=plain)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"provenance of frame {frame} cannot be stored: {error}; use numbers, text, None, lists and dicts"
        ) from error


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
    known = _pop_known(path, history)
    sizes = {
        name: dataset(parameters, name, kind, (None,))[()] if name in parameters else None
        for name, kind in (("diameters", "f"), ("offsets", "iu"))
    }
    law = parameters["force_law"]
    fields = {
        "model": parameters.attrs["model"],
        "units": parameters.attrs["units"],
        "box": dataset(file, "particles/all/box/edges/value", "f", (frames, 3, 3))[frame, :2, :2],
        "positions": positions[frame, :, :2],
        "params": {name: _value(dataset(law, name, NUMBERS + "T")) for name in law},
        **sizes,
        "onset": None if np.isnan(onset) else onset,
        **known,
        "provenance": history,
    }
    try:
        return Packing(**fields)
    except InputError as error:
        raise type(error)(f"{path}, frame {frame}: {error}") from error


def _read_history(path: FilePath, text: str, frame: int) -> dict[str, Any]:
    history = json.loads(text)
    if not isinstance(history, dict):
        raise StorageError(f"{path} is damaged (provenance of frame {frame} is {text[:40]}, not a table): {REMEDY}")
    return history


def _pop_known(path: FilePath, history: dict[str, Any]) -> dict[str, Any]:
    if _KNOWN not in history:  # a file of 0.2.0 or before
        before = {name: "force_tolerance" if name == "tolerance" else name for name in KNOWN}
        return {name: history.pop(said) for name, said in before.items() if said in history}
    known = history.pop(_KNOWN)
    if not isinstance(known, dict) or not known.keys() <= KNOWN.keys():
        raise StorageError(f"{path} is damaged (what is known of a state is {str(known)[:40]}): {REMEDY}")
    return known


def _value(dataset: Any) -> Any:
    if h5py.check_string_dtype(dataset.dtype):
        return dataset.asstr()[()]
    value = dataset[()]
    return value.item() if isinstance(value, np.generic) else value
