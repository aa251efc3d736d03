"""Maps where G*(omega) fails: extreme frequencies, vanishing or overwhelming damping of sliding, rattlers."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from jamlab.packing.packing import Packing
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.rounding_error import ROUNDING
from jamlab.studies.failure.map import Axis, Map, log_axis
from jamlab.studies.failure.plain_physics import plain_complex_modulus
from jamlab.studies.failure.verdict import Trial

_GOOD = 1e-4  # relative error of G' or G'' beyond which a result counts as failed: it would show in a plot or a fit
_ESTIMATE = 10.0  # by which an error may exceed the estimate of the solver
_METHODS = ("dense", "direct", "reduced")  # seeds take one after the other
_N = 12


@dataclass(frozen=True)
class Spectrum:
    """A packing, and how its G* is found; what is None is the condition x."""

    packing: Packing
    method: str
    omega: float | None = None
    beta: float | None = None


def prepare(seed: int, pressure: float = 1e-3, **how: float) -> Spectrum:
    """The packing of a seed, with one of the methods."""
    return Spectrum(_packing(pressure, (seed - 1) // len(_METHODS)), _METHODS[(seed - 1) % len(_METHODS)], **how)


@lru_cache(maxsize=16)
def _packing(pressure: float, index: int) -> Packing:
    return pack(_N, pressure, index + 1)


def try_spectrum(start: Spectrum, omega: float, beta: float) -> Trial:
    """One solver at one frequency, judged by its own estimate."""
    s = complex_modulus(start.packing, [omega], ContactDamping(beta=beta), method=start.method)
    estimate = float(s.error[0])
    if not estimate < _GOOD:
        return Trial("stalled", f"{start.method}: says that its error is {estimate:.1g}")
    plain = _plain(start.packing.positions.tobytes(), start, omega, beta)
    error = max(abs(s.storage[0] / plain.real - 1), abs(s.loss[0] / plain.imag - 1))
    return Trial("converged", f"{start.method}: error {error:.1g}", error, max(_GOOD, _ESTIMATE * estimate))


def _plain(key: bytes, start: Spectrum, omega: float, beta: float) -> complex:
    if (key, omega, beta) not in _KNOWN:
        _KNOWN[key, omega, beta] = plain_complex_modulus(start.packing, omega, beta)
    return _KNOWN[key, omega, beta]


_KNOWN: dict[tuple[bytes, float, float], complex] = {}


_CHECK = "G* anew: dense matrices by complex steps and plain loops, eliminated in extended precision."

MAPS = (
    Map(
        "spectrum-frequency",
        f"G*: frequency against pressure, three solvers, N = {_N}",
        Axis("ω, 1/τ₁", tuple(float(f"{w:.3g}") for w in np.geomspace(1e-30, 1e30, 16))),
        Axis("pressure, k", (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3)),
        6,
        lambda p, seed: prepare(seed, p),
        lambda start, omega: try_spectrum(start, omega, 1.0),
        "Stalled would be: the solver says that the error of G' or of G'' is above 1e-4.",
        _CHECK,
    ),
    Map(
        "spectrum-sliding",
        f"G*: sliding damping against frequency, three solvers, N = {_N}, p = 10⁻³ k",
        log_axis("β", 1e-16, 1e12, 1.0, count=15),
        log_axis("ω, 1/τ₁", 1e-8, 1e8),
        6,
        lambda omega, seed: prepare(seed, omega=omega),
        lambda start, beta: try_spectrum(start, start.omega, beta),
        "Without damping of sliding rotations carry no drag, and with much of it both dampings share 16 digits. "
        "Stalled: the solver says that the error of G' or of G'' is above 1e-4.",
        _CHECK,
        lambda start: _GOOD / ROUNDING,
        "rounding leaves 4 digits of drag",
    ),
)
