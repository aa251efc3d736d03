"""The page "Arguments" of the reference: every argument once, with where it stands, and the parameters of laws. It is
made when the documentation is built."""

import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from argument_places import COMMAND, DECK, FUNCTION, KEY, Stand, columns, of_deck, own, stands

from jamlab.arguments.argument import REQUIRED, Argument, FromDeck, InWords
from jamlab.arguments.decks import DECKS
from jamlab.arguments.table import SUBJECTS
from jamlab.campaign.observable import LARGEST_NUMBER
from jamlab.engine.deck_defaults import defaults
from jamlab.laws.laws import LAWS
from jamlab.laws.parameter import Parameter
from jamlab.packing.kinds import MODELS
from jamlab.rheology.drag_law import DRAGS, DragParameter

MOST = 4  # places of one sort that a row lists

HEAD = """# Arguments

This page lists every argument once. An argument has one name in Python, in the shell (`--` in front, `-` for `_`), in
[campaign files](campaign_files.md), in tables and in [decks](decks.md). Places with other values follow the usual
values. [Docstrings](python/index.rst) give types and shapes, and what each function does with an argument.
"""


def page() -> str:
    """The whole page."""
    places: dict[str, list[Stand]] = {}
    for each in stands():
        places.setdefault(each.name, []).append(each)
    tables = columns()
    parts = [HEAD]
    for subject, lines in SUBJECTS.items():
        rows = [_row(line, places.get(line.name, []), tables.get(line.name, [])) for line in lines]
        parts.append(f"## {subject}\n\n{table(('argument', 'values', 'where'), rows)}")
    rows = list(_of_force_laws())
    parts.append(
        "## Parameters of force laws\n\nThe argument `law` takes them by name, the shell as `--law NAME=VALUE`. Units "
        f"are those of energy (ε) and length (l).\n\n{table(('parameter', 'what it is', 'values', 'of'), rows)}"
    )
    rows = list(_of_drag_laws())
    parts.append(
        "## Parameters of drag laws\n\nClasses such as `jamlab.ContactDamping` take them by name, the shell as "
        f"`--damping NAME=VALUE`.\n\n{table(('parameter', 'what it is', 'values', 'of'), rows)}"
    )
    return written("\n".join(parts))


def written(text: str) -> str:
    """Symbols and public names of plain sentences, as pages write them."""
    for plain, symbol in (("tau_1", "τ₁"), ("eta_f ", r"$\eta_F$ "), ("k_B T", "$k_B T$"), ("φ_J", r"$\phi_J$")):
        text = text.replace(plain, symbol)
    return re.sub(r"(?<![`\w.])jamlab\.(?=[a-z])\w+", r"`\g<0>`", text)


