"""Draw G' and G'' of oscillation against amplitude, and the amplitudes at which disks soften and yield."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK, BLUE, RED
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.published_numbers import SOFTENING_EXPONENT
from jamlab.studies.dynamics.flow_curves import balanced_disks, draw_mean, mean_of_rows
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import average, bootstrap, of_packings, select_usual, side_by_side
from jamlab.studies.panels import FREQUENCY, Drawing, drawing, label, scale, sequence, style

AMPLITUDE = r"amplitude of the strain $\gamma_0$"
SOFT, YIELDED = 0.7, 0.1  # of the storage modulus at small amplitude that is left; 0.9 is lost in noise of 64 disks


def amplitude_sweeps(tables: EnsembleTables) -> Drawing:
    """G' and G'' against the amplitude at three frequencies, with softening and yielding against pressure."""
    table = select_usual(select_usual(balanced_disks(tables.oscillation), ["n"], None), ["background"], None)
    if table["amplitude"].nunique() < 3:
        raise InputError("the table oscillation has no three amplitudes of disks: run a campaign with some")
    frequencies, pressures = (sorted(table[name].unique()) for name in ("omega", "target_pressure"))
    out, axes = drawing("dynamics-amplitudes", 1, len(frequencies) + 1, 4.3, 3.9)
    for part, omega in zip(axes, frequencies, strict=False):
        scale(part)
        for k, pressure in enumerate(pressures):
            rows = table[(table["omega"] == omega) & (table["target_pressure"] == pressure)]
            for column, line in (("storage", "-"), ("loss", "--")):
                name = f"$p$ = {pressure:g}" if column == "storage" else f"loss, p = {pressure:g}"
                text = name if column == "storage" else None
                look = {**style(k), "linestyle": line, "label": text}
                draw_mean(out, part, name, rows, "amplitude", column, **look)
        label(part, AMPLITUDE, rf"$G'$, dashed $G''$  [k], $\omega\,\tau_1$ = {omega:g}", legend=part is axes[0])
    _draw_limits(out, axes[-1], table[table["omega"] == frequencies[0]], pressures)
    out.caption = (
        f"{int(table['n'].iloc[0])} disks, {table['seed'].nunique()} packings at each pressure p, in units of k, means "
        "with 95 % intervals. Storage modulus, dashed the loss modulus, of the first harmonic at three frequencies. "
        f"Last: amplitude at which {100 * SOFT:.0f} % of the storage modulus are left (softening), and at which "
        f"{100 * YIELDED:.0f} % are (yielding), at the lowest frequency; dashed, in proportion to pressure."
    )
    return out


def _draw_limits(out: Drawing, axes: Any, table: pd.DataFrame, pressures: list[float]) -> None:
    scale(axes)
    groups = []
    for pressure in pressures:
        amplitude, storage = of_packings(table[table["target_pressure"] == pressure], "amplitude", "storage")
        groups.append(storage)
    for share, name, look in ((SOFT, "softening", {"color": RED, "marker": "s"}), (YIELDED, "yielding", _YIELD)):
        found = [bootstrap([storage], partial(_limit, amplitude, share)) for storage in groups]
        ends = side_by_side(found)
        out.keep(f"amplitude of {name}", ends, p=pressures)
        out.curve(axes, name, pressures, ends, band=False, **look)
        if name == "softening":
            out.slope(axes, SOFTENING_EXPONENT.value, (pressures[0], pressures[-1]), 0.5 * ends.value[0])
    label(axes, "pressure $p$  [k]", AMPLITUDE)
    exponent: Interval | None = None
    if len(pressures) > 1:
        log_p = np.log(pressures)

        def slope(values: list[Array]) -> float:
            limits = [_falls_to(amplitude, average(each), SOFT) for each in values]
            return float(np.polyfit(log_p, np.log(limits), 1)[0])

        exponent = bootstrap(groups, slope)
    how = f"amplitude at which {100 * SOFT:.0f} % of G' are left, {len(pressures)} pressures, lowest frequency"
    text = "exponent of the softening amplitude over pressure, Boschan et al. 2016"
    out.claim(text, exponent, SOFTENING_EXPONENT, how=how)


_YIELD = {"color": BLUE, "marker": "o", "markeredgecolor": BLACK}


def _limit(amplitude: Array, share: float, groups: list[Array]) -> float:
    return _falls_to(amplitude, average(groups[0]), share)


