"""Packings as a Universe of MDAnalysis (Gowers et al., Proc. 15th Python in Science Conf., 98 (2016))."""

from collections.abc import Iterable
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.core.topologyattrs import ResidueAttr, SegmentStringAttr

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.packing.lammps_files import describe, types
from jamlab.packing.packing import Packing
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.files import read_all


class RestAreas(ResidueAttr):  # type: ignore[misc]
    """Rest areas a0 of droplets: `residues.rest_areas`."""

    attrname = "rest_areas"
    singular = "rest_area"
    dtype = float


class Descriptions(SegmentStringAttr):  # type: ignore[misc]
    """Units and force law, see `jamlab.packing.lammps_files.describe`: `segments.descriptions`."""

    attrname = "descriptions"
    singular = "description"


@checked
def universe(source: FilePath | Packing | Iterable[Packing], **reading: Any) -> Any:
    """A Universe in memory with a frame for each packing.

    Atoms are the disks, or the vertices of droplets, in the order of `Packing.positions`; positions are whole, not
    wrapped. Residues are the particles: `resindices` are the particles' indices, `resids` one more, as in LAMMPS files.
    `types` are the atom types of those files, "1", "2", ..., by size; `radii` are half the diameters, or for vertices
    delta/2, the width of the rim; `masses` are 1. Droplets have bonds around their outline and `residues.rest_areas`.
    The one segment has units and force law as its `description`. The box of a frame is `dimensions`, of height 1, and
    `triclinic_dimensions`, where a sheared one has its tilt. MDAnalysis holds positions and boxes in float32: 7 digits.

    Args:
        source: a packing, several of one sweep, or a file that `jamlab.read_all` takes.
        reading: keyword arguments of `jamlab.read_all` for a file.

    Returns:
        MDAnalysis.Universe.

    Raises:
        InputError: no packings, packings of different sweeps, or more than 64 particle sizes.
        StorageError: the file cannot be read.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> u = jamlab.universe(p)
        >>> u.atoms.n_atoms, bool(np.allclose(u.atoms.radii, p.diameters / 2))
        (32, True)
    """
    frames = _frames(source, reading)
    first = frames[0]
    made = MDAnalysis.Universe.empty(
        len(first.positions), n_residues=first.n, n_segments=1, atom_resindex=first.particle, trajectory=False
    )
    of_particles = types(first).types
    made.add_TopologyAttr("types", of_particles[first.particle].astype(str).astype(object))
    made.add_TopologyAttr("masses", np.ones(len(first.positions)))
    made.add_TopologyAttr("resids", np.arange(1, first.n + 1))
    made.add_TopologyAttr(Descriptions(np.array([describe(first)], dtype=object)))
    columns = first.kind.dump_columns(first)
    made.add_TopologyAttr("radii", columns["radius"][first.particle])
    if "a0" in columns:
        made.add_TopologyAttr("bonds", np.column_stack([np.arange(len(first.positions)), first.successor]))
        made.add_TopologyAttr(RestAreas(columns["a0"]))
    positions = np.zeros((len(frames), len(first.positions), 3), dtype=np.float32)
    positions[:, :, :2] = [packing.positions for packing in frames]
    made.load_new(positions, order="fac", dimensions=np.array([_dimensions(packing.box) for packing in frames]))
    return made


def _frames(source: FilePath | Packing | Iterable[Packing], reading: dict[str, Any]) -> list[Packing]:
    if isinstance(source, Packing):
        frames = [source]
    elif isinstance(source, Iterable) and not isinstance(source, str | bytes):
        frames = list(source)
    else:
        frames = read_all(source, **reading)
    if not frames:
        raise InputError("no packings: a Universe needs at least one frame")
    for k, packing in enumerate(frames):
        if not isinstance(packing, Packing):
            raise InputError(f"entry {k} is a {type(packing).__name__}: give packings, or the name of a file")
        name = frames[0].difference(packing)
        if name is not None:
            raise InputError(f"frame {k} differs from frame 0 in {name}: a Universe holds one sweep")
    return frames


def _dimensions(box: Array) -> list[float]:
    """Lengths of the box vectors and angles between them in degrees, float64."""
    (lx, _), (xy, ly) = box
    return [lx, float(np.hypot(xy, ly)), 1.0, 90.0, 90.0, float(np.degrees(np.arctan2(ly, xy)))]
