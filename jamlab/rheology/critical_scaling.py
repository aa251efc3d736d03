"""Dynamic critical scaling: collapse G*/p^mu over omega/p^lambda, Baumgarten & Tighe eqs 14-17 and fig 3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError, warn
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import ordered_colours
from jamlab.rheology.complex_modulus import ComplexModulus
from jamlab.rheology.spectra_of_table import spectra_of_table
from jamlab.statistics.confidence import bootstrap
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.rows_of_one_kind import Campaign, DataFrame, Select


@dataclass(frozen=True)
class CriticalRange:
    """Which frequencies are critical."""

    # 1/tau_1: above, the response is affine and takes no part in the scaling (at about 1 for every p, fig 3a)
    highest: float = 0.1
    # omega/p^lambda from which the square root law is fitted, clear of the crossover near 1 (fig 3b)
    lowest: float = 30.0
    points: int = 3  # frequencies that make a slope: two have no scatter to show


CRITICAL_RANGE = CriticalRange()


@dataclass(frozen=True)
class Collapse(Result):
    """Fitted exponents with half-widths of their 95 % bootstrap intervals.

    Attributes:
        mu: G_0 ~ p^mu.
        lambda_: tau* ~ p^-lam.
        delta: Delta, G* ~ omega^Delta in the critical regime.
        mu_ci95, lambda_ci95, delta_ci95: half-widths; 0 without resamples, nan where the packings do not give one:
            a pressure needs two packings or more, and most resamples must have a fit.
            exponent and its interval are nan where no pressure has three frequencies from 30 p^lam to 0.1.
        spread: root mean square distance of the rescaled curves from their mean, in ln G*.
        pressure: (k,) of the curves.
        omega: (m,) frequencies of the scaling regime, 1/tau_1.
        storage, loss: (k, m) mean G', G'' at these frequencies.
        unit: unit of stress, for labels.
    """

    _rows = ("pressure", "omega", "storage", "loss")

    mu: float
    lambda_: float
    delta: float
    mu_ci95: float
    lambda_ci95: float
    delta_ci95: float
    spread: float
    pressure: Array
    omega: Array
    storage: Array
    loss: Array
    unit: str

    def __str__(self) -> str:
        return f"{self.exponents}, spread {self.spread:.2g} in ln G*"

    @property
    def exponents(self) -> str:
        """The exponents with their errors, in words."""
        mu, lam = _with_error(self.mu, self.mu_ci95), _with_error(self.lambda_, self.lambda_ci95)
        return f"μ = {mu}, λ = {lam}, Δ = {_with_error(self.delta, self.delta_ci95)}"

    def _columns(self) -> dict[str, Any]:
        """A row for each pressure and frequency."""
        count = len(self.omega)
        points = {"pressure": np.repeat(self.pressure, count), "omega": np.tile(self.omega, len(self.pressure))}
        return points | {"storage": self.storage.ravel(), "loss": self.loss.ravel()}

    @drawn("Line2D, of all curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw G'/p^mu (filled) and G''/p^mu (open) over omega/p^lambda; exponents stand over the legend.

        Pressures are taken as numbers in the unit of stress, and frequencies are those that take part in the fit.
        """
        order = np.argsort(self.pressure)
        for colour, k in zip(ordered_colours(len(order)), order, strict=True):
            p = self.pressure[k]
            name = f"$p$ = {p:.3g} {self.unit}"
            for values, fill, label in ((self.storage[k], colour, name), (self.loss[k], "white", None)):
                plain = {"color": colour, "marker": "o", "markersize": 4, "linewidth": 0.8, "label": label}
                look = merged_line(plain, style)
                look.setdefault("markerfacecolor", fill)
                axes.loglog(self.omega / p**self.lambda_, values / p**self.mu, **look)
        label_axes(axes, r"$\omega\,\tau_1/p^\lambda$", in_unit(r"$G'/p^\mu$ (filled), $G''/p^\mu$ (open)", self.unit))
        axes.legend(title=self.exponents, fontsize=LEGEND, title_fontsize=LEGEND, loc="lower right")  # below all curves


def _with_error(value: float, error: float) -> str:
    return f"{value:.3g} ± {error:.2g}" if error > 0 else f"{value:.3g}"


