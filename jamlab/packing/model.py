"""The base class of models, in parts; a method that a model leaves out refuses by name.

A model is one object of a class derived from `Model`, under its name in `jamlab.packing.kinds.MODELS`. `State` and
`Contacts` are what every model writes: with them and `Lammps` its packings are made, compressed, measured and drawn.
`Shape` is for outlines and voids, `Flow` for drag at contacts and runs in time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Generic, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices, Mask
from jamlab.checks import check_positive, finite_array
from jamlab.errors import InputError
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.parameter import Parameter
from jamlab.packing.bare_packing import BarePacking, P
from jamlab.packing.magnitudes import check_magnitudes
from jamlab.packing.neighbors import Pairs
from jamlab.packing.terms import ContactJacobian, Terms
from jamlab.registry import EXTENDING


class UnitNames(NamedTuple):
    """Names of units, for labels."""

    length: str
    force: str
    stress: str


class Part(Generic[P]):
    """A part of a model."""

    name: ClassVar[str]  # of `Packing.model`

    def says(self, method: str) -> bool:
        """Whether the model writes this method itself."""
        return getattr(type(self), method) is not getattr(Model, method)

    def lacks(self, method: str) -> NoReturn:
        """Refuse a method that the model leaves out."""
        part = next(each.__name__ for each in Model.__mro__ if method in vars(each))
        raise InputError(
            f"model {self.name} does not say `{part}.{method}`, which this needs: write it in class "
            f"{type(self).__name__}, see {EXTENDING} and `jamlab.packing.model.{part}`"
        )


class State(Part[P]):
    """What a packing holds, and how large its particles are."""

    particles: ClassVar[str]  # what they are called, such as "disks"
    words: ClassVar[tuple[str, ...]] = ()  # typed for its name, which messages answer
    sites: ClassVar[int | None] = 1  # positions of each particle; None: `Packing.offsets` says how many
    size_name: ClassVar[str] = "diameter"
    size_label: ClassVar[str] = "diameter"  # of a scale of colours and in pages
    unit_names: ClassVar[Mapping[str, UnitNames]] = {"eps": UnitNames("d", "ε/d", "ε/d²")}  # by `Packing.units`
    # what the letters stand for
    unit_meanings: ClassVar[Mapping[str, str]] = {"eps": "ε: energy of a contact, d: mean diameter"}
    motions: ClassVar[int] = 3  # of a rigid particle
    # whether outlines may come through each other, or fold: then no minimum from there is one of a packing
    has_outlines: ClassVar[bool] = False
    # of `packing_fraction`, by name
    fraction_methods: ClassVar[Mapping[str, Callable[[Any], float]]] = {"nominal": lambda packing: packing.phi}

    # of the force law, by which tables of campaigns tell packings apart
    law_columns: ClassVar[tuple[str, ...]] = ()

    def parameters(self, units: str | None, params: Mapping[str, Any]) -> Mapping[str, Parameter]:
        """Parameters of the force law, declared once, by name.

        Args:
            units: of the strength among them; None: the strengths of all units.
            params: some parameters, where they decide which law it is, as `law` of disks does.
        """
        self.lacks("parameters")

    def values(self, packing: P) -> dict[str, Any]:
        """Parameters of the packing by name, with defaults for those that it does not have."""
        return {name: packing.params.get(name, each.default) for name, each in packing.parameters.items()}

    def law(self, packing: P) -> PairLaw:
        """The law of its contacts."""
        self.lacks("law")

    def free_area(self, packing: P) -> float:
        """Area of all undeformed particles, overlaps of two counted twice."""
        self.lacks("free_area")

    def shape(self, diameters: Array, params: Mapping[str, Any]) -> Array:
        """(n, sites, 2) positions of free particles from their centres, not turned. `params`: each by name, with
        defaults."""
        if self.sites != 1:
            self.lacks("shape")
        return np.zeros((len(diameters), 1, 2))

    def checked(self, packing: P) -> dict[str, Any]:
        """Return the attributes of a packing as they are kept, and refuse invalid ones. By default: one diameter a
        particle, and as many positions of each as `sites`."""
        n, rest = divmod(len(packing.positions), self.sites or 1)
        if rest:
            raise InputError(f"model {self.name}: {len(packing.positions)} positions, but {self.sites} a particle")
        if packing.diameters is None:
            raise InputError(f"model {self.name} needs diameters, one per particle")
        diameters = finite_array("diameters", packing.diameters, (n,))
        check_positive("diameters", diameters)
        check_magnitudes(packing.box, packing.positions, diameters)
        offsets = None if self.sites == 1 else (self.sites or 1) * np.arange(n + 1)
        return {"diameters": diameters, "offsets": offsets}

    def check_moved(self, packing: P) -> None:
        """Refuse a packing with a particle that its move has broken, such as an outline that crosses itself. All but
        its positions, which are finite, was checked before; by default `checked` looks at it again."""
        if self.has_outlines:
            self.checked(packing)

    def selected(self, packing: P, particles: Mask) -> dict[str, Any]:
        """Attributes of some particles alone."""
        found: dict[str, Any] = {}
        if packing.diameters is not None:
            found["diameters"] = packing.diameters[particles]
        if packing.offsets is not None:
            found["offsets"] = np.append(0, np.cumsum(np.diff(packing.offsets)[particles]))
        return found

    def particle(self, packing: P) -> Indices:
        """(len(positions),) particle of each position."""
        return np.arange(packing.n) if packing.offsets is None else np.repeat(np.arange(packing.n), _counts(packing))

    def centroids(self, packing: P) -> Array:
        """(n, 2), by default the mean of the positions of each particle."""
        if packing.offsets is None:
            return packing.positions
        return np.asarray(np.add.reduceat(packing.positions, packing.offsets[:-1]) / _counts(packing)[:, None])

    def centroid_displacements(self, packing: P, u: NDArray[Any]) -> NDArray[Any]:
        """(n, 2) how `centroids` move, to first order, if positions move by u (len(positions), 2), real or complex; by
        default the mean over the positions of each particle."""
        if self.says("centroids"):
            self.lacks("centroid_displacements")
        if packing.offsets is None:
            return u
        return np.asarray(np.add.reduceat(u, packing.offsets[:-1]) / _counts(packing)[:, None])

    def sizes(self, packing: P) -> Array:
        """(n,) sizes, whose mean is the unit of length in packings that jamlab makes."""
        return packing.disk_diameters

    def grown(self, packing: P, growth: float) -> P | None:
        """The packing with distances of contact larger by `growth`; None if nothing is left of a particle."""
        self.lacks("grown")

    def rotations(self, packing: P) -> int:
        """Number of rotations among the degrees of freedom, beside the positions."""
        return 0


def _counts(packing: BarePacking) -> Indices:
    return np.diff(np.asarray(packing.offsets))


class Contacts(Part[P]):
    """Contacts, their forces, and the potential energy."""

    needs_prestress: ClassVar[bool] = False  # whether there is no Hessian without what forces do to it
    meets_flat_walls: ClassVar[bool] = False  # whether `points` finds contacts with flat walls, `Packing.flat_walls`
    # that rounding leaves of forces at a minimum, over the energy of the law and the mean size
    least_force: ClassVar[float] = 1e-13

    def points(self, packing: P, /) -> Any:
        """Sites in contact, by number: `Pairs` or the like, with `among`. A static method under
        `per_packing`, from which all other methods of this part take their contacts: analysis leaves some out."""
        self.lacks("points")

    def check_apart(self, packing: P) -> None:
        """Refuse outlines that have come through each other, and disks behind a wall, by default where `points` does:
        their contacts would pull where they should push."""
        self.points(packing)

    def pairs(self, packing: P) -> Pairs:
        """Pairs of particles i <= j in contact."""
        self.lacks("pairs")

    def contact_forces(self, packing: P) -> Any:
        """`ContactForces` of these pairs: force and gap."""
        self.lacks("contact_forces")

    def places(self, packing: P) -> Indices:
        """(m,) places at which the particles of each of `pairs` touch, as many as the contacts for which they count
        where rattlers are found; by default one, however large the contact."""
        return np.ones(len(self.pairs(packing).i), dtype=np.int64)

    def loads(self, packing: P) -> Array:
        """(n,) largest force on each particle that two contacts alone may balance, as flat sides do; by default 0."""
        return np.zeros(packing.n)

    def terms(self, packing: P, prestress: bool) -> list[Terms]:
        """Terms of the potential energy. `prestress`: False leaves the pre-stress out of the Hessian."""
        self.lacks("terms")

    def shape_terms(self, packing: P) -> list[Terms]:
        """Sites that need no contact, by default none."""
        return []

    def rigidity(self, packing: P) -> Array:
        """(contacts, motions n) compatibility matrix of rigid particles."""
        self.lacks("rigidity")


class Shape(Part[P]):
    """Areas, outlines and voids."""

    def shares(self, packing: P) -> Array:
        """(n,) areas, overlaps shared."""
        self.lacks("shares")

    def outline(self, packing: P, rim: bool) -> tuple[Array, Array]:
        """(n,) area and perimeter."""
        self.lacks("outline")

    def relative_areas(self, packing: P) -> Array:
        """(n,) areas without rims over those at rest."""
        self.lacks("relative_areas")

    def boundary(self, packing: P, /) -> Any:
        """`Boundary` of the covered region."""
        self.lacks("boundary")

    def power_points(self, packing: P, spacing: float) -> tuple[Indices, Array, Array]:
        """Owner, position and radius of the points whose power cells tessellate the box."""
        self.lacks("power_points")

    def rings(self, packing: P) -> tuple[list[Array], list[Array]]:
        """Rings to fill and to outline where a packing is drawn, one a particle."""
        self.lacks("rings")


class Flow(Part[P]):
    """Drag at contacts, and flow in time."""

    # how the plugin carries drag: "pairs" of round sites by the pair style disk/drag, "outlines" of polygons; "": not
    carrier: ClassVar[str] = ""
    corrects_flow: ClassVar[bool] = False  # whether steps in time are corrected, as of stiff line tension

    def jacobian(self, packing: P, lever_arms: str, generator: Array) -> ContactJacobian:
        """Relative velocities at contacts."""
        self.lacks("jacobian")


class Lammps(State[P]):
    """A packing in LAMMPS: part of the decks, atom style, variables, types."""

    atom_style: ClassVar[str] = "atomic"  # molecular ones have bonds
    size_column: ClassVar[str] = "diameter"  # name of the property of atoms that holds the size
    bonds_by_size: ClassVar[bool] = False  # whether a bond has the type of its particle; else all have type 1
    sizes_by_atom: ClassVar[bool] = False  # whether data files always hold it
    sizes_by_disk: ClassVar[bool] = False  # whether the part takes more sizes than there may be types, by `own_sizes`
    # whether FIRE in compiled code, on several threads and with strains of the box, knows the particles
    compiled_fire: ClassVar[bool] = False

    @property
    def part(self) -> Path:
        """File with the force law and the numbers of minima, as those of `lammps_inputs/parts`; its sections begin
        with the name of the model."""
        self.lacks("part")

    @property
    def engine_parts(self) -> tuple[Path, ...]:
        """Files that the engine includes, one after the other, to read a packing and its force law; by default the
        `part`."""
        return (self.part,)

    def check_for_lammps(self, packing: P) -> None:
        """Refuse a packing that LAMMPS would misread; by default none."""

    def type_sizes(self, packing: P) -> Array:
        """(n,) sizes by which particles have atom types."""
        return self.sizes(packing)

    def lammps_variables(self, packing: P) -> dict[str, object]:
        """Variables of the deck part, by default the units and every parameter that is one number or text."""
        values = self.values(packing)
        return {"units": packing.units} | {name: values[name] for name in values if not packing.parameters[name].each}

    def dump_columns(self, packing: P) -> dict[str, Array]:
        """Columns of dumps of which each particle has its own value."""
        return {"radius": 0.5 * self.sizes(packing)}

    def bonds(self, packing: P) -> Indices:
        """(m, 2) positions that are bonded, by number; by default each to the next of its particle."""
        if self.atom_style != "molecular":
            return np.zeros((0, 2), dtype=np.int64)
        i = np.flatnonzero(np.diff(packing.particle) == 0)
        return np.column_stack([i, i + 1])

    def longest_edge(self, packing: P) -> float:
        """Length of the longest bond; 0 without bonds."""
        bonds = self.bonds(packing)
        return float(np.hypot(*np.diff(packing.positions[bonds], axis=1)[:, 0].T).max(initial=0.0))


class Model(Contacts[P], Shape[P], Flow[P], Lammps[P], State[P]):
    """A model of particles, see the module."""
