"""What every task costs against N: CPU time and peak memory.

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
from jamlab.packing.hdf5 import read_hdf5
from jamlab.packing.packing import Packing
from jamlab.plotting import in_unit
from jamlab.processes.side_by_side import Report, run_side_by_side
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.protocols.relaxation import relax_session
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import EnsembleTables
from studies.panels import BESIDE, Drawing, TextTable, drawing, label, scale, sequence
from studies.reference_data import example_file
from studies.study import Study
from studies.tables import one_core, shortest

KICK = 0.01  # mean diameters of disks, or edges of droplets at rest
OMEGA = np.geomspace(1e-6, 1e2, 400)
PRESSURE, STRAIN, RATE, CONFLUENCE = 1e-3, 0.01, 1e-3, 0.98
_LARGE = {"disks": (1024, 4096, 16384, 65536), "droplets": (128, 512, 1152)}  # sizes, of packings that are repeated
_DISKS, _ONSETS, _MOVING, _SWEEPS = (256, 1024, 4096), (128, 256, 512), (64, 256, 1024), (16, 32, 64)  # and made anew

Run = Callable[[], Any]
Part = tuple[tuple[int, ...], Callable[[int], Run]]  # sizes, and what is timed of a size


def large(model: str, n: int, kick: float = 0.0) -> Packing:
    """A stable packing of n, repeated along both sides of its box, its coordinates moved by `kick` on average."""
    small = pack(256, 1e-2, ensemble="shear-stabilized") if model == "disks" else read_hdf5(example_file("dp"))
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


def _fire(packing: Packing) -> None:
    with Session(packing) as session:
        session.minimize(0.0, minimizer="fire", steps=200)


def _relax(packing: Packing) -> None:
    with Session(packing) as session:
        if not relax_session(session).converged:
            raise ConvergenceError(f"{packing.n} droplets were not relaxed")


def _forces(packing: Packing) -> Run:
    session = Session(packing)
    moves = 1e-3 * np.random.default_rng(2).standard_normal((10, *packing.positions.shape))
    return lambda: [session.forces_at(packing.positions + move) for move in moves]


def _sweep(onset: Packing) -> Run:
    return lambda: list(compress(onset, CONFLUENCE, (CONFLUENCE - packing_fraction(onset)) / 40))


def _on_large(run: Callable[[Packing], Any], model: str, kick: float = 0.0) -> Part:
    return _LARGE[model], lambda n: partial(run, large(model, n, kick))


_spectrum = partial(complex_modulus, omega=OMEGA)
PARTS: dict[str, Part] = {
    "disks: 200 FIRE steps": _on_large(_fire, "disks", KICK),
    f"disks: 3 packings at p = {PRESSURE:g}": (_DISKS, lambda n: lambda: [pack(n, PRESSURE, s) for s in (1, 2, 3)]),
    "disks: 3 onsets": (_ONSETS, lambda n: lambda: [jam(n=n, seed=s) for s in (1, 2, 3)]),
    "disks: contacts": _on_large(contacts, "disks"),
    "disks: measure": _on_large(measure, "disks"),
    "disks: elastic tensor": _on_large(elastic_tensor, "disks"),
    f"disks: G* at {len(OMEGA)} frequencies": _on_large(_spectrum, "disks"),
    f"disks: quasi-static shear to {STRAIN:g}": (
        _MOVING,
        lambda n: partial(quasistatic_shear, pack(n, PRESSURE, 1), strain=STRAIN),
    ),
    f"disks: flow at {RATE:g} to {STRAIN:g}": (
        _MOVING,
        lambda n: partial(shear, pack(n, PRESSURE, 1), rate=RATE, strain=STRAIN),
    ),
    "droplets: 10 forces": (_LARGE["droplets"], lambda n: _forces(large("droplets", n))),
    f"droplets: relax after kicks of {KICK:g}": _on_large(_relax, "droplets", KICK),
    "droplets: measure": _on_large(measure, "droplets"),
    f"droplets: G* at {len(OMEGA)} frequencies": _on_large(_spectrum, "droplets"),
    f"droplets: 40 states to {CONFLUENCE:g}": (_SWEEPS, lambda n: _sweep(jam(n, "dp", 1, start="from-disks"))),
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


def draw_scaling(tables: EnsembleTables) -> Drawing:
    """Draw seconds over N, with exponents."""
    out, (axes,) = drawing("size-scaling", 1, 1, 9.5, 5.6)
    scale(axes)
    lines = []
    for index, (part, rows) in enumerate(tables.read("size-scaling").groupby("part", sort=False)):
        n, seconds, peaks = (rows[name].to_numpy(dtype=np.float64) for name in ("n", "seconds", "bytes"))
        look = sequence(index, len(PARTS)) | {"linestyle": "-" if str(part).startswith("disks") else "--"}
        out.curve(axes, str(part), n, seconds, **look)
        measured = "; ".join(f"{a:g}: {b:.3g} s, {c / 1e9:.2g} GB" for a, b, c in zip(n, seconds, peaks, strict=True))
        exponent = fit_exponent(n, seconds) if len(n) > 1 else np.nan
        lines.append([str(part), measured, f"{exponent:.2f}"])
    label(axes, "number of particles $N$", in_unit("CPU time on one core", "s"), **BESIDE)
    out.text, out.caption = [TextTable(["part", "N: seconds, memory", "time ~ N^"], lines)], STUDY.title
    return out


STUDY = Study(
    "size-scaling",
    "What every task costs: time and memory against N",
    {  # small ones first, so that a run that is stopped has every part
        f"{part}, N = {sizes[rank]}": partial(measure_part, part, sizes[rank])
        for rank in range(4)
        for part, (sizes, _) in PARTS.items()
        if rank < len(sizes)
    },
    draw_scaling,
)
