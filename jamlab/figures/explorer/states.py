"""One state as packed arrays: outlines, contacts with forces, voids, cells, and displacements since the one before.

Everything that the page draws or says of a state is computed here, by the functions of the library. Arrays become text
inside the page: base64 of little-endian numbers.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from jamlab.arrays import Array, ArrayLike
from jamlab.errors import BoundaryError, InputError
from jamlab.geometry.contact_network import Contacts, contacts
from jamlab.geometry.particle_shape import particle_areas, shape_factors
from jamlab.geometry.tessellation import Tessellation, tessellation
from jamlab.geometry.voids.voids import void_paths, voids
from jamlab.measure import numbers_of, why_no_modulus
from jamlab.packing.area_change import compression
from jamlab.packing.ensembles import NEGATIVE_G
from jamlab.packing.neighbors import moves_home, shortest_images
from jamlab.packing.packing import Packing
from jamlab.packing.packing_plot import home_moves


def encode(values: ArrayLike, kind: str) -> str:
    """Base64 of an array in numpy's kind of a little-endian type, such as "<f4"."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


@dataclass(frozen=True)
class Pages:
    """What lines of a page may be off by, in sqrt(cell area / particles)."""

    coarse: float = 2e-3  # boundaries of voids and cells: a fifth of a pixel
    joined: float = 1e-9  # ends of pieces of a wall between cells that are nearer than this are one point
    sheared: float = 1e-9  # change of the strain, or relative one of phi, that is more than rounding


PAGES = Pages()


def pack_state(packing: Packing, before: Packing | None) -> dict[str, Any]:
    """Pack one state for the page, as JSON: `box`, and arrays in base64; in the packing's
    units."""
    home = home_moves(packing)
    sites, centres = packing.positions + home[packing.particle], packing.centroids + home
    network = contacts(packing)
    cells = tessellation(packing) if packing.kind.says("power_points") else None
    state: dict[str, Any] = {
        "box": packing.box.tolist(),
        "rim": 0.5 * packing.params.get("delta", 0.0),
        "planes": packing.frame.planes if packing.frame.is_flat else None,
        "sites": encode(sites, "<f4"),
        "contacts": _pack_contacts(packing, network, home),
        "particles": _pack_particles(packing, network, cells),
        "voids": _pack_voids(packing),
        "walls": _packed_lines(np.empty(0, dtype=object)) if cells is None else _pack_walls(packing, cells.lines),
        "moves": None if before is None else encode(displacements(before, packing), "<f4"),
        "affine": None if before is None else affine_part(before.box, unflipped_box(before, packing)),
    }
    if packing.offsets is not None:
        state["centres"] = encode(centres, "<f4")
    return state


def displacements(before: Packing, after: Packing) -> Array:
    """(n, 2) displacements of the centres relative to the box, by the nearest image, less their median. The
    median is the drift, which no force opposes; a rattler that jumps changes the mean, but not the median. With lattice
    coordinates s = x B^-1 they are (s_after - s_before) B_after."""
    box = unflipped_box(before, after)
    lattice = after.centroids @ np.linalg.inv(box) - before.centroids @ np.linalg.inv(before.box)
    moved = lattice @ box
    moved -= shortest_images(moved, box) @ box
    return np.asarray(moved - np.median(moved, axis=0))


def shear_between(before: Packing, after: Packing) -> float:
    """Engineering shear strain from one state to the next: what a flow says, else the least that fits both lattices."""
    if "flow_strain" in before.provenance and "flow_strain" in after.provenance:
        return float(after.provenance["flow_strain"] - before.provenance["flow_strain"])
    new = after.box
    shear = new[1, 0] / new[1, 1] - _lean(before, after)
    period = new[0, 0] / new[1, 1]
    return float(shear - period * np.round(shear / period))


def _lean(before: Packing, after: Packing) -> float:
    """Tilt over height of the box before, once its area has changed."""
    squeezed = before.box @ compression(before).gradient(after.area / before.area).T
    return float(squeezed[1, 0] / squeezed[1, 1])


