"""Keep worker processes running on this machine: a new one starts whenever one dies.

Dask's own nannies give up when a worker dies while it starts, and need `if __name__ == "__main__":` in every script.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Self

from jamlab.processes.child import child_environment

_LOOK = 0.1  # s between looks at the processes: short against the second that a start takes
_EARLY = 30.0  # s of life below which a death counts as early: a start, also on a loaded machine
_EARLY_DEATHS = 12  # in a row and per worker: twice what one task may cause before it fails, see workers.py


class WorkerSupply:
    """Keep a number of worker processes alive; a context manager.

    Args:
        scheduler: its address.
        count: number of processes.
        give_up: called when workers die as fast as they start; `failure` then holds the reason, and none is started.
        cores: that each of them holds.
    """

    def __init__(self, scheduler: str, count: int, give_up: Callable[[], None], cores: int = 1) -> None:
        module = "jamlab.campaign.worker_process"
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
