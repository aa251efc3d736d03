"""What arguments must be: refused by name, value and remedy before any work begins."""

import functools
import inspect
import os
import reprlib
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jamlab.arguments.table import ARGUMENTS
from jamlab.arrays import Array, ArrayLike, Holds
from jamlab.errors import InputError, named
from jamlab.hints import instead_of, meant, misspelt, unknown_argument
from jamlab.processes.progress import ProgressLine
from jamlab.type_variables import P, R, T


class _Kind(NamedTuple):
    """What an argument must be."""

    holds: Callable[[Any], bool]  # whether a value is that
    text: str  # the same for a message
    classes: tuple[str, ...] = ()  # names of the classes among it
    choices: tuple[str, ...] = ()  # texts that are that, where not every text is
    besides: str = ""  # what it may be besides those texts


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Refuse arguments whose types differ from the annotations of a function; for public functions and methods.

    Whole numbers and numbers include numpy scalars and arrays without dimensions, which are handed on as numbers of
    Python, but no truth values; 2.0 is no whole number, text is no sequence, and an int beyond 64 bits is no number,
    since numpy makes an object of it. Nothing else is converted. A call takes 1.5 to 3 us longer. `checked_class` does
    the same for what a class is made from.
    """

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if kwargs.get("progress") is True:
            kwargs["progress"] = ProgressLine()
        args, kwargs = _plain_arguments(function, args, kwargs)  # type: ignore[assignment]  # P names none
        return function(*args, **kwargs)  # which refuses too few and too many

    return call


def check_arguments(function: Callable[..., Any], arguments: Mapping[str, Any]) -> None:
    """Refuse arguments of a public function, by name, that it would refuse by their types and ranges."""
    _plain_arguments(inspect.unwrap(function), (), arguments)


def _plain_arguments(
    function: Callable[..., Any], args: tuple[Any, ...], kwargs: Mapping[str, Any]
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Arguments with plain numbers, all of them what the function takes."""
    known = _arguments(function)
    if not kwargs.keys() <= known.kinds.keys():
        _refuse_unknown(function, known, args, kwargs)
    args = tuple(map(as_plain, args))
    kwargs = {name: as_plain(value) for name, value in kwargs.items()}
    for name, value in [*zip(known.places, args, strict=False), *kwargs.items()]:
        kind = known.kinds.get(name, known.others or _ANYTHING)
        if not kind.holds(value):
            raise _refusal(function, name, kind, value)
        if name in known.numbers and isinstance(value, int | float) and not isinstance(value, bool):
            least, highest = known.numbers[name]
            if not least < value < highest:
                check_range(name, value, known.where)
    for value in args[len(known.places) :] if known.rest else ():
        if not known.further.holds(value):
            raise _refusal(function, str(known.rest), known.further, value)
    return args, kwargs


def _refuse_unknown(function: Callable[..., Any], known: "_Arguments", args: Any, kwargs: Mapping[str, Any]) -> None:
    """Refuse the first argument without a place; a function that takes any name checks those itself, once it has what
    it needs."""
    if known.others is None or not known.needed <= {*known.places[: len(args)], *kwargs}:
        unknown = next(name for name in kwargs if name not in known.kinds)
        raise unknown_argument(_name(function), unknown, [name for name in known.kinds if name != "self"])


def as_plain(value: Any) -> Any:
    """Convert a numpy scalar, or an array without dimensions, to a number of Python, also in a list, a tuple or a dict;
    return anything else as it is. A float32 would overflow in comparisons with large limits, and lose digits of numbers
    that it is combined with."""
    if isinstance(value, np.generic | np.ndarray) and value.ndim == 0 and value.dtype.kind in _NUMBERS:
        return _NUMBERS[value.dtype.kind](value)
    if type(value) in (list, tuple) and any(isinstance(each, _HOLDING) for each in value):
        return type(value)(map(as_plain, value))
    if type(value) is dict and any(isinstance(each, _HOLDING) for each in value.values()):
        return {name: as_plain(each) for name, each in value.items()}
    return value


