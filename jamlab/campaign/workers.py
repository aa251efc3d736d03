"""Start or find Dask workers: processes on this machine, a running scheduler, or SLURM jobs; one task each at a time.

Every worker is a separate process, because neither LAMMPS nor its MPI can run several tasks in threads. A worker on
this machine is `python -m jamlab.campaign.workers SCHEDULER DRIVER_PID CORES`. It asks the kernel to kill it when the
driver dies (PR_SET_PDEATHSIG), so that no orphan goes on computing, whatever killed the driver and whatever the worker
is doing. SLURM jobs exit when they lose their scheduler, which is part of the driver.
"""

import asyncio
import contextlib
import inspect
import logging
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

from jamlab.errors import EngineError, InputError
from jamlab.processes.child import child_environment, die_with
from jamlab.processes.cores import available_cores

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
_SBATCH_TIMEOUT = 60.0  # s
_RESTART_TIMEOUT = 10  # s, to cancel all tasks at the scheduler in this process
_CORES = "cores"  # resource of workers that hold the cores of several ranks
DEATH_TIMEOUT = 60  # s without a scheduler after which a worker exits; as long as a connection may take
_LOOPBACK = "127.0.0.1"
_LOOK = 0.1  # s between looks at the processes: short against the second that a start takes
_EARLY = 30.0  # s of life below which a death counts as early: a start, also on a loaded machine
_EARLY_DEATHS = 12  # in a row and per worker: twice what one task may cause before it fails
_SLURM_DEFAULTS = {"memory": "2 GB", "walltime": "24:00:00"}  # a task needs under 1 GB up to n = 32768


@dataclass(frozen=True)
class Workers:
    """Where tasks run.

    Attributes:
        count: worker processes on this machine, by default one per core that this process may use; or SLURM jobs.
        scheduler: address of a running Dask scheduler whose workers see the same folder.
        slurm: start SLURM jobs with `slurm_options`.
        slurm_options: for `dask_jobqueue.SLURMCluster`: queue, account, walltime, memory, ...
        ranks: MPI ranks of each task; a worker holds as many cores.
    """

    count: int | None = None
    scheduler: str | None = None
    slurm: bool = False
    slurm_options: dict[str, Any] = field(default_factory=dict)
    ranks: int = 1

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise InputError(f"workers = {self.count}: must be 1 or more")
        if self.scheduler is not None and (self.slurm or self.count is not None):
            raise InputError(f"scheduler = {self.scheduler}: it has its own workers: leave out workers and slurm")

    @contextlib.contextmanager
    def client(self) -> "Iterator[Client]":
        """Connect a client; what is started for it ends with it.

        Raises:
            InputError: no scheduler answers, its workers run several tasks at once or hold fewer cores than a task has
                ranks, as this machine may, or SLURM cannot be used.
            EngineError: the workers on this machine die as soon as they start.
        """
        import dask
        from distributed import Client

        expected = self.expected
        with dask.config.set(_SETTINGS), contextlib.ExitStack() as stack:
            if self.scheduler is not None:
                client = stack.enter_context(_connect(self.scheduler))
                _check_cores(client, self.scheduler, self.ranks)
                yield client
                return
            cluster = stack.enter_context(self._slurm_cluster() if self.slurm else _local_scheduler())
            client = stack.enter_context(Client(cluster, set_as_default=False))
            if self.slurm:
                cluster.scale(jobs=expected)
                yield client
                return
            supply = WorkerSupply(cluster.scheduler_address, expected, lambda: _cancel_all(client), self.ranks)
            stack.enter_context(supply)
            try:
                yield client
            except EngineError as error:
                raise EngineError(supply.failure or str(error)) from error

    @property
    def expected(self) -> int:
        """Number of workers to come; 1 where a scheduler has its own.

        Raises:
            InputError: this machine has fewer cores for this process than a task has ranks.
        """
        if self.count or self.scheduler is not None or self.slurm:
            return self.count or 1
        return local_workers(self.ranks)

    def _slurm_cluster(self) -> "SLURMCluster":
        try:
            from dask_jobqueue import SLURMCluster
            from dask_jobqueue.core import Job, JobQueueCluster
            from dask_jobqueue.slurm import SLURMJob
        except ImportError:
            raise InputError("SLURM needs dask-jobqueue: pip install 'jamlab[slurm]'") from None
        if missing := [name for name in ("sbatch", "scancel") if shutil.which(name) is None]:
            raise InputError(
                f"SLURM: no command {' or '.join(missing)}: run --slurm where jobs are submitted, or use"
                " --workers or --scheduler"
            )
        options = _SLURM_DEFAULTS | self.slurm_options
        if taken := [name for name in ("cores", "processes", "job_cpu") if options.get(name, 1) != 1]:
            raise InputError(
                f"[slurm] of the campaign file: {taken[0]} = {options[taken[0]]}: leave it out, and set ranks of a"
                " sweep: its jobs hold as many cores"
            )
        known = {name for part in (SLURMJob, Job, JobQueueCluster) for name in inspect.signature(part).parameters}
        if unknown := options.keys() - known:
            names = ", ".join(sorted(unknown))
            raise InputError(f"[slurm] of the campaign file: unknown key {names}; see dask_jobqueue.SLURMCluster")
        # `cores` are threads of the worker, which runs one task; `job_cpu` are those that the job books
        fixed: dict[str, Any] = {"cores": 1, "processes": 1, "job_cpu": self.ranks, "death_timeout": DEATH_TIMEOUT}
        held = ["--resources", f"{_CORES}={self.ranks}"]
        fixed["worker_extra_args"] = [*options.get("worker_extra_args", []), *held]
        try:
            cluster = SLURMCluster(**options | fixed, scheduler_options={"dashboard": False})
        except (TypeError, ValueError) as error:
            reason = str(error).partition(". ")[0]
            raise InputError(f"[slurm] of the campaign file: {reason}; see dask_jobqueue.SLURMCluster") from error
        try:
            _try_submission(cluster.job_script())
        except BaseException:
            cluster.close()
            raise
        return cluster


