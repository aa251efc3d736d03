"""Reuse the states of finished tasks: a task that differs from one of them only in what it measures makes no packings.

After observables were added to a campaign file, its tasks have new names. The files of the old ones stay in the folder;
their frames, and the tables that come out the same, are copied from there. Frames are stored in float64, bit by bit, so
the tables do not depend on the order in which observables were asked for.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from jamlab.campaign.flow_file import FLOWS
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.task_file import TaskFile, damage, read_gaps, read_task_file
from jamlab.campaign.tasks import Batch, Task, state_key
from jamlab.errors import StorageError
from jamlab.packing.hdf5 import read_all

if TYPE_CHECKING:
    from jamlab.campaign.states import TaskStates

_DEPENDS_ON = {  # table -> the parameters of measuring on which its content depends
    "spectra": ("damping", "prestress", "omega"),
    "quasistatic": ("prestress",),
    "correlation": ("damping", "prestress", "correlation_omega"),
    "modes": ("damping",),
    **{name: ("damping", name) for name in FLOWS},
}


class StoredStates:
    """Finished tasks of a folder by their state key.

    Args:
        folder: of the campaign.
        batches: of the campaign file; only the parameters of other tasks are read from their files.
    """

    def __init__(self, folder: CampaignFolder, batches: Iterable[Batch]) -> None:
        self._held: dict[str, dict[str, dict[str, Any]]] = {}
        foreign = folder.finished()
        finished = frozenset(foreign)
        for batch in batches:
            for task in batch.tasks():
                if task.name in finished:
                    foreign.discard(task.name)
                    self.add(task)
        for name in sorted(foreign):
            try:
                self.add(Task(name, read_gaps(folder.task_file(name))[0]))
            except StorageError:  # damaged: it cannot serve, and `status --verify` reports those that matter
                continue

    def add(self, task: Task) -> None:
        """Note that a task is finished."""
        self._held.setdefault(state_key(task.parameters), {})[task.name] = task.parameters

    def source(self, parameters: dict[str, Any]) -> Task | None:
        """Return the finished task that holds the states of the one with these parameters, and most of its tables."""
        held = self._held.get(state_key(parameters))
        if not held:
            return None
        name = max(sorted(held), key=lambda name: len(shared_tables(parameters, held[name])))
        return Task(name, held[name])


def shared_tables(parameters: dict[str, Any], other: dict[str, Any]) -> set[str]:
    """Name the observables that come out the same for two tasks with the same states."""
    shared = set(parameters["observables"]) & set(other["observables"])
    return {name for name in shared if _measuring(name, parameters) == _measuring(name, other)}


def _measuring(table: str, parameters: dict[str, Any]) -> list[Any]:
    content = [parameters[key] for key in _DEPENDS_ON.get(table, ())]
    return [*content, parameters["tolerances"]["spectrum_error"]] if table == "spectra" else content


def read_stored(folder: CampaignFolder, name: str) -> "tuple[TaskFile, TaskStates] | None":
    """Read a finished task and its states; None if its file is damaged or gone, so that they must be made again."""
    from jamlab.campaign.states import TaskStates

    path = folder.task_file(name)
    if not path.exists() or damage(path, name) is not None:
        return None
    file, (_, missing) = read_task_file(path), read_gaps(path)
    states = TaskStates(read_all(path), file.target_pressure.tolist(), file.converged.tolist(), missing)
    return file, states
