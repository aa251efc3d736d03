"""Packings as a Universe of MDAnalysis (Gowers et al., Proc. 15th Python in Science Conf., 98 (2016)), and back.

MDAnalysis holds coordinates in float32, whatever it was read from.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.analysis.base import AnalysisBase
from MDAnalysis.core.groups import UpdatingAtomGroup
from MDAnalysis.core.topologyattrs import ResidueAttr, SegmentStringAttr
from MDAnalysis.exceptions import NoDataError
from numpy.typing import NDArray

from jamlab.arguments.choices import AtomStyle, Law, ModelName, Units
from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import check_choice, checked
from jamlab.errors import InputError, JamlabError
from jamlab.measure import measure
from jamlab.models.droplets import DROPLETS
from jamlab.packing.facts import facts_of, law_parameters, words
from jamlab.packing.hdf5 import check_one_sweep
from jamlab.packing.kinds import MODELS
from jamlab.packing.lammps_files import MARK, described, types
from jamlab.packing.neighbors import shortest_images
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import QUANTITIES
from jamlab.protocols.relax import relax
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.files import read_all
from jamlab.trajectories.sites import Radii, Sites, check_flat, plane_box, rings_of_bonds


@dataclass(frozen=True)
class Single:
    """What numbers of single precision may differ by."""

    # Half a unit of the last of 24 binary digits, for the coordinate, and as much for the length and angle of
    # the box each, with a margin of a third
    rounding: float = 2.0**-22
    same: float = 1e-4  # relative difference of perimeters that float32 may cause


SINGLE = Single()

_AT_HALF = 1e-4  # relative length below half the box from which on an edge counts as half the box: float32 may move it


class RestAreas(ResidueAttr):  # type: ignore[misc]
    """Rest areas a0 of droplets: `residues.rest_areas`."""

    attrname = "rest_areas"
    singular = "rest_area"
    dtype = float


class FixedFlags(ResidueAttr):  # type: ignore[misc]
    """Which particles are fixed: `residues.fixed_flags`."""

    attrname = "fixed_flags"
    singular = "fixed_flag"
    dtype = bool


class Perimeters(ResidueAttr):  # type: ignore[misc]
    """Perimeters of droplets, a tuple of all frames, if edges are longer than half the box: `residues.perimeters`."""

    attrname = "perimeters"
    singular = "perimeter"
    dtype = object


class Descriptions(SegmentStringAttr):  # type: ignore[misc]
    """Facts of the packings, see `jamlab.packing.facts`, one line a frame: `segments.descriptions`."""

    attrname = "descriptions"
    singular = "description"


@checked
def universe(
    source: FilePath | Packing | Iterable[Packing],
    *,
    radii: Radii = None,
    units: Units | None = None,
    law: Law | None = None,
    box: ArrayLike | None = None,
    model: ModelName | None = None,
    atom_style: AtomStyle | None = None,
) -> MDAnalysis.Universe:
    """Make an MDAnalysis Universe in memory with one frame per packing.

    Atoms are disks, or vertices of droplets, in the order of `Packing.positions`, unwrapped. Residues are particles:
    `resindices` start at 0, `resids` at 1, as in LAMMPS files. `types` are the atom types "1", "2", ... by size;
    `radii` are half the diameters, or delta/2 for vertices; `masses` are 1. Droplets have bonds around their outline
    and `residues.rest_areas`. If particles are fixed, `residues.fixed_flags` marks them. The segment's
    `description` contains units, force law and the facts of each frame. `triclinic_dimensions` has the tilt of the
    box. MDAnalysis stores positions and boxes in float32.

    Args:
        source: a packing, several packings of one sweep, or a file for `jamlab.read_all`.
        radii, units, law, box, model, atom_style: for a file, as in `jamlab.read`; packings contain them.

    Returns:
        A Universe in memory.

    Raises:
        InputError: no packings, or packings of different sweeps.
        StorageError: the file cannot be read.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> u = jamlab.universe(p)
        >>> u.atoms.n_atoms, bool(np.allclose(u.atoms.radii, p.disk_diameters / 2))
        (32, True)
    """
    reading = dict(radii=radii, units=units, law=law, box=box, model=model, atom_style=atom_style)
    frames = _frames(source, {name: value for name, value in reading.items() if value is not None})
    first = frames[0]
    made = MDAnalysis.Universe.empty(
        len(first.positions), n_residues=first.n, n_segments=1, atom_resindex=first.particle, trajectory=False
    )
    of_particles = types(first).types
    made.add_TopologyAttr("types", of_particles[first.particle].astype(str).astype(object))
    made.add_TopologyAttr("masses", np.ones(len(first.positions)))
    made.add_TopologyAttr("resids", np.arange(1, first.n + 1))
    made.add_TopologyAttr(Descriptions(np.array(["\n".join(map(_described, frames))], dtype=object)))
    if not first.frame.all_free:
        made.add_TopologyAttr(FixedFlags(first.frame.fixed))
    columns = first.kind.dump_columns(first)
    made.add_TopologyAttr("radii", columns["radius"][first.particle])
    if len(bonds := first.kind.bonds(first)):
        made.add_TopologyAttr("bonds", bonds)
    if "a0" in columns:
        made.add_TopologyAttr(RestAreas(columns["a0"]))
        if any(shortest_images((1 + _AT_HALF) * p.polygons.edges, p.box).any() for p in frames):
            each = np.empty(first.n, dtype=object)
            each[:] = list(zip(*(p.polygons.perimeters.tolist() for p in frames), strict=True))
            made.add_TopologyAttr(Perimeters(each))
    positions = np.zeros((len(frames), len(first.positions), 3), dtype=np.float32)
    positions[:, :, :2] = [packing.positions for packing in frames]
    made.load_new(positions, order="fac", dimensions=np.array([_dimensions(packing.box) for packing in frames]))
    return made


def _frames(source: FilePath | Packing | Iterable[Packing], reading: dict[str, Any]) -> list[Packing]:
    if reading and (
        isinstance(source, Packing) or (isinstance(source, Iterable) and not isinstance(source, str | bytes))
    ):
        raise InputError(f"{', '.join(reading)}: for a file only; packings know their units and law")
    if isinstance(source, Packing):
        frames = [source]
    elif isinstance(source, Iterable) and not isinstance(source, str | bytes):
        frames = list(source)
    else:
        frames = read_all(source, **reading)
    check_one_sweep(frames)
    return frames


def _described(packing: Packing) -> str:
    """A line of facts; of how many particles, and of their mean size, by which a part is known."""
    return MARK + words(facts_of(packing) | {"particles": packing.n, "mean_size": packing.frame.sizes.mean()})


def _dimensions(box: Array) -> list[float]:
    """Lengths of the box vectors and angles between them in degrees, float64."""
    (lx, _), (xy, ly) = box
    return [lx, float(np.hypot(xy, ly)), 1.0, 90.0, 90.0, float(np.degrees(np.arctan2(ly, xy)))]


class UniverseFrames:
    """Convert frames of a Universe or AtomGroup one by one, see `from_universe`. The topology is read again where a
    group that is updated has other atoms."""

    @checked
    def __init__(
        self,
        atoms: Any,
        radii: Radii = None,
        units: Units | None = None,
        law: Law | None = None,
        box: ArrayLike | None = None,
        relaxed: bool = False,
        model: ModelName | None = None,
    ) -> None:
        try:
            self.trajectory = atoms.atoms.universe.trajectory
        except AttributeError as error:
            raise InputError(
                f"a {type(atoms).__name__} has no atoms with a trajectory: give a Universe or AtomGroup of MDAnalysis"
            ) from error
        self.group = atoms if isinstance(atoms, UpdatingAtomGroup) else atoms.atoms
        self._given, self._model = (radii, units, law), model
        self._box = None if box is None else plane_box("box", box)
        self._relaxed = relaxed
        if self.trajectory.format == "GSD":  # MDAnalysis 2.11 takes HOOMD's tilt factors for cosines of angles
            raise InputError(
                f"{_source(self.trajectory)} is a GSD file: give jamlab.universe(path), or jamlab.read_all"
            )
        self._read_topology()

    def _read_topology(self) -> None:
        """What does not change from frame to frame, of the atoms of the group; one that is updated has others."""
        group, (radii, *_) = self.group, self._given
        self._read = group.ix.copy()
        if not len(group):
            raise InputError("no atoms are selected: a packing needs at least one particle")
        named, counts = np.unique(self._read, return_counts=True)
        if (counts > 1).any():
            raise InputError(f"the group has atom {named[counts > 1][0]} twice: give `group.unique`")
        self._types = _types(group, radii)
        self._lines = _lines(group)
        said = [str(line["model"]) for line in self._lines if "model" in line]
        model = self._model or (said[0] if said else DROPLETS.name)
        bonds = _bonds(group) if MODELS.get(model).has_outlines else np.empty((0, 2), dtype=np.int64)
        self._rings = rings_of_bonds(bonds, len(group)) if len(bonds) else None
        residues = _attribute(group.residues, "rest_areas", None)
        self._a0 = None if residues is None else group.rest_areas
        self._fixed = _attribute(group, "fixed_flags", None)
        self._perimeters = _attribute(group, "perimeters", None)
        own = _attribute(group, "radii", None)
        self._own_radius = None if own is None else np.asarray(own, dtype=np.float64)
        self._radius = self._own_radius if radii is None else None

    def packing(self) -> Packing:
        """Convert the present frame. Errors as in `from_universe`."""
        step = self.trajectory.ts
        if not np.array_equal(self.group.ix, self._read):
            try:
                self._read_topology()
            except InputError as failure:
                raise type(failure)(f"frame {step.frame}: {failure}") from failure
        positions = self.group.positions.astype(np.float64)
        box = _box(self.trajectory) if self._box is None else self._box
        error = SINGLE.rounding * max(float(np.abs(positions).max()), float(np.abs(box).sum()))
        provenance = {"source": _source(self.trajectory), "frame": int(step.frame), "precision": "float32"}
        entries, lost = self._facts(int(step.frame))
        if lost:
            provenance["lost"] = lost
        sites = Sites(
            box=box,
            positions=positions[:, :2],
            types=self._types,
            rings=self._rings,
            wrapped=self._perimeters is None,
            radius=self._radius,
            a0=self._a0,
            fixed=None if self._fixed is None else np.asarray(self._fixed, dtype=bool),
            entries=entries,
            rounding=error,
            provenance=provenance,
        )
        check_flat(positions[:, 2], box[0, 0], f"frame {step.frame}")
        try:
            self._check_whole(sites)
            packing = sites.packing(*self._given, model=self._model)
        except InputError as failure:
            raise type(failure)(f"frame {step.frame}: {failure}") from failure
        return relax(packing) if self._relaxed else packing

    def _facts(self, frame: int) -> tuple[dict[str, Any], list[str]]:
        """Facts of a frame and, where frames were left out or added, names of facts that are unknown. Of a part
        of the particles there is no `phi_J`, and lengths are in mean sizes of the part."""
        if len(self._lines) == len(self.trajectory):
            entries, lost = dict(self._lines[frame]), []
        else:
            names = {name for line in self._lines for name in line}
            same = [name for name in names if all(line.get(name) == self._lines[0].get(name) for line in self._lines)]
            entries, lost = {name: self._lines[0][name] for name in same}, sorted(names - {*same})
            if "rounding" in lost:
                entries["rounding"] = max(line["rounding"] for line in self._lines)
        particles, mean_size = entries.pop("particles", None), entries.pop("mean_size", None)
        if particles in (None, self.group.n_residues):
            return entries, lost
        entries.pop("phi_J", None)
        entries["walls"] = bool(entries.get("walls")) and self._fixed is not None and bool(np.any(self._fixed))
        if self._own_radius is not None:
            sizes = 2 * self._own_radius[self._own_radius > 0]
            parameters = law_parameters(entries.get("law"))
            for name in (name for name in entries if name in parameters and parameters[name].over_size):
                entries[name] *= float(mean_size / sizes.mean())  # the length stays
        return entries, lost

    def _check_whole(self, sites: Sites) -> None:
        """Refuse droplets that the box has cut, where edges are so long that nobody can tell how they were whole."""
        if self._perimeters is None or self._rings is None:
            return
        vertices, starts = sites.positions[self._rings.order], self._rings.offsets[:-1]
        following = np.arange(1, len(vertices) + 1)
        following[self._rings.offsets[1:] - 1] = starts
        found = np.add.reduceat(np.hypot(*(vertices[following] - vertices).T), starts)
        for m, (perimeter, known) in enumerate(zip(found, self._perimeters[self._rings.order][starts], strict=True)):
            if not np.isclose(perimeter, known, rtol=SINGLE.same, atol=sites.rounding).any():
                raise InputError(
                    f"the outline of polygon {m} is not that of its droplet, since the box has cut it, as `wrap` does; "
                    "its edges are longer than half the box, so give whole droplets"
                )


@checked
def from_universe(
    u: MDAnalysis.Universe | MDAnalysis.AtomGroup,
    radii: Radii = None,
    units: Units | None = None,
    *,
    law: Law | None = None,
    box: ArrayLike | None = None,
    relaxed: bool = False,
    model: ModelName | None = None,
    frames: slice | Sequence[int] | Indices | None = None,
) -> list[Packing]:
    """Convert the frames of a trajectory to packings.

    Atoms without bonds become disks, closed rings of bonds become droplets (unwrapped). A Universe of `jamlab.universe`
    has units, force law, sizes and the facts of each frame; for other sources pass them. Missing parameters
    have the defaults of the decks and are listed in `provenance["assumed"]`.

    MDAnalysis stores coordinates in float32: `Packing.rounding` is set, `converged` is False and `max_force` None. In
    `jamlab.measure` z is nan if rounding could open or close a contact; moduli and G* are refused. `relaxed=True`
    relaxes every frame first. `jamlab.read` keeps all digits of LAMMPS files.

    Args:
        u: Universe or AtomGroup; an updating AtomGroup has the atoms of each frame.
        radii: of disks: one number, (n,), or by type or name, {"1": 0.5, "2": 0.7}; default: as in the Universe.
        units: "eps" or "k", see `Packing`; default: as in the Universe, or "eps".
        law: force law, as in `jamlab.read`; its parameter "a0" may be one number.
        box: two sides, or (2, 2) lattice vectors, for trajectories without a box, such as XYZ.
        relaxed: relax every frame, see `jamlab.relax`.
        model: name of the model, if the source does not state it. Default: atoms with bonds are vertices of droplets,
            other atoms are disks.
        frames: a slice or numbers of frames, as in `u.trajectory[frames]`: slice(0, 100, 10), [0, 5, -1]. Default: all.

    Raises:
        InputError: no such frame, no box, no radii, bonds that are not closed rings, atoms out of the plane, or no
            valid packing.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> (q,) = jamlab.from_universe(jamlab.universe(p), relaxed=True)  # positions were float32
        >>> q.converged, bool(np.isclose(jamlab.shear_modulus(q), jamlab.shear_modulus(p), rtol=1e-4))
        (True, True)
    """
    converted = UniverseFrames(u, radii, units, law, box, relaxed, model)
    count = len(converted.trajectory)
    return [converted.packing() for _ in converted.trajectory[numbers_of_frames(frames, count)]]


def numbers_of_frames(frames: slice | Sequence[int] | Indices | None, count: int) -> list[int]:
    """Numbers, from 0, of the frames that are asked for, of so many."""
    if frames is None:
        return list(range(count))
    if isinstance(frames, slice):
        try:
            return list(range(count)[frames])
        except (TypeError, ValueError) as error:
            raise InputError(f"frames = {frames}: {error}; give whole numbers, such as slice(0, 100, 10)") from None
    if np.ndim(frames) != 1:
        raise InputError(f"frames = {' '.join(repr(frames).split()):.80}: give a slice or a list, such as [0, 5, -1]")
    numbers = [int(number) for number in frames]
    for number in numbers:
        if not -count <= number < count:
            raise InputError(f"frames holds {number}: the trajectory has {count} frames, 0 to {count - 1}")
    return [number % count for number in numbers]


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


def _lines(group: Any) -> list[dict[str, Any]]:
    """Facts that `jamlab.universe` left in the segment, one line a frame."""
    found = {str(text) for text in _attribute(group.segments, "descriptions", []) if text}
    if len(found) > 1:
        raise InputError("the atoms are of several universes: convert those of one at a time")
    return [described([line]) for text in found for line in text.splitlines()]


def _source(trajectory: Any) -> str:
    name = getattr(trajectory, "filename", None)
    return Path(name).name if isinstance(name, str | Path) else "memory"


def _box(trajectory: Any) -> Array:
    """Lattice vectors (2, 2) of the present frame."""
    step = trajectory.ts
    if step.dimensions is None or not np.any(step.dimensions[:2]):
        raise InputError(
            f"frame {step.frame} has no box: give box=((lx, 0), (xy, ly)), or set `dimensions` of the Universe"
        )
    lx, b, _, alpha, beta, gamma = (float(value) for value in step.dimensions)
    if (alpha, beta) != (90.0, 90.0):
        raise InputError(f"frame {step.frame} has a box with angles {alpha:g}, {beta:g}: it leans out of the plane")
    turn = np.exp(1j * np.radians(gamma)) if gamma != 90.0 else 1j
    return np.array([[lx, 0.0], [b * turn.real, b * turn.imag]])


class PackingAnalysis(AnalysisBase):  # type: ignore[misc]
    """Measure the frames of a trajectory, as `jamlab.measure` measures `jamlab.from_universe(u)`.

    `PackingAnalysis(u, ("rho", "z")).run(step=10).results.rho` is (n_frames,) float64. Frames are float32:
    moduli are refused unless `relaxed=True`, and z and rattlers are nan where rounding could open or close a contact.

    Args:
        u: Universe or AtomGroup; an updating AtomGroup has the atoms of each frame.
        quantities: names as in `jamlab.measure`, or psi_6, psi_6_global.
        relaxed: relax every frame first.
        radii, units, law, box, model: as in `jamlab.from_universe`.
        verbose: show a progress bar.

    Raises:
        InputError: unknown quantities, moduli of frames that are not relaxed; in `run`, as in `jamlab.from_universe`.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> u = jamlab.universe(jamlab.compress(onset, to=0.9, step=0.02))
        >>> a = jamlab.PackingAnalysis(u, ("rho", "psi_6")).run()
        >>> a.results.rho.shape == (u.trajectory.n_frames,)
        True
    """

    @checked
    def __init__(
        self,
        u: Any,
        quantities: str | Iterable[str] = ("rho", "z"),
        *,
        relaxed: bool = False,
        radii: Radii = None,
        units: Units | None = None,
        law: Law | None = None,
        box: ArrayLike | None = None,
        model: ModelName | None = None,
        verbose: bool = False,
    ) -> None:
        self._frames = UniverseFrames(u, radii, units, law, box, relaxed, model)
        super().__init__(self._frames.trajectory, verbose=verbose)
        self._quantities: tuple[Any, ...] = (quantities,) if isinstance(quantities, str) else tuple(quantities)
        for name in self._quantities:
            check_choice("quantity", name, QUANTITIES)
            if name in ("g", "g_x", "b") and not relaxed:
                raise InputError(f"{name} needs an energy minimum, but frames are float32: use relaxed=True")

    def _prepare(self) -> None:
        for name in self._quantities:
            self.results[name] = np.full(self.n_frames, np.nan)

    def _single_frame(self) -> None:
        packing = self._frames.packing()
        try:
            found = measure(packing, self._quantities)
        except JamlabError as error:
            raise type(error)(f"frame {self._ts.frame}: {error}") from error
        for name, value in found.items():
            self.results[name][self._frame_index] = value
