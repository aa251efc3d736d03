"""Draw the spectra of Baumgarten & Tighe: figs 1, 3, 4 and 6."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.hdf5 import read_hdf5
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.plotting import in_unit
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED
from jamlab.plotting.periodic_cell import circles, fill_everywhere, frame_cell
from jamlab.rheology.complex_modulus import ComplexModulus, complex_modulus
from jamlab.rheology.critical_scaling import CRITICAL_RANGE, scaling_collapse
from jamlab.rheology.displacement_correlation import displacement_response
from jamlab.statistics.power_laws import fit_power_law
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import FEWEST, Sample, mean_over_packings, scaled, select, vary_bootstrap
from studies.panels import BESIDE, FREQUENCY, Drawing, drawing, label, scale, sequence
from studies.papers.statements import Measured, caption
from studies.tables import DATA

SIZE = 32_768  # disks of figs 1, 3 to 6, in boxes of fixed shape as in the paper
SCANNED = {"n": 2048, "target_pressure": 1e-4}  # packings under many values of beta and eta_F
FIXED, STABILIZED = "fixed-box", "shear-stabilized"
LARGE = 25.0  # p N^2 from which packings take part in fits of exponents: below, their size decides, fig 8
LAWS: dict[str, dict[str, Any]] = {
    "contact": {"damping": "contact", "beta": 1.0},
    "stokes": {"damping": "stokes", "eta_f": 1.0},
    "undamped": {"damping": "contact", "beta": 0.0},
}
FEWER = 512  # disks of packings with columns of their own
MODULUS = in_unit(r"$G'$ (filled), $G''$ (open)", "k")
SHEARED = "packing_k.h5"  # `jamlab pack --n 512 --pressure 1e-4 --seed 1 --ensemble shear-stabilized`
REGIMES = {"slow": 1e-10, "critical": 1e-3, "fast": 1e4}  # omega of fig 1: non-affine, square root, affine
STRAIN = 0.2  # amplitude that the six panels are drawn at
PALE = {"facecolor": "#EFE9DD", "edgecolor": "#B9B2A5", "linewidth": 0.4, "rasterized": True}
SEEN = 0.02  # of the affine motion: less is no motion in a picture
SHOWN = 1e-4  # pressure of fig 1
LOWEST = 3.16e-6  # pressure of which the critical regime is widest, among those with five stable packings
RESAMPLES = 60  # of a collapse: each is a fit, seconds for a figure


# spectra by pressure -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Group:
    """Packings of one pressure under one law."""

    seeds: NDArray[np.int64]  # (packings,) of the packings, ascending
    omega: Array  # (m,) frequencies
    # storage, loss: (packings, m)
    storage: Array
    loss: Array
    # g0, eta0, eta_inf: (packings,)
    g0: Array
    eta0: Array
    eta_inf: Array

    def at(self, kept: NDArray[np.bool_]) -> "Group":
        """Cut the packings to some of the frequencies, (m,) bool."""
        return replace(self, omega=self.omega[kept], storage=self.storage[:, kept], loss=self.loss[:, kept])

    def members(self) -> list[ComplexModulus]:
        """List the spectra of single packings, the form that `jamlab.scaling_collapse` takes."""
        none = np.full(self.omega.shape, np.nan)
        return [
            ComplexModulus(self.omega, up, down, float(g0), float(eta0), float(eta_inf), "table", none)
            for up, down, g0, eta0, eta_inf in zip(
                self.storage, self.loss, self.g0, self.eta0, self.eta_inf, strict=True
            )
        ]


def group_by_pressure(table: pd.DataFrame) -> dict[float, Group]:
    """Group rows of one law by pressure, descending; packings with a modulus that is not positive are left out."""
    out = {}
    for p in table["target_pressure"].unique().tolist():
        part = table[table["target_pressure"] == p]
        wide = part.pivot_table(index="seed", columns="omega", values=["storage", "loss"]).dropna()
        up, down = (wide[name].to_numpy(dtype=np.float64) for name in ("storage", "loss"))
        stable: NDArray[np.bool_] = np.asarray((up > 0).all(axis=1) & (down > 0).all(axis=1))
        if not stable.any():
            continue
        seeds = wide.index.to_numpy(dtype=np.int64)[stable]
        ends = part.drop_duplicates("seed").set_index("seed").loc[seeds]
        omega = wide["storage"].columns.to_numpy(dtype=np.float64)
        limits = (ends[name].to_numpy(dtype=np.float64) for name in ("g0", "eta0", "eta_inf"))
        out[p] = Group(seeds, omega, up[stable], down[stable], *limits)
    return dict(sorted(out.items(), reverse=True))


@cache
def spectra(tables: EnsembleTables, law: str, prestress: bool = True, n: int = SIZE) -> dict[float, Group]:
    """Give the spectra of one of the `LAWS` by pressure, descending."""
    return group_by_pressure(select(tables.spectra, n=n, ensemble=FIXED, prestress=prestress, **LAWS[law]))


def sampled(groups: dict[float, Group], large: bool = True) -> dict[float, Group]:
    """Select the pressures with enough packings for an interval, of which p N^2 is large enough for fits."""
    return {p: g for p, g in groups.items() if len(g.g0) >= FEWEST and (not large or p * SIZE**2 >= LARGE)}


def scan(tables: EnsembleTables, law: str, parameter: str) -> dict[float, Group]:
    """Give the spectra at the scanned size and pressure, with pre-stress, by the value of a parameter of damping."""
    rows = select(tables.spectra, damping=law, prestress=True, ensemble=FIXED, **SCANNED)
    values: list[float] = sorted(rows[parameter].unique().tolist())
    found = {value: group_by_pressure(rows[rows[parameter] == value]) for value in values}
    return {value: next(iter(groups.values())) for value, groups in found.items() if groups}


def same_packings(groups: Sequence[Group]) -> Array:
    """Arrange (packings, groups) eta_0 of the packings that all groups have: under one law some may not be stable."""
    shared = set.intersection(*(set(g.seeds.tolist()) for g in groups))
    return np.column_stack([g.eta0[np.isin(g.seeds, list(shared))] for g in groups])


def format_power(p: float) -> str:
    """Format a number as 10^n, or a x 10^n, in mathtext."""
    exponent = int(np.floor(np.log10(p) + 1e-9))
    if exponent in (-1, 0, 1):
        return f"{p:.2g}"
    front = p / 10.0**exponent
    return f"10^{{{exponent}}}" if abs(front - 1) < 1e-6 else rf"{front:.2g}\times 10^{{{exponent}}}"


# slopes of G* in windows of frequency ---------------------------------------------------------------------------------


def part_of(group: Group, part: str) -> Array:
    """Choose a part of G*; its critical part is left when the static modulus and the fluid's own loss are taken off."""
    return {
        "G'": group.storage,
        "G''": group.loss,
        "G' - G_0": group.storage - group.g0[:, None],
        "G'' - eta_F omega": group.loss - group.omega,  # of eta_F = 1
    }[part]


