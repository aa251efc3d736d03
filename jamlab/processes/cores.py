"""How many cores work of this process may use: those that it was given, and not those that the machine has."""

from collections.abc import Iterator
from contextlib import contextmanager

_given: list[int] = []  # innermost last


def available_cores() -> int:
    """Cores that this process may use: what its affinity and its control group leave, and `cores_given` allows."""
    if _given:
        return _given[-1]
    from joblib import cpu_count  # knows affinity and the quotas of containers

    return int(cpu_count())


@contextmanager
def cores_given(count: int) -> Iterator[None]:
    """Let `available_cores` say `count` meanwhile: in a worker that shares the machine with others."""
    _given.append(count)
    try:
        yield
    finally:
        _given.pop()
