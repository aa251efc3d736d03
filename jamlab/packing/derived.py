"""What has been computed of a packing: kept with it, shared by copies of the same state, never computed twice.

Packings do not change, so neither does what follows from one. Of packings that somebody holds, those looked at last
keep what was computed of them, up to a number of sites: a sweep of thousands would else hold all its Hessians.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import ref

from jamlab.packing.read_only import lock

P = ParamSpec("P")
R = TypeVar("R")
S = TypeVar("S")

MOST_SITES = 100_000  # disks and vertices of all packings that keep what was computed of them: about 2 kB each


class Derived(dict[Any, Any]):
    """Results by function and arguments, of one state."""


def per_packing(function: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
    """Compute what a function of a packing gives once; its arrays become read-only. The function depends on the state
    alone, box, positions, sizes and law, and what it gives does not hold the packing. Arguments beside the packing are
    hashable."""
    defaults = getattr(function, "__kwdefaults__", None) or {}

    @functools.wraps(function)
    def call(packing: S, /, *args: P.args, **kwargs: P.kwargs) -> R:
        derived: Derived = packing._derived  # type: ignore[attr-defined]  # Packing is declared above this module
        key = (function, args, *{**defaults, **kwargs}.items())
        if key not in derived:
            _note(packing, key, function(packing, *args, **kwargs))
        result: R = derived[key]
        return result

    return call


def keep(function: Callable[..., R], packing: Any, found: R) -> None:
    """Say what a function under `per_packing` gives of a packing, with its default arguments, where that is known."""
    plain = function.__wrapped__  # type: ignore[attr-defined]
    _note(packing, (plain, (), *(plain.__kwdefaults__ or {}).items()), found)


def _note(packing: Any, key: Any, found: Any) -> None:
    lock(found)
    derived: Derived = packing._derived
    if not derived:
        _memory.take(derived, len(packing.positions))
    derived[key] = found


class _Memory:
    """Who keeps results, in the order in which they came, and the number of their sites."""

    def __init__(self) -> None:
        self._sites = 0
        self._held: dict[int, tuple[ref[Derived], int]] = {}

    def take(self, derived: Derived, sites: int) -> None:
        """Let one more keep results; the oldest lose theirs where it gets too much."""
        key = id(derived)
        self._held[key] = ref(derived, lambda _: self._drop(key)), sites
        self._sites += sites
        while self._sites > MOST_SITES and len(self._held) > 1:
            oldest = next(iter(self._held))
            alive = self._held[oldest][0]()
            self._drop(oldest)
            if alive is not None:
                alive.clear()

    def _drop(self, key: int) -> None:
        _, sites = self._held.pop(key, (None, 0))
        self._sites -= sites


_memory = _Memory()
