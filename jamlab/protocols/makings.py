"""How packings of a model are made: its random start, its descent to a minimum, its search for onset, versions.

A model needs no making of its own: `Making` is that of particles with given sites in a given shape, whose energy L-BFGS
minimises. Disks and droplets have theirs in `of_disks.py` and `of_droplets.py`; another package
derives a class from `Making` and declares an object of it in the group `jamlab.makings`, under the name of its model.
Makings are apart from models, since analysis needs no LAMMPS.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Registered, Units
from jamlab.arrays import Array
from jamlab.checks import check_number, is_number
from jamlab.engine.deck_defaults import defaults, numbers
from jamlab.errors import InputError, named
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.parameter import check_params
from jamlab.packing.kinds import MODELS
from jamlab.packing.model import Model
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import Recipe, usual_of_onset
from jamlab.protocols.minimising import MAKINGS, Minimising
from jamlab.protocols.onset_search import OnsetSearch, SearchState
from jamlab.protocols.size_distributions import diameters_of
from jamlab.protocols.units_of_recipes import units_of

ComplexArray = NDArray[np.complex128]
SAME_AREA = 1e-6  # relative
_TRIES = 100  # places for a particle; at phi = 0.2 two are enough for most


class Making(Minimising):
    """How packings of one model are made.

    Attributes:
        name: of the model.
        version: of onsets, see `jamlab.campaign.tasks`; a change that gives other packings raises it.
        stiffening_version: the same for laws whose force does not grow in proportion to the overlap.
        compression_version: of states of `compress`.
        starts: of `jam(start=...)`, the usual one first; none: there is nothing to choose.
        outlines: arguments of `jam` beside the law, which the start takes.
        way: packing fractions, and the share of the time to onset spent below them: minimisation slows down as
            contacts form.
    """

    name: str
    version: ClassVar[int] = 1
    stiffening_version: ClassVar[int] = 1
    compression_version: ClassVar[int] = 1
    starts: ClassVar[tuple[str, ...]] = ()
    outlines: ClassVar[tuple[str, ...]] = ()
    way: ClassVar[tuple[tuple[float, ...], tuple[float, ...]]] = ((0.2, 0.83, 0.84, 0.85), (0.0, 0.05, 0.3, 0.9))

    def __init__(self, name: str = "") -> None:
        self.name = name or self.name

    # law ------------------------------------------------------------------------------------------------------------

    def arguments(self, given: Mapping[str, Any]) -> list[str]:
        """Names of the parameters that a packing may be made with, of the force law that some of them name."""
        kind = MODELS.get(self.name)
        declared = kind.parameters(None, given)
        known = [name for name in defaults(self.name) if name in declared and name not in kind.unit_names]
        own = [name for name, each in declared.items() if not each.each and name not in kind.unit_names]
        return list(dict.fromkeys([*known, *own, *self.outlines]))

    def params(self, units: Units, /, **changes: Any) -> dict[str, Any]:
        """`Packing.params`: defaults of the deck part where the law has none, and changes."""
        declared, usual = MODELS.get(self.name).parameters(units, changes), defaults(self.name)
        if unknown := sorted(changes.keys() - declared.keys()):
            known = ", ".join(self.arguments(changes))
            raise InputError(f"model {self.name} has no parameter {unknown[0]!r}: use {known}")
        given = {name: usual[name] for name, each in declared.items() if each.default is None and name in usual}
        check_params(self.name, units, declared, params := {**given, **changes})
        for name in changes:
            declared[name].check(name, changes[name], made=True)
        return params

    def check_stiffness(self, law: Mapping[str, Any], tolerance: float) -> None:
        """Refuse particles so stiff that rounding of their own forces exceeds a force; by default none."""

    # start ----------------------------------------------------------------------------------------------------------

    def check(self, recipe: Recipe) -> None:
        """Refuse a recipe from which these particles cannot start: its start, sizes, units and law."""
        self.check_start(recipe)
        diameters_of(recipe)
        self.params(units_of(recipe, "eps", MODELS.get(self.name).unit_names), **recipe.parameters)

    def check_start(self, recipe: Recipe) -> None:
        """Refuse a `start` that these particles do not take."""
        if not self.starts and recipe.start not in (None, usual_of_onset(recipe.model)["start"]):
            raise InputError(f"{named('start', recipe.start)}: start applies to droplets only; leave it out")

    def start(self, recipe: Recipe) -> Packing:
        """A loose random packing, from which a search for onset starts."""
        return self.place(recipe, numbers("onset")["phi_start"], diameters_of(recipe))

    def place(self, recipe: Recipe, phi: float, sizes: Array) -> Packing:
        """Place particles at random, turned at random, one after the other, each where it touches none before it; where
        there is hardly room for one it lies upon others.

        Args:
            recipe: of the packing, of which n, seed, law and units count.
            phi: nominal packing fraction.
            sizes: (n,) diameters.
        """
        check_number("phi", phi, 2.0)
        kind, random = MODELS.get(self.name), np.random.default_rng(recipe.seed)
        units = units_of(recipe, "eps", kind.unit_names)
        params = self.params(units, **recipe.parameters)
        usual = {name: each.default for name, each in kind.parameters(units, params).items()}
        shapes = _shapes(kind, sizes, {**usual, **params}) @ np.array([1, 1j])

        def placed(side: float, positions: Array) -> Packing:
            return Packing(Registered(self.name), np.diag([side, side]), positions.reshape(-1, 2), params, units, sizes)

        wide = float(np.sqrt(np.sum(sizes**2) / phi))
        loose = placed(wide, np.stack([shapes.real, shapes.imag], axis=-1))
        _check_area(loose)
        side = float(np.sqrt(loose.phi * loose.area / phi))
        return placed(side, _beside_each_other(shapes / side, sizes / side, random) * side)

    # search ---------------------------------------------------------------------------------------------------------

    def version_of(self, law: PairLaw) -> int:
        """Version of onsets with a law."""
        return self.version if law.springs else self.stiffening_version

    def find_onset(self, search: OnsetSearch, loose: Packing, step: float) -> tuple[SearchState, str]:
        """Onset above a loose packing by steps of phi that begin with `step`, and the method."""
        return search.by_bisection(loose, step), self.descent.name(search.session)


def _shapes(kind: Model[Packing], sizes: Array, params: Mapping[str, Any]) -> Array:
    """(n, sites, 2) of `State.shape`."""
    shapes = np.asarray(kind.shape(sizes, params), dtype=np.float64)
    if shapes.shape != (wanted := (len(sizes), kind.sites, 2)):
        raise InputError(f"model {kind.name}: `shape` returns {shapes.shape} for {wanted}: (particles, sites, 2)")
    return shapes


def _check_area(packing: Packing) -> None:
    """Refuse a `free_area` that is none, or not that which particles beside each other cover, as far as the model
    says how that is found. Positions of `packing`: each particle around the origin."""
    kind, n = packing.kind, packing.n
    area = kind.free_area(packing)
    if not (is_number(area) and area > 0):
        raise InputError(f"model {kind.name}: `free_area` returns {area!r:.60}: give one positive number")
    exact = kind.fraction_methods.get("exact")
    if kind.sites == 1 or exact is None:
        return
    step = packing.disk_diameters.max() + 2.1 * np.abs(packing.positions).max()
    apart = packing.positions + step * packing.particle[:, None] * [1, 0]
    row = packing.with_state(box=np.diag([n * step, step]), positions=apart)
    covered = exact(row) * row.area
    if abs(covered - area) > SAME_AREA * covered:
        raise InputError(
            f"model {kind.name}: `free_area` is {area:.9g}, but the disks of these {kind.particles} cover "
            f"{covered:.9g} where no two particles overlap; correct `free_area` or `shape`"
        )


def _beside_each_other(shapes: ComplexArray, sizes: Array, random: np.random.Generator) -> Array:
    """(n, sites, 2) positions in a box of side 1, shapes given as complex numbers."""
    found = np.empty_like(shapes)
    for k, shape in enumerate(shapes):
        reach = 0.5 * (sizes[:k, None, None] + sizes[k])
        for _ in range(_TRIES):
            x, y, turn = random.random(3)
            found[k] = x + 1j * y + shape * np.exp(2j * np.pi * turn)
            r = found[:k, :, None] - found[k]
            if (np.hypot(r.real - np.round(r.real), r.imag - np.round(r.imag)) >= reach).all():
                break
    return np.stack([found.real, found.imag], axis=-1)


def making_of(model: str) -> Making:
    """How packings of a model are made: as it is registered, else as `Making` says."""
    MODELS.get(model)  # refuses one that is unknown
    making = MAKINGS.get(model) if model in MAKINGS.names() else Making(model)
    if not isinstance(making, Making):
        raise InputError(f"making of the model {model!r} is {making!r}: give an object of a class derived from Making")
    return making
