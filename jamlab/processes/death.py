"""Calls that ended without an answer, because their process did."""

import signal
from typing import Any, NamedTuple


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


def describe_exit(code: int) -> str:
    """In which way a process ended that has an exit code."""
    if code < 0:
        return f"signal {-code} ({signal.strsignal(-code)})"
    return f"exit code {code}"
