"""Droplets as rigid bodies in compiled code: three coordinates of each, where its vertices have dozens.

Droplets that do not touch are regular polygons of the size at which line tension and area elasticity balance, see
`jamlab.models.droplets`. So below onset their minima are those of rigid polygons with the same rims,
`plugin/kernels/rigid_polygons.h`; above onset rigid polygons press harder, since only their rims give way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import EngineError
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.models.droplets import free_polygon_area, vertex_counts
from jamlab.packing.packing import Packing

_relax = kernel(
    "relax_rigid_polygons",
    *(INTEGER, INTEGERS, REALS, REAL, REAL, INTEGER, REALS, REALS, REAL, REALS, INTEGER, INTEGER, REALS),
)
_evaluate = kernel(
    "evaluate_rigid_polygons", *(INTEGER, INTEGERS, REALS, REAL, REAL, INTEGER, REALS, REALS, REALS, REALS, REALS)
)


@dataclass(frozen=True)
class RigidDroplets:
    """Droplets as rigid bodies.

    Attributes:
        droplets: DP packing that they stand for, in its box; its positions do not matter.
        coordinates: (n, 3) centres, and the angle of the first vertex times the radius through the vertices.
        energy: of contacts; this and what follows after a relaxation.
        max_force: largest force on a droplet, torque over its radius, or generalised force on the box.
        pressure: of contacts.
        contact_force: the largest of a contact.
        crossed: whether outlines cross, so that contacts cannot part them.
    """

    droplets: Packing
    coordinates: Array
    energy: float = 0.0
    max_force: float = 0.0
    pressure: float = 0.0
    contact_force: float = 0.0
    crossed: bool = False

    @classmethod
    def of(cls, droplets: Packing) -> "RigidDroplets":
        """The rigid bodies nearest to droplets: at their centroids, at the mean angle of their vertices."""
        counts, angles, starts = _shapes(droplets)
        r = droplets.positions - np.repeat(droplets.centroids, counts, axis=0)
        turns = np.exp(1j * (np.arctan2(r[:, 1], r[:, 0]) - angles))
        turned = np.angle(np.add.reduceat(turns, starts)) * _radii(droplets)
        return cls(droplets, np.column_stack([droplets.centroids, turned]))

    @property
    def phi(self) -> float:
        """Nominal packing fraction."""
        return self.droplets.phi

    @property
    def energy_per_vertex(self) -> float:
        """Contact energy over the number of vertices, which defines onset."""
        return self.energy / len(self.droplets.positions)

    def packing(self) -> Packing:
        """Free droplets where the rigid ones lie."""
        counts, angles, _ = _shapes(self.droplets)
        radii = _radii(self.droplets)
        turned = angles + np.repeat(self.coordinates[:, 2] / radii, counts)
        spokes = np.repeat(radii, counts)[:, None] * np.column_stack([np.cos(turned), np.sin(turned)])
        return self.droplets._trusted(positions=np.repeat(self.coordinates[:, :2], counts, axis=0) + spokes)

    def relaxed(
        self, descent: Sequence[float], steps: int, *, phi: float | None = None, shears: bool = False, saddles: int = 0
    ) -> "RigidDroplets":
        """The minimum beside this state, or where contacts are lost.

        Args:
            descent: numbers of the relaxation, (15,) in the order of the kernel, see `jamlab.protocols.rigid_search`.
            steps: at most.
            phi: packing fraction to go to first; what touches follows by linear response.
            shears: whether the box shears as well, at constant area.
            saddles: left at most, by a slide along a mode that gives way.
        """
        box, coordinates, out = self.droplets.box.copy(), self.coordinates.copy(), np.zeros(4)
        factor = 1.0 if phi is None else float(np.sqrt(self.phi / phi))
        kinds, numbers = _kinds(self.droplets), np.array(descent, dtype=np.float64)
        taken = _relax(*kinds, int(shears), box, coordinates, factor, numbers, steps, saddles, out)
        droplets = self.droplets._trusted(box=box)
        energy, max_force, virial, contact_force = (float(number) for number in out)
        pressure = virial / (2 * droplets.area)
        return replace(
            RigidDroplets(droplets, coordinates, energy, max_force, pressure, contact_force), crossed=taken < 0
        )

    def derivatives(self, *, shears: bool = False) -> tuple[float, Array, Array]:
        """Energy, (m,) forces and (m, m) second derivatives in the 3 n coordinates. A box that shears has three more:
        sqrt(n) times its elongation along x, the same of its simple shear, and one without meaning.

        Raises:
            EngineError: outlines cross.
        """
        size = 3 * (len(self.coordinates) + shears)
        energy, forces, matrix = np.zeros(1), np.zeros(size), np.zeros((size, size))
        if _evaluate(*_kinds(self.droplets), int(shears), self.droplets.box, self.coordinates, energy, forces, matrix):
            raise EngineError("outlines of two rigid droplets cross")
        return float(energy[0]), forces, matrix


def _shapes(droplets: Packing) -> tuple[Any, Array, Any]:
    """(n,) numbers of vertices, (n_vertices,) angle of each from the first, (n,) first vertices."""
    counts = vertex_counts(droplets)
    starts = np.cumsum(counts) - counts
    number = np.arange(counts.sum()) - np.repeat(starts, counts)
    return counts, 2 * np.pi * number / np.repeat(counts, counts), starts


def _radii(droplets: Packing) -> Array:
    """(n,) through the vertices of free droplets."""
    counts, _, _ = _shapes(droplets)
    return np.asarray(np.sqrt(2 * free_polygon_area(counts, droplets.params) / (counts * np.sin(2 * np.pi / counts))))


def _kinds(droplets: Packing) -> tuple[int, Any, Array, float, float]:
    eps, delta = (float(droplets.params[name]) for name in ("eps", "delta"))
    return droplets.n, _shapes(droplets)[0], _radii(droplets), eps, delta
