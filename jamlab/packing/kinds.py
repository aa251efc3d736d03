"""Registry of the models, in which `Packing.kind` looks up its name.

A packing holds the name of its model alone. The object of that name, a `jamlab.packing.model.Model`, is an entry point
of the group `jamlab.models`, of jamlab or of another package.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jamlab.errors import InputError
from jamlab.laws.parameter import Parameter
from jamlab.packing.bare_packing import P
from jamlab.packing.model import Model
from jamlab.registry import Registry


def _check(name: str, model: Model[Any]) -> None:
    if isinstance(model, type):
        raise InputError(f"model {name!r} is the class {model.__name__}: register one object of it")


MODELS: Registry[Model[Any]] = Registry("jamlab.models", "model", _check)


def kind_of(packing: P) -> Model[P]:
    """What depends on the model of a packing."""
    return MODELS.get(packing.model)


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
