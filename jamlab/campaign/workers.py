"""Where tasks run: processes on this machine, SLURM jobs, or the workers of a Dask scheduler; one task each at a time.

Every worker is a separate process, because neither LAMMPS nor its MPI can run several tasks in threads. Those on this
machine are connected by pipes, so that nobody else can reach them, and end when the driver dies
(`jamlab.processes.child`). SLURM jobs exit when they lose their scheduler, which is part of the driver.
"""

import contextlib
import errno
import hashlib
import itertools
import os
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from threadpoolctl import threadpool_limits

from jamlab.campaign.file import STATES
from jamlab.campaign.folder import CampaignFolder, write_task_file
from jamlab.campaign.observable import load_function, measure_own, stack
from jamlab.campaign.plan import wanted_batches
from jamlab.campaign.slurm import Call, slurm_crew
from jamlab.campaign.states import StoredStates, make_states, read_stored, shared_tables
from jamlab.campaign.tables import STATE_COLUMNS
from jamlab.campaign.tasks import Batch, Task
from jamlab.errors import EngineError, InputError, StorageError
from jamlab.measure import measure
from jamlab.packing.quantities import COLUMNS
from jamlab.processes.cores import available_cores, cores_given
from jamlab.processes.side_by_side import Children
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from distributed import Client


_MOST_DEATHS = 5  # workers that may die during one task before it counts as the cause: some are killed otherwise
_CAUSE = "its workers died again and again: killed, or out of memory"
_SETTINGS = {
    # a long factorisation keeps a worker from answering; its death is noticed by the closed connection
    "distributed.scheduler.worker-ttl": None,
    "distributed.scheduler.allowed-failures": _MOST_DEATHS,
    "distributed.comm.timeouts.connect": "60s",  # twice Dask's default: a loaded machine is slow to answer
    "logging.distributed": "critical",  # failures are reported as outcomes or errors
}
_FIND_TIMEOUT = "10s"  # for a scheduler given by its address, which runs already
_KNOCK_TIMEOUT = 5.0  # s
_CORES = "cores"  # resource of workers that hold the cores of several ranks
_EARLY_DEATHS = 12  # in a row and per worker, before they have begun anything: they cannot start at all


class Crew(Protocol):
    """Workers that carry calls, a few at a time."""

    @property
    def cause(self) -> str:
        """Why a call was given up whose workers died, as text."""

    @property
    def width(self) -> int:
        """Number of workers, there or to come."""

    def submit(self, key: str, call: Call) -> None:
        """Have a call carried."""

    def wait(self) -> tuple[str, Any]:
        """Wait for the next call that ends; its key and what it returned, None if its workers died again and again."""


def carry(call: Call, report: Callable[..., None]) -> Any:
    """Carry a call in a process of `LocalCrew`, which hears first that the process is up."""
    report()
    function, *arguments = call
    return function(*arguments)


class LocalCrew:
    """Processes on this machine; one that dies is replaced, and its call is carried again."""

    cause = _CAUSE

    def __init__(self, children: Children) -> None:
        self.width = children.count
        self._children = children
        self._begun: set[str] = set()
        self._deaths: Counter[str] = Counter()
        self._early = 0

    def submit(self, key: str, call: Call) -> None:
        """Have a call carried by the next process that is free."""
        self._children.submit(key, call)

    def wait(self) -> tuple[str, Any]:
        """Wait for the next call that ends; see `Crew`."""
        while True:
            key, kind, content = self._children.wait()
            if kind == "result":
                return key, content
            if kind == "error":
                raise EngineError(f"workers cannot run a task: {content}") from content
            if kind == "report":
                self._begun.add(key)
                self._early = 0
                continue
            call, code = content
            if key in self._begun:
                self._deaths[key] += 1
                if self._deaths[key] > _MOST_DEATHS:
                    return key, None
            else:
                self._early += 1
                if self._early > _EARLY_DEATHS * self.width:
                    raise EngineError(f"workers die as soon as they start, the last with exit code {code}: see stderr")
            self._begun.discard(key)
            self._children.submit(key, call, first=True)


class DaskCrew:
    """Workers of a Dask scheduler, of which so many are expected, e.g. when their jobs start."""

    cause = _CAUSE

    def __init__(self, client: "Client", expected: int = 1, ranks: int = 1) -> None:
        from distributed import as_completed

        self._client, self._expected, self._ranks = client, expected, ranks
        self._ended = as_completed([], loop=client.loop)

    @property
    def width(self) -> int:
        """Number of workers, there or to come."""
        return max(self._expected, len(self._client.nthreads()))

    def submit(self, key: str, call: Call) -> None:
        """Have a call carried by any worker with enough cores."""
        held = {_CORES: float(self._ranks)} if self._ranks > 1 else {}  # one rank runs on any
        self._ended.add(self._client.submit(*call, key=key, pure=False, resources=held))

    def wait(self) -> tuple[str, Any]:
        """Wait for the next call that ends; see `Crew`."""
        from distributed.scheduler import KilledWorker

        future = next(self._ended)
        key, status = future.key, future.status
        try:
            if status == "finished":
                return key, future.result()
            if status != "error":
                raise EngineError("lost the Dask scheduler: start it again, then `jamlab campaign resume`")
            error = future.exception()
            if isinstance(error, KilledWorker):
                return key, None
            raise EngineError(f"workers cannot run a task: {error}; they must have the driver's jamlab") from error
        finally:
            future.release()


