"""Draw which motion of droplets carries which relaxation: whole droplets, along their outlines, or across them."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.plotting.palette import BLUE, ORANGE, PINK, SKY
from jamlab.rheology.mode_character import MOTIONS
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import FRACTIONS, RATE_BINS, EnsembleTables, droplets_with, values_of
from studies.ensembles import bootstrap, side_by_side
from studies.panels import Drawing, drawing, label, style
from studies.papers.statements import caption

DRAGS = {"contact": "contact drag", "stokes": "Stokes drag"}
SCANNED = 0.90  # packing fraction at which line tension is varied
SHOWN = (0.86, 0.90, 0.96)  # packing fractions of the spectra drawn
WORDS = {"translation": "translation", "rotation": "rotation", "along": "along outlines", "across": "across outlines"}
COLOUR = {"translation": BLUE, "rotation": SKY, "along": ORANGE, "across": PINK}
# rates that part the relaxations of each law, 1/tau_1: at the minima between the maxima of strength
GROUPS = {
    "contact": {"slow": (0.0, 0.1), "middle": (0.1, 10**1.5), "fast": (10**1.5, np.inf)},
    "stokes": {"slow": (0.0, 1.0), "middle": (1.0, 10.0), "fast": (10.0, np.inf)},
}


def droplet_modes(tables: EnsembleTables) -> Drawing:
    """Relaxation spectra of droplets by the motion of its modes, and what moves in slow and in fast ones."""
    table = tables.droplet_modes
    usual = droplets_with(table)
    out, axes = drawing("beyond-droplet-modes", 2, 4, 4.1, 3.7)
    for row, law in enumerate(DRAGS):
        rows = usual[usual["damping"] == law]
        panels = axes[4 * row : 4 * row + 4]
        for part, rho in zip(panels, SHOWN, strict=False):
            _draw_spectrum(out, part, rows[np.isclose(rows["rho"], rho)])
            for _, high in list(GROUPS[law].values())[:-1]:
                part.axvline(high, color="#777777", linewidth=0.8, linestyle=":")
            name = rf"{DRAGS[law]}, $\rho$ = {rho:.2f}"
            label(part, r"rate $\lambda\,\tau_1$", "strength per decade / all", legend=False)
            part.annotate(name, (0.03, 0.95), xycoords="axes fraction", fontsize=9.5, va="top")
        _draw_shares(out, panels[3], rows, law)
    out.legend_above(axes[0], fontsize=10)
    _keep_rates(out, table)
    out.caption = caption(out.name, n=int(usual["n"].mode()[0]), made=usual["seed"].nunique())
    return out


def _draw_spectrum(out: Drawing, axes: Any, rows: pd.DataFrame) -> None:
    """Stack the parts of the mean strength per decade, relative to the strength of all modes."""
    axes.set_xscale("log")
    centres = np.sqrt(RATE_BINS[1:] * RATE_BINS[:-1])
    total = rows["strength"].sum() * np.log10(RATE_BINS[1] / RATE_BINS[0])
    place = np.searchsorted(RATE_BINS, rows["rate"]) - 1
    bottom = np.zeros(len(centres))
    for name in MOTIONS:
        top = bottom + np.bincount(place, rows[name], len(centres)) / total
        axes.fill_between(centres, bottom, top, step="mid", color=COLOUR[name], label=WORDS[name], linewidth=0)
        series = f"{WORDS[name]}, on top of those before"
        out.curve(axes, series, centres, top, label=None, color=COLOUR[name], drawstyle="steps-mid", linewidth=0.6)
        bottom = top
    axes.set_xlim(1e-5, 1e5)
    axes.set_ylim(0, 1.2 * bottom.max())


def group_share(rows: pd.DataFrame, limits: tuple[float, float], columns: tuple[str, ...]) -> Interval | None:
    """Compute the share of some columns in the strength of modes with rates between limits; None without any."""
    kept = rows[(rows["rate"] >= limits[0]) & (rows["rate"] < limits[1])]
    if kept.empty:
        return None
    sums = kept.groupby("seed")[["strength", *columns]].sum()
    values = np.column_stack([sums[list(columns)].sum(axis=1), sums["strength"]])
    return bootstrap([values], lambda g: g[0][:, 0].sum() / g[0][:, 1].sum())


def _draw_shares(out: Drawing, axes: Any, rows: pd.DataFrame, law: str) -> None:
    parts = {rho: rows[np.isclose(rows["rho"], rho)] for rho in FRACTIONS}
    for k, (name, limits) in enumerate(GROUPS[law].items()):
        found = {rho: group_share(part, limits, ("translation", "rotation")) for rho, part in parts.items()}
        shares = {rho: share for rho, share in found.items() if share is not None}
        if not shares:
            continue
        out.curve(
            *(axes, f"{name}: whole droplets", np.array(list(shares)) + 0.001 * k, side_by_side(shares.values())),
            **{"band": False, **style(k)},
        )
        out.values |= {f"{DRAGS[law]}, {name}, whole droplets, rho = {rho:g}": share for rho, share in shares.items()}
        slides = group_share(rows, limits, ("sliding",))
        if law == "contact" and slides is not None:
            out.values[f"{DRAGS[law]}, {name}, dissipation by sliding"] = slides
    axes.set_ylim(0, 1.25)
    axes.set_yticks(np.linspace(0, 1, 6))
    label(axes, r"true packing fraction $\rho$", "share of the motion", loc="upper right")


def _keep_rates(out: Drawing, table: pd.DataFrame) -> None:
    """Keep how mean rates of the slow and of the middle relaxation under contact drag go with line tension."""
    here = table[np.isclose(table["rho"], SCANNED) & (table["damping"] == "contact")]
    tensions = values_of(here, "gamma")
    if len(tensions) < 3:
        return
    for name in ("slow", "middle"):
        low, high = GROUPS["contact"][name]
        groups = []
        for gamma in tensions:
            rows = droplets_with(here, gamma=gamma)
            kept = rows[(rows["rate"] >= low) & (rows["rate"] < high)]
            sums = kept.assign(weighted=kept["strength"] * np.log(kept["rate"])).groupby("seed")
            groups.append(sums[["weighted", "strength"]].sum().to_numpy(dtype=np.float64))
        out.values[f"{name}, exponent of its rate in line tension"] = bootstrap(groups, partial(_slope, tensions))


def _slope(tensions: list[float], groups: list[Array]) -> float:
    means = [g[:, 0].sum() / g[:, 1].sum() for g in groups]
    return float(np.polyfit(np.log(tensions), means, 1)[0])


FIGURES = {"beyond-droplet-modes": droplet_modes}
