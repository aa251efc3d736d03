"""The models by their names; a third model is a third file and a line here."""

from jamlab.models.disks import Disks
from jamlab.models.droplets import Droplets
from jamlab.packing.law_parameters import Parameter
from jamlab.packing.packing import Model

MODELS: dict[str, Model] = {model.name: model for model in (Disks(), Droplets())}


def optional_parameters(model: str) -> dict[str, Parameter]:
    """Parameters of a model's force law that have a default, by name: `jam`, `pack` and campaigns take these."""
    kind = MODELS[model]
    every = [parameter for units in kind.unit_names for parameter in kind.parameters(units).items()]
    return {name: each for name, each in every if each.default is not None}


def law_names(model: str, units: str) -> list[str]:
    """Names of the parameters of a force law that are the same for all particles."""
    return [name for name, each in MODELS[model].parameters(units).items() if not each.each]
