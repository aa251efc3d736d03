"""How a packing was made: all arguments of making in one object, from which the same bits are made again.

The list of making arguments stands here, once: `jamlab.jam`, `pack` and `scene` fill a recipe, the makings of models
read it, and `jamlab.make` follows it. A packing keeps its recipe in the provenance, with a hash of all that the packing
is: a packing that differs in one bit from what its recipe makes has none.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from typing import Any, Literal, Self, TypeVar

import numpy as np

from jamlab.arguments.choices import Ensemble, Law, ModelName, Search, Start, Units
from jamlab.arrays import Array
from jamlab.checks import checked, checked_class
from jamlab.errors import InputError, named
from jamlab.hints import Hinted, unknown_argument
from jamlab.laws.laws import parameters_of
from jamlab.packing.derived import frozen
from jamlab.packing.kinds import MODELS, laws_of

Protocol = Literal["onset", "pressure", "phi"]
RECIPE = "recipe"  # entry of a provenance
_HASH = "hash"  # of such an entry: of the packing that it belongs to
_TAKES = {"onset": ("search", "step", "start"), "pressure": ("pressure",), "phi": ("phi",)}  # by protocol


def usual_of_onset(model: str) -> Mapping[str, Any]:
    """Values of a recipe of onset that gives none. What has no outlines starts as disks."""
    return {"search": "bisection", "start": "direct" if MODELS.get(model).has_outlines else "from-disks"}


@checked_class
@dataclass(frozen=True, kw_only=True, repr=False)
class Recipe(Hinted):
    """All arguments that a packing was made with.

    `jamlab.make(recipe)` makes the packing again, bit by bit on the same machine with the same versions. To vary one
    argument use `dataclasses.replace(recipe, seed=2)`.

    Attributes:
        protocol: "onset" (`jamlab.jam`), "pressure" or "phi" (both `jamlab.pack`).
        n: number of particles.
        model: "sp", "dp", or the name of a model of another package.
        seed: of the random start.
        law: parameters of the force law that replace defaults, by name; given as a name or as parameters.
        sizes: distribution by its words, or n numbers; None: two sizes.
        size_ratio: diameter of large over that of small particles; None: 1.4.
        fraction_large: number of large particles over that of all.
        units: "eps" or "k"; None: eps at onset, k otherwise.
        ensemble: "fixed-box" or "shear-stabilized".
        force_tolerance: largest residual force; None: of the model.
        ranks: threads of each minimisation.
        pressure: of the protocol "pressure".
        phi: nominal packing fraction, of the protocol "phi".
        search, step, start: of the protocol "onset", see `jamlab.jam`.
        changes: what was done afterwards, in order: each (name of a function, its arguments). `compress` has `state`,
            the number of the state in the sweep, -1 for the last.

    Raises:
        InputError: a value of a wrong type, an argument that the protocol does not have, or one that it lacks.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> p.recipe
        Recipe(protocol='pressure', n=32, seed=1, pressure=0.01)
        >>> jamlab.make(p.recipe) == p
        True
        >>> from dataclasses import replace
        >>> jamlab.make(replace(p.recipe, seed=2)) == jamlab.pack(n=32, pressure=1e-2, seed=2)
        True
    """

    protocol: Protocol
    n: int
    model: ModelName = "sp"
    seed: int = 1
    law: Law | None = None
    sizes: str | Sequence[float] | Array | None = None
    size_ratio: float | None = None
    fraction_large: float = 0.5
    units: Units | None = None
    ensemble: Ensemble = "fixed-box"
    force_tolerance: float | None = None
    ranks: int = 1
    pressure: float | None = None
    phi: float | None = None
    search: Search | None = None
    step: float | None = None
    start: Start | None = None
    changes: Sequence[Any] = ()

    def __post_init__(self) -> None:
        usual = usual_of_onset(self.model)
        for name in (name for takes in _TAKES.values() for name in takes):
            value = getattr(self, name)
            if name not in _TAKES[self.protocol]:
                if value is not None:
                    raise InputError(f"{name} = {value!r}: the protocol {self.protocol!r} has none; give None")
            elif value is None and name == self.protocol:
                raise InputError(f"{name}: give it for the protocol {self.protocol!r}")
            elif value is None and name in usual:
                self._set(name, usual[name])
        if self.protocol != "onset" and self.model != "sp":
            raise InputError(
                f"{named('model', self.model)}: "
                "a packing at a pressure or phi is made of disks, sp; compress one from onset"
            )
        self._set("law", frozen(_plain(parameters_of(self.law, laws_of(self.model)))))
        sizes = _plain(self.sizes)
        self._set("sizes", tuple(sizes) if isinstance(sizes, list) else sizes)
        self._set("changes", tuple(map(_change, self.changes)))

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def __hash__(self) -> int:
        return hash((self.protocol, self.model, self.n, self.seed))  # 1 and 1.0 are one size

    def __repr__(self) -> str:
        said = (f"{name}={value!r}" for name, value in self._given().items())
        return f"Recipe({', '.join(said)})"

    def _given(self) -> dict[str, Any]:
        """Values that differ from the usual ones; seed always."""
        usual = {each.name: each.default for each in fields(self)} | {"law": {}}
        usual |= usual_of_onset(self.model) if self.protocol == "onset" else {}
        return {
            each.name: value
            for each in fields(self)
            if (value := getattr(self, each.name)) != usual[each.name] or each.name == "seed"
        }

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Parameters of the force law that replace defaults."""
        return self.law if isinstance(self.law, Mapping) else {}

    def entry(self) -> dict[str, Any]:
        """Its values that are not None, as JSON holds them."""
        return {each.name: value for each in fields(self) if (value := _plain(getattr(self, each.name))) is not None}

    def to_json(self) -> str:
        """The recipe as JSON."""
        return json.dumps(self.entry(), sort_keys=True)

    @classmethod
    @checked
    def from_json(cls, text: str) -> Self:
        """A recipe from its JSON.

        Raises:
            InputError: text that is no recipe.

        Example:
            >>> recipe = jamlab.pack(n=16, phi=0.8, seed=1).recipe
            >>> jamlab.Recipe.from_json(recipe.to_json()) == recipe
            True
        """
        try:
            entry = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{text[:60]!r} is no recipe: {error}") from None
        if not isinstance(entry, dict):
            raise InputError(f"{text[:60]!r} is no recipe: give a JSON object of its arguments")
        known = {each.name: each.default is MISSING for each in fields(cls)}
        if lacking := [name for name, needed in known.items() if needed and name not in entry]:
            raise InputError(f"{text[:60]!r} is no recipe: it lacks {' and '.join(lacking)}")
        if unknown := [name for name in entry if name not in known]:
            raise unknown_argument(cls.__name__, unknown[0], known)
        return cls(**entry)

    def then(self, name: str, /, **arguments: Any) -> Recipe:
        """The recipe with one more change at its end; arguments that are None are left out."""
        return replace(self, changes=(*self.changes, (name, arguments)))


