"""Disks in H5MD files of other programs (https://www.nongnu.org/h5md/h5md.html), such as LAMMPS or MDAnalysis.

Read are, of one group of particles, position, image, id, species, radius or diameter, and the box, each fixed or by
frame. The box may be lengths or vectors, in two dimensions or three.
"""

from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.storage.verified_file import FilePath, read_hdf5
from jamlab.trajectories.lammps_data import DAMAGE, damage_named
from jamlab.trajectories.sites import SIZE_NAMES, Sites, check_flat, plane_box, radius_of, rounding_of

# what is read, or what states at rest have no use for
_KNOWN = {"position", "box", "image", "id", "species", *SIZE_NAMES, "velocity", "force", "mass", "charge"}
_WHOLE = ("h5md", "particles", "observables")  # groups of a file: `observables` hold results, not the state
MOST_BYTES = 2**31  # of one frame of an array


def is_h5md(path: FilePath) -> bool:
    """Whether an HDF5 file is an H5MD file that jamlab did not write."""
    try:
        with read_hdf5(path) as file:
            if file.visititems_links(_leads_away) is not None:  # to what may never end
                return False
            creator = file["h5md/creator"].attrs.get("name", "") if "h5md/creator" in file else ""
            return "particles" in file and "schema" not in file.attrs and str(creator) not in ("jamlab", "b'jamlab'")
    except (OSError, *DAMAGE):  # which its reader names
        return False


def _leads_away(name: str, link: Any) -> str | None:
    return name if isinstance(link, h5py.ExternalLink) else None


def read_h5md(path: FilePath, frame: int | None) -> Iterator[tuple[int, Sites]]:
    """Read one frame of a file, or all, with their numbers, in the length that it is written in."""
    with damage_named(path), read_hdf5(path) as file:
        names = [name for name in file["particles"] if "position" in file["particles"][name]]
        if len(names) != 1 and "all" not in names:
            raise InputError(
                f"groups of particles with positions: {', '.join(names) or 'none'}; one expected, or `all`"
            )
        chosen = "all" if "all" in names else names[0]
        group = file["particles"][chosen]
        if "connectivity" in file:
            raise InputError("the file has bonds: give the vertices of droplets to jamlab.from_outlines")
        unread = [*(group.keys() - _KNOWN), *(file.keys() - set(_WHOLE))]
        unread += [f"particles/{name}" for name in file["particles"] if name != chosen]
        count = len(_array(group, "position", 3)) if _by_frame(group, "position") else 1
        every = range(count)
        for k in every if frame is None else every[frame : frame + 1 or None]:
            yield k, _frame(group, k, count, unread)


def _frame(group: Any, frame: int, count: int, unread: list[str]) -> Sites:
    positions = _at(group, "position", frame, count, 2)
    size, dimension = positions.shape
    cell = group.get("box")
    box = None
    if cell is not None:
        sides = [side.decode() if isinstance(side, bytes) else str(side) for side in cell.attrs.get("boundary", ())]
        if any(side != "periodic" for side in sides[:2]):
            raise InputError(f"boundaries {', '.join(sides)}: packings are periodic in x and y")
        edges = _at(cell, "edges", frame, count, 2 if _array(cell, "edges").ndim - _by_frame(cell, "edges") == 2 else 1)
        box = plane_box("box edges", edges)
    if dimension == 3:
        check_flat(positions[:, 2], float(np.ptp(positions[:, :2]) if box is None else box[0, 0]))
    elif dimension != 2:
        raise InputError(f"positions of {dimension} dimensions: packings have two")
    read = positions[:, :2]
    if "image" in group and box is not None:
        read = read + _at(group, "image", frame, count, 2)[:, :2] @ box
    columns = {name: _at(group, name, frame, count, 1) for name in ("id", "species", *SIZE_NAMES) if name in group}
    if "id" in columns and len(np.unique(columns["id"])) != size:
        raise ValueError(f"frame {frame}: two particles have the same id")
    here = np.argsort(columns["id"]) if "id" in columns else np.arange(size)
    types = [f"{kind:g}" for kind in columns["species"]] if "species" in columns else ["1"] * size
    error = rounding_of(_array(group, "position").dtype, positions)
    if box is not None:
        error += rounding_of(_array(cell, "edges").dtype, box)
    error += sum(rounding_of(_array(group, name).dtype, columns[name]) for name in SIZE_NAMES if name in columns)
    return Sites(
        box,
        read[here],
        np.array(types)[here],
        radius=radius_of({name: values[here] for name, values in columns.items()}),
        deck=False,
        rounding=error,
        unread=unread,
    )


def _by_frame(group: Any, name: str) -> bool:
    """Whether an element has a row for each frame, and not one for all."""
    return isinstance(group[name], h5py.Group)


def _array(group: Any, name: str, dimensions: int | None = None) -> Any:
    """Dataset of an element."""
    data = group[name]["value"] if _by_frame(group, name) else group[name]
    if not isinstance(data, h5py.Dataset) or data.dtype.kind not in "fiu" or data.is_virtual or data.external:
        raise ValueError(f"{data.name} is no array of numbers of this file")
    if 8 * np.prod([float(size) for size in data.shape[_by_frame(group, name) :]]) > MOST_BYTES:
        raise ValueError(f"{data.name} has shape {data.shape}: 2 GB a frame at most")
    if dimensions is not None and data.ndim != dimensions:
        raise ValueError(f"{data.name} has shape {data.shape}: (frames, particles, dimensions) expected")
    return data


def _at(group: Any, name: str, frame: int, count: int, dimensions: int) -> Array:
    """One of so many frames of an element as float64."""
    data = _array(group, name)
    if _by_frame(group, name) and len(data) != count:
        raise InputError(f"{data.name} has {len(data)} frames, positions {count}: which belong together is not known")
    values = np.asarray(data[frame] if _by_frame(group, name) else data[()], dtype=np.float64)
    if values.ndim != dimensions or not np.isfinite(values).all():
        raise ValueError(f"{data.name}, frame {frame}: finite numbers in {dimensions} dimensions expected")
    return values
