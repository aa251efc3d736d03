"""Measure as Boromand et al. do: sizes, places, windows, and the curves that their numbers are fitted to."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from jamlab.arguments.choices import Start
from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.statistics.power_laws import fit_exponent, fit_power_law
from studies.ensemble_tables import ALL_LAW, PACKINGS, EnsembleTables, of_papers
from studies.ensembles import (
    Ensemble,
    Sample,
    at_places,
    average,
    groups_by,
    interpolators,
    log_places,
    median,
    scaled,
    select,
)
from studies.panels import Drawing, size_style
from studies.papers.statements import paper
from studies.tables import AbsentTableError

Curve = tuple[Array, Array]  # means of x and y (places,)

SERIES = {"SP(φ)": ("sp", "d_phi"), "SP(ρ)": ("sp", "d_rho"), "DP(ρ)": ("dp", "d_rho")}
SIZES = (32, 64, 128, 256)  # N of [B] figs 6, 7 and 10
ONSET = {"sp": "phi_J", "dp": "rho_J"}
START: Start = "direct"  # of droplets at onset, as in [B] section 2.3; see `jamlab.jam`
OF_LAWS, FEW = 64, 4  # N of droplets of other force laws; packings of a law that gives an analysis
SUBTRACTED = 3.97  # z_J of table 1, taken off at every size, although z_J = 4 - 2/N' by counting
CONFLUENCE = 0.16  # drho at which droplets are confluent
MIDDLES: dict[str, Callable[[Array], Array]] = {"mean": average, "median": median}  # over packings
ONSET_CORRECTION = 0.7  # N^-0.7 of the mean onset, O'Hern et al., Phys. Rev. E 68, 011306 (2003)

# [B] steps evenly, by 1e-4, so its least squares weigh every distance alike; its regimes begin at these distances
LOWEST = {"sp": 1e-3, "dp": 1e-2}
HIGHEST = {"d_phi": 0.2, "d_rho": 0.13}  # [B] fig 6 a for phi; below confluence for rho
STEP = 1e-3  # of ours: finer changes no digit, states in between are interpolated
_EDGE = 0.01  # ends of a window are places themselves, which count

# places, which `statements.csv` names: distances from onset on logarithmic axes, on linear ones, on both
NEAR, NEAREST, ROOT = log_places(1e-6, 0.4, 5), log_places(1e-6, 1e-3, 10), log_places(1e-3, 1e-2, 10)
CROSSOVER, OF_PHI, SHAPES = log_places(1e-6, 0.1, 10), log_places(1e-4, 1e-1, 5), log_places(1e-4, 0.16, 20)
DISTANCES, EVERY_5, EVERY = np.arange(0.0, 0.43, 0.01), np.arange(0.005, 0.155, 0.005), np.arange(0.001, 0.18, 0.001)
SMALL = DISTANCES[:18]  # up to where droplets are confluent
FROM_ONSET = np.concatenate([log_places(1e-6, 10**-1.8), np.arange(0.02, 0.43, 0.01)])
# packing fractions, distances from confluence, energies
FRACTIONS, ABOVE_ONSET = np.arange(0.80, 1.25, 0.01), np.arange(0.84, 0.95, 0.01)
BELOW, CONFLUENT, LEFT = log_places(1e-6, 0.13, 4), log_places(3e-3, 0.1, 10), log_places(5e-3, 0.13, 8)
ENERGIES = log_places(1e-14, 0.1, 4)
TWO_OVERLAPS = 0.36  # dphi up to which only pairs of disks overlap: phi < 1.2


def even_places(model: str, by: str) -> Array:
    """List the distances from onset at which [B] fits, evenly spaced."""
    return np.arange(LOWEST[model], HIGHEST[by] + 0.5 * STEP, STEP)


def curve(
    tables: EnsembleTables,
    model: str,
    n: int,
    x: str,
    y: str,
    places: str,
    beyond: float = -np.inf,
    packings: str = PACKINGS[0],
) -> Sample:
    """Take the mean curve of a column y over x, of one model and size, at places of this module or at numbers."""
    found = tables.curve(model, n, x, y, _named(places), packings)
    if not np.isfinite(found.y).any():
        raise InputError(f"no packing of {model}, N = {n}, has {y} over {x}: run a campaign with some")
    return found.between(beyond, np.inf).sample()


def _named(places: str) -> ArrayLike:
    """Places of this module by their name, or numbers."""
    return globals()[places] if str(places).isupper() else np.array(str(places).split(), dtype=np.float64)


def curve_near_onset(
    tables: EnsembleTables, model: str, n: int, x: str, y: str, places: str, beyond: float = -np.inf
) -> Sample:
    """Take the mean curve of `curve`, with droplets that were followed near onset only: at each of its places over all
    packings that reach it."""
    at = np.asarray(_named(places), dtype=np.float64)
    found = tables.curve(model, n, x, y, at)
    try:
        rows = select(tables.droplets_above_onset, model=model, n=n)
    except (AbsentTableError, InputError):  # no such table, or none of this model and N: the sweeps alone
        return found.between(beyond, np.inf).sample()
    more = at_places(interpolators(rows, x, [y], False), at)
    both = [np.fmax.reduce(e.x) for e in (found, more)]
    _, kept, taken = np.intersect1d(*(np.round(place, 12) for place in both), return_indices=True)
    values = np.full((len(more.y), len(both[0])), np.nan)
    values[:, kept] = more.y[:, taken]
    x_more = np.where(np.isfinite(values), both[0], np.nan)
    found = Ensemble(np.concatenate([found.x, x_more]), np.concatenate([found.y, values]))
    return found.between(beyond, np.inf).sample()


def curve_of_law(tables: EnsembleTables, model: str, n: int, x: str, y: str, places: str, law: str = "") -> Sample:
    """Take the mean curve of z of droplets. With a law "most" or "least" it is moved by a difference at drho = 0.1 and
    N = 64: z of the force law with most or least contacts, less z of the usual law."""
    usual = curve(tables, model, n, x, y, places)
    if not law:
        return usual
    known = select(tables.droplet_laws, n=OF_LAWS).dropna(subset=["z_010"]).assign(model="dp")
    groups = [part.to_numpy() for _, part in known.groupby(list(ALL_LAW))["z_010"] if len(part) >= FEW]
    other = {"most": max, "least": min}[law](groups, key=np.mean)

    def moved(drawn: list[Array]) -> tuple[Array, Array]:
        x, y = usual.reduce(drawn[:-2])
        return x, y + drawn[-2].mean() - drawn[-1].mean()

    return Sample([*usual.groups, other, of_papers(known)["z_010"].to_numpy()], moved)


def curves(tables: EnsembleTables, kinds: str, x: str, y: str, places: str, packings: str = PACKINGS[0]) -> Sample:
    """Take the mean curves of several models and sizes, such as "sp-32 dp-32", each an argument of the statistic."""
    pairs = [kind.split("-") for kind in kinds.split()]
    return join_samples(*(curve(tables, model, int(n), x, y, places, packings=packings) for model, n in pairs))


def curves_near_onset(tables: EnsembleTables, kinds: str, x: str, y: str, places: str) -> Sample:
    """Take such mean curves of several models and sizes, each an argument of the statistic."""
    pairs = [kind.split("-") for kind in kinds.split()]
    return join_samples(*(curve_near_onset(tables, model, int(n), x, y, places) for model, n in pairs))


def join_samples(*parts: Sample) -> Sample:
    """Give what several samples of one group reduce to, each an argument of the statistic."""
    return Sample(
        [part.groups[0] for part in parts],
        lambda drawn: [part.reduce([one]) for part, one in zip(parts, drawn, strict=True)],
    )


def evenly(
    tables: EnsembleTables,
    series: str,
    column: str,
    n: int = 0,
    beyond: float = 0.0,
    per_decade: int = 0,
    z_j: str = "3.97",
    direction: str = "mean",
    packings: str = PACKINGS[0],
    middle: str = "mean",
) -> Sample:
    """Take z - z_J or G of one size, the largest unless told, at even places, or at even ones in logarithms `beyond` a
    distance; G along x by the ratio of means of packings with both."""
    model, by = SERIES[series]
    n = n or SIZES[-1]
    places = log_places(beyond, HIGHEST[by], per_decade) if per_decade else even_places(model, by)
    e = tables.curve(model, n, by, column, places, packings)
    if column == "z":
        e = Ensemble(e.x, e.y - (SUBTRACTED if z_j == "3.97" else tables.at_onset(model, n)["z"].mean()))
    if direction == "x":
        both = [tables.curve(model, n, by, name, places) for name in ("g_beside_x", "g_x")]
        e = Ensemble(e.x, e.y * average(both[1].y) / average(both[0].y))
    return (e if per_decade else e.between(beyond, np.inf)).sample(MIDDLES[middle])


def onset_rows(tables: EnsembleTables, model: str, start: str = START) -> pd.DataFrame:
    """Select the onsets of disks, or of droplets by one of their starts."""
    if model == "dp" and start == "direct":
        return select(tables.onset_starts, model=model, start=start)
    return select(tables.onset, model=model)


def onsets(tables: EnsembleTables, models: str, n: int | str, column: str = "", start: str = START) -> Sample:
    """Take the onset, or another column, of packings of models such as "sp dp" and of sizes, a group each."""
    sizes = [int(size) for size in str(n).split()]
    found = [groups_by(onset_rows(tables, m, start), "n", column or ONSET[m], sizes) for m in models.split()]
    return Sample([group for groups in found for group in groups])


def mean(groups: Sequence[Array]) -> float:
    """Average over packings, and over sizes."""
    return float(np.mean([values.mean() for values in groups]))


def draw_sizes(
    out: Drawing, axes: Any, tables: EnsembleTables, model: str, x: str, y: str, power: float = 0.0, **look: Any
) -> None:
    """Draw the mean curves of a model near onset, or near confluence, one a size; with a power over x N^power, and
    times N."""
    for n in SIZES:
        at, band = tables.curve(model, n, x, y, NEAR if x.startswith("d_") else BELOW).band
        over, times = (n**power, n) if power else (1, 1)
        out.curve(axes, f"N = {n}", at * over, scaled(band, times), **{"linestyle": "none"} | size_style(n) | look)


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
    """Fit an exponent in a window; nan where no power law is."""
    kept = (x > (1 - _EDGE) * low) & (x < (1 + _EDGE) * high)
    return fit_exponent(x[kept], y[kept])


def power(x: Array, y: Array, low: float = 0.0, high: float = np.inf, inverse: bool = False) -> float:
    """Fit a power law of relative residuals in a window, y as a power of x, or x as one of y."""
    found = float(fit_power_law(x, y, low=(1 - _EDGE) * low, high=(1 + _EDGE) * high).exponents[0])
    return 1 / found if inverse else found


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
