"""Run calls that a parent sends: `python -P -m jamlab.processes.child DESCRIPTOR PARENT_PID`, see `side_by_side.py`.

This process ends when its parent dies, so that no orphan survives, whatever killed the parent: a thread looks
ten times a second, as soon as what is computed lets Python run.
"""

import os
import signal
import sys
import threading
import time
from multiprocessing.connection import Connection

from jamlab.processes.cores import cores_given

_LOOK = 0.1  # s between two looks at the parent
_THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def die_with(parent: int, number: int = signal.SIGKILL) -> None:
    """Have a signal end this process when its parent dies: who has lost its parent has another one."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK)
        os.kill(os.getpid(), number)

    threading.Thread(target=watch, daemon=True).start()


def child_environment() -> dict[str, str]:
    """Environment of a Python process with one thread and the same modules as here, whatever folder it runs in."""
    return os.environ | dict.fromkeys(_THREADS, "1") | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))}


def serve(connection: Connection) -> None:
    """Answer calls until the parent closes the connection; first comes the function, then one item after the other."""
    try:
        function = connection.recv()
        while True:
            item = connection.recv()
            try:
                answer = ("result", function(item, lambda *step: connection.send(("report", step))))
            except Exception as error:  # whatever it is, the parent raises it
                answer = ("error", error)
            connection.send(answer)
    except (EOFError, ConnectionError):
        return


if __name__ == "__main__":
    die_with(int(sys.argv[2]))
    with cores_given(1), Connection(int(sys.argv[1])) as channel:
        serve(channel)