def spectrum(tables: EnsembleTables, law: str, pressure: float, part: str) -> Sample:
    """Take omega and a part of G* of packings at one pressure, with pre-stress."""
    group = spectra(tables, law)[pressure]
    return Sample([part_of(group, part)], lambda drawn: (group.omega, drawn[0]))


def slope(omega: Array, values: Array, low: float, high: float) -> float:
    """Fit the slope of the mean in a window of frequency."""
    return float(fit_power_law(omega, values.mean(axis=0), low=low, high=high).exponents[0])


# exponents in pressure ------------------------------------------------------------------------------------------------


def power(places: Sequence[float] | Array, values: ArrayLike, first: int = 0, last: int | None = None) -> float:
    """Fit an exponent in some places."""
    x, y = np.asarray(places)[first:last], np.asarray(values)[first:last]
    if len(x) < 2:
        raise InputError(f"{len(x)} places for an exponent: two or more are needed")
    return float(fit_power_law(x, y).exponents[0])


def at_pressures(groups: Mapping[float, Array], values: Callable[[Array], float]) -> Sample:
    """Take pressures, and what the packings that are drawn at each give."""
    return Sample(list(groups.values()), lambda drawn: (list(groups), [values(group) for group in drawn]))


def static_modulus(ends: Array) -> float:
    """Average G_0 of packings (packings, 2) with G_0 and eta_0."""
    return float(ends[:, 0].mean())


def slow_rate(ends: Array) -> float:
    """Divide the mean G_0 of such packings by the mean eta_0."""
    return float(np.divide(*ends.mean(axis=0)))