_HOLDING = (np.generic, np.ndarray, list, tuple, dict)  # what is a number of numpy, or may hold one


_NUMBERS: dict[str, Callable[[Any], Any]] = {"b": bool, "i": int, "u": int, "f": float, "c": complex}


def checked_class(cls: type[T]) -> type[T]:
    """Check what a class is made from, as `checked` does the arguments of a function; stands above `@dataclass`."""
    cls.__init__ = checked(cls.__init__)  # type: ignore[method-assign]  # the one way to reach the __init__ of a dataclass
    return cls


def _name(function: Callable[..., Any]) -> str:
    return function.__qualname__.removesuffix(".__init__")


def _refusal(function: Callable[..., Any], name: str, kind: _Kind, value: object) -> InputError:
    if kind.choices and isinstance(value, str):
        return _no_choice(name, value, kind.choices, kind.besides)
    given = f"{' '.join(reprlib.repr(value).split())} ({type(value).__name__})"
    where = _name(function)
    remedy = "; fill masked entries, or leave them out" if np.ma.is_masked(value) else ""
    if _is_whole(value) and not _is_real(value):
        remedy = "; write a number beyond 64 bits with an exponent, as 1e30"
    remedy = remedy or instead_of(where, kind.classes, value)
    return InputError(f"{where}: {name} = {given}: must be {kind.text}{remedy}")


class _Arguments(NamedTuple):
    """What the arguments of a function must be."""

    kinds: dict[str, _Kind]  # by name, without those of any name
    places: tuple[str, ...]  # names of those given by position
    rest: str | None  # name of all further ones by position
    further: _Kind  # what those must be
    others: _Kind | None  # of all further ones by name
    needed: frozenset[str]  # names of those without a default
    numbers: dict[str, tuple[float, float]]  # ends of the range of those that have one in the table
    where: str  # the function, as the table of arguments names it


@functools.cache
def _arguments(function: Callable[..., Any]) -> _Arguments:
    hints, parameters = _hints(function), inspect.signature(function).parameters
    kinds = {name: _kind(hints.get(name, Any)) for name in parameters}
    forms = {each.kind: name for name, each in parameters.items()}
    by_place = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    others = kinds.pop(forms.get(inspect.Parameter.VAR_KEYWORD, ""), None)
    further = kinds.pop(forms.get(inspect.Parameter.VAR_POSITIONAL, ""), _ANYTHING)
    places = tuple(name for name, each in parameters.items() if each.kind in by_place)
    needed = frozenset(name for name in kinds if parameters[name].default is inspect.Parameter.empty)
    lines = {name: ARGUMENTS[name] for name in kinds if name in ARGUMENTS}
    where = _name(function)
    numbers = {name: line.ends(where) for name, line in lines.items() if line.kind in ("integer", "number")}
    rest = forms.get(inspect.Parameter.VAR_POSITIONAL)
    return _Arguments(kinds, places, rest, further, others, needed, numbers, where)


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """Annotations of the arguments; what a function returns may be a name that only type checkers import."""
    plain = inspect.unwrap(function)
    arguments = {name: hint for name, hint in plain.__annotations__.items() if name != "return"}
    holder = types.SimpleNamespace(__annotations__=arguments)
    return typing.get_type_hints(holder, globalns=plain.__globals__, include_extras=True)


def _kind(hint: Any) -> _Kind:
    """How to check an annotation: by its marker `Holds`, as a class, or by its form as documented by `typing`. Any
    other is not checked; tests/test_argument_types.py finds it."""
    if hasattr(hint, "__metadata__"):  # Annotated
        marker = next((each for each in hint.__metadata__ if isinstance(each, Holds)), None)
        return _array(marker) if marker else _kind(hint.__origin__)
    if typing.get_origin(hint) is not None:
        return _of_parts(typing.get_origin(hint), typing.get_args(hint))
    if isinstance(hint, typing.NewType):
        return _kind(hint.__supertype__)
    if not isinstance(hint, type) or hint is Any:
        return _ANYTHING
    return _PLAIN.get(hint) or _class(hint)


