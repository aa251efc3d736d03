"""Ways to make the packings of an ensemble, and the table of what packings made in every way gave, and cost.

A way goes from disks alone to droplets from the start. `python -m studies tables ways` measures the table. It
holds one row for each packing and packing fraction, so every number that follows from it has an interval.
"""

import io
import json
import lzma
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.arguments.choices import ModelName, Start
from jamlab.arrays import Array
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError, InputError, StorageError, named
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.measure import numbers_of
from jamlab.models.disks import DISKS
from jamlab.models.droplets import DROPLETS
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress, part_of
from jamlab.protocols.compression import compress
from jamlab.protocols.droplets_from_disks import droplets_from_disks
from jamlab.protocols.onset import LARGEST_TOLERANCE, jam
from jamlab.statistics.confidence import bend, between, neighbours


@dataclass(frozen=True)
class TableOfWays:
    """How the shipped table of ways was made, and is read."""

    handover: float = 0.88  # rho from which disks and droplets part (Boromand et al., fig 5)
    step: float = 0.02  # of rho: means of z after steps of 0.01 and 0.02 agree within their errors
    # of rho: a packing that rearranges farther from the packing fraction asked for is left out
    off_target: float = 1e-3
    # packings of a way: with 50, 24 of 32 intervals by 32 disks held; by others 83 to 100 %, some of few draws
    fewest: int = 100
    fewest_values: int = 12  # of them that have the quantity, at the levels beside rho
    start: Start = "from-disks"  # of droplets at onset, as the table has them, see `jam`


WAYS = TableOfWays()

ONSET = "rho_J"  # true packing fraction at jamming onset, of packings that have no rho
# what `jamlab.measure` calls them
_MEASURED = {"z": "z", "g": "g", "b": "b", "d_shape_factor": "shape_factor", "void_sides": "void_sides"}


@dataclass(frozen=True)
class EnsembleWay:
    """How a packing, or those of an ensemble, are made."""

    # "disks": compressed to the end; "carried": disks until rho or 0.88, where the models part, then droplets;
    # "droplets": from the random start on, as in Boromand et al
    start: str
    n: int  # particles of a packing
    nv: tuple[int, int] | None = None  # (small, large) number of vertices; None for disks
    contact: str | None = None  # form of the contacts of droplets; None for that of `dp.parameters`
    # largest force at a minimum, at most 1e-9 at onset; None for that of `*.minimum.parameters`
    force_tolerance: float | None = None

    def __str__(self) -> str:
        carried = " carried by disks" if self.start == "carried" else ""
        vertices = "disks" if self.nv is None else f"droplets{carried} with {self.nv[0]}/{self.nv[1]} vertices"
        form = f", contacts {self.contact}" if self.contact else ""
        return f"{self.n} {vertices}{form}" + (f", forces to {self.force_tolerance:g}" if self.force_tolerance else "")

    @property
    def model(self) -> ModelName:
        """Name of the model."""
        return DISKS.name if self.nv is None else DROPLETS.name

    @property
    def law(self) -> dict[str, Any]:
        """Parameters of droplets that replace those of `dp.parameters`."""
        if self.nv is None:
            return {}
        form = {"contact": self.contact} if self.contact else {}
        return {"nv_small": self.nv[0], "nv_large": self.nv[1], **form}


def default_vertices() -> tuple[int, int]:
    """Read the numbers of vertices of `dp.parameters`."""
    law = defaults(DROPLETS.name)
    return int(law["nv_small"]), int(law["nv_large"])


def default_way(n: int) -> EnsembleWay:
    """Describe droplets with the values of `dp.parameters`, carried by disks."""
    return EnsembleWay("carried", n, default_vertices())


def find_onset(way: EnsembleWay, seed: int) -> Packing:
    """Make a packing at onset: disks, or droplets where these start as droplets."""
    force = None if way.force_tolerance is None else min(way.force_tolerance, LARGEST_TOLERANCE)
    if way.start != "droplets":
        return jam(way.n, DISKS.name, seed, force_tolerance=force)
    return jam(way.n, DROPLETS.name, seed, start=WAYS.start, force_tolerance=force, law=way.law)


