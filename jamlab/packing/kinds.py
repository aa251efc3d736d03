"""Registry of the models, in which `Packing.kind` looks up its name.

A packing holds the name of its model alone. The object of that name, a `jamlab.packing.model.Model`, is an entry point
of the group `jamlab.models`, of jamlab or of another package.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jamlab.errors import InputError
from jamlab.laws.laws import LAWS, NAMED
from jamlab.laws.parameter import Parameter
from jamlab.packing.bare_packing import P
from jamlab.packing.model import Model
from jamlab.registry import Registry


def _check(name: str, model: Model[Any]) -> None:
    if isinstance(model, type):
        raise InputError(f"model {name!r} is the class {model.__name__}: register one object of it")


class Models(Registry[Model[Any]]):
    """Models by name."""

    def _unknown(self, name: object) -> str:
        word = name.lower() if isinstance(name, str) else ""
        own = next((own for own, kind in self.each().items() if word in (own, *kind.words)), None)
        return f"unknown model {name!r}: use {own!r}" if own else super()._unknown(name)


MODELS = Models("jamlab.models", "model", _check)


def kind_of(packing: P) -> Model[P]:
    """What depends on the model of a packing."""
    return MODELS.get(packing.model)


def optional_parameters(model: str, params: Mapping[str, Any] | None = None) -> dict[str, Parameter]:
    """Parameters with a default of the force law of a model that some parameters name, by name: `jam`, `pack` and
    campaigns take these."""
    every = MODELS.get(model).parameters(None, params or {})
    return {name: each for name, each in every.items() if each.default is not None}


def laws_of(model: str) -> list[str]:
    """Names of the force laws that packings of a model may have."""
    kind = MODELS.get(model)
    usual = kind.parameters(None, {})
    named = [name for name, parameters in NAMED.items() if parameters.keys() <= usual.keys()]
    return named + [name for name in LAWS.names() if "law" in kind.parameters(None, {"law": name})]


def law_names(model: str, units: str, params: Mapping[str, Any]) -> list[str]:
    """Names of the parameters that are the same for all particles, of the force law that some parameters name."""
    return [name for name, each in MODELS.get(model).parameters(units, params).items() if not each.each]
