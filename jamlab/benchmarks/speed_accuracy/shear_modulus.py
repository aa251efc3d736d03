"""Compare methods for the static shear modulus: linear response, finite strain, and without relaxation."""

from functools import partial

from jamlab.benchmarks.cpu_time import shortest
from jamlab.benchmarks.speed_accuracy.trial import Topic, Trial
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.relaxation import relax

_TIGHT = 1e-14  # largest force of the packing that the reference is taken from
_STRAINS = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)


def measure_trials(quick: bool) -> list[Trial]:
    """Measure one stable packing near onset and one far from it."""
    found = []
    onset = jam("sp", 32 if quick else 64, 1, ensemble="shear-stabilized")
    for above in (1e-4, 0.1):
        *_, packing = compress(onset, onset.phi + above, above / 2, by="phi")
        panel = f"phi - phi_J = {above:g}"
        reference = shear_modulus(_tighten(packing))
        settings: list[tuple[str, float | None]] = [("affine", None), ("linear-response", None)]
        settings += [("finite-strain", s) for s in (_STRAINS[::2] if quick else _STRAINS)]
        for method, strain in settings:
            default = method == "linear-response"
            name = "" if strain is None else f"{strain:g}"
            try:
                seconds, g = shortest(partial(shear_modulus, packing, method, strain=strain), runs=5, budget=0.3)
            except ConvergenceError as error:
                found.append(Trial(panel, method, name, float("nan"), float("nan"), default, str(error)))
                continue
            found.append(Trial(panel, method, name, seconds, abs(float(g) / float(reference) - 1), default))
    return found


def _tighten(packing: Packing) -> Packing:
    with Session(packing) as session:
        relax(session, _TIGHT, near=True)
        return session.packing()


TOPIC = Topic(
    "Static shear modulus",
    "relative error of G",
    "linear response of the same packing relaxed to forces of 1e-14; labels are the first strain tried, which is "
    "halved while contacts change",
    measure_trials,
)
