"""Warn of negative moduli, once for each packing, at the line of the user, in every function that returns one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jamlab.arrays import ArrayLike
from jamlab.errors import warn
from jamlab.packing.ensembles import REMEDY_OF_NEGATIVE_G
from jamlab.packing.packing import Packing

_COMPRESSION = ("B", "b")  # names of bulk moduli; all others are of shear


def warn_of_negative(packing: Packing, moduli: Mapping[str, ArrayLike], place: str = "") -> None:
    """Warn if a packing has a negative modulus among those that are returned, by name; nan is none. `place`: what
    tells the packing from others, such as "state 3"."""
    lowest = {name: np.asarray(values, dtype=np.float64) for name, values in moduli.items()}
    negative = {name: float(values[values < 0].min()) for name, values in lowest.items() if (values < 0).any()}
    if not negative:
        return
    said = ", ".join(f"{name} = {value:.6g}" for name, value in negative.items())
    where = f"{place}: " * bool(place)
    shear = sorted(negative.keys() - set(_COMPRESSION))
    remedy = f"shear at this box shape. {REMEDY_OF_NEGATIVE_G}" if shear else "compression. Compress it further"
    warn(f"{where}{said}: the packing (n = {packing.n}, phi = {packing.phi:.8g}) is unstable to {remedy}")


def warn_of_negative_rows(moduli: Mapping[str, ArrayLike], rows: str) -> None:
    """Warn, once for a table, of the negative moduli in its columns: how many rows have one, and the lowest. `rows`:
    what a row is, such as "packings"."""
    found = NegativeRows()
    found.count(moduli)
    found.tell(rows)


class NegativeRows:
    """Counts of negative moduli in the rows of a table, which may come in parts."""

    def __init__(self) -> None:
        self._rows = 0
        self._found: dict[str, tuple[int, float]] = {}  # column -> how many rows have one, and the lowest

    def count(self, moduli: Mapping[str, ArrayLike]) -> None:
        """Count those of some rows, by the name of the column."""
        columns = {name: np.asarray(values, dtype=np.float64) for name, values in moduli.items()}
        self._rows += max(map(len, columns.values()), default=0)
        for name, values in columns.items():
            negative = values[values < 0]
            if len(negative):
                count, lowest = self._found.get(name, (0, 0.0))
                self._found[name] = count + len(negative), min(lowest, float(negative.min()))

    def tell(self, rows: str) -> None:
        """Warn of all of them once; `rows`: what a row is, such as "packings"."""
        parts = [
            f"{name} < 0 in {count} of {self._rows} {rows} (lowest {lowest:.6g})"
            for name, (count, lowest) in self._found.items()
        ]
        if parts:
            remedy = f"these are unstable to shear at their box shape. {REMEDY_OF_NEGATIVE_G}"
            if all(name in _COMPRESSION for name in self._found):
                remedy = "these are unstable to compression. Compress them further"
            warn(f"{', '.join(parts)}: {remedy}")
