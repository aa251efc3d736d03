"""Options of a choice: what each would give and cost, which is taken, and why the others are not."""

import warnings
from collections.abc import Sequence
from enum import StrEnum
from typing import Any

import pandas as pd


class Why(StrEnum):
    """What became of an option, the column `why` of all options."""

    TAKEN = "taken"
    DEARER = "dearer"
    LARGE = "error too large"
    UNSURE = "own mean too uncertain"  # the part of the error that more packings do not reduce
    FAILS = "too few values"  # too few packings of the way have the quantity there
    UNKNOWN = "no promise"  # the table has too few packings


def judge(rows: Sequence[dict[str, Any]], cost: str, nearest: str | None = None) -> pd.DataFrame:
    """Build the table of options: the cheapest, the first of equals, of those with `why` None is taken, else, if there
    is a column `nearest`, the one whose value of it is least."""
    options = pd.DataFrame(rows)
    free = options["why"].isna()
    options.loc[free, "why"] = Why.DEARER
    if free.any():
        options.loc[options.loc[free, cost].idxmin(), "why"] = Why.TAKEN
    elif nearest and options[nearest].notna().any():
        options.loc[options[nearest].idxmin(), "why"] = Why.TAKEN
    options["why"] = options["why"].map(str)  # pandas makes text of some columns of an enum, but not of all
    return options


def taken(options: pd.DataFrame) -> int | None:
    """Row of the option that is taken, if one is."""
    found = options.index[options["why"] == Why.TAKEN]
    return int(found[0]) if len(found) else None


def warn_renamed(old: str, new: str) -> None:
    """Warn the caller's caller that a name will go."""
    warnings.warn(f"{old} goes with the next release: {new}", DeprecationWarning, stacklevel=4)


class OldWords:
    """Sentences that choices once carried; their fields and `options` hold the same as values."""

    @property
    def why(self) -> str:
        """What the choice prints."""
        warn_renamed(f"{type(self).__name__}.why", "print the choice, or read its `options`")
        return repr(self)
