"""A study of what every task costs against N: CPU time, memory, and what larger N will need.

Every part is measured in a process of its own, whose peak memory is that of the part. Packings of any size are small
ones repeated along both sides of the box: a step costs the same there as in one made at random, but how many steps a
minimum takes does not, so whole packings, sweeps and flows start from random ones.
"""

import resource
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
PRESSURE = 1e-3  # k, of disks packed from random starts
FIRE_STEPS = 200
OMEGA = np.geomspace(1e-6, 1e2, 400)
STRAIN, RATE = 0.01, 1e-3  # of sheared disks
SWEEP = 0.98, 40  # packing fraction that droplets are compressed to, and in how many states
_DISKS, _STABLE = 256, 1e-2  # number and pressure of disks whose repetition is stable too
_SIZES = {"disks": (1024, 4096, 16384, 65536), "droplets": (128, 512, 1152)}
_MADE = {  # from random starts
    "packings": (256, 1024, 4096),
    "onsets": (128, 256, 512),
    "shear": (64, 256, 1024),
    "flow": (64, 256, 1024),
    "states": (16, 32, 64),
}
_WANTED = {"disks": 1_000_000, "droplets": 100_000}
_KILO = 1024  # bytes in a unit of /proc


def exponent_of(n: ArrayLike, seconds: ArrayLike) -> tuple[float, float]:
    """Exponent of a power of n through the seconds (m,), by least squares in the logarithms, and seconds at n = 1."""
    exponent, intercept = np.polyfit(np.log(n), np.log(seconds), 1)
    return float(exponent), float(np.exp(intercept))


def memory_at(n: float, sizes: ArrayLike, peaks: ArrayLike) -> float:
    """Memory at n, on the straight line through the two largest sizes: a process of no particles has its share too."""
    (small, large), (low, high) = np.asarray(sizes, dtype=float)[-2:], np.asarray(peaks, dtype=float)[-2:]
    return float(high + (n - large) * (high - low) / (large - small))


def measure_part(part: str, n: int) -> list[dict[str, Any]]:
    """Measure one part of `PARTS` at about n particles, in a new process: CPU seconds on one core, and peak memory."""
    return [run_side_by_side(_measure_part, [(part, n)], 1)[0]]


def _measure_part(part_and_size: tuple[str, int], report: Report) -> dict[str, Any]:
    part, n = part_and_size
    with one_core():
        run, count = PARTS[part](n)
        with suppress(FileNotFoundError):  # no Linux: the peak is that since the start
            Path("/proc/self/clear_refs").write_text("5")  # forgets the peak so far, see proc(5)
        seconds, _ = shortest(run, runs=3, budget=2.0)
        return {"part": part, "n": count, "seconds": seconds, "bytes": _peak()}


def _peak() -> int:
    """Largest memory of this process so far, bytes."""
    if sys.platform == "darwin":
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) * _KILO


def _repeated(packing: Packing, times: int, kick: float = 0.0) -> Packing:
    """A packing repeated along both sides of its box; every coordinate then moves at random, on average by `kick`."""
    cells = np.indices((times, times)).reshape(2, -1).T
    positions = (packing.positions + (cells @ packing.box)[:, None]).reshape(-1, 2)
    positions += kick * np.random.default_rng(1).standard_normal(positions.shape)
    box, params = times * packing.box, dict(packing.params)
    if packing.offsets is None:
        diameters = np.tile(np.asarray(packing.diameters), len(cells))
        return Packing("sp", box, positions, params, packing.units, diameters=diameters)
    params["a0"] = np.tile(np.asarray(params["a0"]), len(cells))
    offsets = np.concatenate([[0], np.cumsum(np.tile(np.diff(packing.offsets), len(cells)))])
    return Packing("dp", box, positions, params, packing.units, offsets=offsets)


@cache
def _small(model: str) -> Packing:
    return pack(_DISKS, _STABLE, ensemble="shear-stabilized") if model == "sp" else read(example_file("dp"))


def _large(model: str, n: int, kick: float = 0.0) -> Packing:
    small = _small(model)
    return _repeated(small, max(1, round(np.sqrt(n / small.n))), kick)


Run = Callable[[], object]
Prepare = Callable[[int], tuple[Run, int]]  # function of n that gives what is timed, and the n that it has


def _fire(packing: Packing) -> None:
    with Session(packing) as session:
        session.minimize(0.0, style="fire", steps=FIRE_STEPS)


def _relax(packing: Packing) -> None:
    with Session(packing) as session:
        if not relax(session).converged:
            raise ConvergenceError(f"n = {packing.n}: droplets were not relaxed")