def bring_on(
    way: EnsembleWay,
    packing: Packing,
    rho: float,
    step: float = WAYS.step,
    *,
    law: Mapping[str, Any] | None = None,
    ranks: int = 1,
    progress: Progress | None = None,
) -> Packing:
    """Bring a packing, from `find_onset` or from here, to a higher rho by steps. Droplets take over from disks at rho,
    or at `WAYS.handover`, and continue from there.

    Args:
        way: how it is made.
        packing: where it starts.
        rho: true packing fraction to reach.
        step: of rho.
        law: more parameters of droplets that take over.
        ranks: threads of FIRE of disks.
        progress: see `compress`.
    """
    force = way.force_tolerance
    if packing.model == DROPLETS.name or way.nv is None:
        return _compress_to(packing, rho, step, force_tolerance=force, ranks=ranks, progress=progress)
    first = {"ranks": ranks, "progress": part_of(progress, 0.0, 0.5)}
    disks = _compress_to(packing, min(rho, WAYS.handover), step, force_tolerance=force, **first)
    droplets = hand_over(way, disks, law)
    if rho <= WAYS.handover:
        return droplets
    return _compress_to(droplets, rho, step, force_tolerance=force, progress=part_of(progress, 0.5, 1.0))


def hand_over(way: EnsembleWay, disks: Packing, law: Mapping[str, Any] | None = None) -> Packing:
    """Put droplets in the place of disks, see `droplets_from_disks`; `law`: more of its parameters."""
    droplets = droplets_from_disks(disks, force_tolerance=way.force_tolerance, law=way.law | dict(law or {}))
    return _require_reached(droplets, packing_fraction(disks))


def values_at(packing: Packing, quantities: tuple[str, ...]) -> dict[str, float]:
    """Measure some quantities of a packing. d_shape_factor is the mean shape factor above that of a free particle,
    A - A_J; the others are those of `jamlab.measure`. All are nan in an unjammed packing."""
    row = numbers_of(packing, {"z", *(_MEASURED[name] for name in quantities)})
    found = {name: row[_MEASURED[name]] for name in quantities}
    if "d_shape_factor" in found:
        counts = None if packing.offsets is None else np.diff(packing.offsets)
        found["d_shape_factor"] -= free_shape(None if counts is None else (int(counts.min()), int(counts.max())))
    return found if np.isfinite(row["z"]) else dict.fromkeys(quantities, float("nan"))


def free_shape(nv: tuple[int, int] | None) -> float:
    """Mean shape factor of free particles, (nv/pi) tan(pi/nv) of regular polygons; half of the particles are large."""
    if nv is None:
        return 1.0
    counts = np.array(nv)
    return float((counts * np.tan(np.pi / counts) / np.pi).mean())


def _compress_to(packing: Packing, rho: float, step: float, **how: Any) -> Packing:
    reached = packing_fraction(packing)
    if reached >= rho + WAYS.off_target * (packing.model == DROPLETS.name):
        raise ConvergenceError(f"the packing jams at rho = {reached:.5f}, above the requested {rho:g}")
    if reached >= rho - 1e-6:
        return packing
    for state in compress(packing, rho, step, **how):
        packing = _require_reached(state, None)
    return _require_reached(packing, rho)


def _require_reached(packing: Packing, rho: float | None) -> Packing:
    if not packing.converged:
        raise ConvergenceError(f"{packing.model} state at phi = {packing.phi:.4f} did not converge")
    if rho is not None and abs(packing_fraction(packing) - rho) > WAYS.off_target:
        raise ConvergenceError(f"the packing rearranged: rho changed from {rho:.4f} to {packing_fraction(packing):.4f}")
    return packing


