"""One frame from another program, before it is known to be a packing: its law, its sizes, droplets as closed rings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Law, ModelName, Registered, Units
from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import check_choice, finite_array, is_number
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError, typed, warn
from jamlab.laws.laws import parameters_of
from jamlab.laws.parameter import UNITS
from jamlab.models.disks import DISKS
from jamlab.models.droplets import DROPLETS
from jamlab.packing.facts import OF_DIGITS, STATE, shared_parameters
from jamlab.packing.kinds import MODELS, law_names, optional_parameters
from jamlab.packing.magnitudes import check_box
from jamlab.packing.model import Model
from jamlab.packing.neighbors import shortest_images
from jamlab.packing.outlines import polygon_areas
from jamlab.packing.packing import Packing

SIZE_NAMES = {"radius": 1.0, "radii": 1.0, "diameter": 0.5, "diameters": 0.5}  # columns of sizes -> radius over value


@dataclass(frozen=True)
class Doubts:
    """What makes a frame one of another kind."""

    dense: float = 1.5  # phi of disks beyond which radii are possibly diameters, which make it 4 times as large
    flat: float = 1e-4  # a plane: largest height over the width of the box


DOUBTS = Doubts()

Radii = ArrayLike | Mapping[Any, float] | None


def complete_force_law(
    model: ModelName, found: Mapping[str, Any], units: Units | None, params: Mapping[str, Any]
) -> tuple[Units, dict[str, Any], list[str]]:
    """Complete the force law of a file, rest areas apart, with what the user gives; units are "eps" if neither says.
    Returns units, parameters, and the names of those found in neither, which have the defaults of the decks."""
    if "units" not in found and (scales := [name for name in ("eps", "k") if name in found]):
        found = {**found, "units": scales[0]}
    chosen: Units = found.get("units", units or "eps")
    check_choice("units", chosen, UNITS)
    if chosen not in MODELS.get(model).unit_names:
        raise InputError(f"model {model} has no units {chosen!r}")
    said = {"law": law_name} if (law_name := params.get("law", found.get("law"))) is not None else {}
    names = law_names(model, chosen, said)
    if foreign := sorted({"law", *shared_parameters(found.get("law"))} & found.keys() - set(names)):
        raise InputError(f"the source has {foreign[0]}, which model {model} in units {chosen} does not have")
    each = {name for name, parameter in MODELS.get(model).parameters(None, said).items() if parameter.each}
    given = {name: value for name, value in params.items() if name not in each}
    for name in given:
        if name not in names:
            raise InputError(f"model {model} in units {chosen} has no parameter {name!r}: use {', '.join(names)}")
    for name, value in {**given, **({} if units is None else {"units": units})}.items():
        if name in found and found[name] != value:
            raise InputError(f"{name} = {value!r} was given, but the source has {found[name]!r}")
    known = {name: given.get(name, found.get(name)) for name in names}
    law = {name: value for name, value in known.items() if value is not None}
    assumed = [name for name in names if name not in law and name not in optional_parameters(model, said)]
    usual = defaults(model)
    if unknown := [name for name in assumed if name not in usual]:
        raise InputError(f"neither the source nor law has {unknown[0]!r}, which the force law needs")
    return chosen, law | {name: usual[name] for name in assumed}, assumed


def _every_name(model: str, params: Mapping[str, Any]) -> list[str]:
    """Names of the parameters of a model in any units, of the force law that some parameters name."""
    return list(MODELS.get(model).parameters(None, params))


def given_radii(radii: Radii, types: NDArray[np.str_]) -> Array | None:
    """(n,) radii of disks: one number, one for each disk, or one for each type."""
    if radii is None:
        return None
    if isinstance(radii, Mapping):
        by_type = {str(name): value for name, value in radii.items()}
        missing = sorted(set(types.tolist()) - set(by_type))
        if missing:
            raise InputError(
                f"radii has no type {missing[0]!r}: give a radius for each of {sorted(set(types.tolist()))}"
            )
        radii = [by_type[name] for name in types.tolist()]
    elif is_number(radii):
        radii = np.full(len(types), radii)
    return finite_array("radii", radii, (len(types),))


def plane_box(name: str, values: ArrayLike) -> Array:
    """(2, 2) lattice vectors, from such ones, from two or three sides, or from three vectors, of which the third stands
    on the plane of the others."""
    box = np.asarray(values, dtype=np.float64)
    box = np.diag(box) if box.ndim == 1 else box
    if box.shape == (3, 3):
        if np.any(box[:2, 2]) or np.any(box[2, :2]):
            raise InputError(
                f"{name} {box.tolist()} is not planar: its third vector must be perpendicular to the others"
            )
        box = box[:2, :2]
    box = finite_array(name, box, (2, 2))
    if box[0, 1] and not box[1, 1]:  # the same lattice, its vectors the other way round
        box = box[::-1]
    if box[0, 1] and box[0].any():
        turn = np.degrees(np.arctan2(box[0, 1], box[0, 0]))
        raise InputError(
            f"{name} {box.tolist()}: its first vector must lie along x; turn positions and vectors by {-turn:.10g} "
            "degrees about z, in ASE atoms.rotate(..., 'z', rotate_cell=True)"
        )
    box = box * np.where(np.diagonal(box) < 0, -1.0, 1.0)[:, None]  # the same lattice
    check_box(box)
    return box


def check_flat(heights: Array, extent: float, what: str = "the frame") -> None:
    """Refuse points (n,) at heights that differ: dropped, those of a sphere packing would lie on each other. `extent`:
    size of the box or of the points in the plane, in the same unit."""
    spread = float(np.ptp(heights))
    if spread > DOUBTS.flat * extent:
        raise InputError(f"{what} is not flat: z spans {spread:.3g}, and packings are two-dimensional")


@dataclass(frozen=True)
class Rings:
    """Order of points around polygons."""

    order: Indices  # (n_vertices,) every point once, ring after ring; rings go by their lowest point and begin there
    offsets: Indices  # (n + 1,) ring m is order[offsets[m]:offsets[m + 1]]

    def polygons(self, positions: Array, box: Array, wrapped: bool) -> Array:
        """(n_vertices, 2) vertices of the polygons of one frame, counter-clockwise. `wrapped`: the box may cut them,
        and every edge is the shortest of its periodic images; else they are whole."""
        vertices = positions[self.order]
        if wrapped:
            vertices = self._whole(vertices, box)
        place, counts = np.arange(len(vertices)), np.diff(self.offsets)
        starts, ends = np.repeat(self.offsets[:-1], counts), np.repeat(self.offsets[1:], counts)
        turned = np.where(place == starts, place, starts + ends - place)  # the first vertex stays the first
        clockwise = np.repeat(polygon_areas(vertices, self.offsets) < 0, counts)
        return vertices.take(np.where(clockwise, turned, place), axis=0)

    def _whole(self, vertices: Array, box: Array) -> Array:
        """Shift vertices by lattice vectors so that every edge is the shortest one. What is whole keeps its bits."""
        starts, counts = self.offsets[:-1], np.diff(self.offsets)
        following = np.arange(1, len(vertices) + 1)
        following[self.offsets[1:] - 1] = starts
        steps = shortest_images(vertices[following] - vertices, box)
        winding = np.add.reduceat(steps, starts, axis=0).any(axis=1)
        if winding.any():
            raise InputError(
                f"the bonds of polygon {np.flatnonzero(winding)[0]} wrap around the periodic box: every edge must "
                "be the shortest of its periodic images"
            )
        taken = np.cumsum(steps, axis=0) - steps
        return np.asarray(vertices - (taken - np.repeat(taken[starts], counts, axis=0)) @ box)


def rings_of_bonds(bonds: Indices, count: int) -> Rings:
    """Rings that bonds (m, 2), of which one may occur twice, close between so many points; one without bonds is alone,
    as a flat wall."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components, depth_first_order

    ends = np.unique(np.sort(bonds, axis=1), axis=0)
    degree = np.bincount(ends.ravel(), minlength=count)
    odd = np.flatnonzero((degree != 2) & (degree > 0))
    if len(odd) or (ends[:, 0] == ends[:, 1]).any():
        k = odd[0] if len(odd) else ends[ends[:, 0] == ends[:, 1]][0, 0]
        raise InputError(
            f"point {k} has {degree[k]} bonds: vertices of droplets must have exactly 2; for disks give model='sp'"
        )
    i, j = np.concatenate([ends, ends[:, ::-1]]).T
    ring = connected_components(coo_array((np.ones(len(i)), (i, j)), (count, count)))[1]
    _, first, sizes = np.unique(ring, return_index=True, return_counts=True)
    i, j = np.append(i, np.full(len(first), count)), np.append(j, np.sort(first))  # from one more point to all rings
    graph = coo_array((np.ones(len(i)), (i, j)), (count + 1, count + 1)).tocsr()
    order = depth_first_order(graph, count, return_predecessors=False)[1:]
    return Rings(order.astype(np.int64), np.concatenate([[0], np.cumsum(sizes[np.argsort(first)])]))


