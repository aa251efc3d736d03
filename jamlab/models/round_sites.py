"""Particles made of disks that move together: dimers, chains, bumpy particles. A third model starts from here.

Each position of a packing is the centre of one disk. Disks of two particles, or of one particle and its own periodic
image, repel by the law of contacts; what holds the disks of one particle together is in `Contacts.shape_terms`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError
from jamlab.geometry.contact_network import ContactForces, per_length
from jamlab.geometry.packing_fraction import cover_by_disks
from jamlab.installed_files import installed_file
from jamlab.laws.laws import declared, law_class
from jamlab.laws.pair_law import PairLaw, formulas
from jamlab.laws.parameter import Parameter
from jamlab.models.disks import DISKS
from jamlab.packing.derived import per_packing
from jamlab.packing.model import Model
from jamlab.packing.neighbors import Pairs, periodic_pairs
from jamlab.packing.outlines import cross
from jamlab.packing.packing import Packing
from jamlab.packing.terms import Terms, central_terms


@per_packing
def touching_sites(packing: Packing) -> Pairs:
    """Pairs of disks of different particles, or images, within the cutoff of their law."""
    reach = 0.5 * site_diameters(packing) + 0.5 * packing.law.range
    near, particle = periodic_pairs(packing.positions, packing.box, reach), packing.particle
    return near.select((particle[near.i] != particle[near.j]) | (near.shift != 0).any(axis=1))


def site_diameters(packing: Packing) -> Array:
    """(len(positions),) diameter of each disk, that of its particle."""
    return np.asarray(packing.disk_diameters[packing.particle])


def as_disks(packing: Packing) -> Packing:
    """The disks alone, free of each other."""
    sizes = site_diameters(packing)
    return Packing("sp", packing.box, packing.positions, {"eps": 1.0}, "eps", sizes)


class RoundSites(Model[Packing]):
    """What follows from the disks of particles and the bonds between them.

    A model says what its particles are: `name`, `particles`, `sites`, `shape` and `free_area`, see
    `jamlab.packing.model.State`; and its bonds, by default from each disk to the next of its particle, see `bonds`:
    their parameters `own`, their energy in `bond_energy`, and the same for LAMMPS in `bond_style` and
    `bond_coefficients`. Contacts follow any force law of disks.
    """

    own: ClassVar[Mapping[str, Parameter]] = {}  # parameters beside the force law
    bond_style: ClassVar[str]  # of LAMMPS
    # arguments of `bond_coeff`: formulas of v_d, the diameter of the particle, and of the parameters, such as v_bond
    bond_coefficients: ClassVar[tuple[str, ...]]
    unit_names = DISKS.unit_names
    atom_style = "molecular"
    bonds_by_size = True
    points = staticmethod(touching_sites)
    fraction_methods: ClassVar[Mapping[str, Callable[[Packing], float]]] = {
        "exact": lambda packing: cover_by_disks(as_disks(packing)),
        "nominal": lambda packing: packing.phi,
    }

    def parameters(self, units: str | None, params: Mapping[str, Any]) -> Mapping[str, Parameter]:
        return {**declared(params, units), **self.own}

    def checked(self, packing: Packing) -> dict[str, Any]:
        """Packings hold the bonds' parameters, so that files tell the model by them."""
        usual = {name: each.default for name, each in self.own.items()}
        return {**super().checked(packing), "params": {**usual, **packing.params}}

    def law(self, packing: Packing) -> PairLaw:
        """Any law of disks; `law` in the parameters names it."""
        return law_class(packing.params).of(packing.params, packing.units, float(packing.disk_diameters.mean()))

    def bond_energy(
        self, length: Array, diameters: Array, params: Mapping[str, Any]
    ) -> tuple[Array, Array, Array | float]:
        """Energy U, tension U' and stiffness U'' of bonds.

        Args:
            length: (m,) of each bond.
            diameters: (m,) of the disks of its particle.
            params: parameters by name.
        """
        self.lacks("bond_energy")

    def grown(self, packing: Packing, growth: float) -> Packing | None:
        if -growth >= packing.disk_diameters.min():
            return None
        return packing.with_state(diameters=packing.disk_diameters + growth)

    def pairs(self, packing: Packing) -> Pairs:
        """Each once, however many of their disks meet. r joins centroids."""
        (i, j, *_), shift = (names := _named(packing)[0]).T, names[:, 2:]
        return Pairs(i, j, packing.centroids[j] - packing.centroids[i] + shift @ packing.box, shift)

    def places(self, packing: Packing) -> Indices:
        """Every contact of two disks is one."""
        return np.bincount(_named(packing)[1], minlength=len(_named(packing)[0]))

    def contact_forces(self, packing: Packing) -> ContactForces:
        names, row, turned = _named(packing)
        near, distance, s = _touching(packing)
        push = -packing.law(s, distance)[1]
        force = np.where(turned, -1.0, 1.0)[:, None] * per_length(push, distance)[:, None] * near.r
        vectors, gap = np.zeros((len(names), 2)), np.full(len(names), np.inf)
        np.add.at(vectors, row, force)
        np.minimum.at(gap, row, distance - s)
        return ContactForces(vectors, gap)

    def terms(self, packing: Packing, prestress: bool) -> list[Terms]:
        near, distance, s = _touching(packing)
        energy, slope, stiffness = packing.law(s, distance)
        normal, borne = near.r / distance[:, None], slope if prestress else np.zeros_like(slope)
        pairs = np.column_stack([near.i, near.j])
        contacts = central_terms("contact", pairs, near.r, normal, energy, slope, stiffness, borne / distance)
        return [contacts, *self.shape_terms(packing)]

    def shape_terms(self, packing: Packing) -> list[Terms]:
        bonds = self.bonds(packing)
        r = np.diff(packing.positions[bonds], axis=1)[:, 0]
        length, sizes = np.hypot(*r.T), site_diameters(packing)[bonds[:, 0]]
        energy, tension, stiffness = self.bond_energy(length, sizes, packing.params)
        if not np.shape(energy) == np.shape(tension) == length.shape:
            raise InputError(
                f"model {self.name}: `bond_energy` returns energies of shape {np.shape(energy)} and tensions of shape "
                f"{np.shape(tension)} for {len(length)} bonds: give one of each"
            )
        normal = r / length[:, None]
        along = np.broadcast_to(stiffness, length.shape)
        return [central_terms("tension", bonds, r, normal, energy, tension, along, tension / length)]

    @property
    def part(self) -> Path:
        return installed_file("lammps_inputs", "parts/round_sites")

    def lammps_variables(self, packing: Packing) -> dict[str, object]:
        return {
            **packing.law.lammps_variables(),
            **{name: packing.params[name] for name in self.own},
            "bond_style": self.bond_style,
            "bond_coeff": formulas(self.bond_coefficients),
        }

    def rigidity(self, packing: Packing) -> Array:
        near, distance, _ = _touching(packing)
        size, normal = float(packing.disk_diameters.mean()), near.r / distance[:, None]
        arms = packing.positions - packing.centroids[packing.particle]
        rows, each = np.zeros((len(normal), packing.n, 3)), np.arange(len(normal))
        for site, sign in ((near.j, 1.0), (near.i, -1.0)):
            motion = np.column_stack([normal, cross(arms[site], normal) / size])
            np.add.at(rows, (each, packing.particle[site]), sign * motion)
        return rows.reshape(len(rows), -1)

    def power_points(self, packing: Packing, spacing: float) -> tuple[Indices, Array, Array]:
        return packing.particle, packing.positions, 0.5 * site_diameters(packing)

    def rings(self, packing: Packing) -> tuple[list[Array], list[Array]]:
        import shapely  # slow to load

        from jamlab.packing.packing_plot import QUARTER_ARC

        round_ = shapely.buffer(shapely.points(packing.positions), 0.5 * site_diameters(packing), quad_segs=QUARTER_ARC)
        parts = np.split(round_, np.cumsum(np.bincount(packing.particle))[:-1])
        rings = [shapely.get_coordinates(shapely.get_exterior_ring(shapely.union_all(part))) for part in parts]
        return rings, rings


def _touching(packing: Packing) -> tuple[Pairs, Array, Array]:
    """Disks that touch, their distances, and the distances s of contact."""
    near, sizes = packing.kind.points(packing), site_diameters(packing)
    return near, np.hypot(*near.r.T), 0.5 * (sizes[near.i] + sizes[near.j])


def _named(packing: Packing) -> tuple[Indices, Indices, Array]:
    """Pairs (m, 4) of particles i <= j, with the image of j; of each pair of disks, its row and whether it is turned
    round there."""
    near, particle = packing.kind.points(packing), packing.particle
    i, j, shift = particle[near.i], particle[near.j], near.shift
    turned = i > j
    shift = np.where(turned[:, None], -shift, shift)
    marks = np.column_stack([np.minimum(i, j), np.maximum(i, j), shift])
    names, row = np.unique(marks, axis=0, return_inverse=True)
    return names, row.reshape(-1), turned
