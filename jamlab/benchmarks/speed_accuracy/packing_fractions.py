"""Compare methods for the true packing fraction, against phi."""

from jamlab.benchmarks.cpu_time import shortest
from jamlab.benchmarks.speed_accuracy.trial import Topic, Trial
from jamlab.engine.session import Session
from jamlab.geometry.packing_fraction import METHODS, packing_fraction
from jamlab.geometry.voids.voids import voids
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import relax


def measure_trials(quick: bool) -> list[Trial]:
    """Measure all methods on one packing at three phi, against 1 minus the voids, which needs no overlap areas."""
    found = []
    for phi in (0.86, 1.0, 1.2):
        packing = _relax_disks(64 if quick else 256, phi)
        reference = 1.0 - float(voids(packing).area.sum()) / packing.area
        for method in METHODS["sp"]:
            seconds, rho = shortest(lambda p=packing, m=method: packing_fraction(p, m), runs=5, budget=0.3)  # type: ignore[misc]
            error = abs(rho - reference)
            found.append(Trial(f"phi = {phi}", method, "", seconds, float(error), method == "exact"))
    return found


def _relax_disks(n: int, phi: float) -> Packing:
    with Session(random_disks(n, 1, phi=phi)) as session:
        relax(session)
        return session.packing()


TOPIC = Topic(
    "True packing fraction of disks",
    "|rho - reference|",
    "1 minus the area of the voids from their exact boundaries",
    measure_trials,
    "The default, exact, first asks whether pairs are enough, which costs what pairs saves; cells is as exact and a "
    "little slower where pairs are enough, which they are in most packings.",
)
