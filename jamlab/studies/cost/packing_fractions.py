"""True packing fraction of disks: every method, and counting random points, at three nominal packing fractions."""

from collections.abc import Iterator

import numpy as np

from jamlab.engine.session import Session
from jamlab.geometry.packing_fraction import METHODS, packing_fraction
from jamlab.geometry.voids.voids import voids
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import relax
from jamlab.studies.cost.chart import Chart, Trial
from jamlab.studies.table import shortest

_PHI = (0.86, 1.0, 1.2)
_N = 64
_COUNTS = (100, 1000, 10_000, 100_000)  # random points
_ROUNDING = 1e-15  # of areas of order 1: what the two exact ways, which share no step, differ by at most


def measure(seed: int) -> Iterator[Trial]:
    """Measure all methods on one packing at three phi, against 1 minus the voids, which needs no overlap areas."""
    for phi in _PHI:
        packing = _relax_disks(seed, phi)
        reference = 1.0 - float(voids(packing).area.sum()) / packing.area
        panel = f"φ = {phi:g}"
        for method in METHODS["sp"]:
            seconds, rho = shortest(lambda p=packing, m=method: packing_fraction(p, m), runs=5, budget=0.1)  # type: ignore[misc]
            yield Trial(panel, method, "", seconds, rho - reference, _ROUNDING, method == "exact")
        for count in _COUNTS:
            seconds, rho = shortest(lambda p=packing, c=count: covered(p, c, seed), runs=3, budget=0.1)  # type: ignore[misc]
            yield Trial(panel, "random points", f"{count}", seconds, rho - reference, _ROUNDING)


def covered(packing: Packing, count: int, seed: int) -> float:
    """Share of random points that lie inside a disk, in a box with right angles: error sqrt(rho (1 - rho)/count)."""
    assert packing.diameters is not None
    sides = packing.box.diagonal()
    points = np.random.default_rng(seed).uniform(size=(count, 2)) * sides
    inside = np.zeros(count, dtype=bool)
    for centre, diameter in zip(packing.positions, packing.diameters, strict=True):
        apart = points - centre
        apart -= sides * np.round(apart / sides)
        inside |= (apart**2).sum(axis=1) < 0.25 * diameter**2
    return float(inside.mean())


def _relax_disks(seed: int, phi: float) -> Packing:
    with Session(random_disks(_N, seed, phi=phi)) as session:
        relax(session)
        return session.packing()


CHART = Chart(
    "packing-fraction",
    "True packing fraction of 64 disks",
    "error of ρ",
    "number of random points",
    "1 minus the area of the voids from their exact boundaries, known to rounding, 1e-15",
    measure,
    reason="exact asks first whether pairs are enough, which costs what pairs saves; pairs alone is wrong elsewhere",
)
