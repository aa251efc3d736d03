"""The force law that functions make packings with: a name, or parameters that the law declares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jamlab.arguments.choices import Law
from jamlab.checks import name_meant
from jamlab.errors import InputError, typed
from jamlab.laws.laws import parameters_of
from jamlab.packing.kinds import MODELS, laws_of
from jamlab.protocols.makings import making_of


def law_given(law: Law | Mapping[str, Any] | None, model: str) -> dict[str, Any]:
    """Parameters of the force law of packings of a model.

    Raises:
        InputError: an unknown law, a parameter that it does not have, that units fix, or that another model has.
    """
    given = parameters_of(law, laws_of(model))
    known = making_of(model).arguments(given)
    for name, value in given.items():
        if name in known:
            continue
        where = _as_typed(name, value)
        if name in MODELS.get(model).unit_names:
            raise InputError(f"{where}: the strength of contacts and the mean diameter are always 1; leave it out")
        for other in MODELS.each().keys() - {model}:
            if name in making_of(other).arguments(given):
                if name == "law":
                    raise InputError(
                        f"{where}: a law of model {other}, and this packing has model {model}; "
                        f"use {', '.join(laws_of(model))}"
                    )
                raise InputError(f"{where}: {name} is a parameter of model {other}, and this packing has model {model}")
        own = f"law {given['law']!r}" if "law" in given else f"the force law of model {model}"
        use = name_meant(name, known, f"use {', '.join(known)}" if known else "leave it out")
        raise InputError(f"{where}: {own} has no parameter {name!r}; {use}")
    return given


def _as_typed(name: str, value: Any) -> str:
    """A parameter as the reader of a message has given it."""
    if name == "law":
        return typed(f"law = {value!r}", f"--law {value}")
    return typed(f"law[{name!r}] = {value!r}", f"--law {name}={value}")
