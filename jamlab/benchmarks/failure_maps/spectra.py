"""Map where G*(omega) fails: extreme frequencies, vanishing sliding friction, rattlers, unsuitable packings."""

from functools import partial

import numpy as np

from jamlab.benchmarks.failure_maps.verdict import Map, Outcome, attempt
from jamlab.geometry.contact_network import without_rattlers
from jamlab.packing.packing import Packing
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping

_GOOD = 1e-4  # relative error of G* beyond which a result counts as failed: it would show in a plot or a fit
_SLOW = 1e-10  # omega below which G' must equal G_0


def try_frequency(packing: Packing, omega: float, method: str, beta: float = 1.0) -> tuple[str, str]:
    """Judge one solver by its own estimate of its error and, at the lowest frequencies, by G_0."""
    s = complex_modulus(packing, [omega], ContactDamping(beta=beta), method=method)
    error = float(s.error[0])
    if omega <= _SLOW:
        error = max(error, abs(float(s.storage[0]) / s.g0 - 1))
    return ("converged" if error < _GOOD else "stalled"), f"error {error:.1g}"


def _vary_frequency(quick: bool) -> list[Outcome]:
    packing = pack(32 if quick else 128, 1e-3, 3)
    runs = []
    for method in ("dense", "direct", "reduced"):
        for omega in (1e-12, 1.0, 1e6) if quick else 10.0 ** np.arange(-12, 7, 2):
            runs.append(attempt(method, float(omega), partial(try_frequency, packing, float(omega), method)))
    return runs


def _vary_sliding(quick: bool) -> list[Outcome]:
    packing = pack(32 if quick else 128, 1e-3, 3)
    runs = []
    for method in ("dense", "direct", "reduced"):
        for beta in (1e-12, 1.0) if quick else (1e-16, 1e-12, 1e-8, 1e-4, 1e-2, 1.0, 1e2):
            runs.append(attempt(method, beta, partial(try_frequency, packing, 1e-2, method, beta)))
    return runs


def states() -> dict[str, Packing]:
    """A packing with rattlers, and states that are not at rest."""
    packing = pack(32, 1e-3, 3)
    moves = 1e-5 * np.random.default_rng(1).standard_normal(packing.positions.shape)
    loose = packing.with_state(diameters=0.9 * np.asarray(packing.diameters))
    return {
        "with rattlers": packing,
        "backbone alone": without_rattlers(packing),
        "not at a minimum": packing.with_state(positions=packing.positions + moves),
        "not jammed": loose,
    }


def _vary_state(quick: bool) -> list[Outcome]:
    runs = []
    for name, packing in states().items():
        for method in ("dense",) if quick else ("dense", "direct", "reduced"):
            runs.append(attempt(method, name, partial(try_frequency, packing, 1e-2, method)))
    return runs


MAPS = {
    "spectrum-frequency": Map(
        "G*(omega): extreme frequencies, p = 1e-3",
        "method",
        "omega, 1/tau_1",
        _vary_frequency,
        "Converged: the solver's own estimate of its error is below 1e-4, and G' meets G_0 at the low end.",
    ),
    "spectrum-sliding": Map(
        "G*(omega): sliding friction that vanishes, omega = 1e-2",
        "method",
        "beta",
        _vary_sliding,
        "Without sliding friction rotations carry no drag; the solvers must not divide by it.",
    ),
    "spectrum-states": Map(
        "G*(omega): rattlers, and packings that are not at rest",
        "method",
        "packing",
        _vary_state,
        "Rattlers are taken out before the matrices are built; what is not at a minimum is refused.",
    ),
}
