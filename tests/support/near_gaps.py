"""A function of jamlab that is not there yet, with its result and its table of campaigns: all that adding them takes.

`NEW` has the files that are new, `LINES` what is put into others, each before a line that is there.
"""

FUNCTION = '''"""Gaps of neighbours that nearly touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.geometry.contact_network import contacts
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result


@dataclass(frozen=True, eq=False)
class NearGaps(Result):
    """Gaps between rims, ascending.

    Attributes:
        gap: (m,) gaps, in units of length.

    Example:
        >>> bool(np.all(np.diff(jamlab.near_gaps(jamlab.pack(n=16, pressure=1e-2, seed=1)).gap) >= 0))
        True
    """

    _rows = ("gap",)

    gap: Array


@checked
def near_gaps(packing: Packing, gap_width: float = 0.1) -> NearGaps:
    """Return the gaps of contacts that overlap by less than a width.

    Also called: small_gaps, piv.

    Args:
        packing: SP or DP.
        gap_width: largest overlap. Default 0.1.

    Returns:
        Gaps, ascending.

    Raises:
        InputError: an argument out of range.

    Example:
        >>> jamlab.near_gaps(jamlab.pack(n=16, pressure=1e-2, seed=1), gap_width=1.0).gap.ndim
        1
    """
    gap = contacts(packing).forces.gap
    return NearGaps(np.sort(gap[np.abs(gap) < gap_width]))
'''

OBSERVABLE = '''"""An observable of campaigns: gaps of neighbours that nearly touch, a row each."""

from typing import Annotated, Any

from jamlab.campaign.keys import usual, within
from jamlab.campaign.observable import STATE, Observable, Row
from jamlab.packing.packing import Packing
from jamlab.structure.near_gaps import near_gaps


class NearGapsOfStates(Observable):
    """Gaps of every state."""

    name = "near_gaps"
    columns = (*STATE, "gap")

    gap_width: Annotated[float, within("gap_width")] = usual("gap_width")

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        found = near_gaps(packing, self.gap_width)
        return [{"gap": found.gap}] if len(found.gap) else []
'''

ARGUMENT = """    Argument(
        "gap_width",
        "Largest overlap.",
        "number",
        unit="length",
        least=0,
        above=True,
        default=0.1,
        otherwise={"sweep": None},  # of a sweep without this observable
        habits="gap_size",
    ),
"""

NEW = {"structure/near_gaps.py": FUNCTION, "campaign/near_gap_observable.py": OBSERVABLE}
LINES = {
    "__init__.pyi": (
        "from .structure.pair_correlation import pair_correlation",
        "from .structure.near_gaps import near_gaps as near_gaps\n",
    ),
    "results.py": (
        "from jamlab.structure.pair_correlation import",
        "from jamlab.structure.near_gaps import NearGaps as NearGaps\n",
    ),
    "arguments/analysis.py": ('    Argument("ax",', ARGUMENT),
    "arguments/choices.py": ("]  # fmt: skip\nTableFormat", '    "near_gaps",\n'),
}
