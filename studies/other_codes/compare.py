"""Compare jamlab with other codes on one core: a point, a minimum, its time; and with libraries that measure."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.session import Session, evaluate
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts, remove_rattlers
from jamlab.geometry.hexatic_order import hexatic_order
from jamlab.measure import measure
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress, told
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import relax_session, usual_force_tolerance
from studies.other_codes.analysis import ANALYSTS, ASE
from studies.other_codes.jax_md import JaxMD
from studies.other_codes.peers import MISSING, MOST_STEPS, Analyst, Jamlab, Lammps, Peer, installed, plain_point
from studies.tables import one_core, shortest

_JOLT = 0.01  # mean diameters: descent leads back to the same minimum
_TRIES = 20  # starts until one is found whose minimum is stable and whose jolt leads back

Row = dict[str, Any]
# columns of the tables of codes, by heading; version: as installed, None if it is not, and then `note` says what to
# install; cold, warm: seconds of the first minimisation with set-up and compiling, and of the shortest that follow
CODES = {
    "Same coordinates: largest difference from jamlab, relative": (
        *("name", "version", "energy", "forces", "stress", "pressure"),
    ),
    "Same minimum: differences of energy (relative), z and G; seconds of a minimisation; over jamlab's": (
        *("name", "method", "minimum", "z", "g", "max_force", "cold", "cold_ratio", "warm", "warm_ratio", "note"),
    ),
}
LIBRARIES = {  # the same of libraries of analysis
    "Analysis of the minimum without rattlers: largest difference, over the largest value": (
        *("name", "version", "quantity", "difference", "note"),
    )
}
PEERS: tuple[Peer, ...] = (JaxMD(), ASE(), Lammps("cg"), Lammps("fire"), Lammps("hftn"))
HERE: dict[str, Callable[[Packing], Any]] = {  # what jamlab gives under the names that analysts use
    "energy": lambda p: evaluate(p).energy,
    "pressure": lambda p: evaluate(p).pressure,
    "shear modulus": lambda p: shear_modulus(p, direction="simple"),
    "contacts": lambda p: len(contacts(p).pairs),
    "|psi_6|": lambda p: np.abs(hexatic_order(p).local),
}


def compare_analysis(minimum: Packing, *, analysts: Sequence[Analyst] = ANALYSTS) -> list[Row]:
    """Compare jamlab with libraries of analysis on the backbone of one packing of disks in units "eps": a row for each
    quantity of each library; one that is not installed is a row that says so."""
    backbone = remove_rattlers(minimum)
    rows = []
    for analyst in analysts:
        version = installed(analyst.package)
        row: Row = {"name": analyst.name, "version": version, "quantity": "", "difference": None, "note": ""}
        if version is None:
            rows.append(row | {"note": MISSING})
            continue
        for quantity, there in analyst.measure(backbone).items():
            difference = _over_largest(np.asarray(there), np.asarray(HERE[quantity](backbone)))
            rows.append(row | {"quantity": quantity, "difference": difference})
    return rows


def compare(
    n: int = 64, seed: int = 1, phi: float = 0.88, *, peers: Sequence[Peer] = PEERS, progress: Progress | None = None
) -> list[Row]:
    """Compare jamlab and its peers on one packing of an even number of disks in units "eps" in double precision: a row
    for each, jamlab first. Random starts end in different minima in different codes, so the start is a minimum whose
    disks were moved a little. A code that is not installed is a row that says so."""
    start, minimum = jolted_minimum(n, seed, phi)
    target = measure(minimum)
    rows: list[Row] = []
    with one_core():
        for peer in (Jamlab(), *peers):
            told(progress)(len(rows) / (len(peers) + 1), peer.name)
            item = (peer, start, target, rows[0] if rows else None)
            rows.append(run_side_by_side(_row, [item], 1)[0] if peer.apart else _row(item))
    return rows


def _row(item: tuple[Peer, Packing, dict[str, float], Row | None], _: Any = None) -> Row:
    """A peer beside jamlab, whose row and `measure` at its minimum are given: its point, its minimum and its time. The
    point of jamlab itself, which has no row yet, stands beside all pairs in numpy."""
    peer, start, target, jamlab = item
    row: Row = dict.fromkeys(name for names in CODES.values() for name in names)
    row |= {"name": peer.name, "method": peer.method, "version": installed(peer.package)}
    if row["version"] is None:
        return row | {"note": MISSING}
    there, here = plain_point(start) if jamlab is None else peer.evaluate(start), Jamlab().evaluate(start)
    began = time.process_time()
    run = partial(peer.descent(start), usual_force_tolerance("sp"), MOST_STEPS)
    run()
    cold = time.process_time() - began
    warm, positions = shortest(run)
    point = plain_point(start.with_state(positions=positions))
    found = measure(start.with_state(positions=positions))
    left, tolerance = float(np.hypot(*point.forces.T).max()), usual_force_tolerance("sp")
    first = jamlab or {"cold": cold, "warm": warm}
    missed = f"stopped at max force {left:.1g}, not {tolerance:g}" if left > tolerance else ""
    row |= {
        "energy": abs(there.energy / here.energy - 1),
        "forces": _over_largest(there.forces, here.forces),
        "stress": _over_largest(there.stress, here.stress),
        "pressure": abs(there.pressure / here.pressure - 1),
        "minimum": abs(point.energy / target["energy"] - 1),
        **{name: found[name] - target[name] for name in ("z", "g")},
        **{"max_force": left, "cold": cold, "warm": warm},
        **{"cold_ratio": cold / first["cold"], "warm_ratio": warm / first["warm"]},
        "note": missed if jamlab else "its point beside all pairs in numpy",
    }
    return row


def _over_largest(there: Array, here: Array) -> float:
    return float(np.abs(there - here).max() / np.abs(here).max())


def jolted_minimum(n: int, seed: int, phi: float, jolt: float = _JOLT) -> tuple[Packing, Packing]:
    """Find a jammed packing without negative modes; returns its disks moved a little, by `jolt` mean diameters, and the
    minimum that jamlab finds from them."""
    for trial in range(_TRIES):
        rng = np.random.default_rng([seed, trial])
        with Session(random_disks(n, seed + trial, phi=phi)) as session:
            if not relax_session(session).converged or contacts(session.packing()).unjammed:
                continue
            first = session.packing()
            start = first.with_state(positions=first.positions + jolt * rng.standard_normal((n, 2)))
            session.load(start)
            if relax_session(session).converged and np.isfinite(measure(session.packing())["g"]):
                return start, session.packing()
    raise ConvergenceError(f"no stable minimum at phi = {phi} with n = {n}: raise phi or take another seed")


def text_of(value: Any) -> str:
    """A cell of the tables; "-" where there is nothing to say."""
    if value is None or value != value or value == "":
        return "-"
    return f"{value:.2g}" if isinstance(value, float) else str(value)
