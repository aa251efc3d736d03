"""One frame from another program, before it is known to be a packing: its law, its sizes, droplets as closed rings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jamlab.arrays import Array, Indices
from jamlab.checks import check_choice, finite_array, is_number
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.packing.law_parameters import FORCE_LAW, OPTIONAL, UNITS
from jamlab.packing.packing import Packing

Radii = ArrayLike | Mapping[Any, float] | None


def complete_force_law(
    model: str, found: Mapping[str, Any], units: str | None, params: Mapping[str, Any] | None
) -> tuple[str, dict[str, Any], list[str]]:
    """Complete the force law of a file, rest areas apart, with what the user gives; units are "eps" if neither says.
    Returns units, parameters, and the names of those found in neither, which have the defaults of the decks."""
    chosen = str(found.get("units", units or "eps"))
    check_choice("units", chosen, UNITS)
    if (model, chosen) not in FORCE_LAW:
        raise InputError(f"model {model} has no units {chosen!r}")
    names = [name for name in (*FORCE_LAW[model, chosen], *OPTIONAL[model]) if name != "a0"]
    given = {name: value for name, value in (params or {}).items() if name != "a0"}
    for name in given:
        if name not in names:
            raise InputError(f"model {model} in units {chosen} has no parameter {name!r}: use {', '.join(names)}")
    for name, value in {**given, **({} if units is None else {"units": units})}.items():
        if name in found and found[name] != value:
            raise InputError(f"{name} = {value!r} was given, but the source has {found[name]!r}")
    known = {name: given.get(name, found.get(name)) for name in names}
    law = {name: value for name, value in known.items() if value is not None}
    assumed = [name for name in names if name not in law and name not in OPTIONAL[model]]
    return chosen, law | {name: defaults(model)[name] for name in assumed}, assumed


def deck_diameters(types: NDArray[np.str_]) -> Array | None:
    """(n,) diameters of disks of type 1 (small) and 2 (large) of the decks; None if there are other types."""
    small = 2 / (1 + float(defaults("sp")["ratio"]))
    sizes = {"1": small, "2": float(defaults("sp")["ratio"]) * small}
    if not set(types.tolist()) <= set(sizes):
        return None
    return np.array([sizes[name] for name in types.tolist()])


def deck_rest_areas(vertices: NDArray[np.int64]) -> Array | None:
    """(n,) rest areas of the decks' droplets by their number of vertices; None if the decks have no such droplets."""
    law = defaults("dp")
    sizes = np.array([float(law["nv_small"]), float(law["nv_large"])])
    if not np.isin(vertices, sizes).all():
        return None
    return np.asarray((2 * vertices / sizes.sum()) ** 2)


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


@dataclass(frozen=True)
class Rings:
    """Order of points around polygons."""

    order: Indices  # (n_vertices,) every point once, ring after ring; rings go by their lowest point and begin there
    offsets: Indices  # (n + 1,) ring m is order[offsets[m]:offsets[m + 1]]

    def polygons(self, positions: Array, box: Array, *, wrapped: bool) -> tuple[Indices, Array]:
        """Polygons of one frame: points (n_vertices,) in the order of the vertices, counter-clockwise, and the vertices
        (n_vertices, 2). One that is wrapped may lie on both sides of the box; then no edge may be longer than half of
        it."""
        vertices = positions[self.order]
        if wrapped:
            vertices = self._whole(vertices, box)
        starts = np.repeat(self.offsets[:-1], np.diff(self.offsets))
        r = vertices - vertices[starts]
        s = r[self._following()]
        clockwise = np.add.reduceat(r[:, 0] * s[:, 1] - r[:, 1] * s[:, 0], self.offsets[:-1]) < 0
        place = np.arange(len(vertices))
        ends = np.repeat(self.offsets[1:], np.diff(self.offsets))
        turned = np.where(place == starts, place, starts + ends - place)  # the first vertex stays the first
        place = np.where(np.repeat(clockwise, np.diff(self.offsets)), turned, place)
        return self.order[place], vertices[place]

    def _following(self) -> Indices:
        following = np.arange(1, len(self.order) + 1)
        following[self.offsets[1:] - 1] = self.offsets[:-1]
        return following

    def _whole(self, vertices: Array, box: Array) -> Array:
        """Shift vertices by lattice vectors so that every edge is the shortest one; what is whole keeps its bits."""
        edges = vertices[self._following()] - vertices
        steps = np.rint(edges @ np.linalg.inv(box))
        winding = np.argwhere(np.add.reduceat(steps, self.offsets[:-1], axis=0))
        if len(winding):
            raise InputError(
                f"the bonds of polygon {winding[0, 0]} lead around the periodic box: every edge must be shorter than "
                "half of the box"
            )
        taken = np.cumsum(steps, axis=0) - steps
        taken -= np.repeat(taken[self.offsets[:-1]], np.diff(self.offsets), axis=0)
        return np.asarray(vertices - taken @ box)


