"""Estimate what a task costs before one of its kind has run: the pieces of its work, by a table of what a piece takes.

`costs.csv` beside this file, made by `python -m studies tables costs`, holds CPU seconds of one core for every piece
and some numbers of particles; its first line says where and when. A droplet with more vertices counts as more
particles. What the table does not have is named.
"""

import csv
import json
import math
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from jamlab.campaign.file import STATES, Compression, site_count
from jamlab.campaign.tasks import Batch, Parameters
from jamlab.engine.deck_defaults import defaults
from jamlab.laws.laws import parameters_of

FILE = "costs.csv"
PRESSURES = (1e-2, 1e-4, 1e-6)  # of the pieces that pack at a pressure; others lie between two of them
VERTICES = ("nv_small", "nv_large")


@dataclass(frozen=True)
class _Typical:
    """Packing fractions from which the states of a sweep are counted."""

    onset: float = 0.84  # phi of disks, rho of droplets to 0.02
    confluence: float = 0.97  # rho beyond which the last contact is bisected


TYPICAL = _Typical()


class Piece(NamedTuple):
    """A piece of work, such as a state of a compression, and how often a task does it."""

    name: str
    times: float


@dataclass(frozen=True)
class TaskCost:
    """CPU seconds of a task, to make its packings and to measure them, and what is in neither."""

    making: float | None  # None where the table does not have its packings
    measuring: float
    without: tuple[str, ...]  # in neither: observables, changes of the packings, "law" and "sizes" of unknown cost


@cache
def _table() -> tuple[dict[str, Any], dict[str, tuple[list[float], list[float]]]]:
    with resources.files("jamlab.campaign").joinpath(FILE).open(encoding="utf-8") as stream:
        facts = json.loads(stream.readline().lstrip("# "))
        rows = [(row["piece"], float(row["n"]), float(row["seconds"])) for row in csv.DictReader(stream)]
    pieces: dict[str, tuple[list[float], list[float]]] = {}
    for name, n, seconds in sorted(rows):
        sizes, times = pieces.setdefault(name, ([], []))
        sizes.append(n)
        times.append(seconds)
    return facts, pieces


def table_facts() -> dict[str, Any]:
    """Where and when the table was measured: `commit`, `date`, `machine`."""
    return _table()[0]


def estimate_task(batch: Batch) -> TaskCost:
    """Estimate a task of a batch."""
    parameters = batch.parameters
    n = _comparable(parameters)
    unknown = [*parameters.own, *(f"change {name!r}" for name, _ in parameters.recipe.changes)]
    if _changed(parameters) - {*VERTICES}:
        unknown.append("law")
    if parameters.sizes:
        unknown.append("sizes")
    making = [_seconds(piece, n) for piece in making_pieces(parameters)]
    states = count_states(parameters)
    measuring = 0.0
    for piece in measuring_pieces(parameters):
        if (seconds := _seconds(piece, n)) is None:
            unknown.append(piece.name.partition(" ")[2])
        else:
            measuring += states * seconds
    known = [seconds for seconds in making if seconds is not None]
    return TaskCost(sum(known) if len(known) == len(making) else None, measuring, tuple(unknown))


def _changed(parameters: Parameters) -> set[str]:
    """Parameters of the force law that are not the default ones."""
    return {*parameters_of(parameters.recipe.law or {})}


def _comparable(parameters: Parameters) -> float:
    """Number of particles of the default model that have as many sites."""
    model, n = parameters.model, parameters.n
    if not _changed(parameters) & {*VERTICES}:
        return n
    return n * site_count(n, model, parameters.law) / site_count(n, model, defaults(model))


def _seconds(piece: Piece, n: float) -> float | None:
    """CPU seconds of a piece at n particles, by powers of n between those measured, and beyond them."""
    sizes, seconds = _table()[1].get(piece.name, ([], []))
    if not sizes:
        return None
    x, y = np.log(sizes), np.log(seconds)
    k = min(max(int(np.searchsorted(x, math.log(n))), 1), len(x) - 1)
    slope = float(np.clip((y[k] - y[k - 1]) / (x[k] - x[k - 1]), 0.0, 3.0)) if len(x) > 1 else 1.0
    return piece.times * math.exp(y[k] + slope * (math.log(n) - x[k]))


def making_pieces(parameters: Parameters) -> list[Piece]:
    """What is done to make the packings of a task."""
    kind = parameters.model + ("" if parameters.ensemble == "fixed-box" else f" {parameters.ensemble}")
    if parameters.pressures is not None:
        return [piece for pressure in parameters.pressures for piece in _at_pressure(kind, pressure)]
    if parameters.phi is not None:
        return [Piece(f"{kind} phi", len(parameters.phi))]
    found = [Piece(f"{kind} onset", 1.0)]
    return found if parameters.compress is None else [*found, Piece(f"{kind} step", _steps(parameters.compress))]


def _at_pressure(kind: str, pressure: float) -> list[Piece]:
    """A packing at a pressure, as shares of those at the two pressures beside it."""
    levels = np.log10(PRESSURES)
    place = float(np.clip(np.interp(-math.log10(pressure), -levels, np.arange(len(levels))), 0, len(levels) - 1))
    low = min(int(place), len(levels) - 2)
    shares = ((low, 1 - (place - low)), (low + 1, place - low))
    return [Piece(f"{kind} pressure {PRESSURES[k]:g}", share) for k, share in shares if share > 0]


def _steps(how: Compression) -> float:
    """States of a compression beyond onset, with those that bisect its end."""
    way = (how.above_onset or 0.0) if how.to is None else how.to - TYPICAL.onset
    count = max(way / how.step, 1.0)
    if how.first_step is not None:
        count += how.per_decade * math.log10(how.step / how.first_step)
    if how.confluence is not None and TYPICAL.onset + way > TYPICAL.confluence:
        count += max(math.log2(how.step / how.confluence), 0.0)
    return count


def count_states(parameters: Parameters) -> float:
    """States of a task."""
    if parameters.pressures is not None or parameters.phi is not None:
        return len(parameters.pressures or parameters.phi or ())
    return 1 + (0.0 if parameters.compress is None else _steps(parameters.compress))


def measuring_pieces(parameters: Parameters) -> list[Piece]:
    """What is measured of each state by jamlab's own observables."""
    wanted = [Piece(name, each.amount()) for name, each in parameters.observables.items()]
    return [Piece(f"{parameters.model} {name}", times) for name, times in [Piece(STATES, 1.0), *wanted]]
