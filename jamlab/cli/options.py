"""Commands whose words and options are made from the table of arguments.

A command is a function whose parameters are lines of the table: those before `*` are words without a name, those after
it are options. Help, default, range and choices stand in the table, once for Python and shell. A parameter may also be
made by a function of options, such as a drag law of `--damping`: it is marked by `MadeBy`.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from inspect import Parameter, Signature, signature
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, NewType, Union, get_args, get_origin

import typer

from jamlab.arguments.argument import REQUIRED, Argument, FromDeck, InWords
from jamlab.arguments.table import argument
from jamlab.errors import InputError
from jamlab.hints import misspelt
from jamlab.storage.formats import FORMATS, check_ending


@dataclass(frozen=True)
class MadeBy:
    """Marks a parameter that a function makes of options: of its own parameters."""

    function: Callable[..., Any]
    metavar: str = ""  # how its option is written, where the table says it for other uses


@dataclass(frozen=True)
class Written:
    """Marks a file to write: its ending must belong to one of these formats."""

    kinds: tuple[str, ...]


# what stands for a value of 0 that a command does not take
_AT_ZERO = {
    **{(f"jamlab {name}", "rate"): "jamlab quasistatic-shear" for name in ("shear", "flow-curve")},
    ("jamlab relax-stress", "strain"): "jamlab stop-flow",
}


def command(*python: str, name: str = "") -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make a command of a function; its parameters become words and options, as the table has them.

    Args:
        python: public functions that it calls, whose defaults and ranges hold where the table has none for the command.
        name: its words, if they are others than the name of the function.

    Raises:
        KeyError: the table has no line of a parameter.
    """

    def make(function: Callable[..., None]) -> Callable[..., None]:
        place = f"jamlab {name or function.__name__.replace('_', '-')}"

        def call(**given: Any) -> None:
            _made(function, given)

        made = {each.name: _parameter(each, (place, *python), syntax) for each, syntax in _raw(function)}
        call.__name__, call.__doc__ = function.__name__, function.__doc__
        call.__signature__ = Signature([*made.values()])  # type: ignore[attr-defined]
        call.__annotations__ = {each.name: each.annotation for each in made.values()}
        call.python = python  # type: ignore[attr-defined]
        return call

    return make


def option(name: str, *places: str) -> Any:
    """An option of the table for a command that `command` does not make."""
    line = argument(name)
    return typer.Option(*_flags(line, places), help=_help(line, places, ()), show_default=False)


def _raw(function: Callable[..., Any], syntax: str = "") -> Iterator[tuple[Parameter, str]]:
    """Parameters that stand in the shell, each with how it is written if the table does not say it."""
    for each in signature(function).parameters.values():
        made = _mark(each, MadeBy)
        if made is None:
            yield each, syntax
        else:
            yield from _raw(made.function, made.metavar)


def _made(function: Callable[..., Any], given: dict[str, Any]) -> Any:
    """Call a function with what stands in the shell, and with what other functions make of it."""
    made = {each.name: (_mark(each, MadeBy), each.name) for each in signature(function).parameters.values()}
    return function(
        **{name: given[own] if by is None else _made(by.function, given) for name, (by, own) in made.items()}
    )


def _mark(parameter: Parameter, kind: type[Any]) -> Any:
    return next((each for each in getattr(parameter.annotation, "__metadata__", ()) if isinstance(each, kind)), None)


def _parameter(each: Parameter, places: tuple[str, ...], syntax: str) -> Parameter:
    """A parameter as typer takes it."""
    line, written = argument(each.name), _mark(each, Written)
    kinds = written.kinds if written else ()
    hint = each.annotation.__origin__ if written else _typed(each.annotation)
    default = line.default_at(*places)
    word = each.kind is not Parameter.KEYWORD_ONLY
    syntax = syntax or line.metavar or _choices(line, places) or (each.name.upper() if word else "")
    several = _several(hint)
    syntax = syntax or (f"<{several}>" if several else "")
    more: dict[str, Any] = {
        "help": _help(line, places, kinds, bool(several) and not word),
        "show_default": False,
        "metavar": syntax or None,
    }
    make: Any = typer.Argument if word else partial(typer.Option, *_flags(line, places))
    info = make(**more, callback=_check(line, places, kinds))
    if default is REQUIRED:
        default = Parameter.empty
    elif isinstance(default, FromDeck | InWords):
        default = None
    elif line.kind == "path" and isinstance(default, str):
        default = Path(default)
    elif isinstance(default, tuple):
        default = list(default) or None
    return Parameter(each.name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[hint, info])


