"""Compare what jamlab measures of a packing with libraries that measure: matscipy and freud."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.engine.session import evaluate
from jamlab.geometry.contact_network import contacts, without_rattlers
from jamlab.geometry.orientational_order import orientational_order
from jamlab.packing.packing import Packing
from jamlab.protocols.moduli import shear_modulus
from jamlab.studies.other_codes.freud_peer import Freud
from jamlab.studies.other_codes.matscipy_peer import Matscipy
from jamlab.studies.other_codes.peer import Analyst

ANALYSTS: tuple[Analyst, ...] = (Matscipy(), Freud())
HERE: dict[str, Callable[[Packing], Any]] = {  # what jamlab gives under the names that analysts use
    "energy": lambda p: evaluate(p).energy,
    "pressure": lambda p: evaluate(p).pressure,
    "shear modulus": shear_modulus,
    "contacts": lambda p: len(contacts(p).pairs),
    "|psi_6|": lambda p: np.abs(orientational_order(p).local),
}


@dataclass(frozen=True)
class AnalysisRow:
    """One quantity of one library.

    Attributes:
        name: of the library.
        version: as installed; None if it is not, and then `note` says what to install and all else is None.
        quantity: what was measured.
        difference: largest difference from jamlab, over the largest value.
        note: what a reader must know.
    """

    name: str
    version: str | None = None
    quantity: str = ""
    difference: float | None = None
    note: str = ""


def compare_analysis(minimum: Packing, *, analysts: Sequence[Analyst] = ANALYSTS) -> list[AnalysisRow]:
    """Compare jamlab with libraries of analysis on the backbone of one packing of disks in units "eps".

    Returns:
        A row for each quantity of each library. One that is not installed is a row that says so.
    """
    backbone = without_rattlers(minimum)
    rows = []
    for analyst in analysts:
        if analyst.version is None:
            rows.append(AnalysisRow(analyst.name, note=f"not installed: {analyst.install}"))
            continue
        for quantity, there in analyst.measure(backbone).items():
            here = np.asarray(HERE[quantity](backbone))
            difference = float(np.abs(np.asarray(there) - here).max() / np.abs(here).max())
            rows.append(AnalysisRow(analyst.name, analyst.version, quantity, difference))
    return rows
