"""Start or find Dask workers: processes on this machine, a running scheduler, or SLURM jobs; one task each at a time.

Every worker is a separate process, because neither LAMMPS nor its MPI can run several tasks in threads. Workers on this
machine die with the driver, see `worker_process.py`; SLURM jobs exit when they lose their scheduler, which is part of
the driver.
"""

import contextlib
import logging
import os
import shutil
import socket
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from jamlab.campaign.worker_process import DEATH_TIMEOUT
from jamlab.campaign.worker_supply import WorkerSupply
from jamlab.errors import EngineError, InputError

if TYPE_CHECKING:
    from dask_jobqueue import SLURMCluster
    from distributed import Client, LocalCluster

_SETTINGS = {
    # a long factorisation keeps a worker from answering; its death is noticed by the closed connection
    "distributed.scheduler.worker-ttl": None,
    # workers that may die during one task before it counts as the cause: some are killed for other reasons
    "distributed.scheduler.allowed-failures": 5,
    "distributed.comm.timeouts.connect": "60s",  # twice Dask's default: a loaded machine is slow to answer
    "logging.distributed": "critical",  # failures are reported as outcomes or errors
}
_FIND_TIMEOUT = "10s"  # for a scheduler given by its address, which runs already
_KNOCK_TIMEOUT = 5.0  # s
_RESTART_TIMEOUT = 10  # s, to cancel all tasks at the scheduler in this process
_SLURM_DEFAULTS = {"cores": 1, "memory": "2 GB", "walltime": "24:00:00"}  # a task needs under 1 GB up to n = 32768


@dataclass(frozen=True)
class Workers:
    """Where tasks run.

    Attributes:
        count: worker processes on this machine, by default one per core that this process may use; or SLURM jobs.
        scheduler: address of a running Dask scheduler whose workers see the same folder.
        slurm: start SLURM jobs with `slurm_options`.
        slurm_options: for `dask_jobqueue.SLURMCluster`: queue, account, walltime, memory, ...
    """

    count: int | None = None
    scheduler: str | None = None
    slurm: bool = False
    slurm_options: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise InputError(f"workers = {self.count}: must be 1 or more")
        if self.scheduler is not None and (self.slurm or self.count is not None):
            raise InputError(f"scheduler = {self.scheduler}: it has its own workers: leave out workers and slurm")

    @contextlib.contextmanager
    def client(self) -> "Iterator[Client]":
        """Connect a client; what is started for it ends with it.

        Raises:
            InputError: no scheduler answers, its workers run several tasks at once, or SLURM cannot be used.
            EngineError: the workers on this machine die as soon as they start.
        """
        import dask
        from distributed import Client

        with dask.config.set(_SETTINGS), contextlib.ExitStack() as stack:
            if self.scheduler is not None:
                yield stack.enter_context(_connect(self.scheduler))
                return
            cluster = stack.enter_context(self._slurm_cluster() if self.slurm else _local_scheduler())
            client = stack.enter_context(Client(cluster, set_as_default=False))
            if self.slurm:
                cluster.scale(jobs=self.expected)
                yield client
                return
            supply = WorkerSupply(cluster.scheduler_address, self.expected, lambda: _cancel_all(client))
            stack.enter_context(supply)
            try:
                yield client
            except EngineError as error:
                raise EngineError(supply.failure or str(error)) from error

    @property
    def expected(self) -> int:
        """Number of workers to come; 1 where a scheduler has its own."""
        if self.scheduler is not None or self.slurm:
            return self.count or 1
        return self.count or len(os.sched_getaffinity(0))

    def _slurm_cluster(self) -> "SLURMCluster":
        try:
            from dask_jobqueue import SLURMCluster
        except ImportError:
            raise InputError("SLURM needs dask-jobqueue: pip install 'jamlab[slurm]'") from None
        if missing := [name for name in ("sbatch", "scancel") if shutil.which(name) is None]:
            raise InputError(
                f"SLURM: no command {' or '.join(missing)}: run --slurm where jobs are submitted, or use"
                " --workers or --scheduler"
            )
        options = _SLURM_DEFAULTS | self.slurm_options
        fixed = {"processes": 1, "death_timeout": DEATH_TIMEOUT}
        try:
            return SLURMCluster(**options | fixed, scheduler_options={"dashboard": False})
        except (TypeError, ValueError) as error:
            raise InputError(f"[slurm] of the campaign file: {error}; see dask_jobqueue.SLURMCluster") from error


def _cancel_all(client: "Client") -> None:
    """Cancel every future, so that the driver stops waiting for results."""
    client.restart(timeout=_RESTART_TIMEOUT, wait_for_workers=False)


def _local_scheduler() -> "LocalCluster":
    """Start a scheduler in this process, without workers."""
    from distributed import LocalCluster

    return LocalCluster(n_workers=0, processes=True, dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL)


def _knock(address: str) -> None:
    """Raise OSError where nobody listens, and ValueError for what is no address."""
    from distributed.comm import get_address_host_port

    host, port = get_address_host_port(address)
    socket.create_connection((host, port), timeout=_KNOCK_TIMEOUT).close()


def _connect(address: str) -> "Client":
    from distributed import Client

    try:
        _knock(address)  # a client that finds nobody prints a traceback when it is deleted
        client = Client(address, timeout=_FIND_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers at {address!r}: start one with `dask scheduler`, give the address that it "
            "prints, such as tcp://host:8786, and start workers with `dask worker --nthreads 1 ADDRESS`"
        ) from error
    for worker, threads in client.nthreads().items():
        if threads != 1:
            client.close()
            raise InputError(
                f"worker {worker} of {address} runs {threads} tasks at once in threads, which LAMMPS cannot:"
                " start workers with `dask worker --nthreads 1 --nworkers N`"
            )
    return client
