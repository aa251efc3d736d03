"""Collapse flow curves y(x, s) around onset onto y = s^q f((x - x_c)/s^w), with ln f a polynomial, and draw it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from jamlab.arrays import Array
from jamlab.errors import InputError
from studies.dynamics.flow_curves import HIGHEST, SETTINGS, steady_flows
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, average
from studies.panels import FIT, Drawing, drawing, label, scale, sequence
from studies.papers.statements import caption

WINDOW = (0.82, 0.86)  # packing fractions of the fit
ONSET = 0.84347  # onset in shear: Olsson & Teitel, Phys. Rev. E 83, 030302 (2011)
START = (0.843, 0.45, 0.35)  # first guess of onset and of the exponents of stress and width


ORDER = 4  # of the polynomial


@dataclass(frozen=True)
class CriticalCollapse:
    """Exponents of the scaling collapse."""

    critical: float  # x_c
    q: float  # y ~ s^q at x_c
    w: float  # the width of the critical region in x grows as s^w
    coefficients: Array = field(repr=False)  # (k,) of ln f, highest power first
    spread: float  # root mean square distance of ln y from the curve
    before: float  # the same of ln y from one curve in x alone

    @property
    def above(self) -> float:
        """Exponent y of the limit of small s above x_c, y ~ (x - x_c)^(q/w): of the yield stress."""
        return self.q / self.w

    @property
    def below(self) -> float:
        """Exponent beta below x_c, y/s ~ (x_c - x)^-beta if y ~ s there, beta = (1 - q)/w: of the viscosity."""
        return (1 - self.q) / self.w

    def function(self, z: ArrayLike) -> Array:
        """f, of the shape of z; inside the data only."""
        return np.asarray(np.exp(np.polyval(self.coefficients, np.asarray(z, dtype=np.float64))))


def collapse_through(
    x: ArrayLike,
    s: ArrayLike,
    y: ArrayLike,
    start: Sequence[float],
    *,
    critical: float | None = None,
    order: int = ORDER,
) -> CriticalCollapse:
    """Fit both exponents, and the critical point unless it is given, by least squares in ln y (m,), from a guess (x_c,
    q, w). A narrow range of s does not settle all three: data far above x_c scale with many of them."""
    place, log_s, log_y = np.asarray(x, dtype=np.float64), np.log(s), np.log(y)
    if len(place) <= order + 4:
        raise InputError(f"{len(place)} points: {order + 5} or more are needed for {order + 4} unknowns")
    width, middle = float(np.ptp(place)) or 1.0, float(np.median(log_s))

    def misfit(at: float, q: float, w: float) -> tuple[Array, Array]:
        """Distances (m,) of ln y from the polynomial that is best for these numbers, and its coefficients."""
        z = (place - at) * np.exp(-w * log_s)
        powers = np.vander(z / np.exp(-w * middle) / width, order + 1)
        found, *_ = np.linalg.lstsq(powers, log_y - q * log_s, rcond=None)
        return powers @ found - log_y + q * log_s, found / (np.exp(-w * middle) * width) ** np.arange(order, -1, -1)

    first, steps = np.array([start[0] if critical is None else critical, *start[1:]]), np.array([0.1 * width, 0.1, 0.1])
    fixed = 0 if critical is None else 1  # leading unknowns that stay

    def unknowns(move: Array) -> list[float]:
        return [*first[:fixed].tolist(), *(first[fixed:] + steps[fixed:] * move).tolist()]

    at, q, w = unknowns(least_squares(lambda move: misfit(*unknowns(move))[0], np.zeros(3 - fixed)).x)
    rest, coefficients = misfit(at, q, w)
    spread, before = (float(np.sqrt(np.mean(part**2))) for part in (rest, misfit(at, 0.0, 0.0)[0]))
    return CriticalCollapse(at, q, w, coefficients, spread, before)


def flows(tables: EnsembleTables, highest: float = HIGHEST) -> Sample:
    """Take packing fractions, rates and mean stresses of the fit, at rates up to one."""
    table = steady_flows(tables.flow)
    table = table[table["phi"].between(*WINDOW) & (table["rate"] <= highest)]
    table = table[table.groupby("phi")["rate"].transform("nunique") > 1]
    stress = table.pivot_table(index="seed", columns=["phi", "rate"], values="stress")
    phi, rate = (stress.columns.get_level_values(k).to_numpy(dtype=np.float64) for k in (0, 1))
    return Sample([stress.to_numpy(dtype=np.float64)], lambda drawn: (phi, rate, average(drawn[0])))


def exponents(phi: Array, rate: Array, stress: Array, onset: float | None = ONSET) -> Array:
    """Collapse flow curves around onset, without corrections: q (twice), of the yield stress, of the viscosity."""
    found = collapse_through(phi, rate, stress, START, critical=onset)
    return np.array([found.q, found.q, found.above, found.below])


def flow_collapse(tables: EnsembleTables) -> Drawing:
    """Scaling collapse of flow curves around onset, with its exponents."""
    sample = flows(tables)
    values = list(sample.groups)
    phi, rate, stress = sample.reduce(values)
    best, free = (collapse_through(phi, rate, stress, START, critical=onset) for onset in (ONSET, None))
    out, (smooth, branches) = drawing("dynamics-collapse", 1, 2, 5.0, 4.2)
    scale(smooth, x="linear", y="linear")
    scale(branches)
    _draw(out, smooth, branches, best, phi, rate, stress)
    label(smooth, r"$(\phi - \phi_J)/\dot\gamma^{\,w}$", r"$\sigma/\dot\gamma^{\,q}$", loc="upper left")
    label(*(branches, r"$\dot\gamma/|\phi - \phi_J|^{1/w}$", r"$\sigma/|\phi - \phi_J|^{\,q/w}$"), legend=False)
    fit = {"q": best.q, "w": best.w, "onset": best.critical, "spread": 100 * best.spread, "before": 100 * best.before}
    fit |= {"n": SETTINGS["n"], "made": len(values[0]), "low": WINDOW[0], "high": WINDOW[1], "highest": HIGHEST}
    out.caption = caption(out.name, free=free.critical, **fit)
    return out


def _draw(
    out: Drawing, smooth: Any, branches: Any, best: CriticalCollapse, phi: Array, rate: Array, stress: Array
) -> None:
    fractions = np.unique(phi)
    z = (phi - best.critical) / rate**best.w
    for k, each in enumerate(fractions):
        at, look = phi == each, {**sequence(k, len(fractions)), "linestyle": "none"}
        out.curve(smooth, f"$\\phi$ = {each:.2f}", z[at], stress[at] / rate[at] ** best.q, **look)
        distance = abs(each - best.critical)
        x, y = rate[at] / distance ** (1 / best.w), stress[at] / distance**best.above
        out.curve(branches, f"$\\phi$ = {each:.2f}", x, y, **look)
    line = np.linspace(z.min(), z.max(), 200)
    out.curve(smooth, "fit", line, best.function(line), **FIT)
    for side in (-1, 1):
        ends = np.abs(z[side * z > 0])
        if not len(ends):
            continue
        far = side * np.geomspace(ends.min(), ends.max(), 100)
        scaled_rate, scaled_stress = np.abs(far) ** (-1 / best.w), best.function(far) * np.abs(far) ** -best.above
        out.curve(branches, f"fit {'above' if side > 0 else 'below'}", scaled_rate, scaled_stress, **FIT)


FIGURES = {"dynamics-collapse": flow_collapse}
