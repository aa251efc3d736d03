"""Draw the coefficients of tables 1 and 2 of Boromand et al. from our packings, over those of the paper."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from jamlab.arrays import Array
from studies.ensemble_tables import PACKINGS, EnsembleTables
from studies.ensembles import Ensemble, Sample, average, groups_by, median, select
from studies.panels import Drawing
from studies.papers.boromand.conventions import (
    HIGHEST,
    LARGEST,
    SERIES,
    SIZES,
    STABLE,
    SUBTRACTED,
    at,
    even_places,
)
from studies.papers.forest import forest
from studies.papers.statements import statistic
from studies.papers.verdicts import compare

# onset ----------------------------------------------------------------------------------------------------------------


def onsets(tables: EnsembleTables, model: str, column: str, n: tuple[int, ...]) -> Sample:
    """Take z_J or the onset of packings of some sizes, one group each."""
    return Sample(groups_by(select(tables.onset, model=model), "n", column, n))


def mean(groups: list[Array]) -> float:
    """Average over packings, and over sizes."""
    return float(np.mean([values.mean() for values in groups]))


for _id, _model, _column in (
    ("BT-zJ-sp-phi", "sp", "z_J"),
    ("BT-phiJ-sp", "sp", "phi_J"),
    ("BT-zJ-dp", "dp", "z_J"),
    ("BT-rhoJ-dp", "dp", "rho_J"),
):
    _sizes = ({"n": SIZES},) if _column == "z_J" else ()  # table 1 names no N, and fig 6 has one z_J for all
    statistic(_id, sample=onsets, model=_model, column=_column, n=(LARGEST[_model],), variants=_sizes)(mean)


# fits of eqs 13 and 14 ------------------------------------------------------------------------------------------------


def even_curve(
    tables: EnsembleTables,
    series: str,
    column: str,
    z_j: str = "3.97",
    middle: Callable[[Array], Array] = average,
    direction: str = "mean",
    packings: str = PACKINGS[0],
) -> Sample:
    """Take z - z_J or G at even places of the largest size; along x by the ratio of means of packings with both."""
    model, by = SERIES[series]
    n, places = LARGEST[model], even_places(model, by)
    e = tables.curve(model, n, by, column, places, packings)
    if column == "z":
        e = Ensemble(e.x, e.y - (SUBTRACTED if z_j == "3.97" else tables.at_onset(model, n)["z"].mean()))
    if direction == "x":
        both = [tables.curve(model, n, by, name, places) for name in ("g_beside_x", "g_x")]
        e = Ensemble(e.x, e.y * average(both[1].y) / average(both[0].y))
    return e.sample(middle)


def coefficients(x: Array, y: Array, terms: int, low: float = 0.0, high: float = np.inf) -> Array:
    """Fit the coefficients of eqs 13 and 14 by least squares of absolute residuals."""
    kept = np.isfinite(x + y) & (x > low) & (x < high)
    if kept.sum() <= terms:
        return np.full(terms, np.nan)
    return np.asarray(np.linalg.lstsq(x[kept, None] ** (0.5, 1.0)[:terms], y[kept], rcond=None)[0])


for _series, _name, _terms in (("SP(φ)", "sp-phi", 1), ("SP(ρ)", "sp-rho", 2), ("DP(ρ)", "dp", 2)):  # linear in phi: 0
    _half = 0.5 * HIGHEST[SERIES[_series][1]]
    _of_g: tuple[Mapping[str, Any], ...] = ({"middle": median}, {"direction": "x"}, *(STABLE if _name != "dp" else ()))
    for _symbol, _others in (("z", ({"z_j": "own"},)), ("G", _of_g)):
        statistic(
            *(f"BT-{_symbol}{k}-{_name}" for k in range(_terms)),
            sample=even_curve,
            series=_series,
            column=_symbol.lower(),
            terms=_terms,
            variants=({"low": _half}, {"high": _half}, *_others),
        )(coefficients)
# where row SP(ρ) of table 1 may be read without its two coefficients, which make up for one another
statistic("BT-z-sp-rho", sample=even_curve, series="SP(ρ)", column="z", place=0.1, variants=({"z_j": "own"},))(at)


def of_both(tables: EnsembleTables, column: str) -> Sample:
    """Take the curves of droplets and of disks."""
    parts = [even_curve(tables, series, column) for series in ("DP(ρ)", "SP(ρ)")]
    return Sample(
        [part.groups[0] for part in parts],
        lambda drawn: [part.reduce([one]) for part, one in zip(parts, drawn, strict=True)],
    )


@statistic("BT-z-ratio", sample=of_both, column="z")
@statistic("BT-G-ratio", sample=of_both, column="g")
def ratio(droplets: tuple[Array, Array], disks: tuple[Array, Array]) -> float:
    """Divide C_1/C_0 of droplets by that of disks."""
    (d_0, d_1), (s_0, s_1) = (coefficients(*part, 2) for part in (droplets, disks))
    return float(d_1 / d_0 / (s_1 / s_0))


def tables_1_2(tables: EnsembleTables) -> Drawing:
    """Coefficients of tables 1 and 2 from our packings beside the paper's."""
    return forest(compare("tables", tables), "tables", {"[B], tables 1 and 2": ("tables",)})
