"""What every task costs against N: CPU time, peak memory, and what larger packings will need.

Every part is measured in a process of its own. Large packings are small ones repeated along both sides of the box: a
step costs the same there as in one made at random, but how many steps a minimum takes does not, so whole packings,
sweeps and flows start from random ones.
"""

import resource
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.flow.shear import shear
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.measure import measure
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.packing.hdf5 import read
from jamlab.packing.packing import Packing
from jamlab.processes.side_by_side import Report, run_side_by_side
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.protocols.relaxation import relax
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from studies.ensemble_tables import EnsembleTables
from studies.html_page import TextTable
from studies.panels import BESIDE, Drawing, drawing, label, scale, sequence
from studies.reference_data import example_file
from studies.study import Study
from studies.tables import Task, one_core, shortest

KICK = 0.01  # mean diameters of disks, or edges of droplets at rest
OMEGA = np.geomspace(1e-6, 1e2, 400)
PRESSURE, STRAIN, RATE, CONFLUENCE = 1e-3, 0.01, 1e-3, 0.98
_WANTED = {"disks": 1_000_000, "droplets": 100_000}
_LARGE_DISKS, _LARGE_DROPLETS = (1024, 4096, 16384, 65536), (128, 512, 1152)  # sizes, of packings that are repeated
_DISKS, _ONSETS, _MOVING, _SWEEPS = (256, 1024, 4096), (128, 256, 512), (64, 256, 1024), (16, 32, 64)  # and made anew

Run = Callable[[], Any]


def large(model: str, n: int, kick: float = 0.0) -> Packing:
    """A stable packing of n, repeated along both sides of its box, its coordinates moved by `kick` on average."""
    small = pack(256, 1e-2, ensemble="shear-stabilized") if model == "disks" else read(example_file("dp"))
    times = max(1, round(np.sqrt(n / small.n)))
    cells = np.indices((times, times)).reshape(2, -1).T
    positions = (small.positions + (cells @ small.box)[:, None]).reshape(-1, 2)
    positions += kick * np.random.default_rng(1).standard_normal(positions.shape)
    box, params = times * small.box, dict(small.params)
    if small.offsets is None:
        diameters = np.tile(np.asarray(small.diameters), len(cells))
        return Packing("sp", box, positions, params, small.units, diameters=diameters)
    params["a0"] = np.tile(np.asarray(params["a0"]), len(cells))
    offsets = np.concatenate([[0], np.cumsum(np.tile(np.diff(small.offsets), len(cells)))])
    return Packing("dp", box, positions, params, small.units, offsets=offsets)


def _step(packing: Packing) -> Run:
    """A function that does 200 steps of FIRE, or of droplets relaxes them."""

    def run() -> None:
        with Session(packing) as session:
            if packing.model == "sp":
                session.minimize(0.0, style="fire", steps=200)
            elif not relax(session).converged:
                raise ConvergenceError(f"{packing.n} droplets were not relaxed")

    return run


def _forces(packing: Packing) -> Run:
    session = Session(packing)
    moves = 1e-3 * np.random.default_rng(2).standard_normal((10, *packing.positions.shape))
    return lambda: [session.forces_at(packing.positions + move) for move in moves]


def _sweep(onset: Packing) -> Run:
    return lambda: list(compress(onset, CONFLUENCE, (CONFLUENCE - packing_fraction(onset)) / 40))