def of_ends(tables: EnsembleTables, law: str, of: Callable[[Array], float] = slow_rate) -> Sample:
    """Take what G_0 and eta_0 give at each pressure."""
    groups = sampled(spectra(tables, law))
    return at_pressures({p: np.column_stack([g.g0, g.eta0]) for p, g in groups.items()}, of)


def collapsed(tables: EnsembleTables, law: str) -> list[Measured]:
    """Fit mu and lambda by `jamlab.scaling_collapse` of omega < 0.1; other analyses: G_0 and G_0/eta_0 alone."""
    groups = sampled(spectra(tables, law))
    if len(groups) < 3:
        raise InputError(f"{len(groups)} pressures with {FEWEST} stable packings: a collapse takes three")
    fit = scaling_collapse(list(groups), [g.members() for g in groups.values()], resamples=RESAMPLES)
    found = []
    for v, error, of in ((fit.mu, fit.mu_ci95, static_modulus), (fit.lambda_, fit.lambda_ci95, slow_rate)):
        alone = vary_bootstrap(of_ends(tables, law, of), power)[0]
        how = f"collapse of {len(groups)} pressures, N = {SIZE}"
        found.append(Measured(v, v - error, v + error, {f"{of.__name__} alone": alone}, how))
    return found


def stars(tables: EnsembleTables, prestress: bool = False) -> Sample:
    """Take beta*, where sliding takes as much energy as approach, at each pressure."""
    none, full = (sampled(spectra(tables, law, prestress)) for law in ("undamped", "contact"))
    pairs = {p: same_packings([none[p], full[p]]) for p in none if p in full}
    filled = {p: eta for p, eta in pairs.items() if len(eta)}
    return at_pressures(filled, lambda eta: eta[:, 0].mean() / float(np.diff(eta.mean(axis=0))[0]))


# ends of the regimes --------------------------------------------------------------------------------------------------


def wide_spectra(tables: EnsembleTables, prestress: bool = True) -> Sample:
    """Take eta_0, eta_inf and G'' of the pressures whose critical regime is not empty."""
    every = sampled(spectra(tables, "contact", prestress), large=False)
    groups = {p: g for p, g in every.items() if CRITICAL_RANGE.lowest * p < CRITICAL_RANGE.highest}
    drawn = [np.column_stack([g.eta0, g.eta_inf, g.loss]) for g in groups.values()]
    return Sample(drawn, lambda packings: (list(groups), [g.omega for g in groups.values()], packings))


def regime_ends(
    p: list[float], omega: list[Array], drawn: list[Array], at: float = CRITICAL_RANGE.highest, pressure: int = -1
) -> Array:
    """Find where the law omega^0.5 through G'' at one frequency meets eta_inf omega, as a power of p, and at the lowest
    pressure where it meets eta_0 omega and eta_inf omega, in decades of omega/p and of omega."""
    means = [packings.mean(axis=0) for packings in drawn]
    roots = np.array([np.interp(at, w, mean[2:]) / at**0.5 for w, mean in zip(omega, means, strict=True)])
    slow, fast = np.square(roots / np.array([mean[:2] for mean in means]).T)
    return np.array(
        [fit_power_law(p, fast).exponents[0], np.log10(slow[pressure] / p[pressure]), np.log10(fast[pressure])]
    )


# without rotations, without damping, with a fluid ---------------------------------------------------------------------


def of_column(tables: EnsembleTables, column: str, over: str = "", pressure: float = 0.0) -> Sample:
    """Take a column of slow shear of small packings, or its ratio to another, a group a pressure, or at one."""
    rows = select(tables.quasistatic.dropna(subset=[column, over] if over else [column]), n=FEWER)
    rows = select(rows, pressure=pressure) if pressure else rows
    values = rows[column] / (rows[over] if over else 1.0)
    return Sample([part.to_numpy() for _, part in values.groupby(rows["pressure"])])


def mean_of_all(groups: list[Array]) -> float:
    """Average over packings and pressures."""
    return float(np.concatenate(groups).mean())


# drawings -------------------------------------------------------------------------------------------------------------


