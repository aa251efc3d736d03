"""Draw G* of droplets over packing fraction and over line tension, with disks beside it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from jamlab.statistics.bootstrap import Interval
from jamlab.studies.droplet_tables import DRAGS, FRACTIONS, SCANNED, droplets_with, values_of
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import average, bootstrap, mean_over_packings, of_packings
from jamlab.studies.panels import FREQUENCY, Drawing, drawing, label, scale, sequence


def droplet_spectra(tables: EnsembleTables) -> Drawing:
    """G* of droplets over packing fraction, disks beside them, and droplets over line tension; two drag laws."""
    table = tables.droplet_spectra
    out, axes = drawing("beyond-droplet-spectra", 2, 3, 4.8, 3.9)
    for row, law in enumerate(DRAGS):
        rows = table[table["law"] == law]
        droplets, disks = droplets_with(rows), rows[rows["model"] == "sp"]
        for axis, part, what in ((axes[3 * row], droplets, "droplets"), (axes[3 * row + 1], disks, "disks")):
            series = [(rf"$\rho$ = {rho:.2f}", part[np.isclose(part["rho"], rho)]) for rho in FRACTIONS]
            _draw_series(out, axis, series)
            _name_panel(axis, f"{what}, {DRAGS[law]}", "ε/l²" if what == "droplets" else "ε/σ²")
        here = rows[np.isclose(rows["rho"], SCANNED)]
        series = [(rf"$\gamma$ = {g:g}", droplets_with(here, gamma=g)) for g in values_of(here, "gamma")]
        axis = axes[3 * row + 2]
        _draw_series(out, axis, series)
        _name_panel(axis, rf"droplets, {DRAGS[law]}, $\rho$ = {SCANNED:.2f}", "ε/l²")
    for axis in axes:
        axis.set_ylim(1e-4, 30)
    for axis in (axes[0], axes[2]):
        axis.legend(fontsize=8, ncols=3, loc="upper left", framealpha=0.85)
    out.caption = _caption(out, table)
    return out


def _name_panel(axes: Any, name: str, unit: str) -> None:
    label(axes, FREQUENCY, rf"$G'$, $G''$  [{unit}]", legend=False)
    axes.set_title(f"({axes.get_gid()}) {name}", loc="left", fontsize=11)


def _draw_series(out: Drawing, axes: Any, series: Sequence[tuple[str, pd.DataFrame]]) -> None:
    """Draw mean G' (full, with its band) and mean G'' (dashed) of each series that has packings."""
    scale(axes)
    for k, (name, rows) in enumerate(series):
        if rows.empty:
            continue
        colour = sequence(k, max(len(series), 6))["color"]
        rows = rows.assign(loss=rows["loss"] - rows["omega"] * rows["eta_f"].fillna(0.0))
        for column, line in (("storage", "-"), ("loss", "--")):
            omega, values = of_packings(rows, "omega", column)
            known = np.isfinite(values).all(axis=0)  # elsewhere the mean would be that of a selection
            look = {"color": colour, "linestyle": line}
            if column == "loss":
                out.curve(axes, f"G'' {name}", omega[known], average(values[:, known]), label=None, **look)
                continue
            mean = mean_over_packings([values[:, known]])[0]
            out.curve(axes, f"G' {name}", omega[known], mean, label=name, **look)


def _caption(out: Drawing, table: pd.DataFrame) -> str:
    contact = table[table["law"] == "contact"]
    models = {"droplets": droplets_with(contact), "disks": contact[contact["model"] == "sp"]}
    counts = [rows["seed"].nunique() for rows in models.values()]
    ends = (FRACTIONS[0], FRACTIONS[-1])
    for what, rows in models.items():
        out.keep(f"slow limit of G', {what}", [_static(rows, rho) for rho in ends], rho=ends)
    limits = {what: [out.write(f"slow limit of G', {what}, rho = {rho:g}", 3) for rho in ends] for what in models}
    static = "; ".join(f"{what} {' and '.join(both)}" for what, both in limits.items())
    text = (
        "G' (full, with 95 % bands) and G'' (dashed; under Stokes drag less that of the fluid) of "
        f"{int(table['n'].mode()[0])} particles in a fixed box, means over {counts[0]} packings of droplets and "
        f"{counts[1]} of disks, interpolated between states 0.01 apart. Slow limit of G' at rho = "
        f"{ends[0]:.2f} and {ends[1]:.2f}: {static}. "
    )
    here = contact[np.isclose(contact["rho"], SCANNED)]
    tensions = values_of(here, "gamma")
    if len(tensions) > 2:
        groups = [of_packings(droplets_with(here, gamma=g), "omega", "storage")[1][:, 0] for g in tensions]
        slope = bootstrap(groups, lambda drawn: _exponent(tensions, [float(np.median(values)) for values in drawn]))
        name = "exponent of the slow limit of G' in line tension"
        out.keep(name, slope)
        text += (
            f"At rho = {SCANNED:.2f} ({min(map(len, groups))} packings and more of each) its median grows as gamma to "
            f"the power {out.write(name)} from gamma = {tensions[0]:g} to {tensions[-1]:g} eps/l."
        )
    return text


def _static(rows: pd.DataFrame, rho: float) -> Interval | None:
    """Average G' at the lowest frequency; None without packings."""
    part = rows[np.isclose(rows["rho"], rho)]
    if part.empty:
        return None
    return mean_over_packings([of_packings(part, "omega", "storage")[1][:, 0]])[0]


def _exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Fit the exponent of y ~ x^e; nan where a value is not positive."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0]) if min(y) > 0 else float("nan")
