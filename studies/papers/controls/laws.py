"""Laws that the papers state, with their own numbers; where a paper prints no height, ours at one place."""

from collections.abc import Callable

import numpy as np

from jamlab.arrays import Array
from studies.papers.boromand.conventions import CONFLUENCE, SERIES, SUBTRACTED, eq_11, table_fit
from studies.papers.statements import paper

Law = Callable[[Array, int, str], Array]  # of x (states,), N, model
Ours = Callable[[float], float]  # our mean at x

CROSSOVER = 1.0  # d* N^2, [B] sec 3: d* ~ N^-2, and 1e-3 of the smallest packings
PAIRS = 2.0  # (z_conf - z) N nearest to rho*, inset of [B] fig 7
SERIES_OF = {model_and_x: name for name, model_and_x in SERIES.items()}
ONSETS = {"sp": paper("BT-phiJ-sp"), "dp": paper("BT-rhoJ-dp")}  # of table 1


def power(value: float, ours: Ours, at: float, inverse: bool = False) -> Law:
    """y ~ x^value, or x ~ y^value; as high as ours at one place."""
    exponent = 1 / value if inverse else value
    height = ours(at) / at**exponent
    return lambda x, n, model: height * x**exponent


def two_powers(value: float, ours: Ours, before: float, end: float, decades: float) -> Law:
    """y ~ x^value over the last decades before an end, a steeper or flatter power `before`; as high as ours there."""
    middle, height = end * 10**-decades, ours(end)

    def law(x: Array, n: int, model: str) -> Array:
        late = height * (x / end) ** value
        return np.where(x > middle, late, height * (middle / end) ** value * (x / middle) ** before)

    return law


def area(value: float, ours: Ours) -> Law:
    """Area of disks that is shared, [B] eq 11 with the paper's C."""
    c = paper("B4-C")
    return lambda x, n, model: x - c * eq_11(x)


def area_by_phi(value: float, ours: Ours) -> Law:
    """phi - rho over phi, by eq 11 from the onset of table 1."""
    shared = area(value, ours)
    return lambda x, n, model: shared(np.maximum(x - ONSETS[model], 0.0), n, model)


def lost_area(value: float, ours: Ours) -> Law:
    """1 - <a>/a_J over drho, by eq 11 from the onset of table 1."""
    d_phi = np.linspace(0.0, 0.4, 4001)
    onset, d_rho = ONSETS["sp"], paper("B4-C") * eq_11(d_phi)
    rising = slice(0, int(d_rho.argmax()) + 1)
    lost = 1 - (onset + d_rho) / (onset + d_phi)
    return lambda x, n, model: np.interp(x, d_rho[rising], lost[rising])


def equation_11(value: float, ours: Ours) -> Law:
    """drho = C (dphi - dphi^1.5), [B] eq 11."""
    return lambda x, n, model: value * eq_11(x)


def table(value: float, ours: Ours, x: str, column: str) -> Law:
    """z - z_J or G by the fits of [B] tables 1 and 2."""
    return lambda d, n, model: table_fit(SERIES_OF[model, x], column)(np.maximum(d, 0.0))


def table_by_rho(value: float, ours: Ours) -> Law:
    """z by table 1 over rho itself, from the onset of the table."""
    fits = {model: table_fit(SERIES_OF[model, "d_rho"], "z") for model in ONSETS}
    return lambda x, n, model: fits[model](np.maximum(x - ONSETS[model], 0.0))


def table_to_confluence(value: float, ours: Ours) -> Law:
    """z - z_J of disks by table 1 up to rho = `value`, from there on a line to z = 6 at confluence."""
    fit, end = table_fit("SP(ρ)", "z"), value - ONSETS["sp"]
    last = float(fit(end))

    def law(x: Array, n: int, model: str) -> Array:
        return np.where(x < end, fit(x), last + (6 - SUBTRACTED - last) * (x - end) / (CONFLUENCE - end))

    return law


def finite_size(value: float, ours: Ours, x: str, column: str) -> Law:
    """z - z_J or G of N particles: ~ d or constant up to d* = 1/N^2, from there on by table 1 or 2, [B] sec 3."""

    def law(d: Array, n: int, model: str) -> Array:
        fit, star = table_fit(SERIES_OF[model, x], column), CROSSOVER / n**2
        near = float(fit(star)) * (np.maximum(d, 0.0) / star) ** (column == "z")
        return np.where(d < star, near, fit(np.maximum(d, star)))

    return law


def confluence(value: float, ours: Ours, at: float) -> Law:
    """(z_conf - z) N = 2 + c (rho* - rho) N, [B] fig 7: one curve of all sizes; c is ours at one place."""
    slope = ours(at) / at
    return lambda x, n, model: PAIRS / n + slope * x
