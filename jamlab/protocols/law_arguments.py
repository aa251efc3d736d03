"""Force-law parameters that functions take by name: only those that the law declares; any other is no argument."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import Parameter, signature
from typing import Any

from jamlab.errors import InputError
from jamlab.hints import unknown_argument
from jamlab.packing.kinds import MODELS
from jamlab.protocols.makings import making_of


def check_law_arguments(function: Callable[..., Any], model: str, given: Mapping[str, Any]) -> None:
    """Refuse what is neither an argument of a function nor a parameter that the law of its packing has to choose.

    Raises:
        ArgumentError: no such argument.
        InputError: a parameter that units fix, or that another model has.
    """
    law = making_of(model).arguments(given)
    for name, value in given.items():
        if name in law:
            continue
        where = f"{function.__name__}: {name} = {value!r}"
        if name in MODELS.get(model).unit_names:
            raise InputError(f"{where}: the strength of contacts and the mean diameter are always 1; leave it out")
        for other in MODELS.each().keys() - {model}:
            if name in making_of(other).arguments(given):
                raise InputError(f"{where}: it is a parameter of model {other}, and this packing has model {model}")
        own = [each.name for each in signature(function).parameters.values() if each.kind is not Parameter.VAR_KEYWORD]
        raise unknown_argument(function.__name__, name, [*own, *law])
