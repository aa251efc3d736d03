"""Charts of how much model is needed: vertices and contact form of droplets, and packings of an ensemble."""

import time
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
import pandas as pd
from scipy.optimize import curve_fit

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError, JamlabError
from jamlab.estimates.ensemble_way import EnsembleWay, bring_on, default_vertices, free_shape
from jamlab.measure import measure as measure_packing
from jamlab.packing.packing import Packing
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.studies.cost.chart import BAND, Chart, Point, Trial, points_of

_N, _RHO = 8, 0.88
_COUNTS = (6, 8, 10, 12, 16, 20, 24)  # of a small droplet
_FINEST = (24, 32, 48)  # of the reference: with more some packings do not converge
_FORM, _SMOOTH = "outline", "segment/smooth"
_KINKED = "segment"  # of the paper: it has no minima to end in, and takes seconds to say so
_MEASURED = {"pressure": "pressure, relative", "shape": "shape factor", "g": "G, relative", "z": "z"}
_RELATIVE = ("pressure", "g")

Values = dict[str, float]


def hand_over(seed: int) -> Iterator[Trial]:
    """Hand the same disks over with every number of vertices, and in the kinked form with the default one."""
    small, large = default_vertices()
    ratio = large / small
    try:
        disks = bring_on(EnsembleWay("disks", _N), jam("sp", _N, seed), _RHO)
        coarse, fine, finest = (_values(disks, _FORM, count, ratio)[0] for count in _FINEST)
    except JamlabError:
        return  # the packing jams beyond rho, or a droplet is pressed through another
    exact, check = _limit(fine, finest, _FINEST[1:]), _limit(coarse, fine, _FINEST[:2])
    for form, count in [(form, count) for form in (_FORM, _SMOOTH) for count in _COUNTS] + [(_KINKED, small)]:
        values: Values = {}
        seconds, note = float("nan"), ""
        try:
            values, seconds, note = _values(disks, form, count, ratio)
        except JamlabError as error:
            note = str(error).splitlines()[0]
        for key, panel in _MEASURED.items():
            scale = abs(exact[key]) if key in _RELATIVE else 1.0
            off = (values.get(key, float("nan")) - exact[key]) / scale
            unsure = abs(exact[key] - check[key]) / scale
            default = form == defaults("dp")["contact"] and count == small
            yield Trial(panel, form, f"{count}/{round(ratio * count)}", seconds, off, unsure, default, note)


def _limit(coarse: Values, fine: Values, counts: tuple[int, ...]) -> Values:
    """Values of smooth outlines: errors of polygons go with 1/count^2 (Richardson). z is a count, and stays."""
    part = 1.0 / ((counts[1] / counts[0]) ** 2 - 1.0)
    return {key: fine[key] + (part * (fine[key] - coarse[key]) if key != "z" else 0.0) for key in fine}


def _values(disks: Packing, form: str, count: int, ratio: float) -> tuple[Values, float, str]:
    """Quantities, CPU seconds from the disks on, and a note. A state of the kinked form counts where its search ends,
    without G, which `measure` refuses there."""
    began = time.process_time()
    way = EnsembleWay("carried", _N, (count, round(ratio * count)), form)
    droplets = to_polygons(disks, **way.law)
    note = "" if droplets.converged else f"ends at a largest force of {droplets.max_force:.0e}: no minimum, no G"
    if note and form != _KINKED:
        raise ConvergenceError(note)
    row = measure_packing(droplets)
    seconds = time.process_time() - began
    free = free_shape(way.nv)  # a polygon is no circle even at rest
    return {key: row[key] - (free if key == "shape" else 0.0) for key in _MEASURED}, seconds, note


VERTICES = Chart(
    "droplet-vertices",
    f"Contact forms and vertices of {_N} droplets at ρ = {_RHO}",
    "error",
    "vertices of a small and of a large droplet",
    "smooth outlines, default contact form, from the same disks: 32 and 48 vertices of a small droplet, carried on by "
    "the power -2 of their number; z that of 48. Its own error is its distance from what 24 and 32 give so. States of "
    "the form segment, which has no minima, are those where the search ends",
    hand_over,
    seeds=range(1, 25),  # some packings jam beyond rho
    average=partial(points_of, better=1.0),
    reason="12 and 17 vertices are those of Boromand et al., by which their tables are met",
)


