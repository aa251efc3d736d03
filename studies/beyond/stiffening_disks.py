"""Draw pressure, contacts and G of Hertzian disks beside those of harmonic ones, above the onset of each packing.

The table has a row for each state: `jam(n=128, seed=seed, exponent=exponent,
ensemble="shear-stabilized")` compressed by `compress(p, p.phi + 0.1, 0.1, by="phi", nearest=1e-3, per_decade=5)`,
with the pressure, the contacts and particles of the backbone, and G averaged over all directions. States that came
loose or are no minima are left out.
"""

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.statistics.bootstrap import Interval, bootstrap
from studies.ensemble_tables import EnsembleTables
from studies.panels import FIT, Drawing, drawing, label, scale, style
from studies.papers.statements import caption

DECADE = (3e-3, 4.1e-2)  # of the distance from onset, over which the exponents are taken
NAMES = {2.0: "harmonic", 2.5: "Hertz"}
QUANTITIES = {"pressure": "pressure $p$  [ε/σ²]", "excess": r"$z - z_\mathrm{iso}$", "g": "$G$  [ε/σ²]"}
EXPECTED = {  # powers of the distance, alpha - 1, 1/2 and alpha - 3/2
    ("pressure", 2.0): 1.0,
    ("pressure", 2.5): 1.5,
    ("excess", 2.0): 0.5,
    ("excess", 2.5): 0.5,
    ("g", 2.0): 0.5,
    ("g", 2.5): 1.0,
}


def read_states(tables: EnsembleTables) -> pd.DataFrame:
    """The table, with z - z_iso = 2 (N_c - (2 N' + 1))/N': both shears of the box are free."""
    table = tables.read("beyond-stiffening-disks")
    table["excess"] = 2 * (table["contacts"] - (2 * table["backbone"] + 1)) / table["backbone"]
    return table


def stiffening_disks(tables: EnsembleTables) -> Drawing:
    """Pressure, excess contacts and G of Hertzian disks over the distance from onset, beside harmonic ones."""
    table = read_states(tables)
    out, axes = drawing("beyond-stiffening-disks", 1, 3, 4.4, 3.8)
    for ax, (column, text) in zip(axes, QUANTITIES.items(), strict=True):
        for index, (alpha, name) in enumerate(NAMES.items()):
            states = table[table["exponent"] == alpha].pivot_table(index="seed", columns="distance", values=column)
            x, y = states.columns.to_numpy(dtype=float), states.to_numpy(dtype=float)
            mean = bootstrap([y], lambda groups: np.nanmean(groups[0], axis=0))
            scale(ax)
            out.curve(ax, name, x, mean, **style(index))
            out.keep(f"{column}, {name}", exponent_of(x, y))
            _draw_power(out, ax, name, x, np.asarray(mean.value), EXPECTED[column, alpha])
        label(ax, r"$\phi - \phi_J$", text, loc="upper left")
    packings = {name: table.loc[table["exponent"] == alpha, "seed"].nunique() for alpha, name in NAMES.items()}
    said = "; ".join(
        f"{column} "
        + " and ".join(
            f"{out.write(f'{column}, {name}')} ({name}, line {EXPECTED[column, alpha]:g})"
            for alpha, name in NAMES.items()
        )
        for column in QUANTITIES
    )
    out.caption = caption(out.name, low=DECADE[0], high=DECADE[1], said=said, **packings)
    return out


def exponent_of(x: Array, y: Array) -> Interval:
    """Power of x (points,) that the mean over packings of y (packings, points) follows within `DECADE`."""
    kept = (x >= DECADE[0]) & (x <= DECADE[1])

    def slope(groups: list[Array]) -> float:
        mean = np.nanmean(groups[0], axis=0)
        return float(np.polyfit(np.log(x[kept]), np.log(mean[kept]), 1)[0])

    return bootstrap([y], slope)


def _draw_power(out: Drawing, axes: object, name: str, x: Array, y: Array, power: float) -> None:
    kept = (x >= DECADE[0]) & (x <= DECADE[1])
    ends = np.array(DECADE)
    level = np.exp(np.mean(np.log(y[kept]) - power * np.log(x[kept])))
    out.curve(axes, f"{name}, expected", ends, level * ends**power, label=None, **FIT)


FIGURES = {"beyond-stiffening-disks": stiffening_disks}
