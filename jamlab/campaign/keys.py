"""Ranges, defaults and sentences of keys of campaign files, from the table of arguments."""

from typing import Any

from pydantic import Field

from jamlab.arguments.argument import REQUIRED, FromDeck
from jamlab.arguments.table import argument
from jamlab.engine.deck_defaults import defaults


def within(name: str, *places: str) -> Any:
    """Range of a number, for `Annotated`, at the first of the places where it differs."""
    each = argument(name)
    least, highest = each.limits_at(*places)
    above, least = (least, None) if each.above else (None, least)
    return Field(gt=above, ge=least, le=highest, description=each.text)


def highest(name: str, *places: str) -> int:
    """Highest value at the first of the places where it differs."""
    _, value = argument(name).limits_at(*places)
    if value is None:
        raise KeyError(f"argument {name} has no highest value")
    return int(value)


def usual(name: str, *places: str) -> Any:
    """Default at the first of the places where it differs; of a deck its value there."""
    default = argument(name).default_at(*places)
    if default is REQUIRED:
        raise KeyError(f"argument {name} has no default at {', '.join(places)}")
    if isinstance(default, FromDeck):
        return int(value) if float(value := defaults(default.section)[default.name]).is_integer() else float(value)
    return default
