"""Calls that ended without an answer, because their process did."""

import resource
import signal
from typing import Any, NamedTuple

from jamlab.processes.memory import MemoryKills, memory_limits


class Death(NamedTuple):
    """The end of a call whose process ended before the call returned or raised.

    Attributes:
        item: what the function was called for.
        cause: what is known of the end, as text.
        alone: whether this call alone ended. False: one break of a pool ended several, and nobody knows whose fault.
        code: exit code of the process, below 0 the number of the signal that killed it; None if it is not known.
    """

    item: Any
    cause: str
    alone: bool
    code: int | None


def describe_exit(code: int, kills: MemoryKills | None = None) -> str:
    """In which way a process of this machine ended that has an exit code, and at which limit, if that is known."""
    if code >= 0:
        return f"exit code {code}: a called function exited"
    how = f"signal {-code} ({signal.strsignal(-code)})"
    if code == -signal.SIGKILL and kills is not None and kills.rose():
        return f"{how}: killed, out of memory, of which there are {memory_limits()}"
    if code == -signal.SIGXCPU:
        return f"{how}: each process may use {resource.getrlimit(resource.RLIMIT_CPU)[0]} s (ulimit -t)"
    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY:
        return f"{how}: possibly out of memory, of which there are {memory_limits()}"
    return how
