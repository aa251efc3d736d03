"""Compare what jamlab measures of a packing with libraries that measure: matscipy and freud."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.engine.session import evaluate
from jamlab.geometry.contact_network import contacts, without_rattlers
from jamlab.geometry.orientational_order import orientational_order
from jamlab.packing.packing import Packing
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.protocols.moduli import shear_modulus
from jamlab.studies.other_codes.peer import Analyst
from jamlab.studies.other_codes.peers import Matscipy


class Freud(Analyst):
    """Centres of disks in a two-dimensional box, in a process of its own. Both freud and liblammps bring voro++; where
    LAMMPS was opened first, freud would call LAMMPS' and crash."""

    name = "freud"
    package = "freud-analysis"

    def measure(self, packing: Packing) -> dict[str, Any]:
        """Number of contacts, and |psi_6| of every disk."""
        return run_side_by_side(_measure, [packing], 1)[0]


def _measure(packing: Packing, _: Any) -> dict[str, Any]:
    import freud

    lattice = np.zeros((3, 3))
    lattice[:2, :2] = packing.box.T  # columns are lattice vectors
    box = freud.box.Box.from_matrix(lattice, dimensions=2)
    points = box.wrap(np.column_stack([packing.positions, np.zeros(packing.n)]))
    assert packing.diameters is not None
    query = {"r_max": float(packing.diameters.max()), "exclude_ii": True}
    near = freud.locality.AABBQuery(box, points).query(points, query).toNeighborList()
    i, j = np.asarray(near.point_indices), np.asarray(near.query_point_indices)
    touch = np.asarray(near.distances) < 0.5 * (packing.diameters[i] + packing.diameters[j])
    cells = freud.locality.Voronoi().compute((box, points))
    order = freud.order.Hexatic(k=6).compute((box, points), neighbors=cells.nlist)
    return {"contacts": int(touch[i < j].sum()), "|psi_6|": np.abs(order.particle_order)}


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
    """One quantity of one library, and its largest difference from jamlab, over the largest value. Of a library that is
    not installed version and difference are None, and the note says what to install."""

    name: str
    version: str | None = None
    quantity: str = ""
    difference: float | None = None
    note: str = ""


def compare_analysis(minimum: Packing, *, analysts: Sequence[Analyst] = ANALYSTS) -> list[AnalysisRow]:
    """Compare jamlab with libraries of analysis on the backbone of one packing of disks in units "eps". A row for each
    quantity of each library; one that is not installed is a row that says so."""
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
