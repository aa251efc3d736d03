"""Dask workers: processes on this machine, a running scheduler, or jobs of SLURM. One task at a time in each.

Every worker is a process of its own, because LAMMPS and its MPI are not made for threads. Workers on this machine die
with the driver, see `worker_process.py`. SLURM's exit when they lose their scheduler, which lives in the driver.
"""

import contextlib
import logging
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from jamlab.campaign.worker_supply import WorkerSupply
from jamlab.errors import EngineError, InputError

_DEATH_TIMEOUT = 60  # seconds after which a job without its scheduler ends
_SETTINGS = {
    "distributed.scheduler.worker-ttl": None,  # a long factorisation keeps a worker from answering; death is seen
    "distributed.scheduler.allowed-failures": 5,  # workers that may die over one task
    "distributed.comm.timeouts.connect": "60s",
    "logging.distributed": "critical",  # what matters comes back as an outcome or an error
}


@dataclass(frozen=True)
class Workers:
    """Where tasks run.

    Attributes:
        count: worker processes here, or SLURM jobs; by default the cores this process may use.
        scheduler: address of a running Dask scheduler, whose workers see the same folder.
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
            raise InputError(f"scheduler = {self.scheduler}: it has its own workers, leave workers and slurm out")

    @contextlib.contextmanager
    def client(self) -> Iterator[Any]:
        """A connected `distributed.Client`; what was started for it ends with it.

        Raises:
            InputError: no scheduler answers, its workers run several tasks at once, or SLURM is not usable.
            EngineError: workers on this machine die as soon as they start.
        """
        import dask
        from distributed import Client

        with dask.config.set(_SETTINGS), contextlib.ExitStack() as stack:
            if self.scheduler is not None:
                yield stack.enter_context(_external(self.scheduler))
                return
            cluster = stack.enter_context(self._slurm_cluster() if self.slurm else _scheduler())
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
        """Workers that there will be; 1 where a scheduler has its own."""
        if self.scheduler is not None or self.slurm:
            return self.count or 1
        return self.count or len(os.sched_getaffinity(0))

    def _slurm_cluster(self) -> Any:
        try:
            from dask_jobqueue import SLURMCluster
        except ImportError:
            raise InputError("SLURM needs dask-jobqueue: pip install 'jamlab[slurm]'") from None
        options = {"cores": 1, "memory": "2 GB", "walltime": "24:00:00"} | self.slurm_options
        fixed = {"processes": 1, "death_timeout": _DEATH_TIMEOUT}
        try:
            return SLURMCluster(**options | fixed, scheduler_options={"dashboard": False})
        except (TypeError, ValueError) as error:
            raise InputError(f"[slurm] of the campaign file: {error}; see dask_jobqueue.SLURMCluster") from error


def _cancel_all(client: Any) -> None:
    """Let the driver, which waits for results, go on: every future ends as cancelled."""
    client.restart(timeout=10, wait_for_workers=False)


def _scheduler() -> Any:
    """A scheduler in this process, without workers."""
    from distributed import LocalCluster

    return LocalCluster(n_workers=0, processes=True, dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL)


def _external(address: str) -> Any:
    from distributed import Client

    try:
        client = Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers at {address}: start one with `dask scheduler`, and workers with "
            "`dask worker --nthreads 1 ADDRESS`"
        ) from error
    for worker, threads in client.nthreads().items():
        if threads != 1:
            client.close()
            raise InputError(
                f"worker {worker} of {address} runs {threads} tasks at once in threads, LAMMPS cannot:"
                " start workers with `dask worker --nthreads 1 --nworkers N`"
            )
    return client
