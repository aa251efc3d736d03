"""Measure observables of the user's own: functions `module:function` that take a packing and return numbers."""

import ast
import importlib
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import InputError
from jamlab.packing.packing import Packing

Function = Callable[[Packing], Any]


def check_function(observable: str, folders: Sequence[str]) -> None:
    """Look for the function of an observable `module:function` without running any code. Its module is found as by
    an import, in the folders first, but only read; one without source, or that imports all names of another, is
    believed."""
    module, _, name = observable.partition(":")
    places: list[str] | None = [*folders, *sys.path]
    words = module.split(".")
    for k in range(len(words)):
        found = PathFinder.find_spec(".".join(words[: k + 1]), places)
        if found is None or (k + 1 < len(words) and found.submodule_search_locations is None):
            raise _no_module(observable, module, folders, "there is none")
        places = list(found.submodule_search_locations or ())
    source = found.origin if found is not None else None
    if source is None or not source.endswith(".py"):
        return
    try:
        tree = ast.parse(Path(source).read_bytes(), source)
    except (OSError, SyntaxError, ValueError) as error:
        raise _no_module(observable, module, folders, f"{type(error).__name__}: {error}") from error
    if not {name, "*"} & set(_names_in(tree)):
        raise InputError(f"observable {observable}: {source} has no function {name}: correct the name")


def _names_in(tree: ast.AST) -> Iterator[str]:
    """Names that a module may define: functions, assignments and imports at any depth."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name.partition(".")[0] for alias in node.names)


def _no_module(observable: str, module: str, folders: Sequence[str], reason: str) -> InputError:
    return InputError(
        f"observable {observable}: cannot import {module}: {reason}; put {module.partition('.')[0]}.py beside the"
        f" campaign file (searched: {' and '.join(folders)})"
    )


def load_function(observable: str, folders: Sequence[str]) -> Function:
    """Import the function of an observable `module:function`, from the folders first."""
    module, _, name = observable.partition(":")
    with _search(folders):
        try:
            found = importlib.import_module(module)
        except Exception as error:  # the module is the user's: whatever it raises is reported with its name
            raise _no_module(observable, module, folders, f"{type(error).__name__}: {error}") from error
    function = getattr(found, name, None)
    if not callable(function):
        place = getattr(found, "__file__", module)
        raise InputError(f"observable {observable}: {place} has no function {name}: correct the name")
    return function  # type: ignore[no-any-return]


def measure_own(
    observable: str, function: Function, packings: Sequence[Packing], taken: Iterable[str]
) -> dict[str, NDArray[np.float64]]:
    """Measure each packing with a function of the user's own, which returns a number, for the column `function`, or a
    dict of numbers, the same keys every time; columns (packings,) may not bear a taken name."""
    rows = [_row(observable, function, packing, k) for k, packing in enumerate(packings)]
    for k, row in enumerate(rows):
        if row.keys() != rows[0].keys():
            raise InputError(
                f"observable {observable}: columns {', '.join(row)} for state {k}, {', '.join(rows[0])} for state 0:"
                " return the same keys for every packing, with nan where there is no value"
            )
    for column in rows[0]:
        if column in taken:
            raise InputError(f"observable {observable}: column {column!r} is taken: choose another name")
    return {column: np.array([row[column] for row in rows], dtype=np.float64) for column in rows[0]}


def _row(observable: str, function: Function, packing: Packing, state: int) -> dict[str, float]:
    try:
        found = function(packing)
    except Exception as error:  # the function is the user's: whatever it raises is reported with its name
        raise InputError(
            f"observable {observable} failed for state {state}: {type(error).__name__}: {error};"
            " correct it, or return nan where it has no value"
        ) from error
    row = found if isinstance(found, dict) else {observable.partition(":")[2]: found}
    for column, value in row.items():
        number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
        if not number or np.isinf(value) or not isinstance(column, str) or not column.isidentifier():
            raise InputError(
                f"observable {observable} returned {found!r:.200} for state {state}: return a finite number or nan,"
                " or a dict of them whose keys are words"
            )
    if not row:
        raise InputError(f"observable {observable} returned {{}} for state {state}: return at least one number")
    return {column: float(value) for column, value in row.items()}


@contextmanager
def _search(folders: Sequence[str]) -> Iterator[None]:
    """Look for modules in these folders first."""
    before = list(sys.path)
    sys.path[:0] = folders
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path[:] = before
