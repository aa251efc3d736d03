"""One frame from another program, before it is known to be a packing."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.checks import finite_array
from jamlab.errors import InputError
from jamlab.packing.packing import Packing
from jamlab.trajectories.foreign_law_and_sizes import (
    Radii,
    complete_force_law,
    deck_diameters,
    deck_rest_areas,
    given_radii,
)
from jamlab.trajectories.rings import Rings


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
            diameters = self._diameters(radii, assumed)
            return Packing(
                positions=self.positions, diameters=diameters, params=law, provenance=self._history(assumed), **common
            )
        if radii is not None:
            raise InputError("radii are those of disks: the rim of droplets is params['delta']")
        order, vertices = self.rings.polygons(self.positions, self.box, wrapped=self.wrapped)
        law["a0"] = self._rest_areas(order, (params or {}).get("a0"), assumed)
        return Packing(
            positions=vertices, offsets=self.rings.offsets, params=law, provenance=self._history(assumed), **common
        )

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
