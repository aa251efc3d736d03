"""Models by their names: what `Packing.kind` looks up.

A packing holds the name of its model alone. The object of that name, a `jamlab.models.model.Model`, is an entry point
of the group `jamlab.models`, of jamlab or of another package.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from jamlab.errors import InputError
from jamlab.registry import Registry

if TYPE_CHECKING:  # models know packings, so packings know no models
    from jamlab.models.model import Model
    from jamlab.packing.law_parameters import Parameter


class UnitNames(NamedTuple):
    """Names of units, for labels."""

    length: str
    force: str
    stress: str


def _check(name: str, model: Model) -> None:
    if isinstance(model, type):
        raise InputError(f"model {name!r} is the class {model.__name__}: register one object of it")


MODELS: Registry[Model] = Registry("jamlab.models", "model", _check)


def optional_parameters(model: str) -> dict[str, Parameter]:
    """Parameters of a model's force law that have a default, by name: `jam`, `pack` and campaigns take these."""
    kind = MODELS.get(model)
    every = [parameter for units in kind.unit_names for parameter in kind.parameters(units).items()]
    return {name: each for name, each in every if each.default is not None}


def law_names(model: str, units: str) -> list[str]:
    """Names of the parameters of a force law that are the same for all particles."""
    return [name for name, each in MODELS.get(model).parameters(units).items() if not each.each]
