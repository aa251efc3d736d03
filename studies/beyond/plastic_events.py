"""A study of plastic events in slow steady shear: the distribution of their sizes, and its change with the number of
disks."""

from functools import partial
from typing import Any

from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.protocols.target_pressure import pack
from studies.tables import Task

PRESSURE, STRAIN, STEP, WIDTH = 1e-2, 0.3, 2e-3, 1e-4
SIZES = (16, 32, 64)
SEEDS, BLOCK = 20, 4  # packings of a size, and of one task
STEADY = 0.1  # strain from which on events count


def measure_events(n: int, first: int) -> list[dict[str, Any]]:
    """Shear packings at a fixed area: strain, energy, stress drop and participants of every event, a row each."""
    rows = []
    for seed in range(first, first + BLOCK):
        run = quasistatic_shear(pack(n, PRESSURE, seed), STRAIN, STEP, event_width=WIDTH)
        events, row = run.events, {"n": n, "seed": seed, "missed": int((~run.converged).sum())}
        columns = ("strain", "stress_drop", "energy", "participation", "contacts_lost", "contacts_gained", "kind")
        for values in zip(*(getattr(events, name) for name in columns), strict=True):
            rows.append({**row, **dict(zip(columns, values, strict=True))})
    return rows


def _tasks() -> dict[str, Task]:
    starts = range(1, SEEDS + 1, BLOCK)
    return {f"{n} {first}": partial(measure_events, n, first) for n in SIZES for first in starts}