def draw(
    out: Drawing, axes: Any, group: Group, name: str, look: dict[str, Any], x: float = 1.0, y: float = 1.0
) -> None:
    """Draw G' (filled) and G'' (open) over omega, each times a factor."""
    for part, values, more in (
        ("G'", group.storage, {"linestyle": "-"}),
        ("G''", group.loss, {"linestyle": "--", "markerfacecolor": "white"}),
    ):
        both: dict[str, Any] = look | more | {"markevery": max(len(group.omega) // 20, 1)}
        found, text = mean_over_packings([values])[0], name if part == "G'" else None
        out.curve(axes, f"{part} {name}", group.omega * x, scaled(found, y), label=text, **both)


def figure_1(tables: EnsembleTables) -> Drawing:
    """G' and G'' of one pressure near jamming: Kelvin-Voigt at both ends, square roots between."""
    group = spectra(tables, "contact")[SHOWN]
    out, (axes,) = drawing("baumgarten-1", 1, 1, 6.4, 4.6)
    scale(axes)
    draw(out, axes, group, f"$p = {format_power(SHOWN)}$", {"color": GREEN, "marker": "o"})
    low, high, w = CRITICAL_RANGE.lowest * SHOWN, CRITICAL_RANGE.highest, group.omega
    storage, loss = group.storage.mean(axis=0), group.loss.mean(axis=0)
    axes.axvspan(low, high, color="#999999", alpha=0.13, linewidth=0, zorder=0)
    out.slope(axes, 1.0, (w[0], 0.1 * SHOWN), 0.4 * loss[0])
    out.slope(axes, 0.5, (low, high), 2.0 * float(np.interp(low, w, storage)), above=True)
    out.slope(axes, 1.0, (10, w[-1]), 0.4 * float(np.interp(10, w, loss)))
    label(axes, FREQUENCY, MODULUS)
    inset = axes.inset_axes((0.66, 0.04, 0.32, 0.38))
    inset.set_gid("inset")
    _draw_disks(inset, read_hdf5(DATA / SHEARED))
    return out


def _draw_disks(axes: Any, packing: Packing) -> None:
    assert packing.diameters is not None
    fill_everywhere(axes, circles(packing.positions, packing.diameters), packing.box, **PALE)
    frame_cell(axes, packing.box)


def figure_1_fields(tables: EnsembleTables) -> Drawing:
    """Displacements of disks at zero and at peak stress, at a low, a critical and a high frequency, on one scale."""
    out, panels = drawing("baumgarten-1-fields", 2, len(REGIMES), 4.6, 4.9)
    packing = read_hdf5(DATA / SHEARED)
    moduli = complex_modulus(packing, list(REGIMES.values()))
    ratios = []
    for k, (regime, omega) in enumerate(REGIMES.items()):
        backbone, motion = displacement_response(packing, omega)
        strain = 1 / complex(moduli.storage[k], moduli.loss[k])  # per stress
        at = backbone.positions + moves_home(backbone.positions, packing.box)
        affine = np.column_stack([at[:, 1] - 0.5 * packing.box[1, 1], np.zeros(len(at))])
        whole = (motion + strain * affine) / abs(strain)
        ratios.append(np.sqrt((np.abs(motion) ** 2).sum() / (np.abs(strain * affine) ** 2).sum()))
        for axes, u, when in ((panels[k], whole.imag, "zero"), (panels[k + len(REGIMES)], whole.real, "peak")):
            _draw_disks(axes, packing)
            dots: dict[str, Any] = {"color": BLACK, "linestyle": "none", "marker": ".", "markersize": 1}
            out.curve(axes, f"{regime}, omega = {omega:g}, {when} stress", *at.T, label=None, **dots)
            look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "color": BLUE, "width": 0.0035}
            if np.abs(u).max() > SEEN * np.abs(whole).max():
                axes.quiver(*at.T, *(STRAIN * u).T, **look)
            else:
                axes.text(0.5, 0.5, "no displacement", transform=axes.transAxes, fontsize=14, ha="center")
            axes.set_title(rf"{when} stress, $\omega\,\tau_1 = {format_power(omega)}$", fontsize=12)
    out.caption = caption(out.name, strain=STRAIN, n=packing.n, ratios=", ".join(f"{ratio:.2f}" for ratio in ratios))
    return out


def _draw_collapse(out: Drawing, plain: Any, over: Any, groups: dict[float, Group]) -> None:
    """Draw spectra of all pressures, as they are (unless `plain` is None) and over p^0.5 against omega/p."""
    for index, (p, group) in enumerate(groups.items()):
        look, name = sequence(index, len(groups)), f"$p = {format_power(p)}$"
        if plain is not None:
            draw(out, plain, group, name, look)
        draw(out, over, group.at(group.omega <= CRITICAL_RANGE.highest), name, look, 1 / p, p**-0.5)
    low = max(min(g.omega[0] / p for p, g in groups.items()), 1e-4)
    level = float(np.median([g.g0.mean() / p**0.5 for p, g in groups.items()]))
    out.slope(over, 1.0, (low, 1e-1), 0.1 * level * low)
    out.slope(over, 0.5, (30.0, 3e4), 3.0 * level * 30**0.5 / 2, above=True)
    place = BESIDE if plain is None else {"legend": False}
    label(over, r"$\omega\,\tau_1 / p$", r"$G' / p^{1/2}$ (filled), $G'' / p^{1/2}$ (open)", **place)


def figure_3(tables: EnsembleTables) -> Drawing:
    """G* of balanced contact damping for a range of pressures, and its collapse."""
    groups = spectra(tables, "contact")
    out, (a, b) = drawing("baumgarten-3", 1, 2, 6.6, 4.6)
    scale(a, b)
    _draw_collapse(out, a, b, groups)
    w = next(iter(groups.values())).omega
    least = min(group.loss.mean(axis=0)[0] for group in groups.values())
    out.slope(a, 1.0, (w[0], 1e3 * w[0]), 0.25 * least)
    label(a, FREQUENCY, MODULUS, **BESIDE)
    return out


def figure_4(tables: EnsembleTables) -> Drawing:
    """Sliding that is damped less, or not at all."""
    out, (a, b, c) = drawing("baumgarten-4", 1, 3, 5.6, 4.8)
    scale(a, b, c)
    groups = spectra(tables, "undamped")
    for index, (p, group) in enumerate(groups.items()):
        draw(out, a, group, f"$p = {format_power(p)}$", sequence(index, len(groups)), 1.0, p**-0.5)
    for index, (p, group) in enumerate(spectra(tables, "undamped", prestress=False).items()):
        for part, values in (("G'", group.storage), ("G''", group.loss)):  # which nearly fall onto each other
            text = "no pre-stress: dotted" if part == "G'" and not index else None
            name, over = f"{part} p = {p:g}, no pre-stress", values.mean(axis=0) * p**-0.5
            out.curve(a, name, group.omega, over, label=text, color=BLACK, linestyle=":")
    label(a, FREQUENCY, r"$G' / p^{1/2}$ (filled), $G'' / p^{1/2}$ (open)", loc="lower right", fontsize=8)
    out.slope(a, 1.0, (1e-6, 1e-4), 1e-5, above=True)
    _draw_scan(out, b, scan(tables, "contact", "beta"), r"\beta")
    known = {beta: group for beta, group in scan(tables, "contact", "beta").items() if beta > 0}
    for name, text, colour in (("eta0", r"$\eta_0$", BLUE), ("eta_inf", r"$\eta_\infty$", RED)):
        mean_values = [float(getattr(group, name).mean()) for group in known.values()]
        out.curve(c, name, list(known), mean_values, label=text, color=colour, marker="o")
    label(c, r"balance $\beta$", in_unit("viscosity", r"$k\,\tau_1$"))
    return out


def _draw_scan(out: Drawing, axes: Any, groups: dict[float, Group], symbol: str) -> None:
    """Draw G* at one pressure for every value of a parameter of damping."""
    for index, (value, group) in enumerate(groups.items()):
        draw(out, axes, group, rf"${symbol} = {format_power(value) if value else 0}$", sequence(index, len(groups)))
    ncols = 2 if symbol == r"\beta" else 1
    label(axes, FREQUENCY, MODULUS, loc="best", fontsize=7.5, ncols=ncols)


def figure_6(tables: EnsembleTables) -> Drawing:
    """Stokes drag: collapse for eta_F = 1, and what the viscosity of the fluid adds."""
    out, (a, b) = drawing("baumgarten-6", 1, 2, 6.4, 4.8)
    scale(a, b)
    _draw_collapse(out, None, a, spectra(tables, "stokes"))
    _draw_scan(out, b, scan(tables, "stokes", "eta_f"), r"\eta_F")
    return out
