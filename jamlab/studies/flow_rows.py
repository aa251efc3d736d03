"""Choose rows of the tables of flow, and average them over packings."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.statistics.bootstrap import Interval
from jamlab.studies.ensembles import average, bootstrap

RATE = r"rate of shear $\dot\gamma\,\tau_1$"
STRESS = r"shear stress $\sigma$  [k]"
SETTINGS = ["n", "background", "tolerance"]  # of runs that may be averaged
AMPLITUDE = r"amplitude of the strain $\gamma_0$"


def balanced_disks(table: pd.DataFrame, alpha: float = 1.0) -> pd.DataFrame:
    """Rows of disks in one ensemble, balanced contact drag as a power of velocity; packing fractions to four digits."""
    kept = (table["model"] == "sp") & (table["law"] == "contact") & (table["beta"] == 1)
    kept &= np.isclose(table["alpha"], alpha, rtol=1e-4)
    return usual_runs(table[kept].assign(phi=table.loc[kept, "phi"].round(4)), "ensemble")


def usual_runs(table: pd.DataFrame, value: str = "n") -> pd.DataFrame:
    """Rows of the value that most rows share, such as the number of disks, or the tolerance."""
    return table[table[value] == table[value].mode()[0]] if len(table) else table


def steady_flows(table: pd.DataFrame, alpha: float = 1.0) -> pd.DataFrame:
    """Rows of steady flow at a rate, of the number of disks and the accuracy that are usual under linear drag.

    Raises:
        InputError: there are none.
    """
    rows, usual = (part[part["rate"] > 0] for part in (balanced_disks(table, alpha), balanced_disks(table)))
    for setting in SETTINGS:
        usual = usual_runs(usual, setting)
        rows = rows[rows[setting].isin(usual[setting])]
    if rows.empty:
        raise InputError(f"the table flow has no steady flow of disks with alpha = {alpha:g}: run a campaign with some")
    return rows


def by_packing(rows: pd.DataFrame, columns: str, value: str) -> tuple[Array, Array]:
    """Places (m,), such as rates, and values (packings, m); nan where a packing has none."""
    table = rows.pivot_table(index="seed", columns=columns, values=value, dropna=False)
    return table.columns.to_numpy(dtype=np.float64), table.to_numpy(dtype=np.float64)


def mean_over_packings(values: Array) -> Interval:
    """Means (m,) of values (packings, m), with their intervals."""
    return bootstrap([values], lambda groups: average(groups[0]))


def nearest(values: Sequence[float], wanted: float) -> float:
    """The value at hand that is nearest to the one wanted."""
    return min(values, key=lambda value: abs(value - wanted))