def read_table(path: Path | None, shipped: str, columns: Iterable[str], command: str) -> pd.DataFrame:
    """Read a table, or the shipped one; what all of its rows share, such as settings, is in `attrs`."""
    source = path or resources.files("jamlab.estimates").joinpath(shipped)
    try:
        first, _, body = lzma.decompress(source.read_bytes()).decode().partition("\n")
        table = pd.read_csv(io.StringIO(body))
        table.attrs = json.loads(first.removeprefix("#"))["facts"]
        if missing := set(columns) - set(table.columns):
            raise ValueError(f"missing columns {', '.join(sorted(missing))}")
    except (OSError, EOFError, lzma.LZMAError, ValueError, KeyError) as error:
        raise StorageError(f"cannot read the table {source}: {error}; make one with `{command}`") from error
    return table


SHIPPED = "ways.csv.xz"
N = 64  # particles of the packings whose mean is estimated, and which one packing stands for
WAY_QUANTITIES = ("z", "g", "b", "d_shape_factor", "void_sides")
WAY = ("start", "n", "nv", "contact", "force_tolerance")
_COMMAND = "python -m studies tables ways"


@dataclass(frozen=True)
class WayRecord:
    """Packings made in one way."""

    way: EnsembleWay  # how they were made
    seeds: NDArray[np.int64]  # (m,) int64
    levels: Array  # (k,) rho, ascending
    # quantity -> (m, k), nan where a packing is not jammed or has no such value; "rho_J" -> (m, 1)
    values: dict[str, Array]
    seconds: Array  # (m, k) CPU time from the random start to each level, also of packings that failed there


Ways = Mapping[EnsembleWay, WayRecord]


def read_ways(path: Path | None = None) -> Ways:
    """Read the shipped table, or one written by `python -m studies tables ways`."""
    return _read(None) if path is None else _read.__wrapped__(path)


@cache
def _read(path: Path | None) -> Ways:
    table = read_table(path, SHIPPED, (*WAY, "seed", "rho", *WAY_QUANTITIES, ONSET, "seconds"), _COMMAND)
    try:
        found, made_with = collect(table), table.attrs["parameters"]
    except (ValueError, KeyError) as error:
        raise StorageError(f"{path or SHIPPED} is no table of ways: {error}; make one with `{_COMMAND}`") from error
    law = defaults(DROPLETS.name)
    changed = [f"{name} = {was} (now {law.get(name)})" for name, was in made_with.items() if law.get(name) != was]
    if changed:
        raise StorageError(f"{path or SHIPPED} was made with {', '.join(changed)}: regenerate it with `{_COMMAND}`")
    return found


def reference_record(table: Ways, way: EnsembleWay, rho: float | None, *, onset: bool = False) -> WayRecord:
    """The record that others are held against, which must span rho, unless the onset is asked for."""
    record = table.get(way)
    if record is None:
        raise InputError(f"the reference table has no {way}: regenerate it with `{_COMMAND}`")
    low, high = record.levels[[0, -1]]
    if not onset and (rho is None or not low <= rho <= high):
        raise InputError(
            f"{named('rho', rho)}: must lie between {low:g} and {high:g}; use a campaign for other densities"
        )
    return record


def collect(table: pd.DataFrame) -> dict[EnsembleWay, WayRecord]:
    """Collect rows by the way that their packings were made in."""
    if table.empty:
        raise ValueError("it has no rows")
    found = {}
    for key, rows in table.groupby(list(WAY), dropna=False, sort=False):
        wide = rows.pivot(index="seed", columns="rho", values=[*WAY_QUANTITIES, ONSET, "seconds"])
        columns = {name: wide[name].to_numpy(dtype=np.float64) for name in (*WAY_QUANTITIES, ONSET, "seconds")}
        columns[ONSET], seconds = columns[ONSET][:, :1], columns.pop("seconds")
        parts: list[Any] = [None if pd.isna(part) else part for part in cast("tuple[Any, ...]", key)]
        start, n, nv, contact, force_tolerance = parts
        vertices: Any = tuple(int(count) for count in nv.split("/")) if nv else None
        way = EnsembleWay(start, int(n), vertices, contact, force_tolerance)
        levels = wide["seconds"].columns.to_numpy(dtype=np.float64)
        found[way] = WayRecord(way, wide.index.to_numpy(dtype=np.int64), levels, columns, seconds)
    return found


