"""What executors of other libraries tell of their workers beyond PEP 3148; none of the libraries is imported."""

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, ThreadPoolExecutor
from typing import Any

from jamlab.errors import EngineError

_REMEDY = "LAMMPS cannot run several in threads of one process: give each worker one thread"


def is_pool_of_processes(executor: Executor) -> bool:
    """Whether the workers are processes of this machine: `concurrent.futures` and loky."""
    return any(each.__name__ == "ProcessPoolExecutor" for each in type(executor).__mro__)


def check_threads(executor: Executor) -> None:
    """Refuse workers that are known to run several calls at once in threads of one process."""
    if isinstance(executor, ThreadPoolExecutor) and (count := count_known(executor)) != 1:
        raise EngineError(f"{type(executor).__name__} has {count} threads: {_REMEDY}, as ProcessPoolExecutor has")
    chosen = getattr(executor, "_kwargs", {}).keys() & {"workers", "resources"}  # of Dask: not all of its workers
    threads = {} if chosen else _threads_of_dask(executor)
    if several := {address: count for address, count in threads.items() if count > 1}:
        address, count = next(iter(several.items()))
        said = f"the Dask worker {address} has {count} threads: {_REMEDY}"
        raise EngineError(f"{said}, `dask worker --nthreads 1` or `LocalCluster(threads_per_worker=1)`")


def count_known(executor: Executor) -> int | None:
    """Number of workers that an executor has or starts when there is work; None if it does not tell."""
    if _dask_client(executor) is not None:
        return len(_threads_of_dask(executor)) or None
    count = getattr(executor, "_max_workers", None) or getattr(executor, "num_workers", None)
    return count if isinstance(count, int) and count > 0 else None


def is_open(executor: Executor) -> bool:
    """Whether calls under way can still end, as far as it is known: the client of Dask closes when it has lost its
    scheduler, and then leaves its calls as they are."""
    client = _dask_client(executor)
    return client is None or client.status in ("running", "connecting")


def scheduler_in_use(executor: Executor) -> str | None:
    """Address of the scheduler of Dask to which an executor sends calls; None of other executors, and where a plain
    `SpecCluster` looks after the workers, as jamlab's own of batch systems, which says what becomes of its jobs."""
    client = _dask_client(executor)
    if client is None or client.status != "running" or type(client.cluster).__name__ == "SpecCluster":
        return None
    return str(client.scheduler.address)


def describe_failure(executor: Executor, error: BaseException) -> str:
    """Why an executor has no answer of a call; Dask knows of workers that it ended at their memory limit."""
    text, name = " ".join(str(error).split()), type(error).__name__
    if isinstance(error, BrokenExecutor):
        text = text.partition(".")[0]  # the rest is advice
    worker, client = getattr(error, "last_worker", None), _dask_client(executor)
    if worker is None or client is None:
        return f"{name}: {text[:300]}" if text else name
    times = getattr(error, "allowed_failures", 0) + 1
    text = f"{times} Dask workers died, the last one {worker.address}" if times > 1 else "its Dask worker died"
    ended = _ask(lambda: client.get_events("worker-restart-memory")) or ()
    if any(event.get("worker") == worker.address for _, event in ended):
        text += f": killed, out of memory, of which Dask allows a worker {worker.memory_limit / 1e9:.3g} GB"
    return text


def _dask_client(executor: Executor) -> Any:
    """The client of the executor of Dask, `Client.get_executor()`."""
    return getattr(executor, "_client", None) if type(executor).__name__ == "ClientExecutor" else None


def _threads_of_dask(executor: Executor) -> dict[str, int]:
    """Threads of the workers by address; none if the scheduler is out of reach, which calls will tell."""
    client = _dask_client(executor)
    if client is None or client.status != "running":
        return {}
    return dict(_ask(client.nthreads) or {})


def _ask(question: Callable[[], Any]) -> Any:
    """What a scheduler answers; None if it is gone."""
    try:
        return question()
    except Exception:  # whatever a lost connection raises
        return None
