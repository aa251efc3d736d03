"""Measure the table behind the automatic choice of a model: errors and times of every way on the same packings."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jamlab.benchmarks.cpu_time import one_core
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import JamlabError
from jamlab.packing.atomic_file import atomic_file, check_target
from jamlab.packing.law_parameters import CONTACT_FORMS
from jamlab.packing.packing import Packing
from jamlab.packing.versions import versions
from jamlab.protocols.model_choice import QUANTITIES, Way
from jamlab.protocols.onset import jam
from jamlab.protocols.scene import bring_to, default_way, quantities

LEVELS = (0.85, 0.88, 0.91, 0.95)  # rho: onset, where the models part ([B] fig 5), and up towards confluence
N = 32  # the smallest size of Boromand et al.
SEEDS = range(1001, 1011)  # none that a test uses
_FEWER = 2 / 3  # fraction of the default number of vertices


class Start(NamedTuple):
    """Disks at onset, from which every way starts: seed, packing, seconds it took."""

    seed: int
    onset: Packing
    seconds: float


def ways(forms: Sequence[str] = CONTACT_FORMS, fractions: Sequence[float] = (_FEWER,)) -> list[Way]:
    """Ways to compare: disks, default droplets with fewer vertices, other contact forms, default droplets."""
    usual = default_way()
    assert usual.contact is not None and usual.nv is not None
    found = [Way("sp")] + [Way("dp", usual.contact, _vertices(f)) for f in fractions]
    return [*found, *(Way("dp", form, usual.nv) for form in forms if form != usual.contact), usual]


def make_table(
    path: Path | None,
    *,
    n: int = N,
    seeds: range = SEEDS,
    levels: tuple[float, ...] = LEVELS,
    forms: Sequence[str] = CONTACT_FORMS,
    fractions: Sequence[float] = (_FEWER,),
    reference: Way | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Measure the table, and write it as JSON if a path is given.

    Every way and the reference start from the same disks at onset. A way that fails on the first packing of a level is
    not tried on the others.

    Args:
        path: file to write, or None.
        n: particles of each packing.
        seeds: of the packings.
        levels: true packing fractions.
        forms: contact forms to try besides the default one.
        fractions: of the default number of vertices, to try too.
        reference: what errors are measured against; default droplets if None.
        progress: called with each level and seed.

    Raises:
        StorageError: the file cannot be written; raised before the work.
    """
    if path is not None:
        check_target(path)
    began = time.perf_counter()
    reference = reference or default_way()
    rows: list[dict[str, Any]] = []
    with one_core():
        disks = _jam_disks(n, seeds)
        for level in levels:
            rows += _measure_level(level, disks, ways(forms, fractions), reference, progress)
    table = {
        "schema": 1,
        "n": n,
        "reference": asdict(reference),
        "parameters": {k: v for k, v in defaults("dp").items() if k not in ("longest_edge", "contact")},
        "rows": rows,
        "provenance": {
            "command": "jamlab chart table",
            "seeds": list(seeds),
            "quantities": QUANTITIES,
            "wall_time": round(time.perf_counter() - began, 1),
            **versions(),
        },
    }
    if path is not None:
        with atomic_file(path) as temporary:
            temporary.write_text(json.dumps(table, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return table


def finest_way() -> Way:
    """Default droplets with twice the default number of vertices."""
    return Way("dp", default_way().contact, _vertices(2.0))


def _vertices(factor: float) -> tuple[int, int]:
    nv = default_way().nv
    assert nv is not None
    return max(3, round(factor * nv[0])), max(3, round(factor * nv[1]))


def _jam_disks(n: int, seeds: range) -> list[Start]:
    """Disks at onset; seeds without one are left out."""
    found = []
    for seed in seeds:
        began = time.process_time()
        try:
            onset = jam("sp", n, seed)
        except JamlabError:
            continue
        found.append(Start(seed, onset, time.process_time() - began))
    return found


def _measure_level(
    level: float,
    disks: Sequence[Start],
    options: Sequence[Way],
    reference: Way,
    progress: Callable[[str], None] | None,
) -> list[dict[str, Any]]:
    """Rows of one packing fraction, one for each way; none if no packing reaches it."""
    rows = {way: _new_row(way, level) for way in options}
    targets = []
    for seed, onset, seconds in disks:
        if progress is not None:
            progress(f"rho = {level}, seed {seed}")
        target = _attempt(reference, onset, level)
        if target is None:  # the packing jams above this level, or has no reference
            continue
        targets.append(target[0])
        for way, row in rows.items():
            if row["failed"] and row["failed"] == row["of"]:
                continue
            row["of"] += 1
            reached = target if way == reference else _attempt(way, onset, level)
            if reached is None:
                row["failed"] += 1
                continue
            row["times"].append(seconds + reached[1])
            for name in QUANTITIES:
                row["errors"][name].append(reached[0][name] - target[0][name])
    return [_finish_row(row, targets) for row in rows.values()] if targets else []


def _new_row(way: Way, level: float) -> dict[str, Any]:
    return {"way": asdict(way), "rho": level, "of": 0, "failed": 0, "times": [], "errors": {k: [] for k in QUANTITIES}}


def _finish_row(row: dict[str, Any], targets: Sequence[dict[str, float]]) -> dict[str, Any]:
    """Replace times by their mean, errors of G by relative ones, and drop errors that are nan."""
    times = row.pop("times")
    row["seconds"] = sum(times) / len(times) if times else None
    scale = sum(abs(target["g"]) for target in targets) / len(targets)
    row["errors"] = {
        k: [e / (scale if k == "g" else 1) for e in v if not np.isnan(e)] for k, v in row["errors"].items()
    }
    return row


def _attempt(way: Way, onset: Packing, rho: float) -> tuple[dict[str, float], float] | None:
    """Quantities that a way gives, and its seconds; None if it does not reach a jammed state."""
    began = time.process_time()
    try:
        values = quantities(bring_to(way, onset, rho))
    except JamlabError:
        return None
    if np.isnan(values["z"]):
        return None
    return values, time.process_time() - began