@dataclass(frozen=True)
class Workers:
    """Where tasks run."""

    # worker processes on this machine, by default one per core that this process may use; or SLURM jobs
    count: int | None = None
    scheduler: str | None = None  # address of a running Dask scheduler whose workers see the same folder
    slurm: bool = False  # start SLURM jobs with `slurm_options`
    # for `dask_jobqueue.SLURMCluster`: queue, account, walltime, memory, ...
    slurm_options: dict[str, Any] = field(default_factory=dict)
    ranks: int = 1  # threads of each task; a worker holds as many cores
    name: str = "jamlab"  # of the campaign, and of its jobs
    folder: Path = Path()  # that all jobs see, where the certificate of a run on SLURM is kept meanwhile

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise InputError(f"workers = {self.count}: must be 1 or more")
        if self.scheduler is not None and (self.slurm or self.count is not None):
            raise InputError(f"scheduler = {self.scheduler}: it has its own workers: leave out workers and slurm")

    @contextlib.contextmanager
    def crew(self) -> Iterator[Crew]:
        """Start or find workers; what is started ends with the block."""
        if self.scheduler is None and not self.slurm:
            with Children(carry, self.expected) as children:
                yield LocalCrew(children)
            return
        import dask

        with dask.config.set(_SETTINGS):
            if self.scheduler is None:
                with slurm_crew(self.slurm_options, self.name, self.ranks, self.expected, self.folder) as jobs:
                    yield jobs
                return
            with _connect(self.scheduler) as client:
                _check_cores(client, self.scheduler, self.ranks)
                yield DaskCrew(client, self.expected, self.ranks)

    @property
    def expected(self) -> int:
        """Number of workers to come; 1 where a scheduler has its own."""
        if self.count or self.scheduler is not None or self.slurm:
            return self.count or 1
        if self.ranks > (cores := available_cores()):
            raise InputError(
                f"ranks = {self.ranks}: this process may use {cores} cores: lower ranks, or give --workers"
            )
        return cores // self.ranks


def _check_cores(client: "Client", address: str, ranks: int) -> None:
    """Refuse workers that a task with several ranks would wait for without end."""
    known = client.scheduler_info(n_workers=-1)["workers"].values()
    most = max((worker["resources"].get(_CORES, 1) for worker in known), default=ranks)
    if most < ranks:
        line = f"dask worker --nthreads 1 --resources {_CORES}={ranks} ADDRESS"
        raise InputError(f"ranks = {ranks}: no worker of {address} holds as many cores: start some with `{line}`")


def _connect(address: str) -> "Client":
    from distributed import Client
    from distributed.comm import get_address_host_port

    try:  # a client that finds nobody prints a traceback when it is deleted
        socket.create_connection(get_address_host_port(address), timeout=_KNOCK_TIMEOUT).close()
        client = Client(address, timeout=_FIND_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        line = "start one with `dask scheduler`, and workers with `dask worker --nthreads 1 ADDRESS`"
        raise InputError(f"no Dask scheduler answers at {address!r}: {line}") from error
    for worker, threads in client.nthreads().items():
        if threads != 1:
            client.close()
            line = "dask worker --nthreads 1 --nworkers N ADDRESS"
            raise InputError(f"worker {worker} has {threads} threads, and LAMMPS can use one: start it with `{line}`")
    return client


FINISHED, FAILED, FULL = "finished", "failed", "full"
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)
_PER_WORKER = 2  # one that runs and one that waits, so that no worker waits for the driver


class Outcome(NamedTuple):
    """How a task ended. `state`: "finished", "failed" (the reason is in `failed/`) or "full" (the folder cannot be
    written, so no task can go on); `line`: the task, and what went wrong, as text to show; `seconds`: wall time, nan if
    the workers died."""

    state: str
    line: str
    seconds: float