def rings_of_bonds(bonds: Indices, count: int) -> Rings:
    """Rings that bonds (m, 2), of which one may occur twice, close between so many points."""
    ends = np.unique(np.sort(bonds, axis=1), axis=0)
    degree = np.bincount(ends.ravel(), minlength=count)
    odd = np.flatnonzero(degree != 2)
    if len(odd) or (ends[:, 0] == ends[:, 1]).any():
        k = odd[0] if len(odd) else ends[ends[:, 0] == ends[:, 1]][0, 0]
        raise InputError(
            f"point {k} has {degree[k]} bonds: droplets are closed rings in which every vertex has two; for disks "
            "leave the bonds out"
        )
    both = np.concatenate([ends, ends[:, ::-1]])
    neighbors = both[np.lexsort((both[:, 1], both[:, 0])), 1].reshape(-1, 2)
    order: list[int] = []
    offsets = [0]
    seen = np.zeros(count, dtype=bool)
    for start in range(count):
        before, here = int(neighbors[start, 1]), start
        while not seen[here]:
            seen[here] = True
            order.append(here)
            left, right = (int(k) for k in neighbors[here])
            before, here = here, right if left == before else left
        if len(order) > offsets[-1]:
            offsets.append(len(order))
    return Rings(np.array(order), np.array(offsets))


def rings_of_molecules(molecule: Indices) -> Rings | None:
    """Rings of points that follow each other within a molecule (n_vertices,); None if one has fewer than three
    points."""
    _, first, ring, sizes = np.unique(molecule, return_index=True, return_inverse=True, return_counts=True)
    if sizes.min() < 3:
        return None
    order = np.argsort(first[ring.reshape(-1)], kind="stable")
    return Rings(order, np.concatenate([[0], np.cumsum(sizes[np.argsort(first)])]))


@dataclass(frozen=True, eq=False)
class Sites:
    """Atoms of one frame: disks, or vertices of droplets."""

    box: Array  # (2, 2), as in `Packing.box`
    positions: Array  # (n_atoms, 2)
    types: NDArray[np.str_]  # (n_atoms,) names of the atom types
    rings: Rings | None  # which atoms are vertices of one droplet; None: every atom is a disk
    wrapped: bool = True  # whether droplets may lie on both sides of the box
    radius: Array | None = None  # (n_atoms,) of the disks, if the source has radii
    a0: Array | None = None  # (n_atoms,) rest area of the droplet of each vertex, if the source has them
    # further attributes in the source, see `jamlab.packing.lammps_files.described`
    entries: Mapping[str, Any] = field(default_factory=dict)
    deck: bool = True  # whether unknown sizes may be those of the decks' particles
    rounding: float = 0.0  # how far a coordinate may be off, see `Packing.rounding`
    provenance: Mapping[str, Any] = field(default_factory=dict)  # entries about the source

    def packing(
        self, radii: Radii = None, units: str | None = None, params: Mapping[str, Any] | None = None
    ) -> Packing:
        """Make a packing of these atoms; arguments as in `jamlab.read`."""
        model = "sp" if self.rings is None else "dp"
        if self.entries.get("model", model) != model:
            raise InputError(f"the source has model {self.entries['model']}, but bonds of model {model}")
        units, law, assumed = complete_force_law(model, self.entries, units, params)
        common: dict[str, Any] = {"model": model, "box": self.box, "units": units, "onset": self.entries.get("onset")}
        common["ensemble"] = self.entries.get("ensemble", "fixed-box")
        if not self.rounding:
            common |= {name: self.entries[name] for name in ("max_force", "converged") if name in self.entries}
        if self.rings is None:
            common |= {"positions": self.positions, "diameters": self._diameters(radii, assumed)}
        elif radii is not None:
            raise InputError("radii are those of disks: the rim of droplets is params['delta']")
        else:
            order, vertices = self.rings.polygons(self.positions, self.box, wrapped=self.wrapped)
            law["a0"] = self._rest_areas(order, (params or {}).get("a0"), assumed)
            common |= {"positions": vertices, "offsets": self.rings.offsets}
        return Packing(params=law, provenance=self._history(assumed), **common)

    def _history(self, assumed: list[str]) -> dict[str, Any]:
        history = dict(self.provenance)
        if assumed:
            history["assumed"] = assumed
        if self.rounding:
            history["rounding"] = self.rounding
        return history

    def _diameters(self, radii: Radii, assumed: list[str]) -> Array:
        by_type = {
            name[1:]: 0.5 * value for name, value in self.entries.items() if name.startswith("d") and name[1:].isdigit()
        }
        known = given_radii(by_type or None, self.types) if self.radius is None else self.radius
        given = given_radii(radii, self.types)
        if given is not None and known is not None and not np.array_equal(given, known):
            k = int(np.flatnonzero(given != known)[0])
            raise InputError(f"radii gives disk {k} the radius {given[k]:g}, but the source has {known[k]:g}")
        known = given if known is None else known
        if known is not None:
            return 2 * known
        sizes = deck_diameters(self.types) if self.deck else None
        if sizes is None:
            raise InputError(
                "the sizes of the disks are unknown: give radii, a number, one for each disk or {type: radius} "
                f"for the types {', '.join(sorted(set(self.types.tolist()))[:9])}"
            )
        assumed.append("diameters")
        return sizes

    def _rest_areas(self, order: NDArray[np.int64], given: Any, assumed: list[str]) -> Array:
        assert self.rings is not None
        vertices = np.diff(self.rings.offsets)
        known = None if self.a0 is None else self.a0[order][self.rings.offsets[:-1]]
        if given is not None:
            values = finite_array("params['a0']", np.broadcast_to(given, vertices.shape), (len(vertices),))
            if known is not None and not np.array_equal(values, known):
                raise InputError("params['a0'] was given, but the source has other rest areas")
            return values
        if known is not None:
            return known
        areas = deck_rest_areas(vertices)
        if areas is None:
            raise InputError(
                "the rest areas of the droplets are unknown: give params={'a0': one number or one for each}"
            )
        assumed.append("a0")
        return areas
