"""Progress of long work: one signature for every callback of the package."""

import sys
import time
from collections.abc import Callable
from typing import Literal, TypeAlias

Tell = Callable[[float, str], None]  # share of the work that is done, 0 to 1, nan where unknown; what is done now
Progress: TypeAlias = Tell | Literal[True]  # as public functions take it


def no_progress(share: float, text: str) -> None:
    """Tell nobody how far the work is."""


def told(progress: Progress | None) -> Tell:
    """What is called to tell how far the work is; `checked` has made a line of True."""
    return ProgressLine() if progress is True else progress or no_progress


def part_of(progress: Progress | None, first: float, last: float) -> Progress | None:
    """Progress of a part of the work, from one share of the whole to another."""
    if progress is None:
        return None
    whole = told(progress)
    return lambda share, text: whole(first + (last - first) * share, text)


def in_words(seconds: float) -> str:
    """A time as text, in the unit that suits it."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


class ProgressLine:
    """Writes one line on stderr, at most five times a second; `progress=True` stands for it."""

    def __init__(self) -> None:
        self._last = 0.0

    def __call__(self, share: float, text: str) -> None:
        ended, now = share >= 1.0, time.monotonic()
        if ended or now - self._last > 0.2:
            self._last = now
            done = "" if share != share else f"{share:4.0%} "
            sys.stderr.write(f"\r{done}{text:<60.60}" + "\n" * ended)
            sys.stderr.flush()
