"""Make the packings of one task: from a random start to onset and above, or at pressures or packing fractions."""

from dataclasses import dataclass
from typing import Any

from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, JamlabError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.packing.law_parameters import OPTIONAL
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import MOST_CONTACTS, bisect_confluence, compress
from jamlab.protocols.onset import jam
from jamlab.protocols.provenance import record
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import relax
from jamlab.protocols.target_pressure import pack
from jamlab.storage.verified_file import versions


@dataclass(frozen=True)
class TaskStates:
    """States of one task.

    Attributes:
        packings: frame by frame; in a compression the first is the onset itself.
        target_pressures: one per packing, in units of k; nan where there is none.
        converged: one per packing: at a minimum within the tolerances, and at its packing fraction.
        missing: one entry per state that could not be made: `state`, as text, and `reason`.
    """

    packings: list[Packing]
    target_pressures: list[float]
    converged: list[bool]
    missing: list[dict[str, str]]


def make_states(parameters: dict[str, Any], ranks: int = 1) -> TaskStates:
    """Make the packings of a task.

    Args:
        parameters: of the task, see `tasks.py`.
        ranks: MPI ranks that minimise.

    Raises:
        ConvergenceError: no onset was found, no pressure was reached, or the onset lies above `compress.to`.
    """
    missing: list[dict[str, str]] = []
    if "pressures" in parameters:
        packings, targets = _at_pressures(parameters, ranks, missing)
    elif "phi" in parameters:
        packings = _quenched(parameters, ranks)
        targets = [float("nan")] * len(packings)
    else:
        packings = _from_onset(parameters, ranks, missing)
        targets = [float("nan")] * len(packings)
    return TaskStates(packings, targets, [p.converged and p.on_target for p in packings], missing)


def _at_pressures(
    parameters: dict[str, Any], ranks: int, missing: list[dict[str, str]]
) -> tuple[list[Packing], list[float]]:
    """Pack at each pressure from a new random start of the same seed, so that states do not depend on each other."""
    packings, targets = [], []
    for pressure in parameters["pressures"]:
        try:
            how = {"ensemble": parameters["ensemble"], "tolerance": parameters["tolerances"]["max_force"]}
            how |= law_changes(parameters)
            packings.append(pack(parameters["n"], pressure, parameters["seed"], ranks=ranks, **how))
            targets.append(pressure)
        except ConvergenceError as error:
            missing.append({"state": f"pressure {pressure:g}", "reason": str(error)})
    if not packings:
        raise ConvergenceError(missing[0]["reason"])
    return packings, targets


def law_changes(parameters: dict[str, Any]) -> dict[str, Any]:
    """Parameters of the force law that a protocol takes by name; those of a model's deck that it cannot change stay."""
    law = parameters["force_law"]
    return dict(law) if parameters["model"] == "dp" else {name: law[name] for name in OPTIONAL["sp"] if name in law}


def _quenched(parameters: dict[str, Any], ranks: int) -> list[Packing]:
    """Quench random disks of the same seed at each packing fraction; loose ones too."""
    packings, tolerance = [], parameters["tolerances"]["max_force"]
    for phi in parameters["phi"]:
        start = random_disks(parameters["n"], parameters["seed"], phi=phi, units="k", **law_changes(parameters))
        with Session(start, ranks=ranks) as session:
            found = relax(session, tolerance)
            packings.append(record(session.packing(), found, protocol="quench", seed=parameters["seed"], **versions()))
    return packings


def _from_onset(parameters: dict[str, Any], ranks: int, missing: list[dict[str, str]]) -> list[Packing]:
    """Jam and compress; a sweep that breaks off keeps the states made so far."""
    tolerance = parameters["tolerances"]["max_force"]
    how = {"ensemble": parameters["ensemble"], "tolerance": tolerance, "ranks": ranks}
    onset = jam(parameters["model"], parameters["n"], parameters["seed"], **how, **law_changes(parameters))
    if "compress" not in parameters:
        return [onset]
    sweep = dict(parameters["compress"])
    to, by, confluence = sweep.pop("to"), sweep["by"], sweep.pop("confluence", None)
    fraction = packing_fraction(onset) if by == "rho" else onset.phi
    if fraction >= to:
        raise ConvergenceError(f"onset lies at {by} = {fraction:.6f}, above to = {to}: raise `to` of the sweep")
    packings = [onset]
    try:
        sweep |= {"error": parameters["tolerances"]["step_error"], "tolerance": tolerance, "ranks": ranks}
        for packing in compress(onset, to, **sweep):
            packings.append(packing)
        if confluence is not None:
            packings = _add_confluence(packings, confluence, by, tolerance, ranks)
    except JamlabError as error:
        missing.append({"state": f"states after {len(packings) - 1}", "reason": str(error)})
    return packings


def _add_confluence(
    packings: list[Packing], error: float, by: str, tolerance: float | None, ranks: int
) -> list[Packing]:
    """Add the bisection of the place where z first reaches 6; there is none where it never does."""
    full = next((k for k, p in enumerate(packings) if contacts(p).z >= MOST_CONTACTS), 0)
    if not full:
        return packings
    below, above = packings[full - 1], packings[full]
    found = bisect_confluence(below, above, error, by=by, tolerance=tolerance, ranks=ranks)
    return [*packings[:full], *sorted(found, key=lambda p: p.phi), *packings[full:]]