def run_task(folder: str, task: Task, source: str | None = None, modules: Sequence[str] = ()) -> Outcome:
    """Run a task unless its file exists, with the states of a finished task `source`; `modules` are folders with
    modules of the user's own observables."""
    began, used = time.perf_counter(), cpu_seconds()

    def end(state: str, line: str) -> Outcome:
        return Outcome(state, line, time.perf_counter() - began)

    place, label = CampaignFolder(Path(folder)), task.parameters.label
    file = place.task_file(task.name)
    try:
        if not file.exists():
            place.check_target(file)  # before the work, not after
            check_target(file)
            with threadpool_limits(1), cores_given(task.ranks):  # one core a rank: LAMMPS, BLAS and PARDISO alike
                _make_file(place, task, (began, used), source, modules)
        return end(FINISHED, label)
    except StorageError as error:
        return end(FULL, str(error))
    except Exception as error:  # whatever it is, it belongs to this task alone and must not stop the others
        if isinstance(error, OSError) and error.errno in _NO_SPACE:
            return end(FULL, f"no space for {label}: {error}; make room")
        try:
            place.record_failure(task, error)
        except StorageError as full:
            return end(FULL, str(full))
        return end(FAILED, f"{label}: {error}")


def cpu_seconds() -> float:
    """CPU time of this process and of the ranks it waited for."""
    return sum(os.times()[:4])


def _make_file(
    folder: CampaignFolder, task: Task, began: tuple[float, float], source: str | None, modules: Sequence[str]
) -> None:
    functions = {name: load_function(name, modules) for name in task.parameters.own}
    stored = read_stored(folder, source) if source is not None else None
    if stored is None:
        states, known, before = make_states(task.parameters, task.ranks), {}, (0.0, 0.0)
        measured = measure(states.packings)
    else:
        file, states = stored
        shared = shared_tables(task.parameters, file.parameters)
        known = {name: columns for name, columns in file.tables.items() if name in shared}
        before = file.seconds, file.cpu_seconds
        whole = STATES in shared and file.observables.keys() >= set(COLUMNS)  # else a jamlab before measured less
        measured = file.observables if whole else measure(states.packings)
    tables = dict(known)
    for wanted in task.parameters.tables:
        if wanted.name not in known:
            rows = wanted.measure(states, measured["pressure"], task.parameters.tolerances)
            tables[wanted.name] = stack(wanted.stored, rows)
    taken = {*STATE_COLUMNS, *(column for name in known.keys() & functions.keys() for column in known[name])}
    for name in sorted(functions.keys() - known.keys()):
        tables[name] = measure_own(name, functions[name], states.packings, taken)
        taken |= tables[name].keys()
    wall, cpu = before[0] + time.perf_counter() - began[0], before[1] + cpu_seconds() - began[1]
    write_task_file(folder.task_file(task.name), task, states, measured, tables, seconds=wall, cpu_seconds=cpu)


def remaining_tasks(batches: Iterable[Batch], skip: set[str]) -> Iterator[Task]:
    """Yield the tasks whose names are not in `skip`, each once."""
    seen = set(skip)
    for batch in batches:
        for task in batch.tasks():
            if task.name not in seen:
                seen.add(task.name)
                yield task


def drive(
    crew: Crew,
    folder: CampaignFolder,
    chosen: list[Batch],
    stored: StoredStates,
    modules: Sequence[str],
    tell: Callable[[Outcome], None],
) -> None:
    """Run the remaining tasks of some batches, then the seeds that `until` adds, and tell each outcome; the folder is
    locked."""
    place = str(folder.path.resolve())
    under_way: dict[str, Task] = {}

    def fill(tasks: Iterator[Task]) -> None:
        for task in itertools.islice(tasks, max(0, _PER_WORKER * crew.width - len(under_way))):
            key = task_key(folder, task)
            under_way[key] = task
            source = stored.source(task.parameters)
            crew.submit(key, (run_task, place, task, source and source.name, modules))

    before: list[Batch] = []
    while (wanted := wanted_batches(chosen, folder)) != before:
        before, tasks = wanted, remaining_tasks(wanted, folder.finished() | folder.failed())
        fill(tasks)
        while under_way:
            key, outcome = crew.wait()
            task = under_way.pop(key)
            if outcome is None:
                reason = EngineError(f"{task.parameters.label}: {crew.cause}")
                folder.record_failure(task, reason)
                outcome = Outcome(FAILED, str(reason), float("nan"))
            if outcome.state == FULL:
                raise StorageError(f"{outcome.line}; then `jamlab campaign resume` runs what is left")
            if outcome.state == FINISHED:
                if not (file := folder.task_file(task.name)).exists():
                    raise EngineError(
                        f"a worker says that {task.parameters.label} is finished, but {file} is not there: workers must"
                        " see the folder of the campaign under the same path"
                    )
                stored.add(task)
            tell(outcome)
            fill(tasks)


def task_key(folder: CampaignFolder, task: Task) -> str:
    """Name a task at a scheduler that several campaigns may share: each has to make the file in its own folder."""
    place = hashlib.sha256(str(folder.path.resolve()).encode()).hexdigest()
    return f"jamlab-{place[:16]}-{task.name}"
