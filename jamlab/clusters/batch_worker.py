"""Keep the workers of a job of a batch system: `python -m jamlab.clusters.batch_worker COUNT ADDRESS --name NAME ...`.

Starts so many Dask workers of one thread each. One that is killed or crashes starts again in the same job, which has
waited in the queue; one that ends by itself, as when its scheduler is gone, does not. On SIGTERM, such as at the end of
the walltime, they get a few seconds. Their temporary files are in a folder of this job, which is removed at its end.
The keys of a run that was killed are removed as well. In the workers this module is a preload of Dask: one that closes
must not wait for the end of a long computation.
"""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, NoReturn

from jamlab.processes.child import child_environment, dying_line
from jamlab.storage.atomic_file import remove_own_temporaries
from jamlab.storage.held_folder import held_folder, remove_if_abandoned

_ENDS = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR2)  # the last one at a walltime of LSF
_PATIENCE = 2.0  # s between the request to end and the end; batch systems give 3 or more
_SETTLED = 60.0  # s after which a worker is known to work
_MOST_STARTS = 10  # in a row of workers that are killed before that: a task may be the cause, or the machine
_LOOK = 0.1  # s between two looks at the workers
_DASK = {
    "DASK_LOGGING__DISTRIBUTED": "critical",  # losing the scheduler is no error: the output of a job stays empty
    "DASK_DISTRIBUTED__WORKER__USE_FILE_LOCKING": "False",  # the folder of temporary files is this job's own
    "DASK_DISTRIBUTED__WORKER__MEMORY__TARGET": "False",  # results are a line each: there is nothing to move to disk,
    "DASK_DISTRIBUTED__WORKER__MEMORY__SPILL": "False",
    "DASK_DISTRIBUTED__WORKER__MEMORY__PAUSE": "False",  # and a worker that pauses would never go on
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__WORKER__HTTP__ROUTES": "[]",  # pages for everybody on that machine
}


def dask_teardown(worker: Any) -> None:
    """End the process of a worker that closes, also within a call that takes hours; Dask calls this."""

    def end() -> None:
        remove_own_temporaries()
        os._exit(1)

    timer = threading.Timer(_PATIENCE / 2, end)
    timer.daemon = True
    timer.start()


class _Worker:
    """One worker after the other, of one name each."""

    def __init__(self, words: list[str], name: str, scratch: Path) -> None:
        self._words, self._name, self._starts, self._early = words, name, 0, 0
        self._environment = child_environment() | _DASK | {"TMPDIR": str(scratch)}
        self.start()

    def start(self) -> None:
        self._starts += 1
        words = [*self._words, "--name", f"{self._name}-{self._starts}"]
        line = [sys.executable, "-P", "-m", "distributed.cli.dask_worker", *words]
        self.process = subprocess.Popen(dying_line(line), env=self._environment, stdin=subprocess.DEVNULL)
        self._began = time.monotonic()

    def lives(self) -> bool:
        """Whether it is at work, started again if need be."""
        code = self.process.poll()
        if code is None:
            return True
        self._early = 0 if time.monotonic() - self._began > _SETTLED else self._early + 1
        if code >= 0 or self._early >= _MOST_STARTS:
            return False
        self.start()
        return True


def main(count: int, words: list[str]) -> None:
    """Keep so many workers until all have ended."""
    for each in _ENDS:
        signal.signal(each, _stop)
    at = words.index("--name")
    name = words[at + 1]
    words = words[:at] + words[at + 2 :]
    workers: list[_Worker] = []
    with held_folder(Path(tempfile.gettempdir()), "jamlab-job") as scratch:
        try:
            for k in range(count):
                workers.append(_Worker(words, f"{name}-{k}", scratch))
            while workers:
                workers = [worker for worker in workers if worker.lives()]
                time.sleep(_LOOK)
        finally:
            _end(workers)
    error = _connect(words[0])
    if isinstance(error, ConnectionRefusedError):  # nobody listens there: one that is out of reach may live
        remove_if_abandoned(Path(words[words.index("--tls-key") + 1]).parent)
    elif error is not None:
        said = f"the scheduler at {words[0]} is out of reach ({error})"
        print(f"{said}: does the key interface of jobqueue.yaml name the network of the nodes?", file=sys.stderr)


def _stop(number: int, frame: Any) -> NoReturn:
    for each in _ENDS:
        signal.signal(each, signal.SIG_IGN)
    sys.exit(128 + number)


def _end(workers: list[_Worker]) -> None:
    end = time.monotonic() + _PATIENCE
    for worker in workers:
        worker.process.terminate()
    while time.monotonic() < end and any(worker.process.poll() is None for worker in workers):
        time.sleep(_LOOK)
    for worker in workers:
        worker.process.kill()
        worker.process.wait()


def _connect(address: str) -> OSError | None:
    """What the system says when it connects to a scheduler; None if that works."""
    host, _, port = address.rpartition("/")[2].rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE).close()
    except OSError as error:
        return error
    return None


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
