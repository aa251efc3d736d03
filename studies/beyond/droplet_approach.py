"""A study of contacts and shear modulus of droplets near onset: large packings, and droplets of more vertices.

Disks have z - z_J and G ~ drho^1/2, bubbles of a wet foam z - z_J ~ drho (Winkelmann et al., 2017, doi
10.1016/j.colsurfa.2017.03.058). Whether droplets of deformable polygons do either is judged beside disks of the same N,
by the same fits.
"""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.geometry.contact_network import contacts, count_strong
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.measure import measure
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.statistics.confidence import Interval
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import FEWEST, average, bootstrap, interpolators, mean_over_packings, select
from studies.panels import FIT, Drawing, TextTable, drawing, label, scale, style, write_interval
from studies.papers.statements import caption
from studies.papers.verdicts import NORMAL
from studies.study import Study
from studies.tables import Task

NEAREST, FARTHEST, PER_DECADE = 1e-3, 0.03, 4
# distances from onset at which packings are interpolated, in two windows of a power law, which share one
PLACES, SHARED = np.geomspace(1.05e-3, 0.0285, 9), 4
VERTICES = (12, 24, 48)  # of small droplets; large ones have 17/12 as many
# packings of each N and number of vertices, one a task
PACKINGS = {(1024, 12): 40, (512, 12): 20, (256, 24): 30, (256, 48): 20}
DISKS = (256, 1024)  # N of the disks beside them, from the campaign of the papers
LAWS = {"root + linear": (0.5, 1.0), "constant + linear": (0.0, 1.0), "linear": (1.0,)}  # exponents
FITTED = "droplets, N = 256"  # whose laws are drawn
COLUMNS = {"d_z": "z", "d_z_strong": "z, no stops", "g": "G"}  # of a packing at a distance


def measure_approach(n: int, vertices: int, seed: int) -> list[dict[str, Any]]:
    """Compress droplets that were put in the place of disks, to 0.03 above their onset: z with and without contacts
    that only stop a droplet, and G, at each state."""
    law = {"nv_small": vertices, "nv_large": round(17 / 12 * vertices)}
    onset = jam(n, "dp", seed, start="from-disks", law={} if vertices == VERTICES[0] else law)
    rho = packing_fraction(onset)
    how: dict[str, Any] = {"step": FARTHEST, "first_step": NEAREST, "per_decade": PER_DECADE}
    rows = []
    for packing in (onset, *compress(onset, rho + FARTHEST, **how)):
        if packing.converged and packing.on_target is not False:
            row = {"n": n, "vertices": vertices, "seed": seed, "d_rho": packing_fraction(packing) - rho}
            row |= {"z": contacts(packing).z, "z_strong": count_strong(packing)["z_strong"]}
            rows.append(row | {name: measure(packing, name)[name] for name in ("g", "g_x", "pressure")})
    return rows


def _tasks() -> dict[str, Task]:
    """Of each kind a few packings, then the next few, so that a run that is stopped has some of each."""
    named = [(seed, n, vertices) for (n, vertices), packings in PACKINGS.items() for seed in range(1, packings + 1)]
    return {
        f"{n} {vertices} {seed}": partial(measure_approach, n, vertices, seed) for seed, n, vertices in sorted(named)
    }


def from_own_onset(rows: pd.DataFrame) -> pd.DataFrame:
    """Add z less z of the same packing at onset, with both counts, and leave out onsets."""
    who = ["n", "vertices", "seed"]
    onset = rows.loc[rows["d_rho"] == 0, [*who, "z", "z_strong"]]
    rows = rows[rows["d_rho"] > 0].merge(onset, on=who, suffixes=("", "_J"))
    return rows.assign(d_z=rows["z"] - rows["z_J"], d_z_strong=rows["z_strong"] - rows["z_strong_J"])


def curves(rows: pd.DataFrame, column: str) -> Array:
    """Interpolate a column of each packing, (packings, places)."""
    known = rows.dropna(subset=[column])
    found = np.array([curve(np.sqrt(PLACES))[:, 0] for curve in interpolators(known, "d_rho", [column], False)])
    found = found.reshape(-1, len(PLACES))
    return found[np.isfinite(found).all(axis=1)]


def fit_law(y: Array, error: Array, exponents: tuple[float, ...]) -> tuple[Array, float]:
    """Fit coefficients of powers of the distance, weighted by errors of means, and chi^2."""
    columns = PLACES[:, None] ** exponents / error[:, None]
    found = np.linalg.lstsq(columns, y / error, rcond=None)[0]
    return found, float(((columns @ found - y / error) ** 2).sum())


