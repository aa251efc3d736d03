"""Make what several packings share read-only: mappings and arrays, and what holds them."""

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, NoReturn

import numpy as np

from jamlab.errors import InputError


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
    return [frozen(entry) for entry in value] if isinstance(value, list) else value


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