def unflipped_box(before: Packing, after: Packing) -> Array:
    """(2, 2) box of the later state, of the same lattice, that leads from the one before without a flip."""
    box: Array = after.box.copy()
    lean = _lean(before, after) + shear_between(before, after)
    box[1] += np.round((lean * box[1, 1] - box[1, 0]) / box[0, 0]) * box[0]
    return box


def affine_part(before: Array, after: Array) -> dict[str, float]:
    """What the box did: relative change of its area, and engineering shear strain since the state before."""
    gradient = np.linalg.solve(before, after)  # x_after = x_before @ gradient
    return {"area": float(np.linalg.det(gradient) - 1), "shear": float(gradient[1, 0] / gradient[1, 1])}


def _pack_contacts(packing: Packing, network: Contacts, home: Array) -> dict[str, Any]:
    """Contacts between particles that lie in the cell; `image` is that of j as the page draws it."""
    i, j = network.pairs.T
    cell = np.round(home @ np.linalg.inv(packing.box)).astype(np.int64)
    image = network.shift + cell[i] - cell[j]
    found = network.forces
    return {
        "pairs": encode(network.pairs, "<u2"),
        "image": encode(image, "<i2"),
        "force": encode(found.size, "<f4"),
        "gap": encode(found.gap, "<f4"),
        "bearing": encode(network.bearing, "u1"),
    }


def _pack_particles(packing: Packing, network: Contacts, cells: Tessellation | None) -> dict[str, Any]:
    """Numbers of every particle; z counts all contacts of a rattler, else those that bear force, as the mean z does."""
    counted = network.bearing[:, None] | network.rattlers[network.pairs]
    z = np.bincount(network.pairs[counted], minlength=packing.n)
    unknown, says = np.full(packing.n, np.nan), packing.kind.says
    return {
        "shape": encode(shape_factors(packing) if says("outline") else unknown, "<f4"),
        "area": encode(particle_areas(packing) if says("shares") else unknown, "<f4"),
        "cell": encode(unknown if cells is None else cells.area, "<f4"),
        "z": encode(z, "<u2"),
        "rattler": encode(network.rattlers, "u1"),
    }


def _pack_voids(packing: Packing) -> dict[str, Any]:
    """Voids that do not percolate, with their rings less points that no eye would miss; the reason where outlines
    cross."""
    if not packing.kind.says("boundary"):
        return {"why": f"model {packing.model} does not say where {packing.kind.particles} end"}
    try:
        found = voids(packing)
    except BoundaryError as error:
        return {"why": str(error)}
    closed = np.flatnonzero(found.percolating == 0)
    paths = [path for path, percolating in zip(void_paths(found), found.percolating, strict=True) if not percolating]
    pieces = [np.split(path.vertices, np.flatnonzero(path.codes == path.CLOSEPOLY)[:-1] + 1) for path in paths]
    rings = np.array([shapely.linearrings(ring) for void in pieces for ring in void], dtype=object)
    return {
        **_packed_lines(_coarse(packing, rings)),
        "rings": encode(1 + found.islands[closed], "<u4"),
        "sides": encode(found.sides[closed], "<u2"),
        "area": encode(found.area[closed], "<f4"),
        "percolating": int(np.sum(found.percolating > 0)),
    }


def _pack_walls(packing: Packing, pieces: Array) -> dict[str, Any]:
    """Walls between cells as lines, each with its middle in the box."""
    step = PAGES.joined * np.sqrt(packing.area / packing.n)
    ends = shapely.linestrings(step * np.round(pieces / step))
    walls = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(ends)))
    middles = shapely.get_coordinates(shapely.line_interpolate_point(walls, 0.5, normalized=True))
    home = moves_home(middles, packing.box)
    points, wall = shapely.get_coordinates(walls, return_index=True)
    return _packed_lines(_coarse(packing, shapely.linestrings(points + home[wall], indices=wall)))


def _coarse(packing: Packing, lines: Any) -> Any:
    """Lines less points that no eye would miss; a small ring keeps its shape."""
    most = PAGES.coarse * np.sqrt(packing.area / packing.n)
    return shapely.simplify(lines, np.minimum(most, 0.01 * shapely.length(lines)))


