"""Workers of clusters through Dask, by one word: the address of a scheduler, or the name of a batch system.

How a site submits jobs (queue, account, walltime, memory, interface, ...) stands in the file of `dask_jobqueue`, by
default `~/.config/dask/jobqueue.yaml`. Each worker has one thread, and a job books the cores of the `ranks` of a task.
Nothing else of jamlab imports Dask.
"""

import asyncio
import importlib.metadata
import json
import logging
import re
import resource
import shlex
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jamlab.clusters.batch_jobs import BatchJobs
from jamlab.clusters.batch_system import SETTINGS, SYSTEMS, list_command
from jamlab.clusters.keys import key_folder, write_key
from jamlab.clusters.site import Site, first_line
from jamlab.errors import EngineError, InputError, JamlabError, typed, warn

_DASK = {
    "distributed.scheduler.allowed-failures": 0,  # the folder counts deaths: the driver hears of each
    "distributed.scheduler.worker-ttl": None,  # a long factorisation keeps a worker from answering
    "distributed.scheduler.worker-saturation": 1.0,  # no task waits at a worker that another one may end
    "distributed.scheduler.work-stealing": False,
    "distributed.comm.timeouts.connect": "60s",
    "distributed.admin.tick.limit": "1h",  # a busy driver is no fault
}
_JOBS_ALONE: dict[str, Any] = {
    "distributed.scheduler.http.routes": [],  # pages that everybody who reaches the port could read
    "distributed.worker.use-file-locking": False,  # of folders of temporary files, which are a run's own
}
_NAMES = ", ".join(sorted(SYSTEMS))
_REMEDY = f"give its address, such as tcp://host:8786, its scheduler file, or one of {_NAMES}"
_LOGGERS = ("distributed", "dask_jobqueue", "tornado", "asyncio")  # deaths are outcomes or errors of jamlab
_CLOSING = 10  # s
_FILES = 4  # for the connections of a worker: two were open, and more while one starts
_SILENT = 10.0  # s without workers until the user hears of it


@dataclass
class Cluster:
    """Workers of a cluster.

    Attributes:
        executor: runs calls in the workers (PEP 3148).
        dashboard: address of Dask's pages about them, which everybody can read who reaches it; None if there is none.
    """

    executor: Executor
    dashboard: str | None


@contextmanager
def cluster_executor(
    scheduler: str,
    jobs: int | None,
    folder: Path,
    ranks: int = 1,
    tell: Callable[[str], None] = warn,
) -> Iterator[Cluster]:
    """Workers of a running scheduler, or of jobs of a batch system, which end with the block.

    Args:
        scheduler: address of a Dask scheduler, a scheduler file, or one of `SYSTEMS`.
        jobs: most jobs at a time; None for a scheduler.
        folder: the folder of the campaign, which all nodes see: for keys and for what jobs print.
        ranks: cores of each worker.
        tell: gets lines for the user, such as a job that was refused; called in other threads.

    Raises:
        InputError: there is no Dask, no such scheduler, or the settings of the site cannot be.
        EngineError: the scheduler is gone, or the batch system refuses all jobs.
    """
    dask = _dask(scheduler)
    with dask.config.set(_DASK), _silence(), ExitStack() as stack:
        if scheduler in SYSTEMS:
            if jobs is None or jobs < 1:
                given = f"{typed('jobs =', '--jobs')} {jobs}"
                raise InputError(f"{given}: give the largest number of jobs of {scheduler} at a time, 1 or more")
            stack.enter_context(dask.config.set(_JOBS_ALONE))
            yield from _on_jobs(stack, scheduler, jobs, folder, ranks, tell)
        else:
            if jobs is not None:
                given = f"{typed('jobs =', '--jobs')} {jobs}"
                raise InputError(f"{given}: the scheduler {scheduler} has its own workers; jobs are for {_NAMES}")
            yield from _on_scheduler(stack, scheduler, tell)


def job_script(scheduler: str, folder: Path, ranks: int = 1) -> str:
    """The script of a job of a batch system, as `cluster_executor` would send it; nothing is sent.

    Raises:
        InputError: there is no Dask, no such batch system, or the settings of the site cannot be.
    """
    if scheduler not in SYSTEMS:
        given = f"{typed('scheduler =', '--scheduler')} {scheduler}"
        raise InputError(f"{given}: only batch systems have a job script: {_NAMES}")
    _dask(scheduler)
    made = [path for path in (folder, folder / "jobs") if not path.exists()]
    try:
        job = Site(scheduler, folder, ranks).job("jamlab-1", "tls://ADDRESS:PORT", _key_files(folder / "keys.XXXXXXXX"))
    finally:
        for path in reversed(made):
            with suppress(OSError):
                path.rmdir()
    return str(job.job_script())