_PRESSURE = 1e-3
_SIZES = (16, 32, 64, 128, 256)
_LARGE = {1024: 100, 4096: 50}  # N of the reference -> how many of the seeds
# of N, between which differences from the limit of large N fall: 0.69(4) for phi, 0.84(3) for z
_EXPONENTS = (0.5, 1.0)
_PACKINGS = (1, 2, 5, 10, 20, 50)
_DRAWS = 2000
_QUANTITIES = {"phi": "φ", "z": "z", "g": "G, k"}


def means_of_sizes(seed: int) -> Iterator[Trial]:
    """Make a packing of every size; `error` holds its values, from which `points` makes errors of means."""
    for n in (*_SIZES, *(n for n, packings in _LARGE.items() if seed <= packings)):
        began = time.process_time()
        values = measure_packing(pack(n, _PRESSURE, seed), tuple(_QUANTITIES))
        seconds = time.process_time() - began
        for key, panel in _QUANTITIES.items():
            yield Trial(panel, f"N = {n}", "", seconds, float(values[key]))


def points(trials: pd.DataFrame) -> list[Point]:
    """Errors of means over so many packings of a size, drawn with repetition from all that there are. The floor is the
    error of the reference, see `limit_of_size`."""
    rng = np.random.default_rng(0)
    found = []
    for panel in _QUANTITIES.values():
        sizes = {n: trials[(trials["panel"] == panel) & (trials["method"] == f"N = {n}")].dropna(subset="error")
                 for n in (*_SIZES, *_LARGE)}  # fmt: skip
        reference, floor = limit_of_size({n: rows["error"].to_numpy() for n, rows in sizes.items()})
        for n in _SIZES:
            values, cost = sizes[n]["error"].to_numpy(), float(sizes[n]["seconds"].median())
            for count in _PACKINGS:
                off = np.abs(rng.choice(values, (_DRAWS, count)).mean(axis=1) - reference)
                low, high = map(float, np.quantile(off, BAND))
                numbers = (count * cost, float(off.mean()), low, high, floor)
                found.append(Point(panel, f"N = {n}", f"{count}", *numbers, len(values), 0, False, loose=True))
    return found


def limit_of_size(values: Mapping[int, Array]) -> tuple[float, float]:
    """Limit a of large N and its standard error, from a + b/N^c through the means of packings of four sizes or more.
    Where the means scatter about that curve by more than their errors, the error grows by as much."""
    size = np.array(list(values), dtype=np.float64)
    mean = np.array([each.mean() for each in values.values()])
    sigma = np.array([each.std(ddof=1) / np.sqrt(len(each)) for each in values.values()])
    start, bounds = (mean[-1], mean[0] - mean[-1], np.mean(_EXPONENTS)), [(-np.inf, -np.inf), (np.inf, np.inf)]
    low, high = ((*bound, exponent) for bound, exponent in zip(bounds, _EXPONENTS, strict=True))
    found, covariance = curve_fit(_means, size, mean, start, sigma, absolute_sigma=True, bounds=(low, high))
    misfit = float((((_means(size, *found) - mean) / sigma) ** 2).sum()) / (len(size) - len(found))
    return float(found[0]), float(np.sqrt(covariance[0, 0] * max(misfit, 1.0)))


def _means(size: Array, limit: float, part: float, exponent: float) -> Array:
    return limit + part * size**-exponent


MEANS = Chart(
    "ensemble-means",
    f"Means over packings of disks at p = {_PRESSURE:g} k",
    "error of the mean",
    "number of packings",
    "limit a of large N, by a + b/N^c through the means of all sizes, c from {:g} to {:g}, with ".format(*_EXPONENTS)
    + f"{' and '.join(f'{packings} packings of {n}' for n, packings in _LARGE.items())} among them. Its own error is "
    "that of the fit: a mean known a hundred times better would take ten thousand times as many packings",
    means_of_sizes,
    seeds=range(1, 101),
    average=points,
)
