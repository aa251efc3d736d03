"""Make the packings of one task, or take them from a finished task that differs only in what it measures.

After observables were added to a campaign file, its tasks have new names. The files of the old ones stay in the folder;
their frames, and the tables that come out the same, are copied from there. Frames are stored in float64, bit by bit, so
the tables do not depend on the order in which observables were asked for.
"""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import Any

from jamlab.campaign.file import STATES
from jamlab.campaign.folder import CampaignFolder, TaskFile, damage, read_parameters, read_task_file
from jamlab.campaign.observable import TaskStates
from jamlab.campaign.tasks import Batch, Parameters, Task, as_column, state_key, task_names
from jamlab.errors import ConvergenceError, JamlabError, StorageError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.models.models import optional_parameters
from jamlab.packing.hdf5 import read_all
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import MOST_CONTACTS, bisect_confluence, compress
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import decompress, pack


def make_states(parameters: Parameters, ranks: int = 1) -> TaskStates:
    """Make the packings of a task."""
    missing: list[dict[str, str]] = []
    if parameters.pressures is not None:
        packings, targets = _at_pressures(parameters, ranks, missing)
    else:
        packings = _quenched(parameters, ranks) if parameters.phi else _from_onset(parameters, ranks, missing)
        targets = [float("nan")] * len(packings)
    return TaskStates(packings, targets, [p.converged and p.on_target for p in packings], missing)


def _at_pressures(
    parameters: Parameters, ranks: int, missing: list[dict[str, str]]
) -> tuple[list[Packing], list[float]]:
    """Pack at each pressure from a new random start of the same seed, so that states do not depend on each other; with
    `decompress` only until one is met, from which the others are reached one after the other."""
    packings: list[Packing] = []
    targets = []
    effort: dict[str, Any] = {"tolerance": parameters.tolerances.max_force, "ranks": ranks}
    how = {"ensemble": parameters.ensemble, **_particles(parameters)}
    for pressure in parameters.pressures or ():
        try:
            if parameters.decompress and packings:
                packings.append(decompress(packings[-1], pressure, **effort))
            else:
                packings.append(pack(parameters.n, pressure, parameters.seed, **effort, **how))
            targets.append(pressure)
        except ConvergenceError as error:
            missing.append({"state": f"pressure {pressure:g}", "reason": str(error)})
    if not packings:
        raise ConvergenceError(missing[0]["reason"])
    return packings, targets


def _particles(parameters: Parameters) -> dict[str, Any]:
    """Sizes, and parameters of the force law that a protocol takes by name; what it cannot change of a deck stays."""
    law = parameters.force_law
    optional = optional_parameters("sp")
    changes = dict(law) if parameters.model == "dp" else {name: law[name] for name in optional if name in law}
    return changes if parameters.sizes is None else changes | {"sizes": parameters.sizes}


def _quenched(parameters: Parameters, ranks: int) -> list[Packing]:
    """Quench random disks of the same seed at each packing fraction; loose ones too."""
    how: dict[str, Any] = {"tolerance": parameters.tolerances.max_force, "ranks": ranks, **_particles(parameters)}
    return [pack(parameters.n, phi=phi, seed=parameters.seed, **how) for phi in parameters.phi or ()]


def _from_onset(parameters: Parameters, ranks: int, missing: list[dict[str, str]]) -> list[Packing]:
    """Jam and compress; a sweep that breaks off keeps the states made so far."""
    law = _particles(parameters)
    effort: dict[str, Any] = {"tolerance": parameters.tolerances.max_force, "ranks": ranks}
    onset = jam(parameters.n, parameters.model, parameters.seed, ensemble=parameters.ensemble, **effort, **law)
    how = parameters.compress
    if how is None:
        return [onset]
    to, by = how.to, how.by
    fraction = packing_fraction(onset) if by == "rho" else onset.phi
    if fraction >= to:
        raise ConvergenceError(f"onset lies at {by} = {fraction:.6f}, above to = {to}: raise `to` of the sweep")
    packings = [onset]
    try:
        steps: dict[str, Any] = {"by": by, "step": how.step, "first_step": how.nearest, "per_decade": how.per_decade}
        for packing in compress(onset, to, pressure_tolerance=parameters.tolerances.step_error, **steps, **effort):
            packings.append(packing)
        if how.confluence is not None:
            packings = _add_confluence(packings, how.confluence, by, **effort)
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


class StoredStates:
    """Finished tasks of a folder by their state key; of those not in the batches the parameters are read from their
    files."""

    def __init__(self, folder: CampaignFolder, batches: Iterable[Batch]) -> None:
        self._held: dict[str, dict[str, Parameters]] = {}
        batches, finished = list(batches), folder.finished()
        own = (task for batch in batches for task in batch.tasks() if task.name in finished)
        for task in (*own, *foreign_tasks(folder, batches)):
            self.add(task)

    def add(self, task: Task) -> None:
        """Note that a task is finished."""
        self._held.setdefault(state_key(task.parameters), {})[task.name] = task.parameters

    def source(self, parameters: Parameters) -> Task | None:
        """Return the finished task that holds the states of the one with these parameters, and most of its tables."""
        held = self._held.get(state_key(parameters))
        if not held:
            return None
        name = max(sorted(held), key=lambda name: len(shared_tables(parameters, held[name])))
        return Task(name, held[name])


def shared_tables(parameters: Parameters, other: Parameters) -> set[str]:
    """Name the observables that come out the same for two tasks with the same states."""

    def bases(of: Parameters) -> dict[str, Any]:
        found: dict[str, Any] = {STATES: None, **{o.name: o.depends_on(of.tolerances) for o in of.tables}}
        return {name: (basis, as_column(of.definition_names(name), of.definitions)) for name, basis in found.items()}

    known = bases(other)
    same = {name for name, basis in bases(parameters).items() if known.get(name) == basis}
    return same | (set(parameters.own) & set(other.own))


def foreign_tasks(folder: CampaignFolder, batches: Iterable[Batch]) -> Iterator[Task]:
    """Finished tasks that no batch has; damaged files, which nothing reads, are left out."""
    for name in sorted(folder.finished() - task_names(batches)):
        with suppress(StorageError):
            yield Task(name, read_parameters(folder.task_file(name)))


def read_stored(folder: CampaignFolder, name: str) -> tuple[TaskFile, TaskStates] | None:
    """Read a finished task and its states; None if its file is damaged or gone, so that they must be made again."""
    path = folder.task_file(name)
    if not path.exists() or damage(path, name) is not None:
        return None
    file = read_task_file(path)
    return file, TaskStates(read_all(path), file.target_pressure.tolist(), file.converged.tolist(), file.missing)