def _packed_lines(lines: Any) -> dict[str, str]:
    """Points of lines, one line after the other, and where in them each ends."""
    points, line = shapely.get_coordinates(lines, return_index=True)
    return {"points": encode(points, "<f4"), "ends": encode(np.cumsum(np.bincount(line, minlength=len(lines))), "<u4")}


def unit_labels(packing: Packing) -> dict[str, str]:
    """Quantity -> unit; `meaning` says what the letters stand for."""
    length, force, stress = packing.unit_names
    meaning = packing.kind.unit_meanings[packing.units]
    return {"length": length, "area": f"{length}²", "force": force, "stress": stress, "meaning": meaning}


SHOWN = ("rho", "z", "z_all", "rattlers", "pressure", "g")


@dataclass(frozen=True)
class ShownQuantity:
    """A quantity as the page shows it."""

    name: str  # its key
    symbol: str  # before a number
    label: str  # of an axis, without unit
    unit: str = ""  # "" for a pure number


def stored_columns(observables: Mapping[str, ArrayLike], frames: int) -> dict[str, NDArray[np.float64]]:
    """Observables that the page shows."""
    columns = {name: np.asarray(observables[name], dtype=np.float64) for name in SHOWN if name in observables}
    for name, values in columns.items():
        if values.shape != (frames,):
            raise InputError(f"observable {name!r} has shape {values.shape}: give a number for each of {frames} states")
    return columns


def observe(packing: Packing, known: Mapping[str, float], strain: float) -> dict[str, Any]:
    """Numbers of one state for the page: those that are known, others measured; JSON has no nan, so that is None.
    `converged` is None where no minimisation is known, as in a dump that does not say."""
    row = {**numbers_of(packing, [name for name in SHOWN if name not in known]), **known}
    numbers = {name: float(row[name]) if np.isfinite(row[name]) else None for name in SHOWN}
    g, why = numbers["g"], ""
    if g is None:
        why = why_no_modulus(packing) or "the file holds no value"
    elif g < 0:
        why = NEGATIVE_G
    return {
        **numbers,
        "phi": packing.phi,
        "strain": strain,
        "why": why,
        "converged": None if packing.max_force is None and not packing.converged else packing.converged,
        "on_target": packing.on_target,
        "max_force": packing.max_force,
    }


def strains(packings: Sequence[Packing]) -> NDArray[np.float64]:
    """(m,) shear strain of each state: what a flow says of itself, else tilt over height, without flips of the box. A
    box that leans by half its width is the same lattice as one that leans the other way, and boxes flip in a flow."""
    first = packings[0]
    start = float(first.provenance.get("flow_strain", first.box[1, 0] / first.box[1, 1]))
    return np.cumsum([start, *(shear_between(before, after) for before, after in pairwise(packings))])


def along(packings: Sequence[Packing]) -> ShownQuantity:
    """What changes from state to state: rho, the strain at fixed phi, or nothing but the number of the state."""
    phi = np.array([packing.phi for packing in packings])
    if np.ptp(phi) > PAGES.sheared * phi.max():
        return ShownQuantity("rho", "ρ", "true packing fraction ρ")
    if np.ptp(strains(packings)) > PAGES.sheared:
        return ShownQuantity("strain", "γ", "shear strain γ")
    return ShownQuantity("number", "state", "state")


def curves(packing: Packing) -> list[ShownQuantity]:
    """The curves beside the picture; in motion, where rattlers are not defined, z counts all contacts."""
    stress = unit_labels(packing)["stress"]
    moving = "flow_rate" in packing.provenance
    of_all = ShownQuantity("z_all", "z all", "coordination number z, all force-bearing contacts")
    return [
        of_all if moving else ShownQuantity("z", "z", "coordination number z, without rattlers"),
        ShownQuantity("g", "G", "shear modulus G, mean over directions", stress),
        ShownQuantity("pressure", "p", "pressure p", stress),
    ]
