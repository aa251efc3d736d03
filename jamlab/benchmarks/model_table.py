"""The table behind the automatic choice of a model: errors and times of every way on the same packings."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from jamlab.benchmarks.cpu_time import one_core
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import JamlabError
from jamlab.packing.atomic_file import atomic_file, check_target
from jamlab.packing.packing import CONTACT_FORMS, Packing
from jamlab.packing.versions import versions
from jamlab.protocols.model_choice import QUANTITIES, Way
from jamlab.protocols.onset import jam
from jamlab.protocols.scene import bring_to, default_way, quantities

LEVELS = (0.85, 0.88, 0.91, 0.95)
N = 32
SEEDS = range(1001, 1011)  # none that a test uses
_FEWER = 2 / 3  # of the default number of vertices


def ways(forms: Sequence[str] = CONTACT_FORMS, fractions: Sequence[float] = (_FEWER,)) -> list[Way]:
    """Disks, the default contact form with fewer vertices, other forms with the default number; default droplets."""
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
    """Measure, and write the table as JSON if a path is given.

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
        StorageError: the file cannot be written; found out before the work.
    """
    if path is not None:
        check_target(path)
    began = time.perf_counter()
    reference = reference or default_way()
    rows: dict[tuple[Way, float], dict[str, Any]] = {}
    finest: dict[float, list[dict[str, float]]] = {level: [] for level in levels}
    jammed = []
    with one_core():
        for seed in seeds:
            start = time.process_time()
            try:
                onset = jam("sp", n, seed)
            except JamlabError:
                continue
            jammed.append((seed, onset, time.process_time() - start))
        for level in levels:
            for seed, onset, onset_seconds in jammed:
                if progress is not None:
                    progress(f"rho = {level}, seed {seed}")
                target = _attempt(reference, onset, level)
                if target is None:  # the packing jams above this level, or has no reference
                    continue
                finest[level].append(target[0])
                for way in ways(forms, fractions):
                    row = rows.setdefault((way, level), _row(way, level))
                    if row["failed"] and row["failed"] == row["of"]:
                        continue
                    row["of"] += 1
                    reached = target if way == reference else _attempt(way, onset, level)
                    if reached is None:
                        row["failed"] += 1
                        continue
                    row["times"].append(onset_seconds + reached[1])
                    for name in QUANTITIES:
                        row["errors"][name].append(reached[0][name] - target[0][name])
    for (_, level), row in rows.items():
        times = row.pop("times")
        row["seconds"] = sum(times) / len(times) if times else None
        scale = sum(abs(target["g"]) for target in finest[level]) / len(finest[level])
        row["errors"] = {k: [e / (scale if k == "g" else 1) for e in v if e == e] for k, v in row["errors"].items()}
    table = {
        "schema": 1,
        "n": n,
        "reference": asdict(reference),
        "parameters": {k: v for k, v in defaults("dp").items() if k not in ("longest_edge", "contact")},
        "rows": list(rows.values()),
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
    """Twice the default number of vertices."""
    return Way("dp", default_way().contact, _vertices(2.0))


def _vertices(factor: float) -> tuple[int, int]:
    nv = default_way().nv
    assert nv is not None
    return max(3, round(factor * nv[0])), max(3, round(factor * nv[1]))


def _row(way: Way, level: float) -> dict[str, Any]:
    return {"way": asdict(way), "rho": level, "of": 0, "failed": 0, "times": [], "errors": {k: [] for k in QUANTITIES}}


def _attempt(way: Way, onset: Packing, rho: float) -> tuple[dict[str, float], float] | None:
    """Quantities and seconds of a way, None if it gives no jammed state."""
    began = time.process_time()
    try:
        values = quantities(bring_to(way, onset, rho))
    except JamlabError:
        return None
    if values["z"] != values["z"]:
        return None
    return values, time.process_time() - began
