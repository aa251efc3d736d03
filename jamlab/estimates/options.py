"""Options of a choice: what each would give and cost, which is taken, and why the others are not."""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Any

import pandas as pd


class Why(StrEnum):
    """What became of an option, the column `why` of all options."""

    TAKEN = "taken"
    COSTS_MORE = "more expensive"
    LARGE = "error too large"
    UNSURE = "own mean too uncertain"  # the part of the error that more packings do not reduce
    FAILS = "too few values"  # too few packings of the way have the quantity there
    UNKNOWN = "no promise"  # the table has too few packings


def judge(rows: Sequence[dict[str, Any]], cost: str, nearest: str | None = None) -> tuple[pd.DataFrame, int | None]:
    """Build the table of options, and say which row is taken: the cheapest, the first of equals, of those with `why`
    None; else, if there is a column `nearest`, the one whose value of it is least; else none."""
    free = [k for k, option in enumerate(rows) if option["why"] is None]
    known = [k for k, option in enumerate(rows) if nearest and not math.isnan(option[nearest])]
    row = min(free, key=lambda k: rows[k][cost], default=None)
    if row is None:
        row = min(known, key=lambda k: rows[k][nearest or cost], default=None)
    why = [Why.TAKEN if k == row else option["why"] or Why.COSTS_MORE for k, option in enumerate(rows)]
    return pd.DataFrame(rows).assign(why=list(map(str, why))), row
