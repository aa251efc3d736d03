"""Draw flow in time: flow curves of disks, oscillation over amplitude and under power-law drag."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.plotting import in_unit
from jamlab.plotting.palette import BLACK, RED
from jamlab.statistics.confidence import Interval
from jamlab.statistics.herschel_bulkley import HerschelBulkley, herschel_bulkley
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, average, bootstrap, mean_over_packings, of_packings, scaled, select, side_by_side
from studies.panels import FIT, Drawing, drawing, label, scale, sequence, style, write_interval
from studies.papers.statements import caption, paper

RATE = r"rate of shear $\dot\gamma\,\tau_1$"
STRESS = in_unit(r"shear stress $\sigma$", "k")
SETTINGS = {"n": 256, "background_drag": 1e-2, "tolerance": 5e-2}  # of the runs that are averaged
ONSET = 0.84  # packing fraction nearest to onset
JAMMED = 0.86  # of the fit with a yield stress
HIGHEST = 1e-2  # rate up to which laws are fitted
_STANDS = 1e-15  # rate that adds nothing to a yield stress


def square_disks(table: pd.DataFrame, **wanted: Any) -> pd.DataFrame:
    """Select disks in boxes of fixed shape; phi to four digits."""
    return select(table.assign(phi=table["phi"].round(4)), model="sp", ensemble="fixed-box", **wanted)


def balanced_disks(table: pd.DataFrame, alpha: float = 1.0, **wanted: Any) -> pd.DataFrame:
    """Select disks in boxes of fixed shape, balanced contact drag as a power of velocity; phi to four digits."""
    kinds = {"damping": "contact", "beta": 1.0, "alpha": round(alpha, 4)}
    return square_disks(table.assign(alpha=table["alpha"].round(4)), **kinds, **wanted)


def steady_flows(table: pd.DataFrame, alpha: float = 1.0, **wanted: Any) -> pd.DataFrame:
    """Select steady flow, of the number of disks and the accuracy that are averaged."""
    return balanced_disks(table, alpha, **SETTINGS, **wanted)


def with_limit(rows: pd.DataFrame, tables: EnsembleTables, **wanted: Any) -> pd.DataFrame:
    """Add quasi-static shear to rows of steady flow, at rate 0."""
    still = square_disks(tables.quasistatic_shear, n=SETTINGS["n"], **wanted)
    return pd.concat([rows, still.assign(rate=0.0)], ignore_index=True)


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


def flow_curves(tables: EnsembleTables) -> Drawing:
    """Flow curves of disks around onset, stress over pressure, and the law of Herschel and Bulkley."""
    table = steady_flows(tables.flow)
    out, (stress, friction, fit) = drawing("dynamics-flow-curves", 1, 3, 4.8, 3.9)
    for axes in (stress, friction, fit):
        scale(axes, y="linear" if axes is friction else "log")
    fractions = sorted(table["phi"].unique())
    for k, phi in enumerate(fractions):
        rows = table[table["phi"] == phi]
        rows = rows.assign(friction=rows["stress"] / rows["flow_pressure"])
        for axes, column in ((stress, "stress"), (friction, "friction")):
            draw_mean(out, axes, f"$\\phi$ = {phi:.2f}", rows, "rate", column, **sequence(k, len(fractions)))
    at_onset = select(table, phi=ONSET)
    slowest = at_onset["rate"].min()
    lowest = float(at_onset.loc[at_onset["rate"] == slowest, "stress"].mean())
    out.slope(stress, paper("flow-at-onset"), (slowest, HIGHEST), 0.6 * lowest)
    said = _draw_fit(out, fit, tables)
    label(stress, RATE, STRESS, fontsize=7.5)
    label(friction, RATE, r"stress over pressure $\sigma/p$", legend=False)
    label(fit, RATE, in_unit(r"$\sigma - \sigma_y$", "k"), loc="upper left")
    made = table["seed"].nunique()
    out.caption = caption(out.name, n=SETTINGS["n"], made=made, jammed=JAMMED, highest=HIGHEST, **said)
    return out


def _draw_fit(out: Drawing, axes: Any, tables: EnsembleTables) -> dict[str, str]:
    """Draw the law with a yield stress, and write what it gives with quasi-static shear and without."""
    moving = steady_flows(tables.flow, phi=JAMMED)
    rates, stress = of_packings(moving, "rate", "stress")
    law = yield_law(rates, stress)
    y, mean = law.yield_stress, mean_over_packings([stress])[0]
    above = Interval(mean.value - y, mean.low - y, mean.high - y)
    out.curve(axes, f"$\\phi$ = {JAMMED:.2f}", rates, above, band=False, color=RED, marker="s", ls="none")
    line = np.geomspace(rates.min(), HIGHEST, 50)
    out.curve(axes, f"$n$ = {law.exponent:.3f}", line, law(line) - y, **FIT)
    both = of_packings(with_limit(moving, tables, phi=JAMMED), "rate", "stress")
    return {name: _write_law(yield_law_interval(*each)) for name, each in (("alone", (rates, stress)), ("both", both))}


def _write_law(found: Interval) -> str:
    return f"exponent {write_interval(found[1], 3)}, yield stress {write_interval(scaled(found[0], 1e4), 2)}"


def flow_at_onset(tables: EnsembleTables) -> Sample:
    """Take rates and mean stresses at the packing fraction nearest to onset."""
    rows = steady_flows(tables.flow, phi=ONSET)
    rates, stress = of_packings(rows[rows["rate"] <= HIGHEST], "rate", "stress")
    return Sample([stress], lambda drawn: (rates, average(drawn[0])))


def slope_at_onset(rates: Array, stress: Array, highest: float = HIGHEST) -> float:
    """Fit the exponent of the stress over the rate."""
    return fit_exponent(rates[rates <= highest], stress[rates <= highest])


AMPLITUDE = r"amplitude of the strain $\gamma_0$"
SWEPT = {"n": 64, "background_drag": 1e-2}  # disks of the sweeps of amplitude
PRESSURES = (3e-3, 1e-2, 3e-2)  # of the same
SOFT = 0.7  # of the storage modulus at small amplitude that is left; 0.9 is lost in noise of 64 disks


def amplitude_sweeps(tables: EnsembleTables) -> Drawing:
    """G' and G'' against the amplitude at three frequencies, and where disks soften against pressure."""
    table = balanced_disks(tables.oscillation, **SWEPT)
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
        label(
            part,
            AMPLITUDE,
            in_unit(rf"$G'$, dashed $G''$ at $\omega\,\tau_1$ = {omega:g}", "k"),
            legend=part is axes[0],
        )
    scale(axes[-1])
    amplitude, groups = _moduli(tables)
    ends = side_by_side([bootstrap([g], lambda drawn: _softens(amplitude, average(drawn[0]))) for g in groups])
    out.curve(axes[-1], "softening", PRESSURES, ends, band=False, color=RED, marker="s")
    out.slope(axes[-1], paper("flow-softening"), (PRESSURES[0], PRESSURES[-1]), 0.5 * ends.value[0])
    label(axes[-1], in_unit("pressure $p$", "k"), AMPLITUDE)
    made = {"n": int(table["n"].iloc[0]), "made": table["seed"].nunique()}
    out.caption = caption(out.name, soft=100 * SOFT, **made)
    return out


