"""Charts of what packings cost: search for onset, a pressure, vertices and contact form of droplets, an ensemble."""

import operator
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import curve_fit

from jamlab.arrays import Array
from jamlab.engine.box_border import COMPRESSION, Border
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, JamlabError
from jamlab.estimates.ways import EnsembleWay, bring_on, default_vertices, free_shape
from jamlab.measure import measure as measure_packing
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.protocols.target_pressure import pack
from studies.speed_accuracy.chart import BAND, Chart, Panel, Point, Trial, points_of

_N = 16
_STEPS = {"bisection": (0.1, 5e-2, 1e-2, 2e-3, 5e-4), "paper": (1e-2, 3e-3, 1e-3, 3e-4)}
_PACKING, _MEAN = "onset of one packing", "mean over packings"


def search_onset(seed: int) -> Iterator[Trial]:
    """Search from one random start by every step; the difference keeps its sign, so that it averages."""
    reference = jam("sp", _N, seed, search="paper", step=float(defaults("onset")["step_paper"])).phi
    panel = Panel(_PACKING, reference, 1e-8, operator.sub, {"runs": 1})
    for search, steps in _STEPS.items():
        for step in steps:
            default = search == "bisection" and step == float(defaults("onset")["step"])
            yield panel.trial(search, f"{step:g}", partial(_find, seed, search, step), default)


def _find(seed: int, search: str, step: float) -> float:
    return jam("sp", _N, seed, search=search, step=step).phi


def points_of_onsets(trials: pd.DataFrame) -> list[Point]:
    """Points of one packing; and of the mean, whose error holds its bias and what is unknown of it. What twenty
    packings know of a mean is told by the step whose difference is known least: one that differs in none of them, or in
    two, may do so in the next."""
    found = points_of(trials)
    means = []
    for point in found:
        rows = trials[(trials["method"] == point.method) & (trials["setting"] == point.setting)]
        off = rows["error"].dropna().to_numpy(dtype=np.float64)
        if len(off) > 1:
            means.append((point, float(off.mean()), float(off.std(ddof=1) / np.sqrt(len(off)))))
    floor = max((spread for _, _, spread in means), default=0.0)
    for point, bias, spread in means:
        middle = abs(bias)
        ends = (max(0.0, middle - 1.28 * spread), middle + 1.28 * spread)  # 10 and 90 % of what the bias may be
        error = float(np.hypot(bias, spread))
        changes: Any = {"low": ends[0], "high": ends[1], "floor": floor, "loose": floor > 0}
        found.append(replace(point, panel=_MEAN, error=error, **changes))
    return found


_DISKS = 256
_PRESSURES = (1e-2, 1e-3, 1e-4)
_FORCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)  # over the pressure
_PACK_FORCES = (1e-4, 1e-6)  # the same where Newton steps follow: they need a start, and end far below
_MISSES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)  # of the pressure, relative
_MOST = 60  # minima of a secant
_FIRE_STEPS = 50_000


def pack_to_pressures(seed: int) -> Iterator[Trial]:
    """Measure at every pressure from one random start; the target itself is the reference."""
    for pressure in _PRESSURES:
        panel = Panel(f"p = {pressure:g} k", pressure, 1e-16 / pressure, lambda p, asked: p / asked - 1, {"runs": 1})
        usual = force_tolerance("sp")
        for force in (*(f * pressure for f in _PACK_FORCES), usual):
            yield panel.trial("pack", f"force {force:g}", partial(_pack, pressure, seed, force), force == usual)
        for force in _FORCES:
            yield panel.trial("free box, FIRE alone", f"{force:g} p", partial(_fire_in_free_box, pressure, seed, force))
        yield from _secant(panel, pressure, seed)


def _pack(pressure: float, seed: int, force: float) -> float:
    return float(pack(_DISKS, pressure, seed, tolerance=force).provenance["pressure"])


def _start(pressure: float, seed: int) -> Packing:
    return random_disks(_DISKS, seed, phi=float(defaults("pressure")["phi_jammed"]) + 2 * pressure, units="k")


