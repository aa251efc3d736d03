"""Compare three solvers for G*(omega)."""

from functools import partial

import numpy as np

from jamlab.benchmarks.cpu_time import shortest
from jamlab.benchmarks.speed_accuracy.trial import Topic, Trial
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import ComplexModulus, complex_modulus


def measure_trials(quick: bool) -> list[Trial]:
    """Measure contact damping at p = 1e-3, frequencies over ten decades."""
    omega = np.geomspace(1e-8, 1e2, 31)
    found = []
    for n in (64, 256) if quick else (64, 256, 1024):
        packing = pack(n, 1e-3, 1)
        chosen = complex_modulus(packing, omega).method
        results: dict[str, tuple[float, ComplexModulus]] = {}
        for method in ("dense", "direct", "reduced"):
            results[method] = shortest(partial(complex_modulus, packing, omega, method=method), runs=3, budget=0.5)
        reference = {"dense": "direct", "direct": "dense", "reduced": "direct"}
        for method, (seconds, s) in results.items():
            other = results[reference[method]][1]
            parts = ((s.storage, other.storage), (s.loss, other.loss))
            error = max(float(np.abs(a / b - 1).max()) for a, b in parts)
            note = f"own estimate {s.error.max():.1g}"
            found.append(Trial(f"N = {n}", method, "", seconds, error, method == chosen, note))
    return found


TOPIC = Topic(
    "Complex shear modulus at 31 frequencies",
    "largest relative error of G' or G''",
    "one complex factorisation a frequency (direct); for that one, the whole spectrum (dense)",
    measure_trials,
)
