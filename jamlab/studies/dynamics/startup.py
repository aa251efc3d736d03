"""Draw the overshoot of start-up against rate and packing fraction."""

import pandas as pd

from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.flow_rows import RATE, by_packing, mean_over_packings, steady_flows
from jamlab.studies.panels import Drawing, drawing, label, scale, sequence

LOOSE = 0.845  # packing fraction below which nothing holds a quenched packing before it flows


def overshoot(tables: EnsembleTables) -> Drawing:
    """Overshoot of start-up from quenched packings: height, excess over steady flow, and strain."""
    table = steady_flows(tables.flow)
    table = table[table["phi"] > LOOSE]
    out, (height, excess, strain) = drawing("dynamics-overshoot", 1, 3, 4.6, 3.9)
    for axes in (height, excess, strain):
        scale(axes, "log", "log" if axes is height else "linear")
    fractions = sorted(table["phi"].unique())
    for k, phi in enumerate(fractions):
        rows = _peaks(table[table["phi"] == phi])
        look = sequence(k, len(fractions))
        for axes, column in ((height, "peak_stress"), (excess, "excess"), (strain, "peak_strain")):
            rate, values = by_packing(rows, "rate", column)
            mean = mean_over_packings(values)
            out.curve(axes, f"$\\phi$ = {phi:.2f}", rate, mean.value, mean.low, mean.high, band=False, **look)
        rate, values = by_packing(rows, "rate", "stress")
        steady = mean_over_packings(values).value
        out.curve(height, f"steady, $\\phi$ = {phi:.2f}", rate, steady, label=None, color=look["color"], ls=":")
    label(height, RATE, r"peak stress, dotted steady stress $\sigma$  [k]", loc="upper left")
    label(excess, RATE, "peak over steady stress", legend=False)
    label(strain, RATE, "strain at the peak", legend=False)
    out.caption = (
        f"Start-up of {int(table['n'].iloc[0])} quenched disks, means over {table['seed'].nunique()} packings with "
        "95 % intervals. The peak is the largest stress up to strain 1, which stress of so few disks reaches by chance "
        "too: where steady flow fluctuates most, at low rates near onset, most of the excess is of that kind."
    )
    return out


def _peaks(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows with the excess of the peak over the steady stress; without a peak it is 1, at no strain."""
    return rows.assign(excess=(rows["peak_stress"] / rows["stress"]).fillna(1.0))