def _forces_of_droplets(n: int) -> tuple[Run, int]:
    packing = _large("dp", n)
    session = Session(packing)
    rng = np.random.default_rng(2)
    moves: NDArray[np.float64] = 1e-3 * rng.standard_normal((10, *packing.positions.shape))
    return lambda: [session.forces_at(packing.positions + move) for move in moves], packing.n


def _sweep(n: int) -> tuple[Run, int]:
    onset, (end, states) = jam("dp", n, 1), SWEEP
    step = (end - packing_fraction(onset)) / states
    return lambda: list(compress(onset, end, step)), n


def _of_three(make: Callable[[int, int], Packing]) -> Prepare:
    """Make packings of three seeds, from random starts."""
    return lambda n: (lambda: [make(n, seed) for seed in (1, 2, 3)], n)


def _of_minimum(model: str, work: Callable[[Packing], object], kick: float = 0.0) -> Prepare:
    """Work on a state at a minimum: the small packing, repeated; or on one that was kicked off it."""

    def prepare(n: int) -> tuple[Run, int]:
        packing = _large(model, n, kick)
        return partial(work, packing), packing.n

    return prepare


def _of_random(work: Callable[[Packing], object]) -> Prepare:
    """Work on disks at a pressure, made from a random start."""
    return lambda n: (partial(work, pack(n, PRESSURE, 1)), n)


PARTS: dict[str, Prepare] = {
    f"disks: {FIRE_STEPS} FIRE steps": _of_minimum("sp", _fire, KICK),
    f"disks: 3 packings at p = {PRESSURE:g}": _of_three(lambda n, seed: pack(n, PRESSURE, seed)),
    "disks: 3 onsets": _of_three(lambda n, seed: jam(n=n, seed=seed)),
    "disks: contacts": _of_minimum("sp", contacts),
    "disks: measure": _of_minimum("sp", measure),
    "disks: elastic tensor": _of_minimum("sp", elastic_tensor),
    f"disks: G* at {len(OMEGA)} frequencies": _of_minimum("sp", lambda packing: complex_modulus(packing, OMEGA)),
    f"disks: quasi-static shear to {STRAIN:g}": _of_random(lambda packing: quasistatic_shear(packing, STRAIN)),
    f"disks: flow at {RATE:g} to {STRAIN:g}": _of_random(lambda packing: shear(packing, RATE, STRAIN)),
    "droplets: 10 forces": _forces_of_droplets,
    f"droplets: relax after kicks of {KICK:g}": _of_minimum("dp", _relax, KICK),
    "droplets: measure": _of_minimum("dp", measure),
    f"droplets: G* at {len(OMEGA)} frequencies": _of_minimum("dp", lambda packing: complex_modulus(packing, OMEGA)),
    f"droplets: {SWEEP[1]} states to {SWEEP[0]:g}": _sweep,
}


def _tasks() -> dict[str, Task]:
    """One task for each part and size; small ones first, so that a run that is stopped has every part."""
    sizes = {
        part: next((n for what, n in _MADE.items() if what in part), _SIZES[part.partition(":")[0]]) for part in PARTS
    }
    ranks = range(max(map(len, sizes.values())))
    in_turn = [(part, n) for rank in ranks for part in PARTS for n in sizes[part][rank : rank + 1]]
    return {f"{part}, N = {n}": partial(measure_part, part, n) for part, n in in_turn}


def draw_scaling(tables: EnsembleTables) -> Drawing:
    """Draw seconds over N, with exponents and what follows for a million disks or 10^5 droplets."""
    out, (axes,) = drawing("size-scaling", 1, 1, 9.5, 5.6)
    scale(axes)
    lines = []
    for index, (part, rows) in enumerate(tables.read("size-scaling").groupby("part", sort=False)):
        n, seconds, peaks = (rows[name].to_numpy(dtype=np.float64) for name in ("n", "seconds", "bytes"))
        line = "-" if str(part).startswith("disks") else "--"
        out.curve(axes, str(part), n, seconds, linestyle=line, **sequence(index, len(PARTS)))
        measured = "; ".join(f"{a:g}: {b:.3g} s, {c / 1e9:.2g} GB" for a, b, c in zip(n, seconds, peaks, strict=True))
        if len(n) < 2:
            continue
        (exponent, at_one), wanted = exponent_of(n, seconds), _WANTED[str(part).partition(":")[0]]
        there = [f"{at_one * wanted**exponent:.3g} s", f"{memory_at(wanted, n, peaks) / 1e9:.2g} GB"]
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
