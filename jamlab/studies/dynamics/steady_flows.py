"""Select steady flows of disks, average them over packings, and fit the law with a yield stress."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.herschel_bulkley import HerschelBulkley, herschel_bulkley
from jamlab.studies.ensembles import average, bootstrap, mean_over_packings, of_packings, select_usual
from jamlab.studies.panels import Drawing

RATE = r"rate of shear $\dot\gamma\,\tau_1$"
STRESS = r"shear stress $\sigma$  [k]"
SETTINGS = ["n", "background", "tolerance"]  # of runs that may be averaged
ONSET = 0.84  # packing fraction nearest to onset
JAMMED = 0.86  # of the fit with a yield stress
HIGHEST = 1e-2  # rate up to which laws are fitted: beyond, contacts themselves limit the flow
_STANDS = 1e-15  # rate that adds nothing to a yield stress


def balanced_disks(table: pd.DataFrame, alpha: float = 1.0) -> pd.DataFrame:
    """Select disks in one ensemble, balanced contact drag as a power of velocity; packing fractions to four digits."""
    kept = (table["model"] == "sp") & (table["law"] == "contact") & (table["beta"] == 1)
    kept &= np.isclose(table["alpha"], alpha, rtol=1e-4)
    rows = table[kept].assign(phi=table.loc[kept, "phi"].round(4))
    return select_usual(rows, ["ensemble"], None)


def steady_flows(table: pd.DataFrame, alpha: float = 1.0) -> pd.DataFrame:
    """Select steady flow at a rate, of the number of disks and the accuracy that are usual under linear drag."""
    rows, linear = (part[part["rate"] > 0] for part in (balanced_disks(table, alpha), balanced_disks(table)))
    rows = select_usual(rows, SETTINGS, of=linear)
    if rows.empty:
        raise InputError(f"the table flow has no steady flow of disks with alpha = {alpha:g}: run a campaign with some")
    return rows


def mean_of_rows(rows: pd.DataFrame, by: str, value: str) -> tuple[Array, Interval]:
    """Average a column over packings at each place (m,), such as each rate."""
    places, values = of_packings(rows, by, value)
    return places, mean_over_packings([values])[0]


def draw_mean(out: Drawing, axes: Any, series: str, rows: pd.DataFrame, by: str, value: str, **look: Any) -> None:
    """Draw the mean of a column over packings with its intervals as bars."""
    out.curve(axes, series, *mean_of_rows(rows, by, value), band=False, **look)


def yield_law(rates: Array, stress: Array) -> HerschelBulkley:
    """Fit the law of Herschel and Bulkley to mean stresses of (packings, m), weighted by their relative errors. Rate 0
    is quasi-static shear, whose mean counts as any other."""
    kept = (rates <= HIGHEST) & np.isfinite(stress).all(axis=0)
    rates = np.maximum(rates, _STANDS)
    mean = average(stress[:, kept])
    return herschel_bulkley(rates[kept], mean, 0.03 * mean)


def yield_law_interval(rates: Array, stress: Array) -> Interval:
    """Fit yield stress and exponent, with their intervals over packings; nan of too few rates."""

    def of(groups: list[Array]) -> Array:
        try:
            found = yield_law(rates, groups[0])
        except ConvergenceError:
            return np.full(2, np.nan)
        return np.array([found.yield_stress, found.exponent])

    return bootstrap([stress], of, resamples=100)