def _class(cls: type) -> _Kind:
    try:
        isinstance(None, cls)
    except TypeError:  # a protocol that cannot be asked at run time
        return _ANYTHING
    article = "an" if cls.__name__[0] in "AEIOU" else "a"
    return _Kind(lambda value: isinstance(value, cls), f"{article} {cls.__name__}", (cls.__name__,))


def _of_parts(origin: Any, parts: tuple[Any, ...]) -> _Kind:
    """How to check an annotation that others are parts of."""
    if origin in (types.UnionType, typing.Union):
        return _union(parts)
    if origin is typing.Literal:
        return _choice(parts)
    if not isinstance(origin, type):
        return _ANYTHING
    if issubclass(origin, Callable):  # type: ignore[arg-type]  # an abstract class all the same
        return _Kind(callable, "a function")
    if issubclass(origin, os.PathLike):
        return _Kind(lambda value: isinstance(value, origin), "a path")
    if issubclass(origin, Mapping):
        key, item = map(_kind, parts)
        return _Kind(
            lambda value: isinstance(value, origin) and all(key.holds(k) and item.holds(v) for k, v in value.items()),
            f"a mapping from {key.text} to {item.text}",
        )
    if origin is tuple and Ellipsis not in parts:
        return _row([_kind(part) for part in parts])
    if issubclass(origin, Iterable) and not issubclass(origin, np.ndarray):
        return _items(origin, _kind(parts[0]))
    return _ANYTHING


def _choice(choices: tuple[Any, ...]) -> _Kind:
    """One text of several, or True."""
    if choices == (True,):
        return _Kind(lambda value: value is True, "True")
    return _Kind(
        lambda value: isinstance(value, str) and value in choices, " or ".join(map(repr, choices)), choices=choices
    )


def _union(parts: tuple[Any, ...]) -> _Kind:
    kinds = {part: _kind(part) for part in parts}
    if _ANYTHING in kinds.values():
        return _ANYTHING
    if _PLAIN[str] in kinds.values():  # any text, as the name of what a package registers
        parts = tuple(part for part in parts if not kinds[part].choices)
    inner = sorted(parts, key=lambda part: (part is type(None), not hasattr(part, "__metadata__"), kinds[part].text))
    text = " or ".join(kinds[part].text for part in inner)
    classes = tuple(name for kind in kinds.values() for name in kind.classes)
    choices = tuple(name for part in parts for name in kinds[part].choices)
    besides = " or ".join(kinds[part].text for part in inner if not kinds[part].choices and part is not type(None))
    return _Kind(lambda value: any(kind.holds(value) for kind in kinds.values()), text, classes, choices, besides)


def _items(origin: type, item: _Kind) -> _Kind:
    def holds(value: Any) -> bool:
        if isinstance(value, np.ndarray) and value.ndim and origin is not tuple:
            return all(map(item.holds, value))
        if isinstance(value, str | bytes | Mapping | np.ndarray) or not isinstance(value, origin):
            return False
        return not isinstance(value, list | tuple) or all(map(item.holds, value))  # an iterator can be read once only

    return _Kind(holds, f"a sequence, each {item.text}", item.classes)


def _row(kinds: list[_Kind]) -> _Kind:
    """Tuples as long as their annotation."""
    return _Kind(
        lambda value: (
            isinstance(value, tuple) and len(value) == len(kinds) and all(map(lambda k, v: k.holds(v), kinds, value))
        ),
        f"({', '.join(kind.text for kind in kinds)})",
    )


