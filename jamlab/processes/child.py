"""Run calls that a parent sends through a pipe, see `side_by_side.py`, or become a program.

`python -P -m jamlab.processes.child PARENT_PID` is followed by the descriptor of the pipe, or by a command line. This
process ends when its parent dies, so that no orphan survives, whatever killed the parent. One that answers calls looks
ten times a second, as soon as what is computed lets Python run; a program gets SIGTERM from Linux.
"""

import ctypes
import os
import signal
import sys
import threading
import time
from multiprocessing.connection import Connection
from typing import NoReturn

from jamlab.processes.answers import answer
from jamlab.processes.cores import cores_given

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")  # of the environment


def die_with(parent: int, number: int = signal.SIGKILL) -> None:
    """Have a signal end this process when its parent dies: who has lost its parent has another one."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.1)  # s between two looks at the parent
        os.kill(os.getpid(), number)

    threading.Thread(target=watch, daemon=True).start()


def child_environment() -> dict[str, str]:
    """Environment of a Python process with one thread and the same modules as here, whatever folder it runs in; it is
    no rank of an `mpiexec` that runs this process, and MPI of LAMMPS starts there by itself."""
    alone = {name: value for name, value in os.environ.items() if not name.startswith(("PMI_", "PMIX_"))}
    return alone | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))}


def serve(connection: Connection) -> None:
    """Answer calls until the parent closes the connection; first comes the function, then one item after the other."""
    try:
        function = connection.recv_bytes()
        while True:
            connection.send(answer(function, connection.recv_bytes(), lambda *told: connection.send(told)))
    except (EOFError, ConnectionError):
        return


def dying_line(line: list[str]) -> list[str]:
    """Command line that runs another one so that it ends with this process; needs `child_environment`."""
    return [sys.executable, "-P", "-m", "jamlab.processes.child", str(os.getpid()), *line]


def become_program(parent: int, line: list[str]) -> NoReturn:
    """Become a program that gets SIGTERM when its parent dies, at which mpiexec ends its ranks.

    There is no process between the two that could be killed alone. The program must not start others that outlive it.
    """
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG of linux/prctl.h; kept by exec
    if os.getppid() != parent:  # it died before
        sys.exit(128 + signal.SIGTERM)
    os.execv(line[0], line)


if __name__ == "__main__":
    parent, *words = sys.argv[1:]
    if not words[0].isdecimal():
        become_program(int(parent), words)
    die_with(int(parent))
    with cores_given(1), Connection(int(words[0])) as channel:
        serve(channel)
