"""Draw how far displacements are correlated in Baumgarten & Tighe: fig 7."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.statistics.data_collapse import fit_scaling_exponents
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, average, bootstrap, mean_over_packings, scaled, select
from studies.panels import FREQUENCY, PAPER, Drawing, drawing, label, scale, sequence, style
from studies.papers.baumgarten.spectra import ENDS, LAWS, SIZE, format_power, mean_of_all, of_column, power
from studies.papers.statements import paper, statistic

MANY = 2048  # N with twenty packings: the five of the size that is drawn tell no length from another
PRESSURES = (1e-2, 1e-3, 1e-4)  # of the drawn packings
SCANNED = 1e-4  # pressure of all sizes and of all decades of frequency
SLOWEST, MIDDLE = 1e-8, 1e-5  # frequencies
PLATEAU = 0.1  # of the box; longer lengths are cut off by it, at 0.17 to 0.19 L
SHORTEST = 2.0  # d; a shorter length is that of a pair of disks


# lengths --------------------------------------------------------------------------------------------------------------


def correlations(part: pd.DataFrame) -> Array:
    """Arrange distance and C (packings, frequencies, bins, 2) of the packings with all frequencies; bins count steps of
    each packing, as boxes differ a little."""
    shared = part.groupby("seed")["omega"].nunique()
    part = part[part["seed"].isin(shared.index[shared == part["omega"].nunique()])]
    if part.empty:
        raise InputError("no packing has its correlation at every frequency: finish the tasks of that sweep")
    step = part.groupby("seed")["delta"].transform(lambda x: np.diff(np.unique(x)).min())
    numbered = part.assign(bin=(part["delta"] / step).round().astype(int))
    wide = numbered.pivot_table(index="seed", columns=["omega", "bin"], values=["delta", "c"])
    shape = (len(wide), part["omega"].nunique(), -1)
    return np.stack([wide[name].to_numpy(dtype=np.float64).reshape(shape) for name in ("delta", "c")], axis=-1)


def in_boxes(part: pd.DataFrame) -> Array:
    """Arrange the same with distances over the mean box."""
    return correlations(part) / [float(part["box"].mean()), 1.0]


def first_zeros(whole: Array) -> Array:
    """Find the (frequencies,) distances at which the mean C of some packings, (packings, frequencies, bins, 2), first
    falls through zero, by linear interpolation; nan without one."""
    x, c = np.moveaxis(average(whole), -1, 0)
    k = (c <= 0).argmax(axis=1)  # 0 where none is, too
    rows = np.flatnonzero(k > 0)
    k = k[rows]
    left, right, above = x[rows, k - 1], x[rows, k], c[rows, k - 1]
    zeros = np.full(len(x), np.nan)
    zeros[rows] = left + (right - left) * above / (above - c[rows, k])
    return zeros


def rows_of(tables: EnsembleTables, law: str, **wanted: Any) -> pd.DataFrame:
    """Select the rows of one law, with pre-stress."""
    return select(tables.correlation, prestress=True, **LAWS[law], **wanted)


def of_pressures(tables: EnsembleTables, law: str, n: int = MANY, **wanted: Any) -> tuple[list[float], list[Array]]:
    """Give the pressures of one size, descending, and C over boxes at each, at the frequencies of the largest size."""
    table = rows_of(tables, law, **wanted)
    table = table[table["omega"].isin(table.loc[table["n"] == SIZE, "omega"].unique())]
    table = select(table, n=n)
    pressures: list[float] = sorted(table["pressure"].unique().tolist(), reverse=True)
    return pressures, [in_boxes(table[table["pressure"] == p]) for p in pressures]


# numbers --------------------------------------------------------------------------------------------------------------


def lengths(tables: EnsembleTables, n: int = MANY) -> Sample:
    """Take C under Stokes drag over boxes of one size at each pressure, at the lowest frequency."""
    return Sample(of_pressures(tables, "stokes", n, omega=SLOWEST)[1])


def mean_length(drawn: list[Array]) -> float:
    """Average the first zeros of C over pressures and frequencies, in boxes."""
    return float(np.nanmean([np.nanmean(first_zeros(whole)) for whole in drawn]))


statistic("T7-length-stokes", sample=lengths, variants=({"n": SIZE},))(mean_length)


def over_ends(tables: EnsembleTables, axis: int) -> Sample:
    """Take frequencies (axis 0) or pressures (1), and l under contact damping averaged over the other."""
    pressures, cubes = of_pressures(tables, "contact")
    table = rows_of(tables, "contact", n=SIZE)
    x = np.array(pressures) if axis else np.sort(table["omega"].unique())
    return Sample(cubes, lambda drawn: (x, np.nanmean([first_zeros(whole) for whole in drawn], axis=axis)))


def over_all_decades(tables: EnsembleTables) -> Sample:
    """Take twelve decades of frequency, and l in the packings that have them."""
    rows = rows_of(tables, "contact", n=MANY, pressure=SCANNED)
    rows = rows[rows["seed"].isin(rows.loc[rows["omega"] == rows["omega"].max(), "seed"])]
    omega = np.sort(rows["omega"].unique())
    return Sample([correlations(rows)], lambda drawn: (omega, first_zeros(drawn[0])))


@statistic("T7-length-omega", sample=over_ends, axis=0, variants=ENDS)
@statistic("T7-length-p", sample=over_ends, axis=1, variants=ENDS)
@statistic("T7-length-decades", sample=over_all_decades, variants=ENDS)
def ratio_of_ends(x: Array, length: Array, first: int = 0, last: int | None = None) -> float:
    """Compute by how much l changes from the smallest x to the largest, by the power of x that fits best: over many
    decades a small exponent is a large factor."""
    return float((x.max() / x.min()) ** power(x, length, first, last))


def over_sizes(tables: EnsembleTables) -> Sample:
    """Take N, and l/L at one frequency and pressure."""
    n = [512, MANY, SIZE]
    cubes = [in_boxes(rows_of(tables, "contact", n=m, pressure=SCANNED, omega=MIDDLE)) for m in n]
    return Sample(cubes, lambda drawn: (n, [first_zeros(whole)[0] for whole in drawn]))


def minima(tables: EnsembleTables) -> Sample:
    """Take frequencies from 1e-4 to 0.1, and the distance where C under Stokes drag is least."""
    rows = rows_of(tables, "stokes", n=SIZE, pressure=min(PRESSURES))
    rows = rows[rows["omega"].between(0.99e-4, 1.01e-1)]
    omega = np.sort(rows["omega"].unique())

    def least(drawn: list[Array]) -> tuple[Array, Array]:
        x, c = np.moveaxis(average(drawn[0]), -1, 0)
        return omega, x[np.arange(len(x)), np.nanargmin(c, axis=1)]

    return Sample([correlations(rows)], least)


statistic("T7-length-N", sample=over_sizes, variants=ENDS)(power)
statistic("T7-minimum", sample=minima, variants=ENDS)(power)
_EACH: list[dict[str, Any]] = [{"pressure": p} for p in (1e-4, 3.16e-4, 1e-3, 3.16e-3, 1e-2)]
for _name, _column, _others in (
    ("lanes", "half_lane", [{"column": "length_quarter_lane"}]),
    ("imaginary", "imaginary", []),
):
    _of: dict[str, Any] = {"sample": of_column, "column": f"length_{_column}", "over": "length"}
    statistic(f"T7-{_name}", variants=[*_EACH, *_others], **_of)(mean_of_all)


def reduced_lengths(tables: EnsembleTables) -> Sample:
    """Take omega/p^0.5 and C under Stokes drag at each pressure, and the side of the box."""
    rows = [rows_of(tables, "stokes", n=SIZE, pressure=p) for p in PRESSURES]
    x = [np.sort(part["omega"].unique()) / p**0.5 for part, p in zip(rows, PRESSURES, strict=True)]
    side = float(pd.concat(rows)["box"].mean())
    return Sample([correlations(part) for part in rows], lambda drawn: (x, drawn, side))


@statistic(
    "T7-logarithm",
    sample=reduced_lengths,
    variants=({"low": 1.5 * SHORTEST}, {"high": 0.75 * PLATEAU}, {"high": 2 * PLATEAU}),
)
def power_of_logarithm(
    x: list[Array], drawn: list[Array], side: float, low: float = SHORTEST, high: float = PLATEAU
) -> float:
    """Fit the exponent of -ln p that collapses lengths between a few disks and the cut-off of the box."""
    curves = []
    for place, whole in zip(x, drawn, strict=True):
        length = first_zeros(whole)
        kept = np.isfinite(length) & (length < high * side) & (length > low)
        if kept.sum() < 2:
            return float("nan")
        curves.append((place[kept], length[kept]))
    start = (0.0, paper("T7-logarithm"))
    return fit_scaling_exponents(-np.log(PRESSURES), [curves], a=0.0, start=start).b


# drawing --------------------------------------------------------------------------------------------------------------


def figure_7(tables: EnsembleTables) -> Drawing:
    """Correlation of transverse displacements under both laws, and its length."""
    out, (a, b, c, d) = drawing("baumgarten-7", 2, 2, 5.4, 4.2)
    _draw_contact_correlation(out, a, tables)
    _draw_stokes_correlation(out, b, rows_of(tables, "stokes", n=SIZE, pressure=min(PRESSURES)))
    scale(c, d)
    stokes, power = rows_of(tables, "stokes", n=SIZE), paper("T7-logarithm")
    for index, p in enumerate(PRESSURES):
        part = select(stokes, pressure=p)
        omega, whole = np.sort(part["omega"].unique()), correlations(part)
        found = bootstrap([whole], lambda g: first_zeros(g[0]))
        look, name = sequence(index, len(PRESSURES)), f"$p = {format_power(p)}$"
        out.curve(c, name, omega, found, **look)
        out.curve(d, name, omega / p**0.5, scaled(found, (-np.log(p)) ** power), **look)
    ends = [stokes["omega"].min(), stokes["omega"].max()]
    out.curve(c, "paper: plateau $L/4$", ends, [float(stokes["box"].mean()) * paper("T7-length-stokes")] * 2, **PAPER)
    label(c, f"Stokes drag: {FREQUENCY}", r"length $l$  [$d$]")
    label(d, r"Stokes drag: $\omega\,\tau_1 / p^{1/2}$", rf"$l\,(-\ln p)^{{{power:g}}}$")
    return out


def _draw_contact_correlation(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw C over boxes of the packings with twelve decades of frequency, at both ends and in between."""
    part = rows_of(tables, "contact", pressure=SCANNED, n=[512, MANY])
    fastest = part[part["omega"] == part["omega"].max()]
    part = part.merge(fastest[["n", "seed"]].drop_duplicates())
    omegas = np.sort(part.loc[part["n"] == MANY, "omega"].unique())
    for index, omega in enumerate(omegas[[0, len(omegas) // 2, -1]]):
        for n, fill in ((MANY, "full"), (512, "none")):
            rows = part[(part["n"] == n) & np.isclose(part["omega"], omega)]
            if len(rows):
                name = rf"$N = {n}$, $\omega = {format_power(float(omega))}$"
                look = style(index) | {"fillstyle": fill}
                _draw_correlation(out, axes, name, rows, float(rows["box"].mean()), look)
    axes.axhline(0, color="#888888", linewidth=0.8)
    label(axes, rf"contact damping, $p = {format_power(SCANNED)}$: $\delta / L$", r"$C$")


def _draw_stokes_correlation(out: Drawing, axes: Any, part: pd.DataFrame) -> None:
    """Draw C at seven frequencies."""
    omegas = np.sort(part["omega"].unique())
    omegas = omegas[np.unique(np.linspace(0, len(omegas) - 1, 7).round().astype(int))]
    for index, omega in enumerate(omegas):
        name = rf"$\omega = {format_power(float(omega))}$"
        _draw_correlation(out, axes, name, part[part["omega"] == omega], 1.0, sequence(index, len(omegas)))
    axes.axhline(0, color="#888888", linewidth=0.8)
    p = format_power(float(part["pressure"].iloc[0]))
    label(axes, rf"Stokes drag, $p = {p}$: distance $\delta$  [$d$]", r"$C$")


def _draw_correlation(
    out: Drawing, axes: Any, name: str, rows: pd.DataFrame, unit: float, look: dict[str, Any]
) -> None:
    cube = correlations(rows)[:, 0]
    whole = cube[..., 1] / average(cube[:, 0, 1])  # 1 at the shortest distance, as in the paper; zeros stay
    out.curve(axes, name, average(cube[..., 0]) / unit, mean_over_packings([whole])[0], **look)