def _array(marker: Holds) -> _Kind:
    """Arrays, and what numpy makes such an array of."""

    def holds(value: Any) -> bool:
        try:
            return np.asarray(value).dtype.kind in marker.kinds and not np.ma.is_masked(value)
        except Exception:  # whatever the conversion of a stranger's object raises, it is no array
            return False

    return _Kind(holds, marker.text)


def _is_whole(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _is_real(value: object) -> bool:
    if isinstance(value, int):
        return not isinstance(value, bool) and -(2**63) <= value < 2**64
    return isinstance(value, float | np.floating | np.integer)


_ANYTHING = _Kind(lambda _: True, "anything")
_PLAIN: dict[type, _Kind] = {
    int: _Kind(_is_whole, "a whole number"),
    float: _Kind(_is_real, "a number"),
    bool: _Kind(lambda value: isinstance(value, bool | np.bool_), "True or False"),
    str: _Kind(lambda value: isinstance(value, str), "text"),
    type(None): _Kind(lambda value: value is None, "None"),
    Path: _Kind(lambda value: isinstance(value, Path), "a path"),
}


def name_meant(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Ask whether the known name was meant that an unknown one misspells; `otherwise` if there is none."""
    near = misspelt(name, known)
    return f"did you mean {near}?" if near else otherwise


def check_choice(name: str, value: object, choices: Iterable[str]) -> None:
    """Refuse a name that is not among the choices."""
    known = tuple(choices)
    if not isinstance(value, str) or value not in known:
        raise _no_choice(name, value, known)


def _no_choice(name: str, value: object, known: tuple[str, ...], besides: str = "") -> InputError:
    use = meant(value, [name], known, argument=True) if isinstance(value, str) else ""
    told = f"use {use}, or another of" if use else "use one of"
    return InputError(f"unknown {name} {value!r}: {told} {', '.join(known)}{f', or {besides}' if besides else ''}")


def check_range(name: str, value: float, *places: str) -> None:
    """Refuse a number that the table of arguments does not allow at the first of the places that differs there."""
    if not (line := ARGUMENTS[name]).admits(value, *places):
        raise InputError(f"{named(name, value)}: must be {line.allowed(*places)}")


def check_number(name: str, value: Any, highest: float, least: float = 0.0) -> None:
    """Refuse what is no finite number above 0, from `least` and up to `highest`."""
    if not is_number(value) or not 0 < value <= highest or value < least:
        limits = f"a number above 0 and at most {highest:g}" if is_number(highest) else "a finite number above 0"
        limits = f"a number from {least:g} to {highest:g}" if least else limits
        raise InputError(f"{named(name, value)}: must be {limits}")


def check_seed(seed: Any) -> None:
    """Refuse what is no seed of random numbers."""
    if not _is_whole(seed) or seed < 0:
        raise InputError(f"seed = {seed}: must be a whole number, 0 or more")


def is_number(value: object) -> bool:
    """Whether a value is a finite real number; a truth value is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    size: Any = abs(as_plain(value))  # a float32 knows no number so large
    return bool(size <= sys.float_info.max)  # False too for an int that no float can hold


def finite_array(name: str, values: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """A float64 copy of `values` of a shape, in which None stands for any length."""
    try:
        array = np.array(values, dtype=np.float64, order="C")  # as compiled code wants it
    except (TypeError, ValueError):
        raise InputError(f"{name} must hold numbers only, in rows of one length") from None
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = "(" + ", ".join("any" if size is None else str(size) for size in shape) + ")"
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = tuple(int(k) for k in bad[0])
        raise InputError(f"{name}{list(where)} is {array[where]}: all values must be finite numbers")
    return array


def check_positive(name: str, values: Array) -> None:
    """Refuse an array (n,) that holds a number that is not above 0."""
    bad = np.flatnonzero(values <= 0)
    if len(bad):
        raise InputError(f"{name}[{bad[0]}] is {values[bad[0]]:.6g}: must be positive")