@overload
def scaling_collapse(
    pressures: Sequence[float] | Array,
    spectra: Sequence[Sequence[ComplexModulus]],
    *,
    resamples: int = 200,
    seed: int = 1,
) -> Collapse: ...
@overload
def scaling_collapse(
    pressures: Campaign | DataFrame, *, select: Select | None = None, resamples: int = 200, seed: int = 1
) -> Collapse: ...
@checked
def scaling_collapse(
    pressures: Campaign | DataFrame | Sequence[float] | Array,
    spectra: Sequence[Sequence[ComplexModulus]] | None = None,
    *,
    select: Select | None = None,
    resamples: int = 200,
    seed: int = 1,
) -> Collapse:
    """Scaling collapse of the mean spectra of several pressures: fit mu and lambda, and Delta from its slope.

    Args:
        pressures: three or more. Or a campaign, or its table "spectra", of one sweep or several, which has pressures
            and spectra: packings are taken by `target_pressure`, ascending, and those that did not converge are left
            out.
        spectra: one or more spectra for each pressure, all at the same frequencies.
        select: of a campaign or a table with packings of several kinds: columns and their values in the rows that are
            wanted, such as {"n": 128, "prestress": False, "beta": 1.0}.
        resamples: number of bootstrap samples over the packings of each pressure; 0: no errors.
        seed: of the bootstrap.

    Warns:
        JamlabWarning: Delta is nan, because too few frequencies are in the critical regime; or packings of a table did
            not converge.

    Raises:
        InputError: fewer than three pressures, no spectra, frequencies that differ, a modulus that is not positive; a
            table whose packings differ in more than pressure and seed.

    Example:
        >>> pressures = [1e-2, 1e-3, 1e-4]
        >>> packings = [jamlab.pack(n=32, pressure=p, seed=1) for p in pressures]
        >>> spectra = [[jamlab.complex_modulus(q, np.logspace(-6, 1, 36), prestress=False)] for q in packings]
        >>> c = jamlab.scaling_collapse(pressures, spectra, resamples=0)
        >>> len(c.pressure), 0 < c.mu < 1.5
        (3, True)
    """
    if isinstance(pressures, Campaign | DataFrame):
        if spectra is not None:
            raise InputError("spectra: a campaign, or its table, has its own; leave them out")
        known = spectra_of_table(pressures, select).by_pressure
        pressures, spectra = [*known], [*known.values()]
    elif select is not None:
        raise InputError("select: applies to a campaign, or its table; choose among spectra by hand")
    elif spectra is None:
        raise InputError("spectra are missing: give pressures and spectra, or a campaign")
    p = np.ravel(np.asarray(pressures, dtype=np.float64))
    _check_groups(p, spectra)
    _check_positive(p, spectra)
    omega = spectra[0][0].omega
    kept = omega <= CRITICAL_RANGE.highest
    curves = [np.array([[s.storage[kept], s.loss[kept]] for s in group]) for group in spectra]
    x = omega[kept]
    means = [c.mean(axis=0) for c in curves]
    best = _fit(x, p, means)
    if np.isnan(best[2]):
        missing = (
            f"no Δ: no pressure has {CRITICAL_RANGE.points} frequencies from {CRITICAL_RANGE.lowest:g} p^λ to "
            f"{CRITICAL_RANGE.highest:g}, λ = {best[1]:.3g}"
        )
        warn(f"{missing}; use a larger n, or more frequencies")
    errors = np.zeros(3) * best[:3]  # nan where the exponent is
    if resamples:
        drawn = bootstrap(curves, lambda c: _fit(x, p, [g.mean(axis=0) for g in c])[:3], resamples=resamples, seed=seed)
        errors = 0.5 * (drawn.high - drawn.low)
    mu_ci95, lam_ci95, exponent_ci95 = (float(e) for e in errors)
    storage, loss = np.stack(means, axis=1)
    return Collapse(*best[:3], mu_ci95, lam_ci95, exponent_ci95, best[3], p, x, storage, loss, spectra[0][0].unit)


def _check_groups(p: Array, spectra: Sequence[Sequence[ComplexModulus]]) -> None:
    """Refuse too few pressures, and spectra that do not belong together."""
    if len(p) != len(spectra) or not all(len(group) for group in spectra):
        raise InputError(f"got {len(p)} pressures and {len(spectra)} groups: a collapse needs spectra of each pressure")
    given = ", ".join(f"{pressure:g}" for pressure in p)
    if not (np.isfinite(p) & (p > 0)).all():
        raise InputError(f"pressures = {given}: must be finite numbers above 0")
    if len(p) < 3:
        raise InputError(f"a collapse needs three pressures or more, got {len(p)}{': ' * bool(given)}{given}")
    if len(np.unique(p)) < len(p):
        raise InputError(f"pressures = {given}: give each pressure once, with all its spectra")
    every = [spectrum for group in spectra for spectrum in group]
    if not all(np.array_equal(spectrum.omega, every[0].omega) for spectrum in every):
        raise InputError("a collapse needs spectra at the same frequencies")
    for name in ("unit", "direction"):
        found = dict.fromkeys(str(getattr(spectrum, name)) for spectrum in every)
        found.pop("", None)  # one made by hand says no unit
        if len(found) > 1:
            raise InputError(f"a collapse needs spectra of one {name}, got {', '.join(found)}")


def _check_positive(pressures: Array, spectra: Sequence[Sequence[ComplexModulus]]) -> None:
    """Refuse moduli that have no logarithm."""
    for pressure, group in zip(pressures, spectra, strict=True):
        unstable = [s.g0 for s in group if not (np.all(s.storage > 0) and np.all(s.loss > 0))]
        if unstable:
            raise InputError(
                f"{len(unstable)} of {len(group)} packings at pressure {pressure:g} have a modulus that is not "
                f"positive (lowest G_0 = {min(unstable):.3g}): use prestress=False or shear-stabilized packings, or "
                'leave them out, such as by table[table["g0"] > 0]'
            )


def _fit(omega: Array, p: Array, curves: Sequence[Array]) -> tuple[float, float, float, float]:
    """Fit mu, lambda and Delta, nan without critical regime; and the spread. `curves`: (2, m) mean G' and G'' of each
    pressure."""
    families = [[(omega, c[part]) for c in curves] for part in (0, 1)]
    found = fit_scaling_exponents(p, families, start=(-1.0, -0.5))
    mu, lam = -found.b, -found.a
    slopes = []
    for c, pressure in zip(curves, p, strict=True):
        critical = omega > CRITICAL_RANGE.lowest * pressure**lam
        if np.count_nonzero(critical) >= CRITICAL_RANGE.points:
            slopes += [np.polyfit(np.log(omega[critical]), np.log(part[critical]), 1)[0] for part in c]
    return mu, lam, float(np.mean(slopes)) if slopes else float("nan"), found.spread
