"""Dynamic critical scaling: G*/p^mu against omega/p^lambda on one curve, Baumgarten & Tighe eqs 14-17 and fig 3."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from jamlab.errors import InputError
from jamlab.rheology import ComplexModulus

Array = NDArray[np.float64]

_GRID = 60
_HIGHEST = 0.1  # 1/tau_1: above, the response is affine and takes no part in the scaling
_CRITICAL = 30.0  # omega/p^lambda from which the square root law is fitted


@dataclass(frozen=True)
class Collapse:
    """Fitted exponents with half-widths of their 95 % bootstrap intervals.

    Attributes:
        mu: G_0 ~ p^mu.
        lam: tau* ~ p^-lam.
        exponent: Delta, G* ~ omega^Delta in the critical regime.
        mu_error, lam_error, exponent_error: half-widths.
        spread: root mean square distance of the rescaled curves from their mean, in ln G*.
    """

    mu: float
    lam: float
    exponent: float
    mu_error: float
    lam_error: float
    exponent_error: float
    spread: float


def collapse(
    pressures: Sequence[float], spectra: Sequence[Sequence[ComplexModulus]], *, resamples: int = 200, seed: int = 1
) -> Collapse:
    """Fit mu and lambda so that the mean spectra of several pressures fall on one curve; Delta from its slope.

    Args:
        pressures: three or more.
        spectra: for each pressure one spectrum or more, all of the same frequencies.
        resamples: bootstrap samples over the packings of each pressure; none make no errors (0).
        seed: of the bootstrap.

    Raises:
        InputError: fewer than three pressures, no spectra, frequencies that differ or do not reach the critical regime,
            a modulus that is not positive.
    """
    p = np.asarray(pressures, dtype=np.float64)
    if len(p) < 3 or len(p) != len(spectra) or not all(len(group) for group in spectra):
        raise InputError(f"a collapse needs spectra of three pressures or more, got {len(p)} and {len(spectra)} groups")
    omega = spectra[0][0].omega
    if not all(np.array_equal(s.omega, omega) for group in spectra for s in group):
        raise InputError("a collapse needs spectra of the same frequencies")
    for pressure, group in zip(p, spectra, strict=True):
        unstable = [s.g0 for s in group if not (np.all(s.storage > 0) and np.all(s.loss > 0))]
        if unstable:
            raise InputError(
                f"a packing at pressure {pressure:g} has no positive modulus (G_0 = {unstable[0]:.3g}): leave it out, "
                "or use prestress=False"
            )
    kept = omega <= _HIGHEST
    curves = [np.array([[s.storage[kept], s.loss[kept]] for s in group]) for group in spectra]
    x = np.log(omega[kept])
    best = _fit(x, np.log(p), [np.log(c.mean(axis=0)) for c in curves])
    rng = np.random.default_rng(seed)
    samples = []
    for _ in range(resamples):
        drawn = [c[rng.integers(len(c), size=len(c))].mean(axis=0) for c in curves]
        samples.append(_fit(x, np.log(p), [np.log(c) for c in drawn])[:3])
    errors = np.zeros(3)
    if samples:
        low, high = np.percentile(np.array(samples), [2.5, 97.5], axis=0)
        errors = 0.5 * (high - low)
    mu_error, lam_error, exponent_error = (float(e) for e in errors)
    return Collapse(best[0], best[1], best[2], mu_error, lam_error, exponent_error, best[3])


def _fit(x: Array, log_p: Array, curves: Sequence[Array]) -> tuple[float, float, float, float]:
    def spread(exponents: Array) -> float:
        mu, lam = exponents
        starts = x - lam * log_p[:, None]
        # where at least two curves overlap
        grid = np.linspace(np.sort(starts[:, 0])[1], np.sort(starts[:, -1])[-2], _GRID)
        inside = (grid >= starts[:, :1]) & (grid <= starts[:, -1:])
        total = 0.0
        for part in (0, 1):
            lines = [np.interp(grid, s, c[part] - mu * lp) for s, c, lp in zip(starts, curves, log_p, strict=True)]
            values = np.where(inside, lines, 0.0)
            count = inside.sum(axis=0)
            mean = values.sum(axis=0) / count
            total += float(np.sum(np.where(inside, values - mean, 0.0) ** 2) / np.sum(count))
        return total / 2

    found = minimize(spread, [0.5, 1.0], method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-12})
    mu, lam = found.x
    slopes = []
    for c, lp in zip(curves, log_p, strict=True):
        critical = x - lam * lp > np.log(_CRITICAL)
        if np.count_nonzero(critical) >= 3:
            slopes += [np.polyfit(x[critical], part[critical], 1)[0] for part in c]
    if not slopes:
        raise InputError(f"no frequency lies between {_CRITICAL:g} p^lambda and {_HIGHEST:g}: lower the pressure")
    return float(mu), float(lam), float(np.mean(slopes)), float(np.sqrt(found.fun))