QUANTUM = {"z": 2.0, "void_sides": 1.0}  # over n: least step of what is counted; packings of equal z still scatter


class Difference(NamedTuple):
    """Difference of two ensemble means."""

    value: float  # mean of the first way minus mean of the reference
    error: float  # standard error
    freedom: float  # degrees of freedom of it


class Scatter(NamedTuple):
    """What one packing of a way gives and costs at rho."""

    deviation: float  # standard deviation from packing to packing
    freedom: float  # degrees of freedom of it
    share: float  # of the seeds that give a value
    seconds: float  # CPU time of a seed


def scatter(record: WayRecord, quantity: str, rho: float) -> Scatter:
    """Scatter, yield and cost of a way at rho, between the levels of its table."""
    levels, count = _levels(record, quantity), _count(record, quantity)
    deviation = math.exp(between(levels, np.log(deviations(record, quantity)), rho))
    share = between(levels, count / len(record.seeds), rho)
    seconds = between(levels, record.seconds.mean(axis=0), rho)
    return Scatter(deviation, _skewed(between(levels, count, rho)), share, seconds)


def is_known(record: WayRecord, reference: WayRecord, quantity: str, rho: float) -> bool:
    """Whether both have enough packings in the table beside rho for their difference to have an error."""
    fewest = WAYS.fewest if record is not reference else WAYS.fewest_values
    left, right, _ = neighbours(_levels(record, quantity), rho)
    return all(
        len(one.seeds) >= fewest
        and min(_count(one, quantity)[[left, right]]) >= WAYS.fewest_values
        and min(deviations(one, quantity)[[left, right]]) > 0
        for one in (record, reference)
    )


def difference(record: WayRecord, reference: WayRecord, quantity: str, rho: float) -> Difference:
    """Mean over packings of one way minus that of a reference, at rho; both share the levels of their table."""
    levels = _levels(record, quantity)
    means, variances = zip(*(_mean(one, quantity) for one in (record, reference)), strict=True)
    offsets = means[0] - means[1]
    error = math.hypot(between(levels, np.sqrt(sum(variances)), rho), bend(levels, offsets, rho))
    freedom = _skewed(min(len(record.seeds), len(reference.seeds)))
    return Difference(between(levels, offsets, rho), error, freedom)


def deviations(record: WayRecord, quantity: str) -> Array:
    """(k,) standard deviation from packing to packing at every level; nan where fewer than two have a value."""
    values = record.values[quantity]
    count = _count(record, quantity)
    squares = np.nansum((values - np.nansum(values, axis=0) / np.maximum(count, 1)) ** 2, axis=0)
    found = np.sqrt(squares / np.maximum(count - 1, 1))
    return np.where(count > 1, np.maximum(found, 0.5 * QUANTUM.get(quantity, 0.0) / record.way.n), np.nan)


def _levels(record: WayRecord, quantity: str) -> Array:
    return record.levels[:1] if quantity == ONSET else record.levels


def _mean(record: WayRecord, quantity: str) -> tuple[Array, Array]:
    """(k,) means at the levels, and their variances; nan where none has a value."""
    count = np.where(_count(record, quantity) > 0, _count(record, quantity), np.nan)
    return np.nansum(record.values[quantity], axis=0) / count, deviations(record, quantity) ** 2 / count


def _count(record: WayRecord, quantity: str) -> Array:
    return np.asarray(np.isfinite(record.values[quantity]).sum(axis=0, dtype=np.float64))


def _skewed(packings: float) -> float:
    """Degrees of freedom: half of the usual ones, as the scatter of skewed quantities is known less well."""
    return 0.5 * (packings - 1)