_disks, _droplets = partial(large, "disks"), partial(large, "droplets")
PARTS: dict[str, tuple[tuple[int, ...], Callable[[int], Run]]] = {  # part -> sizes, what is timed of a size
    "disks: 200 FIRE steps": (_LARGE_DISKS, lambda n: _step(_disks(n, KICK))),
    f"disks: 3 packings at p = {PRESSURE:g}": (_DISKS, lambda n: lambda: [pack(n, PRESSURE, s) for s in (1, 2, 3)]),
    "disks: 3 onsets": (_ONSETS, lambda n: lambda: [jam(n=n, seed=s) for s in (1, 2, 3)]),
    "disks: contacts": (_LARGE_DISKS, lambda n: partial(contacts, _disks(n))),
    "disks: measure": (_LARGE_DISKS, lambda n: partial(measure, _disks(n))),
    "disks: elastic tensor": (_LARGE_DISKS, lambda n: partial(elastic_tensor, _disks(n))),
    f"disks: G* at {len(OMEGA)} frequencies": (_LARGE_DISKS, lambda n: partial(complex_modulus, _disks(n), OMEGA)),
    f"disks: quasi-static shear to {STRAIN:g}": (
        _MOVING,
        lambda n: partial(quasistatic_shear, pack(n, PRESSURE, 1), strain=STRAIN),
    ),
    f"disks: flow at {RATE:g} to {STRAIN:g}": (
        _MOVING,
        lambda n: partial(shear, pack(n, PRESSURE, 1), rate=RATE, strain=STRAIN),
    ),
    "droplets: 10 forces": (_LARGE_DROPLETS, lambda n: _forces(_droplets(n))),
    f"droplets: relax after kicks of {KICK:g}": (_LARGE_DROPLETS, lambda n: _step(_droplets(n, KICK))),
    "droplets: measure": (_LARGE_DROPLETS, lambda n: partial(measure, _droplets(n))),
    f"droplets: G* at {len(OMEGA)} frequencies": (
        _LARGE_DROPLETS,
        lambda n: partial(complex_modulus, _droplets(n), OMEGA),
    ),
    f"droplets: 40 states to {CONFLUENCE:g}": (_SWEEPS, lambda n: _sweep(jam("dp", n, 1))),
}


def measure_part(part: str, n: int) -> list[dict[str, Any]]:
    """Measure one part of `PARTS` at n particles, in a new process: CPU seconds on one core, and peak memory."""
    return [run_side_by_side(_measure_part, [(part, n)], 1)[0]]


def _measure_part(part_and_size: tuple[str, int], report: Report) -> dict[str, Any]:
    part, n = part_and_size
    with one_core():
        seconds, _ = shortest(PARTS[part][1](n), runs=3, budget=2.0)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    return {"part": part, "n": n, "seconds": seconds, "bytes": peak}


def _tasks() -> dict[str, Task]:
    """One task for each part and size; small ones first, so that a run that is stopped has every part."""
    turns = [(rank, part, n) for part, (sizes, _) in PARTS.items() for rank, n in enumerate(sizes)]
    in_turn = sorted(turns, key=lambda turn: turn[0])
    return {f"{part}, N = {n}": partial(measure_part, part, n) for _, part, n in in_turn}


def draw_scaling(tables: EnsembleTables) -> Drawing:
    """Draw seconds over N, with exponents and, by them, what a million disks or 10^5 droplets will need."""
    out, (axes,) = drawing("size-scaling", 1, 1, 9.5, 5.6)
    scale(axes)
    lines = []
    for index, (part, rows) in enumerate(tables.read("size-scaling").groupby("part", sort=False)):
        n, seconds, peaks = (rows[name].to_numpy(dtype=np.float64) for name in ("n", "seconds", "bytes"))
        wanted = _WANTED[str(part).partition(":")[0]]
        line = "-" if wanted == _WANTED["disks"] else "--"
        out.curve(axes, str(part), n, seconds, linestyle=line, **sequence(index, len(PARTS)))
        if len(n) < 2:
            continue
        measured = "; ".join(f"{a:g}: {b:.3g} s, {c / 1e9:.2g} GB" for a, b, c in zip(n, seconds, peaks, strict=True))
        exponent, at_one = np.polyfit(np.log(n), np.log(seconds), 1)
        memory = np.polyval(np.polyfit(n[-2:], peaks[-2:], 1), wanted)  # a process of no particles has its share too
        there = [f"{np.exp(at_one) * wanted**exponent:.3g} s", f"{memory / 1e9:.2g} GB"]
        lines.append([str(part), measured, f"{exponent:.2f}", f"{wanted:.0e}", *there])
    label(axes, "number of particles N", "CPU time on one core, s", **BESIDE)
    columns = ["part", "N: seconds, memory", "time ~ N^", "wanted N", "time there", "memory there"]
    out.text, out.caption = [TextTable(columns, lines)], STUDY.title
    return out


STUDY = Study(
    "size-scaling",
    "What every task costs: time and memory against N, and what large packings need",
    _tasks(),
    draw_scaling,
)
