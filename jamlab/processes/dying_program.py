"""Run a program that ends with the process that started this one: `python -P -m ... PARENT_PID PROGRAM ARGUMENT ...`.

It gets SIGTERM, at which mpiexec ends its ranks. On Linux this process becomes the program, and the kernel keeps the
wish over execve; elsewhere it waits for the program and hands the signal on.
"""

import os
import signal
import subprocess
import sys

from jamlab.processes.child import ask_kernel, die_with


def dying_line(line: list[str]) -> list[str]:
    """Command line that runs another one so that it ends with this process; needs `child_environment`."""
    return [sys.executable, "-P", "-m", "jamlab.processes.dying_program", str(os.getpid()), *line]


def run_program(parent: int, line: list[str]) -> int:
    """Run a program and return its exit code; on Linux it takes the place of this process."""
    if ask_kernel(signal.SIGTERM):
        if os.getppid() != parent:
            os._exit(1)
        os.execv(line[0], line)
    ended: list[bool] = []
    started: list[subprocess.Popen[bytes]] = []

    def end(*_: object) -> None:
        ended.append(True)
        for program in started:
            program.terminate()

    signal.signal(signal.SIGTERM, end)
    die_with(parent, signal.SIGTERM)
    with subprocess.Popen(line) as program:
        started.append(program)
        if ended:  # while the program was started
            program.terminate()
        return program.wait()


if __name__ == "__main__":
    sys.exit(run_program(int(sys.argv[1]), sys.argv[2:]))