def local_workers(ranks: int) -> int:
    """Number of workers of so many cores each that fit into those that this process may use.

    Raises:
        InputError: not even one.
    """
    cores = available_cores()
    if ranks > cores:
        raise InputError(
            f"ranks = {ranks}: this process may use {cores} cores: lower ranks, or use --slurm, --scheduler, or"
            " --workers to share cores"
        )
    return cores // ranks


def resources(ranks: int) -> dict[str, float]:
    """Resources that a task with so many ranks asks of its worker; one rank runs on any."""
    return {_CORES: float(ranks)} if ranks > 1 else {}


def _check_cores(client: "Client", address: str, ranks: int) -> None:
    """Refuse workers that a task with several ranks would wait for without end."""
    known = client.scheduler_info(n_workers=-1)["workers"].values()
    most = max((worker["resources"].get(_CORES, 1) for worker in known), default=ranks)
    if most < ranks:
        raise InputError(
            f"ranks = {ranks}: no worker of {address} holds as many cores: start some with `dask worker --nthreads 1"
            f" --resources {_CORES}={ranks} ADDRESS`"
        )


def _try_submission(script: str) -> None:
    """Let SLURM say at once what is wrong with a job; Dask would log a traceback and wait for workers for ever.

    Raises:
        InputError: with SLURM's own words.
    """
    with tempfile.NamedTemporaryFile("w", suffix=".sh") as file:
        file.write(script)
        file.flush()
        try:
            done = subprocess.run(
                ["sbatch", "--test-only", file.name],
                capture_output=True,
                text=True,
                timeout=_SBATCH_TIMEOUT,
                check=False,
            )
        except (OSError, subprocess.SubprocessError) as error:
            raise InputError(f"sbatch cannot be run: {error}") from error
    if done.returncode:
        reason = " ".join(done.stderr.split()) or f"sbatch ended with {done.returncode}"
        raise InputError(f"SLURM refuses the job: {reason}; change [slurm] of the campaign file")


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


class WorkerSupply:
    """Keep a number of worker processes on this machine alive: a new one starts whenever one dies; a context manager.

    Dask's own nannies give up when a worker dies while it starts, and need `if __name__ == "__main__":` in scripts.

    Args:
        scheduler: its address.
        count: number of processes.
        give_up: called when workers die as fast as they start; `failure` then holds the reason, and none is started.
        cores: that each of them holds.
    """

    def __init__(self, scheduler: str, count: int, give_up: Callable[[], None], cores: int = 1) -> None:
        module = "jamlab.campaign.workers"
        self._line = [sys.executable, "-P", "-m", module, scheduler, str(os.getpid()), str(cores)]
        self._count = count
        self.failure: str | None = None
        self._give_up = give_up
        self._stop = threading.Event()
        # the kernel ties a worker's life to the thread that started it: one thread starts them all and stays
        self._thread = threading.Thread(target=self._keep, name="jamlab workers", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _keep(self) -> None:
        # Ctrl-C reaches the whole process group; workers inherit this mask, and the driver ends them
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        workers = [(self._start(), time.monotonic()) for _ in range(self._count)]
        early = 0
        try:
            while not self._stop.wait(_LOOK):
                for k, (process, began) in enumerate(workers):
                    if process.poll() is None:
                        continue
                    early = early + 1 if time.monotonic() - began < _EARLY else 0
                    if early > _EARLY_DEATHS * self._count:
                        code = process.returncode
                        self.failure = f"workers die as soon as they start, the last with exit code {code}: see stderr"
                        self._give_up()
                        return
                    workers[k] = (self._start(), time.monotonic())
        finally:
            for process, _ in workers:
                process.kill()
            for process, _ in workers:
                process.wait()

    def _start(self) -> subprocess.Popen[bytes]:
        environment = child_environment() | {"DASK_LOGGING__DISTRIBUTED": "critical"}
        return subprocess.Popen(self._line, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)


async def _serve(scheduler: str, cores: int) -> None:
    from distributed import Worker

    # Dask would listen on every interface; this worker and its scheduler share one machine
    options = {"host": _LOOPBACK, "dashboard_address": f"{_LOOPBACK}:0", "dashboard": False}
    options["resources"] = {"cores": cores}
    async with Worker(scheduler, nthreads=1, memory_limit=0, death_timeout=DEATH_TIMEOUT, **options) as worker:
        await worker.finished()


if __name__ == "__main__":
    die_with(int(sys.argv[2]))
    asyncio.run(_serve(sys.argv[1], int(sys.argv[3])))
