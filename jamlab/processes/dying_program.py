"""Become a program that ends with the process that started it: `python -P -m ... PARENT_PID PROGRAM ARGUMENT ...`.

The kernel keeps the wish over execve, and sends SIGTERM, at which mpiexec ends its ranks.
"""

import os
import signal
import sys

from jamlab.processes.child import die_with


def dying_line(line: list[str]) -> list[str]:
    """Command line that runs another one so that it ends with this process; needs `child_environment`."""
    return [sys.executable, "-P", "-m", "jamlab.processes.dying_program", str(os.getpid()), *line]


if __name__ == "__main__":
    die_with(int(sys.argv[1]), signal.SIGTERM)
    os.execv(sys.argv[2], sys.argv[2:])
