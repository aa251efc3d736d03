"""jamlab beside its peers in one run on one core: one point, one minimum, and the time that it takes."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.benchmarks.cpu_time import one_core, shortest
from jamlab.benchmarks.other_codes.ase_peer import ASE
from jamlab.benchmarks.other_codes.jax_md_peer import JaxMD
from jamlab.benchmarks.other_codes.lammps_peer import Lammps
from jamlab.benchmarks.other_codes.numpy_disks import all_pairs
from jamlab.benchmarks.other_codes.openmm_peer import OpenMM
from jamlab.benchmarks.other_codes.peer import EXTRA, Descent, Peer, Point
from jamlab.engine.session import Session, evaluate
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.measure import measure
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax

Array = NDArray[np.float64]

PEERS: tuple[Peer, ...] = (JaxMD(), OpenMM(), ASE(), Lammps("cg"), Lammps("fire"), Lammps("hftn"))

_FASTER = (
    "faster here: the same minimiser that jamlab starts with, but with LAMMPS' line search on the energy, which misses "
    "the tolerance on other starts (jamlab chart speed-accuracy), and to twice the force"
)
_JOLT = 0.01  # mean diameters: leaves the minimum, not its basin
_TRIES = 20  # starts until one is found whose minimum is stable and whose jolt leads back


@dataclass(frozen=True)
class Row:
    """One code.

    Attributes:
        name: of the code; method: its minimiser.
        version: installed, or None: then all else is None, and `note` says what to install.
        energy, forces, stress, pressure: largest difference from jamlab at the same coordinates, over the largest
            value; stress is None where the code has none.
        minimum: relative difference of the energy at its minimum from jamlab's; z, g: differences there.
        max_force: left at its minimum, worked out in numpy.
        cold: s, first minimisation with set-up and compiling; warm: s, shortest of those that follow.
        cold_ratio, warm_ratio: over jamlab's.
        note: what a reader must know.
    """

    name: str
    method: str = ""
    version: str | None = None
    energy: float | None = None
    forces: float | None = None
    stress: float | None = None
    pressure: float | None = None
    minimum: float | None = None
    z: float | None = None
    g: float | None = None
    max_force: float | None = None
    cold: float | None = None
    warm: float | None = None
    cold_ratio: float | None = None
    warm_ratio: float | None = None
    note: str = ""


def compare(
    n: int = 64,
    seed: int = 1,
    phi: float = 0.88,
    *,
    peers: Sequence[Peer] = PEERS,
    progress: Callable[[str], None] | None = None,
) -> list[Row]:
    """jamlab and its peers on one packing of disks in units "eps".

    Random starts end in different minima in different codes, so the start is a minimum whose disks were moved a little.

    Args:
        n: even number of disks; the peers work through all n^2 pairs or a cutoff, whatever they do by default.
        seed: of the start.
        phi: nominal packing fraction, above onset.
        peers: which codes.
        progress: called with the name of each code when its turn comes.

    Returns:
        Rows, jamlab first. A code that is not installed is a row that says so.

    Raises:
        ConvergenceError: no stable minimum was found to start from.
    """
    start, minimum = jolted_minimum(n, seed, phi)
    tolerance = force_tolerance("sp")
    at_start, at_end = evaluate(start), measure(minimum)
    here = Point(at_start.energy, at_start.forces, at_start.stress, at_start.pressure)
    reference = all_pairs(start)
    with one_core():
        if progress is not None:
            progress("jamlab")
        cold, warm, _ = _timed(partial(_jamlab_descent, start))
        forces = reference(minimum.positions).forces
        rows = [
            Row(
                "jamlab",
                "relax",
                _jamlab_version(),
                **_differences(reference(start.positions), here),
                minimum=0.0,
                z=0.0,
                g=0.0,
                max_force=float(np.hypot(*forces.T).max()),
                cold=cold,
                warm=warm,
                cold_ratio=1.0,
                warm_ratio=1.0,
                note="its point beside all pairs in numpy",
            )
        ]
        for peer in peers:
            if progress is not None:
                progress(peer.name)
            if peer.version is None:
                rows.append(Row(peer.name, peer.method, note=f"not installed: {EXTRA}"))
                continue
            differences = _differences(peer.evaluate(start), here)
            cold_peer, warm_peer, positions = _timed(partial(peer.descent, start, tolerance))
            point = reference(positions)
            left = float(np.hypot(*point.forces.T).max())
            end = measure(start.with_state(positions=positions))
            notes = []
            if left > tolerance:
                notes.append(f"stopped at max force {left:.1g}, not {tolerance:g}")
            if warm_peer < warm:
                notes.append(_FASTER)
            rows.append(
                Row(
                    peer.name,
                    peer.method,
                    peer.version,
                    **differences,
                    minimum=abs(point.energy / at_end["energy"] - 1),
                    z=end["z"] - at_end["z"],
                    g=end["g"] - at_end["g"],
                    max_force=left,
                    cold=cold_peer,
                    warm=warm_peer,
                    cold_ratio=cold_peer / cold,
                    warm_ratio=warm_peer / warm,
                    note="; ".join(notes),
                )
            )
    return rows


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Rows as plain values for JSON."""
    return {"rows": [asdict(row) for row in rows]}


def jolted_minimum(n: int, seed: int, phi: float) -> tuple[Packing, Packing]:
    """A start, and the minimum that jamlab finds from it: of a jammed packing without negative modes.

    Raises:
        ConvergenceError: none was found.
    """
    for trial in range(_TRIES):
        rng = np.random.default_rng([seed, trial])
        with Session(random_disks(n, seed + trial, phi=phi)) as session:
            if not relax(session).converged or contacts(session.packing()).rattlers.all():
                continue
            first = session.packing()
            start = first.with_state(positions=first.positions + _JOLT * rng.standard_normal((n, 2)))
            session.load(start)
            if relax(session).converged and np.isfinite(measure(session.packing())["g"]):
                return start, session.packing()
    raise ConvergenceError(f"no stable minimum at phi = {phi} with n = {n}: raise phi or take another seed")


def _jamlab_descent(start: Packing) -> Descent:
    session = Session(start)

    def run() -> Array:
        session.load(start)
        relax(session)
        return session.positions()

    return run


def _timed(make: Callable[[], Descent]) -> tuple[float, float, Array]:
    """Seconds of the first run, with what goes before, shortest of the next, and the positions reached."""
    began = time.process_time()
    run = make()
    run()
    cold = time.process_time() - began
    warm, positions = shortest(run)
    return cold, warm, positions


def _differences(point: Point, here: Point) -> dict[str, Any]:
    return {
        "energy": abs(point.energy / here.energy - 1),
        "forces": float(np.abs(point.forces - here.forces).max() / np.abs(here.forces).max()),
        "stress": None if point.stress is None else _over_largest(point.stress - np.asarray(here.stress), here.stress),
        "pressure": abs(point.pressure / here.pressure - 1),
    }


def _over_largest(difference: Array, values: Any) -> float:
    return float(np.abs(difference).max() / np.abs(values).max())


def _jamlab_version() -> str:
    from importlib import metadata

    return metadata.version("jamlab")
