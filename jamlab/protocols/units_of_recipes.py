"""Units of the packings that a recipe makes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from jamlab.arguments.choices import Units
from jamlab.errors import InputError, named
from jamlab.packing.recipe import Recipe


def units_of(recipe: Recipe, usual: Units, known: Iterable[Any]) -> Units:
    """Units that a recipe asks for; else the usual ones, or the first of those that its law has.

    Raises:
        InputError: units that its law does not have.
    """
    there: tuple[Units, ...] = tuple(known)
    if recipe.units is None:
        return usual if usual in there else there[0]
    if recipe.units not in there:
        law = f"law {recipe.parameters['law']!r}" if "law" in recipe.parameters else f"model {recipe.model}"
        raise InputError(f"{named('units', recipe.units)}: {law} has units {' or '.join(there)} only; leave it out")
    return recipe.units