def _moduli(tables: EnsembleTables) -> tuple[Array, list[Array]]:
    """Arrange amplitudes and the storage moduli of packings at each pressure, at the lowest frequency."""
    rows = balanced_disks(tables.oscillation, **SWEPT)
    rows = rows[rows["omega"] == rows["omega"].min()]
    each = [of_packings(select(rows, target_pressure=p), "amplitude", "storage") for p in PRESSURES]
    return each[0][0], [storage for _, storage in each]


def of_pressures(tables: EnsembleTables) -> Sample:
    """Take amplitudes and the mean storage moduli at each pressure."""
    amplitude, groups = _moduli(tables)
    return Sample(groups, lambda drawn: (amplitude, [average(each) for each in drawn]))


def power_of_softening(amplitude: Array, storage: list[Array]) -> float:
    """Fit the exponent in pressure of the amplitude at which 70 % of the storage modulus are left."""
    limits = [_softens(amplitude, each) for each in storage]
    return float(np.polyfit(np.log(PRESSURES), np.log(limits), 1)[0])


def _softens(amplitude: Array, storage: Array) -> float:
    """Find the amplitude at which the storage modulus first falls to `SOFT` of its first value; nan if never."""
    ratio = storage / storage[0]
    below = np.flatnonzero(ratio < SOFT)
    if not len(below):
        return np.nan
    k = int(below[0])
    part = np.log(ratio[k - 1] / SOFT) / np.log(ratio[k - 1] / max(ratio[k], 1e-3))
    return float(amplitude[k - 1] * (amplitude[k] / amplitude[k - 1]) ** part)


ALLOWED = 10.0  # %


def equivalent_damping(tables: EnsembleTables) -> Drawing:
    """Error of the equivalent linear damping against frequency and the power of the drag."""
    small = {"n": 64, "target_pressure": 1e-2, "amplitude": 1e-4, "background_drag": 1e-4}
    table = select(tables.oscillation, **small).dropna(subset=["equivalent_time"]).round({"alpha": 4})
    table = table.assign(reduced=table["omega"] * table["equivalent_time"])
    powers = sorted(table["alpha"].unique())
    out, panels = drawing("dynamics-equivalent-damping", 1, 2, 4.8, 4.0)
    said = []
    for axes, (part, name) in zip(panels, {"storage": "G'", "loss": "G''"}.items(), strict=True):
        scale(axes, y="linear")
        for k, alpha in enumerate(powers):
            rows = table[table["alpha"] == alpha]
            rows = rows.assign(error=100 * (rows[f"equivalent_{part}"] / rows[part] - 1))
            mean, x = (mean_of_rows(rows, "omega", column)[1] for column in ("error", "reduced"))
            out.curve(axes, rf"$\alpha$ = {alpha:.2f}", x.value, mean, band=False, **sequence(k, len(powers)))
            said.append(f"{name} at alpha {alpha:.2f}: {round(mean.value.min())} to {round(mean.value.max())}")
        axes.axhspan(-ALLOWED, ALLOWED, color="#999999", alpha=0.15, linewidth=0)
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        label(axes, r"$\omega\,\tau_\alpha$", in_unit(f"error of {name}", "%"), legend=part == "storage")
    made = {"n": small["n"], "made": table["seed"].nunique(), "said": "; ".join(said)}
    out.caption = caption(out.name, pressure=small["target_pressure"], amplitude=small["amplitude"], **made)
    return out


FIGURES = {
    "dynamics-flow-curves": flow_curves,
    "dynamics-amplitudes": amplitude_sweeps,
    "dynamics-equivalent-damping": equivalent_damping,
}
