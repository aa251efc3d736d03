"""Registries by name of models, makings, force laws, drag laws and observables, also of other packages.

An object is registered in this process, or a package declares it as an entry point, by which every process finds it,
also one that reads a file or runs a part of a campaign:

    [project.entry-points."jamlab.models"]
    dimers = "my_package.dimers:DIMERS"

jamlab's own are declared in the same way, in its `pyproject.toml`. An entry point is imported when its name is first
asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Generic

from jamlab.errors import InputError, warn
from jamlab.type_variables import T

EXTENDING = "docs/extending/index.md"  # page that tells how to write one


class Registry(Generic[T]):
    """Objects of one sort by name.

    Args:
        group: of entry points, such as "jamlab.models".
        what: one of them, in words, for messages.
        check: of the name and an object, raises if the object is none of them; by default none is refused.
    """

    def __init__(self, group: str, what: str, check: Callable[[str, T], None] | None = None) -> None:
        self.group, self.what, self._check = group, what, check
        self._entries: dict[str, T] = {}
        self._broken: set[str] = set()

    def register(self, name: str, entry: T) -> T:
        """Make an object known by a name in this process, and give it back.

        Raises:
            InputError: the name is taken by another object, or the object calls itself by another name.
        """
        if self._entries.get(name) is entry:
            return entry
        if name in self._entries or name in self._points:
            by = f" of {_origin(self._points[name])}" if name in self._points else ""
            raise InputError(f"{self.what} {name!r}: the name is taken by another one{by}; choose another name")
        self._entries[name] = self._checked(name, entry)
        return entry

    def names(self) -> list[str]:
        """Names that are known, those of installed packages first."""
        return list(dict.fromkeys([*self._points, *self._entries]))

    def get(self, name: str) -> T:
        """The object of a name.

        Raises:
            InputError: no such name, or its package cannot be imported.
        """
        if name not in self._entries:
            point = self._points.get(name) if isinstance(name, str) else None
            if point is None:
                raise InputError(self._unknown(name))
            try:
                entry = point.load()
            except Exception as error:  # whatever a package of somebody else does when it is imported
                raise InputError(
                    f"{self.what} {name!r}: {point.value} of {_origin(point)} cannot be imported: "
                    f"{type(error).__name__}: {error}; repair or reinstall that package"
                ) from error
            self._entries[name] = self._checked(name, entry)
        return self._entries[name]

    def each(self) -> dict[str, T]:
        """All objects by name; one that cannot be imported is left out, with a warning, once."""
        found: dict[str, T] = {}
        for name in self.names():
            if name not in self._broken:
                try:
                    found[name] = self.get(name)
                except InputError as error:  # nobody asked for it: all others go on
                    self._broken.add(name)
                    warn(str(error))
        return found

    def _checked(self, name: str, entry: T) -> T:
        own = getattr(entry, "name", name)
        if not isinstance(name, str) or not name:
            raise InputError(f"{self.what} {name!r}: its name must be a text")
        if isinstance(own, str) and own != name:
            raise InputError(f"{self.what} {name!r} calls itself {own!r}: register it under its own name")
        if self._check is not None:
            self._check(name, entry)
        return entry

    @cached_property
    def _points(self) -> dict[str, EntryPoint]:
        found: dict[str, EntryPoint] = {}
        for point in _installed().select(group=self.group):
            other = found.setdefault(point.name, point)
            if other.value != point.value:
                raise InputError(
                    f"{self.what} {point.name!r}: both {_origin(other)} and {_origin(point)} declare it; uninstall one"
                )
        return found

    def _unknown(self, name: object) -> str:
        known = f"known are {', '.join(names)}" if (names := self.names()) else "none is known, so reinstall jamlab"
        return (
            f"unknown {self.what} {name!r}: {known}; for another one install its package, which declares it as an "
            f"entry point {self.group!r}, or import the module that registers it, which workers and commands do not"
        )


@cache
def _installed() -> EntryPoints:
    """Entry points of all installed packages, which take some 5 ms to read, once a process."""
    return entry_points()


def _origin(point: EntryPoint) -> str:
    return f"package {point.dist.name}" if point.dist is not None else "an installed package"