def _fire_in_free_box(pressure: float, seed: int, force: float) -> float:
    """The pressure where the enthalpy is minimised by FIRE alone, from the start on."""
    with Session(_start(pressure, seed)) as session:
        session.minimize(1e-2 * pressure, style="fire", steps=_FIRE_STEPS)  # the box would blow up at once
        border = Border(COMPRESSION, pressure)
        found = session.minimize(force * pressure, style="fire", steps=_FIRE_STEPS, border=border)
    if found.max_force > force * pressure:
        raise ConvergenceError("force tolerance not met")
    return found.pressure


def _secant(panel: Panel, pressure: float, seed: int) -> Iterator[Trial]:
    """Minima at fixed box, phi by a secant, as the deck in.sp.pressure; the clock is read at every miss that is met."""
    waiting = list(_MISSES)
    began = time.process_time()
    start = _start(pressure, seed)
    with Session(start) as session:
        slope, before, phi = 0.3, None, start.phi
        for _ in range(_MOST):
            state = relax(session).evaluation
            miss = state.pressure / pressure - 1
            while waiting and abs(miss) <= waiting[0]:
                took = time.process_time() - began
                yield Trial(panel.name, "secant in φ", f"miss {waiting.pop(0):g}", took, miss, panel.reference_error)
            if not waiting:
                return
            if before is not None and before[0] != phi and before[1] > 0.1 * pressure < state.pressure:
                found = (state.pressure - before[1]) / (phi - before[0])
                slope = found if 0.03 < found < 3 else slope
            before = (phi, state.pressure)
            phi += min((pressure - state.pressure) / slope, 0.5 * pressure / slope)
            session.load(at_phi(session.packing(), phi))
    for miss in waiting:
        numbers = (float("nan"), float("nan"), panel.reference_error)
        yield Trial(panel.name, "secant in φ", f"miss {miss:g}", *numbers, note=f"{_MOST} minima")


_DROPLETS, _RHO = 8, 0.88
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
        disks = bring_on(EnsembleWay("disks", _DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
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
    way = EnsembleWay("carried", _DROPLETS, (count, round(ratio * count)), form)
    droplets = to_polygons(disks, **way.law)
    note = "" if droplets.converged else f"ends at a largest force of {droplets.max_force:.0e}: no minimum, no G"
    if note and form != _KINKED:
        raise ConvergenceError(note)
    row = measure_packing(droplets)
    seconds = time.process_time() - began
    free = free_shape(way.nv)  # a polygon is no circle even at rest
    return {key: row[key] - (free if key == "shape" else 0.0) for key in _MEASURED}, seconds, note


_PRESSURE = 1e-3
_SIZES = (16, 32, 64, 128, 256)
_LARGE = {1024: 100, 4096: 50}  # N of the reference -> how many of the seeds
# of N, between which differences from the limit of large N fall: 0.69(4) for phi, 0.84(3) for z
_EXPONENTS = (0.5, 1.0)
_PACKINGS = (1, 2, 5, 10, 20, 50)
_DRAWS = 2000
_QUANTITIES = {"phi": "φ", "z": "z", "g": "G, k"}


def means_of_sizes(seed: int) -> Iterator[Trial]:
    """Make a packing of every size; `error` holds its values, from which `points_of_means` makes errors of means."""
    for n in (*_SIZES, *(n for n, packings in _LARGE.items() if seed <= packings)):
        began = time.process_time()
        values = measure_packing(pack(n, _PRESSURE, seed), tuple(_QUANTITIES))
        seconds = time.process_time() - began
        for key, panel in _QUANTITIES.items():
            yield Trial(panel, f"N = {n}", "", seconds, float(values[key]))


def points_of_means(trials: pd.DataFrame) -> list[Point]:
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


CHARTS = (
    Chart("onset-search", search_onset, average=points_of_onsets),
    Chart("pressure-packing", pack_to_pressures),
    Chart("droplet-vertices", hand_over, range(1, 25), partial(points_of, better=1.0)),  # some jam beyond rho
    Chart("ensemble-means", means_of_sizes, range(1, 101), points_of_means),
)
