"""Packings as a Universe of MDAnalysis (Gowers et al., Proc. 15th Python in Science Conf., 98 (2016)), and back."""

from collections.abc import Iterable, Mapping
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.analysis.base import AnalysisBase
from MDAnalysis.analysis.results import ResultsGroup
from MDAnalysis.core.topologyattrs import ResidueAttr, SegmentStringAttr
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.checks import check_choice, checked
from jamlab.errors import InputError, JamlabError
from jamlab.measure import measure
from jamlab.packing.lammps_files import describe, types
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import QUANTITIES
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.files import read_all
from jamlab.trajectories.from_universe import UniverseFrames
from jamlab.trajectories.sites import Radii


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


class PackingAnalysis(AnalysisBase):  # type: ignore[misc]
    """Measure the frames of a trajectory, as `jamlab.measure` does those of `jamlab.from_universe(u)`.

    `PackingAnalysis(u, ("rho", "z")).run(step=10).results.rho` is (n_frames,) float64. With
    `run(backend="multiprocessing", n_workers=4)` processes share the frames; so they do with "dask", which in a script
    needs `if __name__ == "__main__":`. Frames are float32: moduli are refused unless `relaxed=True`, and z and rattlers
    are nan where rounding could open or close a contact.

    Args:
        u: Universe, or an AtomGroup of it.
        quantities: of `jamlab.measure`, and psi_6, psi_6_overall.
        radii, units, params, box, relaxed: as in `jamlab.from_universe`.
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

    _analysis_algorithm_is_parallelizable = True

    @classmethod
    def get_supported_backends(cls) -> tuple[str, ...]:
        """Names for `run(backend=...)`."""
        return ("serial", "multiprocessing", "dask")

    @checked
    def __init__(
        self,
        u: Any,
        quantities: str | Iterable[str] = ("rho", "z"),
        *,
        radii: Radii = None,
        units: str | None = None,
        params: Mapping[str, Any] | None = None,
        box: ArrayLike | None = None,
        relaxed: bool = False,
        verbose: bool = False,
    ) -> None:
        self._frames = UniverseFrames(u, radii, units, params, box, relaxed)
        super().__init__(self._frames.trajectory, verbose=verbose)
        self._quantities = (quantities,) if isinstance(quantities, str) else tuple(quantities)
        for name in self._quantities:
            check_choice("quantity", name, QUANTITIES)
            if name in ("g", "g_x", "b") and not relaxed:
                raise InputError(f"{name} belongs to an energy minimum, and frames are float32: say relaxed=True")

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

    def _get_aggregator(self) -> ResultsGroup:
        return ResultsGroup(lookup=dict.fromkeys(self._quantities, ResultsGroup.ndarray_hstack))