def _falls_to(amplitude: Array, storage: Array, share: float) -> float:
    """Find the amplitude at which the storage modulus first falls to a share of its first value; nan if never."""
    ratio = storage / storage[0]
    below = np.flatnonzero(ratio < share)
    if not len(below):
        return np.nan
    k = int(below[0])
    part = np.log(ratio[k - 1] / share) / np.log(ratio[k - 1] / max(ratio[k], 1e-3))
    return float(amplitude[k - 1] * (amplitude[k] / amplitude[k - 1]) ** part)


PARTS = {"storage": "G'", "loss": "G''"}
ALLOWED = 10.0  # %


def equivalent_damping(tables: EnsembleTables) -> Drawing:
    """Error of the equivalent linear damping against frequency and the power of the drag."""
    table = _small_oscillations(tables.oscillation)
    powers = sorted(table["alpha"].unique())
    out, (grid, *parts) = drawing("dynamics-equivalent-damping", 1, 3, 4.8, 4.0)
    scale(grid, y="linear")
    said = []
    for axes, (part, name) in zip(parts, PARTS.items(), strict=True):
        scale(axes, y="linear")
        for k, alpha in enumerate(powers):
            rows = table[table["alpha"] == alpha]
            omega, mean = mean_of_rows(rows, "omega", f"{part}_error")
            x = mean_of_rows(rows, "omega", "reduced")[1].value
            text = rf"$\alpha$ = {alpha:.2f}"
            out.curve(axes, text, x, mean, band=False, **sequence(k, len(powers)))
            out.keep(f"error of {name} in percent, alpha = {alpha:.2f}", mean, omega=omega)
            said.append(f"{name} at alpha {alpha:.2f}: {round(mean.value.min())} to {round(mean.value.max())}")
        axes.axhspan(-ALLOWED, ALLOWED, color="#999999", alpha=0.15, linewidth=0)
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        label(axes, r"$\omega\,\tau_\alpha$", f"error of {name}  [%]", legend=part == "storage")
    _draw_map(out, grid, table)
    label(grid, FREQUENCY, r"power $\alpha$ of the drag", legend=False)
    first = table.iloc[0]
    out.caption = (
        f"{int(first['n'])} disks at pressure {first['target_pressure']:g} k, {table['seed'].nunique()} packings: "
        "error of G* by the equivalent linear damping of Baumgarten & Tighe, eqs 23-29, against the drag law itself "
        f"at strain amplitude {first['amplitude']:g}. (a) Error of |G*| in percent, against frequency and alpha. (b), "
        "(c) Error of the storage and loss modulus over frequency times the equivalent time; grey, 10 %; 95 % "
        "intervals. Linear drag is the check: its error is that of finite amplitude. "
        f"In percent: {'; '.join(said)}."
    )
    return out


def _small_oscillations(table: pd.DataFrame) -> pd.DataFrame:
    """Select rows at the amplitude at which powers were measured, with errors in percent."""
    bent = table[table["alpha"] < 1]
    if bent.empty:
        raise InputError("the table oscillation has no drag with alpha below 1: run a campaign with some")
    settings = ("n", "target_pressure", "amplitude", "background", "tolerance")
    rows = select_usual(table, settings, of=bent).dropna(subset=["equivalent_time"]).round({"alpha": 4})
    for part in PARTS:
        rows[f"{part}_error"] = 100 * (rows[f"equivalent_{part}"] / rows[part] - 1)
    size = np.hypot(rows["equivalent_storage"], rows["equivalent_loss"]) / np.hypot(rows["storage"], rows["loss"])
    return rows.assign(reduced=rows["omega"] * rows["equivalent_time"], size_error=100 * (size - 1))


def _draw_map(out: Drawing, axes: Any, table: pd.DataFrame) -> None:
    mean = table.groupby(["alpha", "omega"], as_index=False)["size_error"].mean()
    span = max(float(mean["size_error"].abs().max()), ALLOWED)
    look = {"c": mean["size_error"], "cmap": "PuOr", "vmin": -span, "vmax": span, "edgecolor": BLACK}
    axes.scatter(mean["omega"], mean["alpha"], s=330, marker="s", linewidth=0.5, **look)
    for alpha, rows in mean.groupby("alpha"):
        out.curve(axes, f"alpha {alpha:.2f}", rows["omega"], np.full(len(rows), alpha), ls="none")
    for _, row in mean.iterrows():
        colour = "white" if abs(row["size_error"]) > 0.6 * span else BLACK
        at = (row["omega"], row["alpha"])
        axes.annotate(f"{round(row['size_error']):+d}", at, ha="center", va="center", fontsize=7.5, color=colour)
    axes.margins(0.1, 0.15)
