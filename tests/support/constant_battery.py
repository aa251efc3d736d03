"""Short runs of all that jamlab does, from which one sees what a constant of the code changes.

Each takes the folder of the states and returns what it found; `numbers` turns that into plain numbers.
"""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

STATES = Path(__file__).parents[1] / "states"
BATTERY: dict[str, Callable[[Path], Any]] = {}


class _Imported:
    """jamlab as it is imported when a scenario runs."""

    def __getattr__(self, name: str) -> Any:
        return getattr(importlib.import_module("jamlab"), name)


jamlab: Any = _Imported()


def scenario(function: Callable[[Path], Any]) -> Callable[[Path], Any]:
    BATTERY[function.__name__] = function
    return function


def numbers(found: Any) -> dict[str, Any]:
    """Name -> list of numbers or a text, of whatever a scenario returns; packings by their measures and their bits."""
    rows: dict[str, Any] = {}
    _collect(found, "", rows)
    return rows


def _collect(found: Any, name: str, rows: dict[str, Any]) -> None:
    found = _plain(found)
    if isinstance(found, dict):
        for key, each in found.items():
            _collect(each, f"{name}/{key}", rows)
    elif hasattr(found, "with_state"):
        _collect_packing(found, name, rows)
    elif isinstance(found, list) and not all(isinstance(each, int | float) for each in found):
        for place, each in enumerate(found):
            _collect(each, f"{name}/{place}", rows)
    else:
        rows[name] = found


def _plain(found: Any) -> Any:
    """A dictionary, a list, a packing, or a text in the place of what else scenarios return."""
    if hasattr(found, "tocoo"):
        found = found.toarray()
    if hasattr(found, "columns") and hasattr(found, "to_numpy"):
        return {str(each): found[each].to_numpy() for each in found if "second" not in str(each)}
    if dataclasses.is_dataclass(found) and not hasattr(found, "with_state"):
        kept = {each.name for each in dataclasses.fields(found)} - {"seconds", "frames", "packing", "provenance"}
        return {each: getattr(found, each, None) for each in sorted(kept)}
    if isinstance(found, np.ndarray | np.generic) and found.dtype.kind in "biufc":
        whole = np.atleast_1d(found).ravel()
        return (np.ascontiguousarray(whole).view(float) if found.dtype.kind == "c" else whole.astype(float)).tolist()
    if isinstance(found, bool | int | float):
        return [float(found)]
    if isinstance(found, list | tuple | np.ndarray):
        return list(found)
    return found if isinstance(found, dict) or hasattr(found, "with_state") else str(found)


def _collect_packing(p: Any, name: str, rows: dict[str, Any]) -> None:
    rows[f"{name}/bits"] = crc32(p.positions.tobytes() + p.box.tobytes())
    rows[f"{name}/converged"] = bool(p.converged)
    rows[f"{name}/state"] = [p.phi, jamlab.packing_fraction(p), jamlab.contacts(p).z]
    rows[f"{name}/onset"] = [] if p.phi_J is None else [float(p.phi_J)]
    with contextlib.suppress(jamlab.JamlabError):
        measured = jamlab.measure(p, ("energy", "pressure"))
        rows[f"{name}/energy and pressure"] = [float(each) for each in measured.values()]


def prepare(folder: Path) -> None:
    """States that the runs start from; made once by the code as it is."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {
        "sp16": lambda: jamlab.pack(16, 1e-2, seed=1),
        "sp64": lambda: jamlab.pack(64, 1e-3, seed=2),
        "sp256": lambda: jamlab.pack(256, 1e-3, seed=3),
        "sp500": lambda: jamlab.pack(500, 3e-3, seed=3),
        "marginal": lambda: jamlab.pack(32, 1e-6, seed=4),
        "stabilized": lambda: jamlab.pack(32, 1e-2, seed=5, ensemble="shear-stabilized"),
        "sticky": lambda: jamlab.pack(32, 1e-2, seed=3, law={"stickiness": 0.05}),
        "onset": lambda: jamlab.jam(n=16, seed=1),
        "walled": lambda: jamlab.relax(jamlab.with_walls(jamlab.pack(32, 1e-2, seed=1), thickness=1.5)),
        "flat": lambda: jamlab.relax(jamlab.with_walls(jamlab.pack(32, 1e-2, seed=1), thickness=1.5, flat=True)),
        "dp8": lambda: jamlab.jam(n=8, model="dp", seed=1),
        "dp36": lambda: last(jamlab.compress(jamlab.jam(n=36, model="dp", seed=2), to=0.90, step=0.02)),
    }
    for name, make in made.items():
        path = folder / f"{name}.h5"
        if not path.exists():
            jamlab.write(path, make())


def last(states: Any) -> Any:
    *_, found = states
    return found


def read(folder: Path, name: str) -> Any:
    return jamlab.read(folder / f"{name}.h5")


def droplets() -> Any:
    return jamlab.read(STATES / "compressed_droplets.h5")


def shaken(p: Any, size: float, seed: int = 1) -> Any:
    return p.with_state(positions=p.positions + size * np.random.default_rng(seed).normal(size=p.positions.shape))


def relaxed(p: Any) -> Any:
    try:
        return jamlab.relax(p)
    except jamlab.JamlabError as error:
        return type(error).__name__


def draw(folder: Any, *plots: Any) -> None:
    """Draw and save each."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    for plot in plots:
        with contextlib.suppress(AttributeError):
            plot()
        pyplot.savefig(Path(folder) / "a.png")
        pyplot.close("all")


def quiet() -> Any:
    """Context in which nothing is printed."""
    stack = contextlib.ExitStack()
    stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
    stack.enter_context(contextlib.redirect_stderr(io.StringIO()))
    return stack
