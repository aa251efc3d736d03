"""Draw flow of disks in time, from the table shipped beside: flow curves around onset, their collapse, overshoot.

`dynamics_flow.csv` is `jamlab.flow.flow_ensemble.flow_table` of 256 disks; `tests/flow/benchmark_flow_ensemble.py`
makes it anew.
"""

from collections.abc import Callable
from importlib import resources

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.figures.papers.claims import Claim, claim
from jamlab.figures.papers.panels import Drawing, drawing, label, scale, sequence
from jamlab.figures.papers.tables import EnsembleTables
from jamlab.statistics.bootstrap import bootstrap
from jamlab.statistics.published_numbers import FLOW_AT_ONSET

Array = NDArray[np.float64]

ONSET = 0.84  # packing fraction nearest to onset
HIGHEST = 1e-2  # rate up to which the law at onset is fitted: beyond, contacts themselves limit the flow


def read_flow_table() -> pd.DataFrame:
    """The table shipped with jamlab."""
    with resources.files("jamlab.figures.papers").joinpath("dynamics_flow.csv").open("rb") as file:
        return pd.read_csv(file)


def flow_curves(tables: EnsembleTables) -> Drawing:
    """Flow curves of disks around onset, the overshoot of start-up, and pressure over stress."""
    table = read_flow_table()
    out, (stress, friction, peak) = drawing("dynamics-flow-curves", 1, 3, 4.8, 3.9)
    for axes in (stress, friction, peak):
        scale(axes, "log", "log" if axes is stress else "linear")
    fractions = sorted(table["phi"].unique())
    for k, phi in enumerate(fractions):
        rows = table[table["phi"] == phi]
        look, name = sequence(k, len(fractions)), f"$\\phi$ = {phi:.2f}"
        for axes, values in (
            (stress, rows["stress"]),
            (friction, rows["stress"] / rows["pressure"]),
            (peak, rows["peak_stress"].fillna(rows["stress"]) / rows["stress"]),
        ):
            if axes is peak and phi < ONSET:  # nothing holds a loose packing before it flows
                continue
            rate, mean, error = _means(rows["rate"], values)
            out.curve(axes, name, rate, mean, mean - error, mean + error, band=False, **look)
    low, high = table["rate"].min(), min(table["rate"].max(), HIGHEST)
    at_onset = table[(table["phi"] == ONSET) & (table["rate"] == low)]["stress"]
    if len(at_onset):
        out.slope(stress, FLOW_AT_ONSET.value, (low, high), 0.5 * float(at_onset.mean()))
    rate_label = r"rate of shear $\dot\gamma\,\tau_1$"
    label(stress, rate_label, r"shear stress $\sigma$  [k]")
    label(friction, rate_label, r"stress over pressure $\sigma/p$", legend=False)
    label(peak, rate_label, "peak of start-up over steady stress", legend=False)
    out.claims = [_exponent_at_onset(table)]
    out.caption = (
        f"Steady flow of {int(table['n'].iloc[0])} disks with balanced contact drag at a given rate, means over "
        f"{table['seed'].nunique()} packings with standard errors. (a) Stress over rate; the lower the rate, the more "
        "curves part, to a yield stress above onset and a liquid below; dashed, the power law at onset. (b) Stress "
        "over pressure. (c) Overshoot of start-up from a quenched packing above onset; 1 where there is none."
    )
    return out


def _means(rate: pd.Series, values: pd.Series) -> tuple[Array, Array, Array]:
    """Rates, means over packings, and their standard errors."""
    groups = values.groupby(rate)
    mean, spread = groups.mean(), groups.std(ddof=1).fillna(0.0)
    error = spread.to_numpy() / np.sqrt(groups.count().to_numpy())
    return np.array(mean.index, dtype=float), mean.to_numpy(), np.asarray(error)


def _exponent_at_onset(table: pd.DataFrame) -> Claim:
    rows = table[(table["phi"] == ONSET) & (table["rate"] <= HIGHEST)]
    curves = rows.pivot_table(index="seed", columns="rate", values="stress").dropna()
    found = None
    if len(curves) > 1 and curves.shape[1] > 1:
        found = bootstrap([curves.to_numpy()], _slope(np.log(curves.columns.to_numpy(dtype=float))))
    how = f"slope of ln stress over ln rate up to {HIGHEST:g} at packing fraction {ONSET}"
    quantity = "exponent of stress over rate near onset"
    return claim("dynamics-flow-curves", quantity, found, FLOW_AT_ONSET, how=how, cause="beside onset, not at it")


def _slope(log_rate: Array) -> Callable[[list[Array]], float]:
    return lambda groups: float(np.polyfit(log_rate, np.log(groups[0].mean(axis=0)), 1)[0])
