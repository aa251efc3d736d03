"""Packings from the frames of a Universe of MDAnalysis, whatever it was read from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.exceptions import NoDataError
from numpy.typing import ArrayLike, NDArray

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.packing.lammps_files import described
from jamlab.packing.packing import Packing
from jamlab.protocols.relax import relax as relaxed_packing
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.columns import damage_named
from jamlab.trajectories.sites import Radii, Sites, check_flat, plane_box, rings_of_bonds

# Half a unit of the last of 24 binary digits, for the coordinate, and as much for the length and angle of the box each,
# with a margin of a third
_FLOAT32 = 2.0**-22


_GSD = (
    *(f"particles/{name}" for name in ("N", "position", "image", "type", "diameter", "velocity", "mass", "charge")),
    *("configuration/", "bonds/"),
)


class UniverseFrames:
    """Convert frames of a Universe or AtomGroup one by one, see `from_universe`; its topology is read once."""

    def __init__(
        self,
        atoms: Any,
        radii: Radii = None,
        units: str | None = None,
        params: Mapping[str, Any] | None = None,
        box: ArrayLike | None = None,
        relaxed: bool = False,
    ) -> None:
        try:
            self.group = atoms.atoms
            self.trajectory = self.group.universe.trajectory
        except AttributeError as error:
            raise InputError(
                f"a {type(atoms).__name__} has no atoms with a trajectory: give a Universe or AtomGroup of MDAnalysis"
            ) from error
        if not len(self.group):
            raise InputError("no atoms are selected: a packing needs at least one particle")
        self._given = (radii, units, params)
        self._box = None if box is None else plane_box("box", box)
        self._relaxed = relaxed
        self._types = _types(self.group, radii)
        bonds = _bonds(self.group)
        self._rings = rings_of_bonds(bonds, len(self.group)) if len(bonds) else None
        residues = _attribute(self.group.residues, "rest_areas", None)
        self._a0 = None if residues is None else self.group.rest_areas
        self._entries = _entries(self.group)
        self._unread: list[str] = []
        if self.trajectory.format == "GSD":
            with _gsd(self.trajectory) as file:
                names = file.file.find_matching_chunk_names("")
            self._unread = [name for name in names if not name.startswith(_GSD)]

    def packing(self) -> Packing:
        """Convert the present frame. Errors as in `from_universe`."""
        step = self.trajectory.ts
        positions = self.group.positions.astype(np.float64)
        box = _box(self.trajectory) if self._box is None else self._box
        error = _FLOAT32 * max(float(np.abs(positions).max()), float(np.abs(box).sum()))
        provenance = {"source": _source(self.trajectory), "frame": int(step.frame), "precision": "float32"}
        sites = Sites(
            box=box,
            positions=positions[:, :2],
            types=self._types,
            rings=self._rings,
            radius=self._radius(step),
            a0=self._a0,
            entries=self._entries,
            deck=False,
            rounding=max(error, self._entries.get("rounding", 0.0)),
            provenance=provenance,
            unread=self._unread,
        )
        check_flat(positions[:, 2], box[0, 0], f"frame {step.frame}")
        try:
            packing = sites.packing(*self._given)
        except InputError as failure:
            raise type(failure)(f"frame {step.frame}: {failure}") from failure
        return relaxed_packing(packing) if self._relaxed else packing

    def _radius(self, step: Any) -> Array | None:
        if self._rings is not None or self._given[0] is not None:
            return None
        if self.trajectory.format == "GSD":
            with _gsd(self.trajectory) as file:  # diameters of a frame, or in the first one for all
                if not any(file.file.chunk_exists(k, "particles/diameter") for k in (0, int(step.frame))):
                    return None  # MDAnalysis gives every particle the diameter 1 then
        if "radius" in step.data and len(step.data["radius"]) == len(self.group.universe.atoms):
            of_frame: Array = np.asarray(step.data["radius"], dtype=np.float64)[self.group.indices]
            return of_frame
        radii = _attribute(self.group, "radii", None)
        return None if radii is None else np.asarray(radii, dtype=np.float64)


@checked
def from_universe(
    u: MDAnalysis.Universe | MDAnalysis.AtomGroup,
    radii: Radii = None,
    units: str | None = None,
    *,
    params: Mapping[str, Any] | None = None,
    box: ArrayLike | None = None,
    relaxed: bool = False,
    start: int | None = None,
    stop: int | None = None,
    step: int | None = None,
) -> list[Packing]:
    """Convert the frames of a trajectory to packings.

    Atoms without bonds are disks. Bonds that close rings make droplets of their vertices, whole again where the box cut
    them. A Universe of `jamlab.universe` holds units, force law and sizes; for others give what they lack. Parameters
    found nowhere have the defaults of the decks, and their names stand in `provenance["assumed"]`.

    MDAnalysis holds coordinates in float32, whatever the file holds. `Packing.rounding` says so, `converged` is False
    and `max_force` None. In `jamlab.measure` z is nan where rounding could open or close a contact; moduli and G* are
    refused. `relaxed=True` takes every frame to the minimum next to it first. `jamlab.read`
    keeps all digits of LAMMPS files.

    Args:
        u: Universe, or an AtomGroup of it.
        radii: of disks: one number, (n,), or by type or name, {"1": 0.5, "2": 0.7}; default those of the Universe.
        units: "eps" or "k", see `Packing`; default those of the Universe, or "eps".
        params: of the force law, any of them, see `Packing`; `a0` may be one number.
        box: two sides, or (2, 2) lattice vectors, for trajectories without a box, such as XYZ.
        relaxed: relax every frame, see `jamlab.relax`.
        start, stop, step: frames, as in a slice.

    Raises:
        InputError: no box, no radii, bonds that close no rings, atoms out of the plane, or no packing; names the frame.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> (q,) = jamlab.from_universe(jamlab.universe(p), relaxed=True)  # positions were float32
        >>> q.converged, bool(np.isclose(jamlab.shear_modulus(q), jamlab.shear_modulus(p), rtol=1e-4))
        (True, True)
    """
    if step == 0:
        raise InputError("step = 0: must be a whole number other than 0, such as 10 for every tenth frame")
    frames = UniverseFrames(u, radii, units, params, box, relaxed)
    return [frames.packing() for _ in frames.trajectory[start:stop:step]]


def read_gsd(
    path: FilePath, frame: int | None, radii: Radii, units: str | None, params: Mapping[str, Any] | None, box: Any
) -> list[Packing]:
    """One frame of a GSD file, or all; without that frame an empty list. Arguments as in `jamlab.read`."""
    if box is not None:
        raise InputError(f"box = {box!r:.60} was given, but {path} has one: leave it out")
    with damage_named(path):
        try:
            read = MDAnalysis.Universe(str(path))
        except ImportError as error:
            raise InputError("it needs the package gsd: pip install gsd") from error
        count = len(read.trajectory)
        if frame is not None and not -count <= frame < count:
            return []
        start, stop = (None, None) if frame is None else (frame % count, frame % count + 1)
        return from_universe(read, radii, units, params=params, start=start, stop=stop)


def _attribute(group: Any, name: str, default: Any) -> Any:
    try:
        return getattr(group, name)
    except (NoDataError, AttributeError):
        return default


def _types(group: Any, radii: Radii) -> NDArray[np.str_]:
    """Types of atoms, or where radii go by them their names: formats such as XYZ have names, and types are guessed."""
    types, names = (np.array([str(v) for v in _attribute(group, k, ["1"] * len(group))]) for k in ("types", "names"))
    known = {str(name) for name in radii} if isinstance(radii, Mapping) else set()
    return names if not set(types.tolist()) <= known and set(names.tolist()) <= known else types


def _bonds(group: Any) -> NDArray[np.int64]:
    if _attribute(group, "bonds", None) is None or not len(group.bonds):
        return np.empty((0, 2), dtype=np.int64)
    place = np.full(len(group.universe.atoms), -1)
    place[group.indices] = np.arange(len(group))
    ends = place[np.asarray(group.bonds.indices, dtype=np.int64)]
    return np.asarray(ends[(ends >= 0).all(axis=1)])


def _entries(group: Any) -> dict[str, Any]:
    """Read the description that `jamlab.universe` left in the segment, without diameters: atoms have radii."""
    found = _attribute(group.segments, "descriptions", [])
    entries = described([str(text) for text in found])
    return {name: value for name, value in entries.items() if not (name.startswith("d") and name[1:].isdigit())}


def _source(trajectory: Any) -> str:
    name = getattr(trajectory, "filename", None)
    return Path(name).name if isinstance(name, str | Path) else "memory"


def _box(trajectory: Any) -> Array:
    """Lattice vectors (2, 2) of the present frame."""
    step = trajectory.ts
    if trajectory.format == "GSD":  # MDAnalysis 2.11 takes HOOMD's tilt factors for cosines of angles
        with _gsd(trajectory) as file:
            lx, ly, _, xy, xz, yz = (float(value) for value in file[int(step.frame)].configuration.box)
        if xz or yz:
            raise InputError(f"frame {step.frame} has tilt factors xz = {xz:g}, yz = {yz:g}: it leans out of the plane")
        return np.array([[lx, 0.0], [xy * ly, ly]])
    if step.dimensions is None or not np.any(step.dimensions[:2]):
        raise InputError(
            f"frame {step.frame} has no box: give box=((lx, 0), (xy, ly)), or set `dimensions` of the Universe"
        )
    lx, b, _, alpha, beta, gamma = (float(value) for value in step.dimensions)
    if (alpha, beta) != (90.0, 90.0):
        raise InputError(f"frame {step.frame} has a box with angles {alpha:g}, {beta:g}: it leans out of the plane")
    turn = np.exp(1j * np.radians(gamma)) if gamma != 90.0 else 1j
    return np.array([[lx, 0.0], [b * turn.real, b * turn.imag]])


def _gsd(trajectory: Any) -> Any:
    """The GSD file of a trajectory, open, for what MDAnalysis does not read, or not as it is meant."""
    import gsd.hoomd

    return gsd.hoomd.open(str(trajectory.filename), "r")