def _typed(hint: Any) -> Any:
    """A type as typer takes it: choices are words, which the table and the function check."""
    parts = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if not any(get_origin(part) is Literal or isinstance(part, NewType) for part in parts):
        return hint
    return str | None if type(None) in parts else str


def _flags(line: Argument, places: tuple[str, ...]) -> list[str]:
    """The names of an option: of several values one at a time, of a flag that is set by default both."""
    name = f"--{line.each}" if line.each else line.option
    if line.kind == "flag" and line.default_at(*places) is not False:
        return [f"{name}/--no-{name[2:]}"]
    return [name, f"-{line.short}"] if line.short else [name]


def _choices(line: Argument, places: tuple[str, ...]) -> str:
    """Closed choices in braces; those of a registry are not asked for."""
    known = () if callable(line.choices) else line.choices_at(*places)
    return f"{{{','.join(known)}}}" if known else ""


def _several(hint: Any) -> str:
    """The name of the type of which a list is given, one value at a time; "" of other types."""
    lists = [part for part in (hint, *get_args(hint)) if get_origin(part) is list]
    return str(get_args(lists[0])[0].__name__) if lists else ""


def _help(line: Argument, places: tuple[str, ...], kinds: tuple[str, ...], several: bool = False) -> str:
    """The sentence of the table, with unit, endings, range and default; it names options."""
    default = _in_words(line.default_at(*places), line.unset_at(*places))
    endings = ", ".join(ending for kind in kinds for ending in FORMATS[kind][: 1 + 2 * (kind == "picture")])
    shown = f"default: {default}" if default else ""
    facts = [line.unit, "repeatable" * several, endings, _range(line, places), shown]
    told = "; ".join(fact for fact in facts if fact)
    text = re.sub(r"`(\w+)`", lambda found: argument(found[1]).option, line.text_at(*places).rstrip("."))
    return text + f" ({told})" * bool(told) + "."


def _in_words(default: Any, unset: str) -> str:
    """A default for a reader; "" of none, and of flags."""
    if default is None or isinstance(default, FromDeck):
        return unset
    if isinstance(default, tuple | list):
        return ", ".join(map(str, default)) or unset
    if isinstance(default, InWords):
        return default.text
    return "" if default is REQUIRED or isinstance(default, bool) else _short(default)


def _range(line: Argument, places: tuple[str, ...]) -> str:
    least, highest = line.limits_at(*places)
    first = "" if least is None else f"{'above ' * line.above}{_short(least)}"
    if highest is None:
        return first and (first if line.above else f"{first} or more")
    return f"{first} to {_short(highest)}" if first else f"at most {_short(highest)}"


def _short(value: Any) -> str:
    """A number as it is typed: 1e6, 1e-3."""
    if not isinstance(value, float | int):
        return str(value)
    if value == 0 or 0.01 <= abs(value) < 1e5:
        return f"{value:g}"
    digits, power = f"{value:.3e}".split("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(power)}"


def _check(line: Argument, places: tuple[str, ...], kinds: tuple[str, ...]) -> Callable[..., Any]:
    """The check of an option: of the ending of a file, of a number, or of a closed choice."""

    def check(param: typer.CallbackParam, given: Any) -> Any:
        flag = param.opts[0] if param.opts[0].startswith("-") else (param.name or "").upper()
        for value in given if isinstance(given, list | tuple) else [given]:
            if isinstance(value, Path) and kinds:
                check_ending(value, *kinds, option=flag)
            elif isinstance(value, float | int) and not isinstance(value, bool):
                _check_number(flag, value, line, places)
            elif isinstance(value, str) and _choices(line, places) and value not in line.choices_at(*places):
                near = misspelt(value, line.choices_at(*places))
                raise InputError(f"{flag} {value}: use {near or line.allowed(*places)}")
        return given

    return check


def _check_number(flag: str, value: float, line: Argument, places: tuple[str, ...]) -> None:
    if value == 0 and (other := _AT_ZERO.get((places[0], line.each or line.name))):
        raise InputError(f"{flag} {value}: use `{other}`")
    if not line.admits(value, *places):
        raise InputError(f"{flag} {value}: must be {line.allowed(*places) or 'a finite number'}")
