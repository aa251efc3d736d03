"""Measure as Boromand et al. do: sizes, places, windows, and the curves that their numbers are fitted to."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.statistics.power_laws import fit_exponent, power_law
from studies.ensemble_tables import PACKINGS, EnsembleTables
from studies.ensembles import Sample, SizeLaw, average, log_places, size_law
from studies.papers.statements import paper

SERIES = {"SP(φ)": ("sp", "d_phi"), "SP(ρ)": ("sp", "d_rho"), "DP(ρ)": ("dp", "d_rho")}
SIZES = (32, 64, 128, 256)  # N of [B] figs 6, 7 and 10
COMPRESSED = {"sp": SIZES, "dp": SIZES[:3]}  # sizes of which twenty packings and more are followed beyond onset
LARGEST = {model: n[-1] for model, n in COMPRESSED.items()}
SUBTRACTED = 3.97  # z_J of table 1, taken off at every size, although z_J = 4 - 2/N' by counting
CONFLUENCE = 0.16  # drho at which droplets are confluent
ONSET_CORRECTION = 0.7  # N^-0.7 of the mean onset, O'Hern et al., Phys. Rev. E 68, 011306 (2003)

# [B] steps evenly, by 1e-4, so its least squares weigh every distance alike; its regimes begin at these distances
LOWEST = {"sp": 1e-3, "dp": 1e-2}
HIGHEST = {"d_phi": 0.2, "d_rho": 0.13}  # [B] fig 6 a for phi; below confluence for rho
STABLE = tuple({"packings": which} for which in PACKINGS[1:])  # other analyses of G of disks
STEP = 1e-3  # of ours: finer changes no digit, states in between are interpolated
NEAR = log_places(1e-6, 0.4, 5)  # distances from onset of panels with logarithmic axes
DISTANCES = np.arange(0.0, 0.43, 0.01)  # the same of panels with linear axes
FRACTIONS = np.arange(0.80, 1.25, 0.01)  # packing fractions of panels with linear axes
FROM_ONSET = np.concatenate([log_places(1e-6, 10**-1.8), np.arange(0.02, 0.43, 0.01)])  # of both kinds
TWO_OVERLAPS = 0.36  # dphi up to which only pairs of disks overlap: phi < 1.2
_EDGE = 0.01  # ends of a window are places themselves, which count


def even_places(model: str, by: str) -> Array:
    """List the distances from onset at which [B] fits, evenly spaced."""
    return np.arange(LOWEST[model], HIGHEST[by] + 0.5 * STEP, STEP)


def curve(
    tables: EnsembleTables,
    model: str,
    n: int,
    x: str,
    y: str,
    places: ArrayLike,
    within: tuple[float, float] | None = None,
    middle: Callable[[Array], Array] = average,
    packings: str = PACKINGS[0],
) -> Sample:
    """Take the mean curve of a column y over x, of one model and size, at some places."""
    found = tables.curve(model, n, x, y, places, packings)
    if not np.isfinite(found.y).any():
        raise InputError(f"no packing of {model}, N = {n}, has {y} over {x}: run a campaign with some")
    return (found if within is None else found.between(*within)).sample(middle)


def of_curve(model: str, n: int, x: str, y: str, places: ArrayLike, **more: Any) -> dict[str, Any]:
    """Write the keywords of a statistic of the mean curve of y over x."""
    return {"sample": curve, "model": model, "n": n, "x": x, "y": y, "places": places, **more}


def curves(
    tables: EnsembleTables,
    kinds: Sequence[tuple[str, int]],
    x: str,
    y: str,
    places: ArrayLike,
    packings: str = PACKINGS[0],
) -> tuple[list[Array], Callable[[list[Array]], list[tuple[Array, Array]]]]:
    """Take the curves of several models and sizes, and what averages each."""
    found = [tables.curve(model, n, x, y, places, packings) for model, n in kinds]
    for (model, n), one in zip(kinds, found, strict=True):
        if not np.isfinite(one.y).any():
            raise InputError(f"no packing of {model}, N = {n}, has {y} over {x}: run a campaign with some")
    return [one.curves for one in found], lambda drawn: [(average(c[..., 0]), average(c[..., 1])) for c in drawn]


# statistics of a mean curve, x and y (places,) ------------------------------------------------------------------------


def at(x: Array, y: ArrayLike, place: float) -> float:
    """Interpolate a curve at one x; nan beyond its ends."""
    kept = np.isfinite(x) & np.isfinite(y)
    if not kept.any():
        return float("nan")
    x, rounding = x[kept], 1e-9  # means of equal places differ in the last digit
    if not x[0] - rounding <= place <= x[-1] + rounding:
        return float("nan")
    return float(np.interp(place, x, np.asarray(y)[kept]))


def first_above(x: Array, y: Array, share: float) -> float:
    """Interpolate the place from which a curve exceeds a share; nan if it begins there, or never does."""
    k = int(np.argmax(y > share))
    return float(np.interp(share, y[k - 1 : k + 1], x[k - 1 : k + 1])) if k else float("nan")


def exponent(x: Array, y: Array, low: float = 0.0, high: float = np.inf) -> float:
    """Fit an exponent by the least squares of logarithms in a window."""
    kept = (x > (1 - _EDGE) * low) & (x < (1 + _EDGE) * high)
    return fit_exponent(x[kept], y[kept])


def power(x: Array, y: Array, low: float = 0.0, high: float = np.inf, inverse: bool = False) -> float:
    """Fit a power law of relative residuals in a window, y as a power of x, or x as one of y."""
    found = float(power_law(x, y, low=(1 - _EDGE) * low, high=(1 + _EDGE) * high).exponents[0])
    return 1 / found if inverse else found


def halves(low: float, high: float) -> tuple[dict[str, float], dict[str, float]]:
    """Choose the upper and the lower half of a window, in logarithms: where a power holds, both give it."""
    middle = (low * high) ** 0.5
    return {"low": middle}, {"high": middle}


def decades(low: float, high: float) -> list[dict[str, float]]:
    """Choose every decade of a window: where a power holds, each gives it."""
    return [{"low": float(a), "high": float(b)} for a, b in pairwise(log_places(low, high, 1))]


# laws of the paper ----------------------------------------------------------------------------------------------------


def eq_11(d_phi: ArrayLike) -> Array:
    """Compute drho over C, [B] eq 11."""
    d = np.asarray(d_phi, dtype=np.float64)
    return np.asarray(d - d**1.5)


def table_fit(series: str, column: str) -> Callable[[ArrayLike], Array]:
    """Give z - z_J or G by the fits of [B] tables 1 and 2, eqs 13 and 14: c_0 d^0.5 + c_1 d at d from onset."""
    name = {"SP(φ)": "sp-phi", "SP(ρ)": "sp-rho", "DP(ρ)": "dp"}[series]
    c_0 = paper(f"BT-{column}0-{name}")
    c_1 = 0.0 if series == "SP(φ)" else paper(f"BT-{column}1-{name}")  # not fitted, for lack of need
    return lambda d: np.asarray(c_0 * np.asarray(d) ** 0.5 + c_1 * np.asarray(d))


def onset_law(n: Sequence[int], groups: Sequence[Array], correction: float = ONSET_CORRECTION) -> SizeLaw:
    """Fit the mean onset against N, each size weighted by its standard error."""
    return size_law(n, groups, correction)
