"""What large packings need: CPU time and memory of each part of the work against N, and what follows for larger N.

Every part is measured in a process of its own, whose peak memory is that of the part. Packings of any size are small
ones repeated along both sides of the box: a step costs the same there as in one made at random, but how many steps a
minimum takes does not, so whole packings are made from random starts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.measure import measure
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.packing.hdf5 import read
from jamlab.packing.packing import Packing
from jamlab.processes.side_by_side import Report, run_side_by_side
from jamlab.protocols.relaxation import relax
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.studies.cpu_time import one_core, shortest
from jamlab.studies.example_packings import example_file

KICK = 0.01  # mean diameters of disks, or edges of droplets at rest
PRESSURE = 1e-3  # k, of disks packed from random starts
FIRE_STEPS = 200
OMEGA = np.geomspace(1e-6, 1e2, 41)
_DISKS, _STABLE = 256, 1e-2  # number and pressure of disks whose repetition is stable too
_KILO = 1024  # bytes in a unit of /proc


@dataclass(frozen=True)
class Cost:
    """One part of the work at one size.

    Attributes:
        n: number of particles.
        seconds: CPU time on one core, the shortest of a few runs.
        bytes: peak memory of the process, Python and all libraries included.
    """

    n: int
    seconds: float
    bytes: int


@dataclass(frozen=True)
class PowerLaw:
    """seconds = at_one * n ** exponent."""

    at_one: float
    exponent: float

    def __call__(self, n: float) -> float:
        return float(self.at_one * n**self.exponent)


def fit_time(costs: Sequence[Cost]) -> PowerLaw:
    """Fit a power of n to the seconds, by least squares in the logarithms."""
    exponent, intercept = np.polyfit(np.log([c.n for c in costs]), np.log([c.seconds for c in costs]), 1)
    return PowerLaw(float(np.exp(intercept)), float(exponent))


def bytes_at(costs: Sequence[Cost], n: int) -> float:
    """Memory at n, on the straight line through the two largest sizes: a process of no particles has its share too."""
    small, large = costs[-2:]
    return large.bytes + (n - large.n) * (large.bytes - small.bytes) / (large.n - small.n)


def cost(part: str, n: int) -> Cost:
    """Measure one part of `PARTS` at about n particles, in a new process."""
    return run_side_by_side(_measure_part, [(part, n)], 1)[0]


def _measure_part(part_and_size: tuple[str, int], report: Report) -> Cost:
    part, n = part_and_size
    with one_core():
        run, count = PARTS[part](n)
        Path("/proc/self/clear_refs").write_text("5")  # forgets the peak so far, see proc(5)
        seconds, _ = shortest(run, runs=3, budget=2.0)
    return Cost(count, seconds, _peak())


def _peak() -> int:
    """Largest resident memory of this process, in bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) * _KILO


def repeated(packing: Packing, times: int, kick: float = 0.0) -> Packing:
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
    return repeated(small, max(1, round(np.sqrt(n / small.n))), kick)


Run = Callable[[], object]


def _fire(n: int) -> tuple[Run, int]:
    packing = _large("sp", n, KICK)

    def run() -> None:
        with Session(packing) as session:
            session.minimize(0.0, style="fire", steps=FIRE_STEPS)

    return run, packing.n


def _pack(n: int) -> tuple[Run, int]:
    return lambda: [pack(n, PRESSURE, seed) for seed in (1, 2, 3)], n


def _relax_droplets(n: int) -> tuple[Run, int]:
    packing = _large("dp", n, KICK)

    def run() -> None:
        with Session(packing) as session:
            if not relax(session).converged:
                raise ConvergenceError(f"n = {packing.n}: droplets were not relaxed")

    return run, packing.n


def _forces_of_droplets(n: int) -> tuple[Run, int]:
    packing = _large("dp", n)
    session = Session(packing)
    rng = np.random.default_rng(2)
    moves: NDArray[np.float64] = 1e-3 * rng.standard_normal((10, *packing.positions.shape))
    return lambda: [session.forces_at(packing.positions + move) for move in moves], packing.n


def _of_minimum(model: str, work: Callable[[Packing], object]) -> Callable[[int], tuple[Run, int]]:
    """Work on a state at a minimum: the small packing, repeated."""

    def prepare(n: int) -> tuple[Run, int]:
        packing = _large(model, n)
        return lambda: work(packing), packing.n

    return prepare


# name -> function of n that gives what is timed, and the n that it has
PARTS: dict[str, Callable[[int], tuple[Run, int]]] = {
    f"disks: {FIRE_STEPS} FIRE steps": _fire,
    f"disks: 3 packings at p = {PRESSURE:g}": _pack,
    "disks: contacts": _of_minimum("sp", contacts),
    "disks: measure": _of_minimum("sp", measure),
    "disks: elastic tensor": _of_minimum("sp", elastic_tensor),
    f"disks: G* at {len(OMEGA)} frequencies": _of_minimum("sp", lambda packing: complex_modulus(packing, OMEGA)),
    "droplets: 10 forces": _forces_of_droplets,
    f"droplets: relax after kicks of {KICK:g}": _relax_droplets,
    "droplets: measure": _of_minimum("dp", measure),
}