def _plain(value: Any) -> Any:
    """A value as JSON holds it."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value


def _change(change: Any) -> tuple[str, Mapping[str, Any]]:
    if not (isinstance(change, list | tuple) and len(change) == 2):
        raise InputError(f"changes: {change!r:.80} is no pair (name of a function, its arguments)")
    name, arguments = change
    if not (isinstance(name, str) and isinstance(arguments, Mapping)):
        raise InputError(f"changes: {change!r:.80} is no pair (name of a function, its arguments)")
    return name, frozen({key: value for key, value in _plain(arguments).items() if value is not None})


# of a packing ---------------------------------------------------------------------------------------------------------


class Made:
    """What has a recipe: a packing; see `jamlab.packing.packing.Packing`."""

    provenance: dict[str, Any]

    @property
    def recipe(self) -> Recipe:
        """How it was made: `jamlab.make(packing.recipe)` makes the same bits again.

        Raises:
            InputError: it was not made by jam, pack or scene, or it was changed since by something else than the
                changes that `jamlab.make` repeats.

        Example:
            >>> jamlab.relax(jamlab.pack(n=16, pressure=1e-2, seed=1)).recipe.changes
            (('relax', {}),)
        """
        recipe = recipe_of(self)
        if recipe is None:
            raise InputError(
                "this packing has no recipe: it was not made by jam, pack or scene, or it was changed afterwards, by "
                "with_state, a Session, a flow or a file of fewer digits; `provenance` says where it comes from"
            )
        return recipe


M = TypeVar("M", bound=Made)


def recipe_of(packing: Made) -> Recipe | None:
    """The recipe of a packing, if it has one and is what that makes."""
    entry = packing.provenance.get(RECIPE)
    if not isinstance(entry, Mapping) or entry.get(_HASH) != _digest(packing):
        return None
    return Recipe(**{name: value for name, value in entry.items() if name != _HASH})


def made_by(packing: M, recipe: Recipe | None) -> M:
    """The packing with a recipe; None: without one."""
    history = {name: value for name, value in packing.provenance.items() if name != RECIPE}
    if recipe is not None:
        history[RECIPE] = {**recipe.entry(), _HASH: _digest(packing)}
    made: M = packing._trusted(provenance=history)  # type: ignore[attr-defined]  # Packing is declared above
    return made


def changed(given: Made, made: M, name: str, /, **arguments: Any) -> M:
    """A packing that a function made of a given one, with the recipe of that and one change more."""
    recipe = recipe_of(given)
    return made_by(made, None if recipe is None else recipe.then(name, **arguments))


def _digest(packing: Any) -> str:
    """Hash of all that a packing is, without its provenance."""
    found = hashlib.blake2b(digest_size=12)
    for each in fields(packing):
        if each.init and each.name != "provenance":
            found.update(each.name.encode())
            _feed(found, getattr(packing, each.name))
    return found.hexdigest()


def _feed(found: Any, value: Any) -> None:
    if isinstance(value, Mapping):
        for name in sorted(value):
            found.update(name.encode())
            _feed(found, value[name])
    elif isinstance(value, np.ndarray):
        found.update(str(value.shape).encode())
        found.update(np.ascontiguousarray(value, dtype=np.float64).tobytes())
    elif isinstance(value, bool | int | float | np.generic):
        found.update(repr(float(value)).encode())
    else:
        found.update(repr(value).encode())
