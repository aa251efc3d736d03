"""Where arguments stand: in public functions, commands, campaign files and decks, with default, range and choices
there."""

import inspect
import re
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import annotated_types
import typer
from pydantic import BaseModel

import jamlab
from jamlab import checks, results
from jamlab.arguments.argument import REQUIRED, FromDeck
from jamlab.campaign.file import CampaignTable, SeedRange, SweepTable
from jamlab.campaign.observable import LogGrid
from jamlab.campaign.tables import TABLE_COLUMNS
from jamlab.cli.main import app
from jamlab.engine.deck_defaults import LIMITS, defaults, settings
from jamlab.installed_files import installed
from jamlab.packing.kinds import MODELS
from jamlab.protocols.makings import making_of
from jamlab.registry import Registry
from jamlab.rheology.drag_law import DRAGS

FUNCTION, COMMAND, KEY, DECK, COLUMN = "function", "command", "key", "deck", "column"
# what options say of the command itself
OF_THE_SHELL = {"help", "version", "install_completion", "show_completion"}


class Stand(NamedTuple):
    """One argument in one place."""

    name: str
    form: str
    place: str  # as in the table of arguments
    default: Any = REQUIRED
    limits: tuple[float | None, float | None] | None = None  # None: not said there
    choices: tuple[str, ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Places of which the table may say something, the nearest first."""
        if self.form == COMMAND:
            words = self.place.split()[1:]
            function = f"Campaign.{words[1]}" if len(words) > 1 else words[0].replace("-", "_")
            return self.place, function
        if self.form == KEY:
            return self.place, "sweep"
        return (self.place, "deck") if self.form == DECK else (self.place,)


def stands() -> list[Stand]:
    """Every argument of every place."""
    return [*of_functions(), *of_commands(), *of_keys(), *of_decks()]


def of_functions() -> Iterator[Stand]:
    """Arguments of public functions, of what is made by its class, and of methods."""
    for name, thing in public_things():
        if inspect.isclass(thing):
            if name in jamlab.__all__ and hasattr(thing.__init__, "__wrapped__"):
                yield from _of_function(name, thing.__init__)
            for method, function in vars(thing).items():
                if method[0] != "_" and inspect.isfunction(plain := getattr(function, "__func__", function)):
                    yield from _of_function(f"{name}.{method}", plain)
        else:
            yield from _of_function(name, thing)


def public_things() -> Iterator[tuple[str, Any]]:
    """Public functions and classes, and classes of jamlab that these are derived from, by name."""
    found = {name: getattr(jamlab, name) for name in jamlab.__all__}
    found |= {name: getattr(results, name) for name in results.__all__}
    for thing in list(found.values()):
        parents = thing.__mro__ if inspect.isclass(thing) else ()
        found |= {each.__name__: each for each in parents if each.__module__.startswith("jamlab")}
    for name, thing in sorted(found.items()):
        if inspect.isfunction(thing) or (inspect.isclass(thing) and thing.__module__.startswith("jamlab")):
            yield name, thing


def _of_function(place: str, function: Any) -> Iterator[Stand]:
    hints = checks._hints(function) if hasattr(function, "__wrapped__") else {}
    for name, each in inspect.signature(function).parameters.items():
        if name not in ("self", "cls") and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD):
            default = REQUIRED if each.default is each.empty else each.default
            default = {} if repr(default) == "<factory>" else default  # of a dataclass
            yield Stand(name, FUNCTION, place, default, None, literals(hints.get(name)))


def literals(hint: Any) -> tuple[str, ...]:
    """Texts of an annotation."""
    if typing.get_origin(hint) is typing.Literal:
        return typing.get_args(hint)
    return tuple(text for part in typing.get_args(hint) for text in literals(part))


def of_commands() -> Iterator[Stand]:
    """Options of commands."""
    for place, command in commands(typer.main.get_command(app), "jamlab"):
        for each in command.params:
            if each.name not in OF_THE_SHELL:
                default = REQUIRED if each.required else each.default() if callable(each.default) else each.default
                yield Stand(each.name, COMMAND, place, str(default) if isinstance(default, Path) else default)


def commands(group: Any, place: str) -> Iterator[tuple[str, Any]]:
    """Commands by their words."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, f"{place} {name}")
        else:
            yield f"{place} {name}", command


def of_keys() -> Iterator[Stand]:
    """Keys of campaign files."""
    yield from _of_table("campaign", CampaignTable)
    yield from _of_table("sweep", SweepTable)
    yield from _of_table("sweep.seeds", SeedRange)
    yield from _of_table("sweep.omega", LogGrid)


def _of_table(place: str, table: type[BaseModel]) -> Iterator[Stand]:
    for name, each in table.model_fields.items():
        if (place, name) == ("sweep.damping", "others"):  # stands for laws, whose own names are the keys
            continue
        default = REQUIRED if each.is_required() else each.get_default(call_default_factory=True, validated_data={})
        default = default.model_dump() if isinstance(default, BaseModel) else default
        kinds = [*each.metadata, *_parts(each.annotation)]
        least = [kind.ge if hasattr(kind, "ge") else kind.gt for kind in kinds if _is_bound(kind, "ge", "gt")]
        highest = [kind.le if hasattr(kind, "le") else kind.lt for kind in kinds if _is_bound(kind, "le", "lt")]
        limits = (min(least, default=None), max(highest, default=None)) if least or highest else None
        yield Stand(name, KEY, place, default, limits, literals(each.annotation))
        for inner in kinds:
            if inspect.isclass(inner) and issubclass(inner, BaseModel) and place != "campaign":
                yield from _of_table(f"{place}.{name}", inner)


def _parts(hint: Any) -> Iterator[Any]:
    """All that an annotation is made of."""
    yield hint
    for part in (*typing.get_args(hint), *getattr(hint, "__metadata__", ())):
        if hasattr(part, "metadata"):  # of pydantic
            yield from part.metadata
        yield from _parts(part)


def _is_bound(kind: Any, *names: str) -> bool:
    bounds = (annotated_types.Ge, annotated_types.Gt, annotated_types.Le, annotated_types.Lt)
    return isinstance(kind, bounds) and any(hasattr(kind, name) for name in names)


def of_decks() -> Iterator[Stand]:
    """Variables of decks."""
    folder = installed("lammps_inputs")
    for path in sorted(folder.glob("in.*")):
        limits = settings(folder, path.name, what=LIMITS)
        for name, text in settings(folder, path.name).items():
            interval = re.match(r"[\[(](\S+), (\S+)\]", limits.get(name, ""))
            choices = () if interval or name not in limits else tuple(limits[name].split(" | "))
            numbers = (float(interval[1]), float(interval[2])) if interval else None
            yield Stand(name, DECK, path.name, _value(text), numbers, choices)


def _value(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def columns() -> dict[str, list[str]]:
    """Columns of tables of campaigns, each with the tables that have it."""
    found: dict[str, list[str]] = {}
    for table, names in TABLE_COLUMNS.items():
        for name in names:
            found.setdefault(name, []).append(table)
    return found


def own(registry: Registry[Any]) -> list[str]:
    """Names of a registry whose objects are jamlab's own: other packages have pages of theirs."""
    return [name for name in registry.names() if registry.get(name).__module__.startswith("jamlab.")]


def declared() -> dict[str, list[str]]:
    """Parameters of force laws, of makings of their particles and of drag laws, each with the laws that have it."""
    found: dict[str, list[str]] = {}
    for model in own(MODELS):
        for name in [*MODELS.get(model).parameters(None, {}), *making_of(model).arguments({}), *defaults(model)]:
            found.setdefault(name, []).append(model)
    for law in own(DRAGS):
        for name in DRAGS.get(law).parameters():
            found.setdefault(name, []).append(law)
    return found


def of_deck(default: FromDeck) -> Any:
    """The value that a default stands for."""
    return defaults(default.section)[default.name]