def _dask(scheduler: str) -> Any:
    """Dask, with what `scheduler` needs."""
    loaded = scheduler not in SYSTEMS or "dask_jobqueue" in sys.modules
    if not loaded and threading.current_thread() is not threading.main_thread():
        raise InputError(f"{scheduler}: dask_jobqueue loads in the main thread only: open the cluster there")
    try:
        with _signals_later():
            import dask
            import distributed  # noqa: F401

            if scheduler in SYSTEMS:
                import cryptography  # noqa: F401
                import dask_jobqueue  # noqa: F401
    except ImportError as error:
        raise InputError(f"{scheduler} needs Dask ({error}): pip install 'jamlab[dask]'") from None
    return dask


@contextmanager
def _signals_later() -> Iterator[None]:
    """Let signals that end the command come after the block: Python loses an exception that is raised while it takes
    care of an import. dask_jobqueue takes SIGINT for itself as it is imported; it is given back."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    kept = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    taken = {number for number, handler in kept.items() if callable(handler)}  # not by what C code has set
    for each in taken:
        signal.signal(each, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        for each, handler in kept.items():
            if handler is not None:
                signal.signal(each, handler)
        for first in came[:1]:
            signal.raise_signal(first)


@contextmanager
def _silence() -> Iterator[None]:
    """Keep the loggers of Dask silent; their levels are the user's again afterwards."""
    known = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _LOGGERS]
    loggers = [
        logging.getLogger(name) for name in [*_LOGGERS, *known]
    ]  # Dask gives some below these levels of their own
    levels = [logger.level for logger in loggers]
    debugging = logging.getLogger("jamlab").isEnabledFor(logging.DEBUG)
    for logger in loggers:
        logger.setLevel(logging.INFO if debugging else logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


# a running scheduler


def _on_scheduler(stack: ExitStack, scheduler: str, tell: Callable[[str], None]) -> Iterator[Cluster]:
    from distributed import Client

    address = _address(scheduler)
    try:
        client = Client(address, timeout="20s", set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"no Dask scheduler answers at {address} ({first_line(error)}): {_REMEDY}") from error
    stack.callback(client.close, timeout=_CLOSING)
    _check_workers(client, scheduler, tell)
    client.loop.call_later(_SILENT, _tell_of_no_workers, client, scheduler, tell)
    try:
        yield Cluster(client.get_executor(pure=False), client.dashboard_link or None)
    except JamlabError as error:
        if client.status != "running":
            raise EngineError(f"the Dask scheduler at {scheduler} is gone: start it again, and run again") from error
        raise


def _address(scheduler: str) -> str:
    """Address of a scheduler, also from its scheduler file; a client of what cannot be one would take long to end."""
    from distributed.comm import get_address_host_port
    from distributed.security import Security

    try:
        address = json.loads(Path(scheduler).read_text())["address"] if Path(scheduler).is_file() else scheduler
        get_address_host_port(address)
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(f"{scheduler!r} is no Dask scheduler ({first_line(error)}): {_REMEDY}") from error
    if address.startswith("tls:") and Security().get_connection_args("client")["ssl_context"] is None:
        said = f"{address} wants certificates: name them below distributed.comm.tls"
        raise InputError(f"{said} in ~/.config/dask/distributed.yaml, as for its workers")
    return str(address)


def _workers(client: Any) -> dict[str, dict[str, Any]]:
    return dict(client.scheduler_info(n_workers=-1).get("workers", {}))


def _check_workers(client: Any, scheduler: str, tell: Callable[[str], None]) -> None:
    """Refuse workers that run several tasks at once, and name versions that differ."""
    for address, worker in _workers(client).items():
        if worker["nthreads"] != 1:
            said = f"the worker {address} runs {worker['nthreads']} tasks at once in threads, which LAMMPS cannot"
            raise InputError(
                f"{said}: start it by `dask worker {scheduler} --nthreads 1 --nworkers {worker['nthreads']}`"
            )
    found = client.get_versions(check=False)
    here = found["client"]["packages"]
    for whose, versions in {"the scheduler": found["scheduler"], **found["workers"]}.items():
        its = versions["packages"] if versions else {}
        for name in ("python", "distributed"):
            if its and str(its[name]).split(".")[:2] != str(here[name]).split(".")[:2]:
                tell(f"{name} is {here[name]} here and {its[name]} at {whose}: install the same version")
    mine = importlib.metadata.version("jamlab")
    for address, version in client.run(importlib.metadata.version, "jamlab", on_error="return").items():
        if version != mine:
            said = "has no jamlab" if isinstance(version, Exception) else f"has jamlab {version}, and here is {mine}"
            raise InputError(f"the worker {address} {said}: install jamlab {mine} there")


def _tell_of_no_workers(client: Any, scheduler: str, tell: Callable[[str], None]) -> None:
    if client.status == "running" and not _workers(client):
        said = f"the scheduler at {scheduler} has no workers: the run waits until one comes"
        tell(f"{said}; `dask worker {client.scheduler.address} --nthreads 1` starts one")


# jobs of a batch system


def _on_jobs(
    stack: ExitStack, scheduler: str, jobs: int, folder: Path, ranks: int, tell: Callable[[str], None]
) -> Iterator[Cluster]:
    import dask
    from distributed import Client, SpecCluster

    site = Site(scheduler, folder, ranks)
    site.check_program()
    keys = stack.enter_context(key_folder(site.shared))
    stack.enter_context(dask.config.set({"temporary-directory": str(keys)}))  # so that nothing else is left behind
    own, files = _make_keys(keys)
    _allow_files(jobs * site.workers, tell)
    try:
        cluster = SpecCluster(scheduler=site.scheduler(own), security=own, silence_logs=False)
    except (RuntimeError, ValueError, TypeError, OSError) as error:
        said = f"interface or scheduler-options of jobqueue.{scheduler} in {SETTINGS}: {first_line(error)}"
        raise InputError(f"no scheduler can be started by {said}") from error
    stack.callback(_close, cluster)
    client = stack.enter_context(Client(cluster, set_as_default=False))
    loop = client.loop.asyncio_loop
    made = cluster.scheduler
    failed: list[str] = []

    def fail(reason: str) -> None:
        failed.append(reason)
        threading.Thread(target=client.close, kwargs={"timeout": _CLOSING}, daemon=True).start()

    kept = BatchJobs(
        jobs,
        site.workers,
        make=lambda name: site.job(name, made.contact_address or made.address, files),
        at_work=lambda: {str(each.name): bool(each.processing) for each in made.workers.values()},
        tasks=lambda: sum(task.state in ("queued", "no-worker", "processing") for task in made.tasks.values()),
        ask=lambda: _output(list_command(made)),
        tell=lambda line: tell(f"{made}: {line}"),
        fail=fail,
        lists=shlex.join(list_command(made)),
    )
    keeping = asyncio.run_coroutine_threadsafe(kept.keep(), loop)
    stack.callback(_stop, kept, keeping, loop, site, keys)
    try:
        yield Cluster(client.get_executor(pure=False), site.dashboard(cluster))
    except JamlabError as error:
        if failed:
            raise EngineError(f"{made}: {failed[0]}; {site.remedy()}") from error
        raise


def _stop(kept: BatchJobs, keeping: Any, loop: Any, site: Site, keys: Path) -> None:
    """Cancel the jobs, and wait for one that is being sent: nobody else would know its number."""
    for end in (asyncio.run_coroutine_threadsafe(kept.stop(), loop), keeping):
        with suppress(Exception):  # jobs that cannot be cancelled end by themselves without their scheduler
            end.result(2 * _CLOSING)
    alone = site.has_own_logs and not [other for other in site.shared.glob("keys.*") if other.name != keys.name]
    _remove_empty_logs(site.logs, None if alone else kept.sent)


def _remove_empty_logs(logs: Path, numbers: set[str] | None) -> None:
    """Remove the files of what jobs of these numbers printed, or all jobs if None, if that is nothing; and the folder,
    if it is empty."""
    with suppress(OSError):
        for log in logs.iterdir():
            mine = numbers is None or not numbers.isdisjoint(re.findall(r"\d+", log.name))
            if mine and log.stat().st_size == 0:
                log.unlink(missing_ok=True)
        logs.rmdir()


def _allow_files(workers: int, tell: Callable[[str], None]) -> None:
    """Let this process hold the connections of so many workers."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 200 + _FILES * workers
    if soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(wanted, hard), hard))
    if hard < wanted:
        tell(f"this process may open {hard} files, enough for {(hard - 200) // _FILES} workers: raise `ulimit -Hn`")


def _close(cluster: Any) -> None:
    with suppress(Exception):  # its jobs are cancelled: what is left are connections
        cluster.close(timeout=_CLOSING)


async def _output(words: list[str]) -> str | None:
    """What a program prints; None if it fails."""
    try:
        process = await asyncio.create_subprocess_exec(
            *words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL
        )
        output, _ = await asyncio.wait_for(process.communicate(), 30)
    except (OSError, TimeoutError):
        return None
    return output.decode(errors="replace") if process.returncode == 0 else None


def _make_keys(folder: Path) -> tuple[Any, Any]:
    """Keys of this run: in memory for the scheduler and the client, and in files for the workers."""
    from distributed.security import Security

    own = Security.temporary()
    files = _key_files(folder)
    for name in ("tls_ca_file", "tls_worker_cert", "tls_worker_key"):
        write_key(Path(getattr(files, name)), getattr(own, name))
    return own, files


def _key_files(folder: Path) -> Any:
    from distributed.security import Security

    at = {name: str(folder.absolute() / name) for name in ("tls_ca_file", "tls_worker_cert", "tls_worker_key")}
    return Security(require_encryption=True, **at)
