"""Models by their names: what `Packing.kind` looks up.

A packing holds the name of its model alone. The object of that name, a `jamlab.models.model.Model`, is an entry point
of the group `jamlab.models`, of jamlab or of another package.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from jamlab.errors import InputError
from jamlab.registry import Registry

if TYPE_CHECKING:  # models know packings, so packings know no models
    from jamlab.laws.parameter import Parameter
    from jamlab.models.model import Model


class UnitNames(NamedTuple):
    """Names of units, for labels."""

    length: str
    force: str
    stress: str


def _check(name: str, model: Model) -> None:
    if isinstance(model, type):
        raise InputError(f"model {name!r} is the class {model.__name__}: register one object of it")


MODELS: Registry[Model] = Registry("jamlab.models", "model", _check)


def model_named(word: str) -> str:
    """The name of the model that a user's word means, such as that of soft disks for "disks"; another word as it is."""
    small = word.lower()
    if small in MODELS.names():
        return small
    return next((name for name, kind in MODELS.each().items() if small in kind.words), word)


def optional_parameters(model: str, params: Mapping[str, Any] | None = None) -> dict[str, Parameter]:
    """Parameters with a default of the force law of a model that some parameters name, by name: `jam`, `pack` and
    campaigns take these."""
    every = MODELS.get(model).parameters(None, params or {})
    return {name: each for name, each in every.items() if each.default is not None}


def law_names(model: str, units: str, params: Mapping[str, Any]) -> list[str]:
    """Names of the parameters that are the same for all particles, of the force law that some parameters name."""
    return [name for name, each in MODELS.get(model).parameters(units, params).items() if not each.each]
