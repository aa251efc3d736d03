"""Run freud: pairs that touch, and bond-orientational order over Voronoi neighbours."""

from typing import Any

import numpy as np

from jamlab.packing.packing import Packing
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.studies.other_codes.peer import Analyst


class Freud(Analyst):
    """Centres of disks in a two-dimensional box, in a process of its own.

    Both freud and liblammps bring voro++; where LAMMPS was opened first, freud would call LAMMPS' and crash.
    """

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