def statistics(values: Array) -> Array:
    """Give exponents in both windows, coefficients of root and linear law, and chi^2 of each of `LAWS` of the mean of
    packings (packings, places)."""
    y, error = average(values), values.std(axis=0, ddof=1) / len(values) ** 0.5
    windows = (slice(None, SHARED + 1), slice(SHARED, None))
    powers = [fit_exponent(PLACES[part], y[part]) if (y[part] > 0).all() else np.nan for part in windows]
    laws = [fit_law(y, error, exponents) for exponents in LAWS.values()]
    return np.array([*powers, *laws[0][0], *(chi_2 for _, chi_2 in laws)])


def kinds(tables: EnsembleTables) -> dict[str, pd.DataFrame]:
    """Name the packings of each model, N and number of vertices."""
    shipped, own = tables.states, from_own_onset(tables.read("droplet-approach"))
    found = {f"disks, N = {n}": select(shipped, model="sp", n=n) for n in DISKS}
    found = {name: rows.assign(d_z_strong=rows["d_z"]) for name, rows in found.items()}  # they have no stops
    found["droplets, N = 256"] = select(shipped, model="dp", n=256)
    for (n, vertices), rows in own.groupby(["n", "vertices"]):
        more = "" if vertices == VERTICES[0] else f", {vertices:g} vertices"
        found[f"droplets, N = {n}{more}"] = rows
    return found


def draw_approach(tables: EnsembleTables) -> Drawing:
    """Draw z - z_J and G over the distance from onset, of droplets and disks, and their exponents."""
    out, axes = drawing("droplet-approach", 1, 3, 5.2, 4.4)
    scale(*axes)
    lines, made = [], []
    for axis, (column, quantity) in zip(axes, COLUMNS.items(), strict=True):
        for k, (name, rows) in enumerate(kinds(tables).items()):
            values = curves(rows, column)
            if len(values) < FEWEST:
                continue
            made.append(len(values))
            mean = mean_over_packings([values])
            look = style(k) | {"linestyle": "none", "fillstyle": "none" if name.startswith("disks") else "full"}
            out.curve(axis, name, PLACES, Interval(mean.value[0], mean.low[0], mean.high[0]), band=False, **look)
            if not (name.startswith("disks") and column == "d_z_strong"):
                found = bootstrap([values], lambda drawn: statistics(drawn[0]))
                lines.append(_line(out, f"{quantity}: {name}", len(values), found))
            if name == FITTED:
                _draw_laws(out, axis, values)
    distance = r"$\Delta\rho = \rho - \rho_J$"
    label(axes[0], distance, r"$z - z_J$, all contacts", legend=False)
    label(axes[1], distance, r"$z - z_J$, without stops", legend=False)
    label(axes[2], distance, "shear modulus $G$", legend=False)
    out.legend_above(axes[0], ncols=4)
    columns = ["of", "packings", "exponent, near", "exponent, far", "root", "linear"]
    columns += ["1 − exponent, near, over its error", "root over its error", *(f"χ², {law}" for law in LAWS)]
    out.text.append(TextTable(columns, lines, words=True))
    ends = {"near": f"{PLACES[0]:.2g} to {PLACES[SHARED]:.2g}", "far": f"{PLACES[SHARED]:.2g} to {PLACES[-1]:.2g}"}
    out.caption = caption(out.name, few=min(made), most=max(made), **ends)
    return out


def _draw_laws(out: Drawing, axis: Any, values: Array) -> None:
    """Draw both laws as they fit best."""
    y, stderr = average(values), values.std(axis=0, ddof=1) / len(values) ** 0.5
    for law, line in (("root + linear", "-"), ("linear", "--")):
        found = PLACES[:, None] ** LAWS[law] @ fit_law(y, stderr, LAWS[law])[0]
        out.curve(axis, f"{law}, fitted to {FITTED}", PLACES, found, **FIT | {"linestyle": line})


def _line(out: Drawing, name: str, made: int, found: Interval) -> list[str]:
    """Keep the numbers of a curve; gives its line of the table."""
    names = ("exponent, near", "exponent, far", "root", "linear", *(f"chi^2 of {law}" for law in LAWS))
    each = [Interval(*ends) for ends in zip(found.value, found.low, found.high, strict=True)]
    out.values |= {f"{name}, {what}": one for what, one in zip(names, each, strict=True)}
    near, root = each[0], each[2]
    off = [(1 - near.value) / error(near), root.value / error(root)]
    fitted = len(names) - len(LAWS)
    plain = (f"{value:.0f}" for value in (*off, *(one.value for one in each[fitted:])))
    return [name, str(made), *map(write_interval, each[:fitted]), *plain]


def error(found: Interval) -> float:
    """Standard error of a normal estimate from its 95 % interval."""
    return float(found.high - found.low) / NORMAL


STUDY = Study("droplet-approach", "Contacts and modulus of droplets near onset", _tasks(), draw_approach)
