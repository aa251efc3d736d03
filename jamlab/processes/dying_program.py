"""Run a program that ends with the process that started this one: `python -P -m ... PARENT_PID PROGRAM ARGUMENT ...`.

It gets SIGTERM, at which mpiexec ends its ranks.
"""

import os
import signal
import subprocess
import sys

from jamlab.processes.child import die_with


def dying_line(line: list[str]) -> list[str]:
    """Command line that runs another one so that it ends with this process; needs `child_environment`."""
    return [sys.executable, "-P", "-m", "jamlab.processes.dying_program", str(os.getpid()), *line]


def run_program(parent: int, line: list[str]) -> int:
    """Run a program and return its exit code."""
    started: list[subprocess.Popen[bytes]] = []
    ended: list[int] = []

    def end(number: int, _: object) -> None:
        ended.append(number)
        for program in started:
            program.terminate()

    signal.signal(signal.SIGTERM, end)
    with subprocess.Popen(line) as program:
        started.append(program)
        if ended:  # while the program was started
            program.terminate()
        die_with(parent, signal.SIGTERM)
        return program.wait()


if __name__ == "__main__":
    sys.exit(run_program(int(sys.argv[1]), sys.argv[2:]))
