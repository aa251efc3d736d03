"""Executors for tests: one that calls at once in this process, and those of other libraries, with their workers."""

import multiprocessing
import subprocess
import sys
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager


class InThisProcess(Executor):
    """Calls as soon as it is asked to."""

    def submit(self, function, /, *arguments):
        future = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future


def pool(start="spawn", workers=2):
    """A pool of the standard library."""
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context(start))


@contextmanager
def loky():
    """A pool of loky of its own; the reusable one would outlive the test."""
    from loky import ProcessPoolExecutor as LokyExecutor

    with LokyExecutor(2) as executor:
        yield executor


@contextmanager
def local_dask(**how):
    """Two workers of Dask of one thread each; a death ends a call at once."""
    import dask
    from distributed import Client, LocalCluster

    how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50} | how
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0, "logging.distributed": "critical"}),
        LocalCluster(**how) as cluster,
        Client(cluster) as client,
    ):
        yield client.get_executor(pure=False)


@contextmanager
def running_dask(folder):
    """A scheduler and two workers of Dask that were started by somebody else."""
    from distributed import Client

    file = folder / "scheduler.json"

    def start(name, *words):
        line = [sys.executable, "-m", f"distributed.cli.dask_{name}", "--scheduler-file", str(file), "--no-dashboard"]
        return subprocess.Popen([*line, *words], cwd=folder, stderr=subprocess.DEVNULL)

    processes = [start("scheduler", "--port", "0"), *(start("worker", "--nthreads", "1") for _ in range(2))]
    try:
        with Client(scheduler_file=str(file)) as client:
            yield client.get_executor(pure=False)
    finally:
        for process in reversed(processes):
            process.terminate()
        for process in processes:
            process.wait()
