"""Soft disks: the model "sp", one site each, which repel where they overlap."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.checks import check_positive, finite_array
from jamlab.errors import EngineError, InputError
from jamlab.geometry.contact_network import ContactForces, per_length
from jamlab.geometry.packing_fraction import cover_by_disks, fraction_by_pairs
from jamlab.geometry.power_cells import disk_cells
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.geometry.voids.boundary_loops import Boundary, trace_disks
from jamlab.installed_files import installed_file
from jamlab.laws.laws import declared, law_class
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.parameter import UNITS, Parameter
from jamlab.packing.facts import law_of, words
from jamlab.packing.magnitudes import check_magnitudes
from jamlab.packing.model import Model, UnitNames
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing
from jamlab.packing.terms import ContactJacobian, SparseRows, Terms, central_terms


class Disks(Model[Packing]):
    """See `Model`."""

    name: ClassVar[Literal["sp"]] = "sp"
    particles = "disks"
    words = ("disks", "disk")
    unit_names: ClassVar[Mapping[str, UnitNames]] = {
        "eps": UnitNames("σ", "ε/σ", "ε/σ²"),
        "k": UnitNames("d", "k d", "k"),
    }
    unit_meanings: ClassVar[Mapping[str, str]] = {
        "eps": "ε: energy of a contact, σ: mean diameter",
        "k": "k: stiffness of a contact, d: mean diameter",
    }
    motions = 2  # of a rigid particle: no contact holds a disk from turning
    compiled_fire = True
    sizes_by_disk = True
    meets_flat_walls = True
    law_columns = ("exponent", "stickiness")
    carrier = "pairs"
    least_force = 2e-14
    points = staticmethod(touching_disks)
    fraction_methods: ClassVar[Mapping[str, Callable[[Packing], float]]] = {
        "exact": cover_by_disks,
        "pairs": fraction_by_pairs,
        "nominal": lambda packing: packing.phi,
    }

    # state ------------------------------------------------------------------------------------------------------------

    def parameters(self, units: str | None, params: Mapping[str, Any]) -> Mapping[str, Parameter]:
        return declared(params, units)

    def checked(self, packing: Packing) -> dict[str, Any]:
        if packing.offsets is not None:
            raise InputError("offsets belong to model dp, not to sp")
        if packing.diameters is None:
            raise InputError("model sp needs diameters, one per disk")
        diameters = finite_array("diameters", packing.diameters, (len(packing.positions),))
        sizes = diameters[diameters != 0]  # flat walls have none
        check_positive("diameters", np.where(diameters == 0, 1.0, diameters))
        check_magnitudes(packing.box, packing.positions, sizes)
        law_class(packing.params).of(packing.params, packing.units, float(sizes.mean()))
        return {"diameters": diameters}

    def law(self, packing: Packing) -> PairLaw:
        return law_class(packing.params).of(packing.params, packing.units, float(packing.frame.sizes.mean()))

    def free_area(self, packing: Packing) -> float:
        return float(np.pi / 4 * np.sum(packing.disk_diameters**2))

    def grown(self, packing: Packing, growth: float) -> Packing | None:
        if -growth >= packing.frame.sizes.min():
            return None
        return packing.with_state(diameters=packing.disk_diameters + growth * ~packing.frame.flat_sites)

    def rotations(self, packing: Packing) -> int:
        return packing.n

    # contacts ---------------------------------------------------------------------------------------------------------

    def pairs(self, packing: Packing) -> Pairs:
        return touching_disks(packing)

    def contact_forces(self, packing: Packing) -> ContactForces:
        _, r, distance, s = _touching(packing)
        push = -packing.law(s, distance)[1]
        return ContactForces(per_length(push, distance)[:, None] * r, distance - s)

    def terms(self, packing: Packing, prestress: bool) -> list[Terms]:
        pairs, r, distance, s = _touching(packing)
        if not distance.all():
            i, j = pairs[distance.argmin()]
            raise InputError(
                f"disks {i} and {j} have the same position, so their contact has no direction: move one of them"
            )
        energy, slope, stiffness = packing.law(s, distance)
        normal = r / distance[:, None]
        borne = np.where(np.abs(slope) > packing.law.slack, slope, 0.0) if prestress else np.zeros_like(slope)
        turned = ~packing.frame.flat_sites[pairs[:, 1]]  # a flat wall does not turn a force
        across = np.where(turned, borne / distance, 0.0)
        return [central_terms("spring", pairs, r, normal, energy, slope, stiffness, across)]

    def jacobian(self, packing: Packing, lever_arms: str, generator: Array) -> ContactJacobian:
        pairs, r, distance, s = _touching(packing)
        size, arms_of_pairs = 3 * packing.n + 1, levers(packing, lever_arms)
        return ContactJacobian(
            normal=r / distance[:, None],
            flow=r @ generator.T,
            stiffness=packing.law.drag_stiffness(s, distance),
            sites=pairs,
            weights=np.tile([-1.0, 1.0], (len(pairs), 1)),
            rolling=SparseRows(arms_of_pairs, 2 * packing.n + pairs, size),
            levers=arms_of_pairs,
        )

    def rigidity(self, packing: Packing) -> Array:
        """(contacts, 2 n) change of every gap with the positions of disks."""
        pairs, r, distance, _ = _touching(packing)
        rows, normal, each = np.zeros((len(pairs), packing.n, 2)), r / distance[:, None], np.arange(len(pairs))
        np.add.at(rows, (each, pairs[:, 1]), normal)
        np.add.at(rows, (each, pairs[:, 0]), -normal)
        return rows.reshape(len(rows), -1)

    # shape ------------------------------------------------------------------------------------------------------------

    def shares(self, packing: Packing) -> Array:
        return disk_cells(packing).area.copy()

    def outline(self, packing: Packing, rim: bool) -> tuple[Array, Array]:
        cells = disk_cells(packing)
        return cells.area, cells.perimeter

    def relative_areas(self, packing: Packing) -> Array:
        return disk_cells(packing).area / (0.25 * np.pi * packing.disk_diameters**2)

    def boundary(self, packing: Packing) -> Boundary:
        return trace_disks(packing)

    def power_points(self, packing: Packing, spacing: float) -> tuple[Indices, Array, Array]:
        return np.arange(packing.n), packing.positions, 0.5 * packing.disk_diameters

    def rings(self, packing: Packing) -> tuple[list[Array], list[Array]]:
        from jamlab.plotting.periodic_cell import circles  # with matplotlib, which packings alone do not load

        drawn = circles(packing.positions, packing.disk_diameters)
        return drawn, drawn

    # LAMMPS -----------------------------------------------------------------------------------------------------------

    @property
    def part(self) -> Path:
        return installed_file("lammps_inputs", "parts/sp")

    @property
    def engine_parts(self) -> tuple[Path, ...]:
        return tuple(installed_file("lammps_inputs", f"parts/{name}") for name in ("sp_of_python", "disk_pairs"))

    def check_for_lammps(self, packing: Packing) -> None:
        if packing.frame.is_flat and not packing.law.deck_part:
            raise EngineError(
                f"{packing.law} has no flat walls in LAMMPS, whose pair styles know points alone: use rough walls, "
                "jamlab.with_walls(packing), or jamlab's own laws"
            )
        order = np.lexsort(packing.positions.T)
        if len(same := np.flatnonzero((np.diff(packing.positions[order], axis=0) == 0).all(axis=1))):
            i, j = sorted(order[same[0] : same[0] + 2])
            raise EngineError(f"disks {i} and {j} have the same position; move one of them")

    def lammps_variables(self, packing: Packing) -> dict[str, object]:
        found = packing.law.lammps_variables()
        if "pair_style" not in found:  # a law that the part of the decks holds by itself
            return found
        return found | {
            "law_words": words({name: value for name, value in law_of(packing).items() if name not in UNITS})
        }


DISKS = Disks()  # as entry points name it


def _touching(packing: Packing) -> tuple[Indices, Array, Array, Array]:
    """Pairs (m, 2) of disks that touch, vectors between them, their lengths, and the distances s of contact."""
    near = touching_disks(packing)
    pairs = np.column_stack([near.i, near.j])
    return pairs, near.r, np.hypot(*near.r.T), np.asarray(0.5 * packing.disk_diameters[pairs].sum(axis=1))


def levers(packing: Packing, lever_arms: str) -> Array:
    """(m, 2) lever arms of two disks that touch."""
    pairs, _, distance, _ = _touching(packing)
    radii = 0.5 * packing.disk_diameters[pairs]
    if lever_arms == "contact":  # in the middle of the overlap
        radii = radii - 0.5 * (radii.sum(axis=1) - distance)[:, None]
    return np.asarray(radii)