def rings_of_molecules(molecule: Indices) -> Rings | None:
    """Rings of points that follow each other within a molecule (n_vertices,); None if one has fewer than three points,
    two flat walls apart, or none, which LAMMPS writes as 0."""
    if (molecule <= 0).any():
        return None
    _, first, ring, sizes = np.unique(molecule, return_index=True, return_inverse=True, return_counts=True)
    if (few := sizes[sizes < 3]).size and not (few.tolist() == [1, 1] and few.size < sizes.size):
        return None
    order = np.argsort(first[ring.reshape(-1)], kind="stable")
    return Rings(order, np.concatenate([[0], np.cumsum(sizes[np.argsort(first)])]))


@dataclass(frozen=True, eq=False)
class Sites:
    """Atoms of one frame: disks, or vertices of droplets."""

    box: Array | None  # (2, 2), as in `Packing.box`; None: the source has none
    positions: Array  # (n_atoms, 2)
    types: NDArray[np.str_]  # (n_atoms,) names of the atom types
    # which atoms are vertices of one droplet, or what finds that out; None: every atom is a disk
    rings: Rings | Callable[[], Rings] | None = None
    guessed: bool = False  # whether rings follow from molecules alone, which disks may have too
    sites: int | None = None  # of each particle, in a file by jamlab that is not of droplets
    wrapped: bool = False  # whether the box may cut droplets, see `Rings.polygons`
    radius: Array | None = None  # (n_atoms,) of the disks, or of the rims of vertices, if the source has radii
    a0: Array | None = None  # (n_atoms,) rest area of the droplet of each vertex, if the source has them
    fixed: NDArray[np.bool_] | None = None  # (n_atoms,) whether the particle of each atom is fixed, if the source says
    entries: Mapping[str, Any] = field(default_factory=dict)  # facts in the source, see `jamlab.packing.facts`
    rounding: float = 0.0  # how far a coordinate may be off for its digits; `entries` may know of a larger error
    provenance: Mapping[str, Any] = field(default_factory=dict)  # entries about the source

    def packing(
        self,
        radii: Radii = None,
        units: Units | None = None,
        law: Law | None = None,
        box: ArrayLike | None = None,
        model: ModelName | None = None,
    ) -> Packing:
        """Make a packing of these atoms; arguments as in `jamlab.read`."""
        given = parameters_of(law)
        model = self._model(model, units, given)
        kind, entries = MODELS.get(model), dict(self.entries)
        rings = self._rings() if kind.has_outlines else None
        if rings is not None and self.radius is not None and self.guessed:
            if np.ptp(self.radius):
                least, most = self.radius.min(), self.radius.max()
                raise InputError(f"vertices have rim radii of {least:g} to {most:g}: all must have the same")
            entries.setdefault("delta", 2 * float(self.radius[0]))
        units, params, assumed = complete_force_law(model, entries, units, given)
        cell = self._cell(box)
        common: dict[str, Any] = {name: entries[name] for name in STATE if entries.get(name) is not None}
        common |= {"model": model, "box": cell, "units": units}
        common["rounding"] = max(self.rounding, entries.get("rounding", 0.0))
        if self.rounding:
            common = {name: value for name, value in common.items() if name not in OF_DIGITS}
        first = self._first_sites(kind) if rings is None else rings.order[rings.offsets[:-1]]
        common["fixed"] = self._fixed(first)
        if rings is None:
            common |= {"positions": self._whole(kind, cell), "diameters": self._diameters(radii)[first]}
        elif radii is not None:
            raise InputError("radii apply to disks only; the rim width of droplets is law['delta']")
        else:
            params["a0"] = self._rest_areas(rings, given.get("a0"))
            vertices = rings.polygons(self.positions, cell, self.wrapped)
            common |= {"positions": vertices, "offsets": rings.offsets}
        history = {**entries.get("provenance", {}), **self.provenance, **({"assumed": assumed} if assumed else {})}
        packing = Packing(params=params, provenance=history, **common)
        if rings is None and "model" not in self.entries and packing.phi > DOUBTS.dense:
            warn(
                f"disks cover the box {packing.phi:.3g} times (nominal packing fraction phi): are these diameters? "
                "`radii` and columns of radii take half of them"
            )
        return packing

    def _rings(self) -> Rings | None:
        return self.rings() if callable(self.rings) else self.rings

    def _model(self, model: ModelName | None, units: Units | None, given: Mapping[str, Any]) -> ModelName:
        """The model that is asked for, that the source names, or that has the parameters of the force law."""
        said = self.entries.get("model")
        if model is not None:
            MODELS.get(model)  # refuses one that is unknown
            if said not in (None, model):
                raise InputError(f"model = {model!r} was given, but the source has {said!r}")
        wanted = model or said
        if wanted is None:
            law = {**self.entries, **given}
            names = {*({"law", *shared_parameters(law.get("law"))} & self.entries.keys()), *given}
            known = MODELS.each()
            own = {name: {*_every_name(name, law), *kind.unit_names} for name, kind in known.items()}
            fit = [name for name, kind in known.items() if names <= own[name] and units in (None, *kind.unit_names)]
            wanted = DISKS.name if self.rings is None else DROPLETS.name
            if len(fit) == 1 and (
                (self.rings is not None and self.guessed) or fit[0] not in (DISKS.name, DROPLETS.name)
            ):
                wanted = fit[0]
        if self.sites not in (None, MODELS.get(wanted).sites):
            raise InputError(
                f"particles of {self.sites} atoms each are no {MODELS.get(wanted).particles} (model {wanted}): "
                "install the package of their model, or give `model`, if its package is installed"
            )
        if MODELS.get(wanted).has_outlines and self.rings is None:
            raise InputError(
                "no bonds, and no molecules of three atoms or more, say which vertices make a droplet: check the file, "
                "or read disks, which have no parameters of droplets"
            )
        return Registered(wanted)

    def _first_sites(self, kind: Model[Packing]) -> Indices:
        """(n,) the first site of each particle of given sites, which follow each other."""
        count = len(self.positions)
        if kind.sites is None or count % kind.sites:
            raise InputError(f"{count} atoms are no {kind.particles}, of {kind.sites} atoms each")
        return np.arange(0, count, kind.sites)

    def _whole(self, kind: Model[Packing], box: Array) -> Array:
        """Positions; where the box may have cut particles, each at the image next to the one before in its particle.
        What is whole keeps its bits."""
        if not self.wrapped or kind.sites in (None, 1):
            return self.positions
        sites = self.positions.reshape(-1, kind.sites, 2).copy()
        steps = np.diff(sites, axis=1)
        taken = shortest_images(steps.reshape(-1, 2), box).reshape(steps.shape)
        sites[:, 1:] -= np.cumsum(taken, axis=1) @ box
        return sites.reshape(-1, 2)

    def _fixed(self, first: Indices) -> NDArray[np.bool_] | None:
        """(n,) mask, from the atoms or from the bits of all particles. `first`: (n,) the first site of each."""
        if self.fixed is not None:
            return self.fixed[first]
        if (bits := self.entries.get("fixed")) is None:
            return None
        n = len(first)
        mask = np.unpackbits(np.frombuffer(bytes.fromhex(bits), dtype=np.uint8)).astype(bool)
        if not n <= len(mask) < n + 8:
            raise InputError(f"fixed={bits:.40}: it has bits of {len(mask)} particles, not of {n}")
        return mask[:n]

    def _cell(self, given: ArrayLike | None) -> Array:
        box = None if given is None else plane_box("box", given)
        if box is None and self.box is None:
            raise InputError(
                "the source has no periodic box (of an xyz file: no Lattice): give "
                + typed("box= as two sides or two lattice vectors", "--box LX,LY")
            )
        if box is not None and self.box is not None and not np.array_equal(box, self.box):
            raise InputError(f"box = {box.tolist()} was given, but the source has {self.box.tolist()}")
        cell: Array = box if self.box is None else self.box  # type: ignore[assignment]
        check_box(cell)
        return cell

    def _diameters(self, radii: Radii) -> Array:
        by_type = {
            name[1:]: 0.5 * value for name, value in self.entries.items() if name.startswith("d") and name[1:].isdigit()
        }
        known = given_radii(by_type or None, self.types) if self.radius is None else self.radius
        given = given_radii(radii, self.types)
        if given is not None and known is not None and not np.array_equal(given, known):
            k = int(np.flatnonzero(given != known)[0])
            raise InputError(f"radii gives disk {k} the radius {given[k]:g}, but the source has {known[k]:g}")
        known = given if known is None else known
        if known is None:
            raise InputError(
                "the sizes of the disks are unknown: give "
                + typed("radii, a number, one for each disk or {type: radius}", "--radii, a number or TYPE=RADIUS,...")
                + f" for the types {', '.join(sorted(set(self.types.tolist()))[:9])}"
            )
        return 2 * known

    def _rest_areas(self, rings: Rings, given: Any) -> Array:
        vertices = np.diff(rings.offsets)
        known = None if self.a0 is None else self.a0.take(rings.order).take(rings.offsets[:-1])
        if given is not None:
            values = finite_array("law['a0']", np.broadcast_to(given, vertices.shape), (len(vertices),))
            if known is not None and not np.array_equal(values, known):
                raise InputError("law['a0'] was given, but the source has other rest areas")
            return values
        if known is None:
            raise InputError(
                "the rest areas of the droplets are unknown: give "
                + typed("law={'a0': one number or one for each}, or model='sp'", "--law a0=AREA, or --model sp")
                + " if these are disks that have molecules or bonds"
            )
        return known