def table(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table of Markdown."""
    cells = [heading, ("---",) * len(heading), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |\n" for row in cells)


def _row(line: Argument, where: list[Stand], tables: list[str]) -> tuple[str, ...]:
    name = f"`{line.name}`" + (f" {line.symbol}" if line.symbol else "")
    text = line.text + (f" Unit: {line.unit}." if line.unit else "")
    return f"{name}<br>{text}", "<br>".join(_values(line, where)), "<br>".join(_places(line, where, tables))


# values ---------------------------------------------------------------------------------------------------------------


def _values(line: Argument, where: list[Stand]) -> Iterator[str]:
    """Range or choices, and default; then those of places that differ."""
    if line in DECKS:
        yield from _of_decks(where)
        return
    if usual := range_at(line):
        yield usual
    yield default_of(line.default, line.unset)
    yield from _others(line, where)


def _of_decks(where: list[Stand]) -> Iterator[str]:
    """What the decks say of their own numbers, those with the same together."""
    alike: dict[str, list[str]] = {}
    for each in where:
        low, high = each.limits or (None, None)
        said = " or ".join(f"`{choice}`" for choice in each.choices) or ("" if low is None else f"{low:g} to {high:g}")
        text = f"`{each.default}`" if isinstance(each.default, str) else f"{each.default:g}"
        alike.setdefault(", ".join(filter(None, [said, f"default {text}"])), []).append(_name(each.place))
    for words, names in alike.items():
        yield words if len(alike) == 1 else f"{_listed(names)}: {words}"


def _others(line: Argument, where: list[Stand]) -> Iterator[str]:
    """What is said of single places, those of which the same is said together."""
    there = {place for each in where for place in each.places}
    alike: dict[str, list[str]] = {}
    for place in dict.fromkeys((*line.otherwise, *line.limits_otherwise, *line.choices_otherwise)):
        said = [range_at(line, place)] if place in {**line.limits_otherwise, **line.choices_otherwise} else []
        if place in line.otherwise:
            said.append(default_of(line.otherwise[place], line.unset_at(place)))
        if place in there and (words := ", ".join(filter(None, said))):
            alike.setdefault(words, []).append(_name(place))
    for words, names in alike.items():
        yield f"{_listed(names)}: {words}"


def range_at(line: Argument, *places: str) -> str:
    """Limits or choices; "" where there are none."""
    if known := line.choices_at(*places):
        return " or ".join(f"`{each}`" for each in known)
    least, highest = line.limits_at(*places)
    if least is None and highest is None:
        return ""
    number = "whole, " if line.kind == "integer" else ""
    above = "above " if line.above else ""
    if highest is None or highest >= LARGEST_NUMBER:
        return f"{number}{above}{least:g}" + ("" if line.above else " or more")
    return f"{number}{above}{least:g} to {highest:g}" if least is not None else f"{number}at most {highest:g}"


def default_of(value: Any, unset: str) -> str:
    """A default in words."""
    if value is REQUIRED:
        return "required"
    if isinstance(value, InWords):
        return f"default: {value.text}"
    if isinstance(value, FromDeck):
        return f"default {of_deck(value):g}"
    if value is None:
        return f"default: {unset}" if unset else "default: none"
    if isinstance(value, bool):
        return f"default {'on' if value else 'off'}"
    if isinstance(value, str):
        return f"default `{value}`" if value != "" else "default: no words"
    if isinstance(value, int | float):
        return "default ∞" if value == np.inf else f"default {value:g}"
    return f"default `{value}`" if value else "default: none"


# places ---------------------------------------------------------------------------------------------------------------


def _places(line: Argument, where: list[Stand], tables: list[str]) -> Iterator[str]:
    """Functions, commands, keys of campaign files, decks and tables that have the argument."""
    found = {form: list(dict.fromkeys(each.place for each in where if each.form == form))
             for form in (FUNCTION, COMMAND, KEY, DECK)}  # fmt: skip
    if found[FUNCTION]:
        yield f"Python: {_listed(map(_name, found[FUNCTION]))}"
    if found[COMMAND]:
        option = "" if line.name in _WORDS else f"`--{(line.each or line.name).replace('_', '-')}` of "
        words = [place.removeprefix("jamlab ") for place in found[COMMAND]]
        yield f"shell: {option}{_listed(f'`{each}`' for each in words)}"
    if found[KEY]:
        yield f"campaign file: {_listed(map(_name, found[KEY]))}"
    if found[DECK]:
        yield f"decks: {_listed(f'`{place}`' for place in found[DECK])}"
    if tables:
        yield f"column of {_listed(f'`{each}`' for each in tables)}"


_WORDS = {"file", "files", "target", "campaign", "quantity"}  # what a command takes without an option


def _name(place: str) -> str:
    return "decks" if place == "deck" else f"`{place}`"


def _listed(names: Iterable[str]) -> str:
    listed = list(names)
    if len(listed) > MOST + 1:
        return f"{', '.join(listed[:MOST])} and {len(listed) - MOST} more"
    return ", ".join(listed)


# parameters of laws ---------------------------------------------------------------------------------------------------


def _of_force_laws() -> Iterator[tuple[str, ...]]:
    """Each parameter once, with the models or laws that have it."""
    found: dict[str, list[tuple[str, Parameter, Any]]] = {}
    for model in own(MODELS):
        usual = defaults(model)
        for name, each in MODELS.get(model).parameters(None, {}).items():
            found.setdefault(name, []).append((model, each, usual.get(name, each.default)))
    for name, each in found.items():
        alike: dict[str, list[str]] = {}
        for model, parameter, default in each:
            alike.setdefault(_of_parameter(parameter, default), []).append(f"`{model}`")
        values = [f"{', '.join(models)}: {words}" if len(alike) > 1 else words for words, models in alike.items()]
        first = each[0][1]
        text = first.meaning + (f" ({unit})" if (unit := _unit(first)) else "")
        laws = [f"`{law}`" for law in own(LAWS) if name in LAWS.get(law).parameters]
        yield f"`{name}`", text, "<br>".join(values), ", ".join([*(f"`{model}`" for model, *_ in each), *laws])


def _of_parameter(parameter: Parameter, default: Any) -> str:
    if parameter.choices:
        return " or ".join(f"`{each}`" for each in parameter.choices) + f", default `{default}`"
    if parameter.each:
        return "one for each particle"
    least, largest = parameter.limits
    return f"{least:g} to {largest:g}, default {default:g}"


def _unit(parameter: Parameter) -> str:
    powers = [("ε", parameter.energy), ("l", parameter.length)]
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    return " ".join(name + ("" if power == 1 else f"{power}".translate(raised)) for name, power in powers if power)


def _of_drag_laws() -> Iterator[tuple[str, ...]]:
    found: dict[str, list[tuple[str, DragParameter, Any]]] = {}
    for law in own(DRAGS):
        for name, each in DRAGS.get(law).parameters().items():
            found.setdefault(name, []).append((law, each, getattr(DRAGS.get(law)(), name)))
    for name, each in found.items():
        meaning, (_, first, default) = " or ".join(dict.fromkeys(p.meaning for _, p, _ in each)), each[0]
        if first.choices:
            values = " or ".join(f"`{choice}`" for choice in first.choices) + f", default `{default}`"
        else:
            values = f"{_limits(first)}, default {default:g}"
        yield f"`{name}`", meaning, values, ", ".join(f"`{law}`" for law, *_ in each)


def _limits(parameter: DragParameter) -> str:
    if parameter.positive:
        return "above 0"
    return (
        f"{parameter.least:g} or more"
        if np.isinf(parameter.largest)
        else f"{parameter.least:g} to {parameter.largest:g}"
    )
