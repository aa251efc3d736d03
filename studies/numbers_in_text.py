"""Write numbers with their intervals as text, for captions."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.statistics.bootstrap import Interval


def as_interval(found: Any) -> Interval:
    """Take a number without an interval as one whose ends are not known; None as nan."""
    if isinstance(found, Interval):
        return found
    return Interval(*(np.asarray(np.nan if v is None else v, dtype=np.float64) for v in (found, None, None)))


def write_interval(found: Interval, digits: int = 2) -> str:
    """Write a number with its 95 % interval, such as "0.21 [0.19, 0.23]"."""
    return f"{_fixed(found.value, digits)} [{_fixed(found.low, digits)}, {_fixed(found.high, digits)}]"


def write_list(values: Iterable[Any], form: str = "g") -> str:
    """Write numbers in one format, with commas between; None and nan are "none"."""
    numbers = [np.nan if v is None else float(v.value if isinstance(v, Interval) else v) for v in values]
    return ", ".join(f"{v:{form}}" if np.isfinite(v) else "none" for v in numbers)


def _fixed(value: ArrayLike, digits: int) -> str:
    number = float(np.ravel(value)[0])
    return f"{number:.{digits}f}" if abs(number) >= 10.0**-digits or number == 0 else f"{number:.2g}"
