"""What packings share and nobody may change: mappings, arrays, and what has been computed of a packing.

Packings do not change, so neither does what follows from one: it is kept with the packing, shared by copies of the same
state, never computed twice. Of packings that somebody holds, those looked at last keep what was computed of them, up to
a number of sites: a sweep of thousands would else hold all its Hessians.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from typing import Any, Concatenate, NoReturn
from weakref import WeakKeyDictionary

import numpy as np

from jamlab.checks import as_plain
from jamlab.errors import InputError
from jamlab.type_variables import P, R, T

MOST_SITES = 100_000  # disks and vertices of all packings that keep what was computed of them: about 2 kB each


class ReadOnlyDict(dict[str, Any]):
    """A dict that refuses changes: several packings share it, and `converged` is said of what it holds.

    >>> jamlab.pack(n=32, pressure=1e-2, seed=1).params["k"] = 2.0
    Traceback (most recent call last):
        ...
    jamlab.errors.InputError: params and provenance of a packing are read-only: give a changed copy to `with_state`
    """

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise InputError("params and provenance of a packing are read-only: give a changed copy to `with_state`")

    __setitem__ = __delitem__ = clear = pop = popitem = setdefault = update = __ior__ = _refuse

    def __reduce__(self) -> tuple[type, tuple[dict[str, Any]]]:
        return type(self), (dict(self),)  # pickle and copy would set one item after the other


def frozen(value: Any) -> Any:
    """Copy a mapping, with those inside it, so that nobody else can change it."""
    if isinstance(value, ReadOnlyDict):
        return value
    if isinstance(value, Mapping):
        return ReadOnlyDict({name: frozen(entry) for name, entry in value.items()})
    return [frozen(entry) for entry in value] if isinstance(value, list) else as_plain(value)


def lock(value: Any) -> None:
    """Make arrays read-only, those in tuples, lists and dataclasses as well."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif isinstance(value, tuple | list):
        for each in value:
            lock(each)
    elif is_dataclass(value):
        for each in vars(value).values():
            lock(each)


class Derived:
    """What has been computed of one state."""

    def __init__(self) -> None:
        self.results: dict[Any, Any] = {}  # by function and arguments


def per_packing(function: Callable[Concatenate[T, P], R]) -> Callable[Concatenate[T, P], R]:
    """Compute what a function of a packing gives once; its arrays become read-only. The function depends on the state
    alone, box, positions, sizes and law, and what it gives does not hold the packing. Arguments beside the packing are
    hashable."""
    defaults = getattr(function, "__kwdefaults__", None) or {}

    @functools.wraps(function)
    def call(packing: T, /, *args: P.args, **kwargs: P.kwargs) -> R:
        derived: Derived = packing._derived  # type: ignore[attr-defined]  # Packing is declared above this module
        key = (function, args, *{**defaults, **kwargs}.items())
        if key not in derived.results:
            _note(packing, key, function(packing, *args, **kwargs))
        result: R = derived.results[key]
        return result

    return call


def keep(function: Callable[..., R], packing: Any, found: R) -> None:
    """Say what a function under `per_packing` gives of a packing, with its default arguments, where that is known."""
    plain: Any = getattr(function, "__wrapped__", None)
    if plain is None:
        raise InputError(
            f"{function.__qualname__} keeps nothing with a packing: make it `staticmethod(per_packing(...))`"
        )
    _note(packing, (plain, (), *(plain.__kwdefaults__ or {}).items()), found)


_recent: WeakKeyDictionary[Derived, int] = WeakKeyDictionary()  # sites of who keeps results, in order of time


def _note(packing: Any, key: Any, found: Any) -> None:
    lock(found)
    derived: Derived = packing._derived
    if not derived.results:
        _recent[derived] = len(packing.positions)
        while len(_recent) > 1 and sum(_recent.values()) > MOST_SITES:
            oldest = next(iter(_recent))
            oldest.results.clear()
            del _recent[oldest]
    derived.results[key] = found
