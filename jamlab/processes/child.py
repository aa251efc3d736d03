"""Run calls that a parent sends: `python -P -m jamlab.processes.child DESCRIPTOR PARENT_PID`, see `side_by_side.py`.

This process ends when its parent dies, so that no orphan goes on computing, whatever killed the parent. On Linux the
kernel kills it (PR_SET_PDEATHSIG), whatever it is doing; elsewhere a thread looks every second.
"""

import ctypes
import os
import signal
import sys
import threading
import time
from multiprocessing.connection import Connection

from jamlab.processes.cores import cores_given

_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_LOOK = 1.0  # s between two looks at the parent
_THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def die_with(parent: int, number: int = signal.SIGKILL) -> None:
    """Have a signal end this process when its parent dies; exit at once if it is dead already."""
    if not ask_kernel(number):
        threading.Thread(target=_watch, args=(parent, number), daemon=True).start()
    if os.getppid() != parent:
        os._exit(1)


def ask_kernel(number: int) -> bool:
    """Ask the kernel to send a signal when the parent dies; False where it cannot, as on macOS."""
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    return prctl is not None and prctl(_PR_SET_PDEATHSIG, number) == 0


def _watch(parent: int, number: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK)
    os.kill(os.getpid(), number)


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
