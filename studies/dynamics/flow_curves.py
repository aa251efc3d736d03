"""Draw flow in time: curves of disks, yield stress, overshoot, droplets beside disks; oscillation over amplitude."""

from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.plotting.palette import BLACK, BLUE, GREEN, MODEL_STYLE, ORANGE, PINK, RED
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.herschel_bulkley import HerschelBulkley, herschel_bulkley
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, average, bootstrap, mean_over_packings, of_packings, scaled, select, side_by_side
from studies.panels import FIT, FREQUENCY, Drawing, drawing, label, model_style, scale, sequence, style, write_interval
from studies.papers.statements import caption, paper, statistic

RATE = r"rate of shear $\dot\gamma\,\tau_1$"
STRESS = r"shear stress $\sigma$  [k]"
SETTINGS = {"n": 256, "background": 1e-2, "tolerance": 5e-2}  # of the runs that are averaged
ONSET = 0.84  # packing fraction nearest to onset
JAMMED = 0.86  # of the fit with a yield stress
HIGHEST = 1e-2  # rate up to which laws are fitted: beyond, contacts themselves limit the flow
_STANDS = 1e-15  # rate that adds nothing to a yield stress


def balanced_disks(table: pd.DataFrame, alpha: float = 1.0, **wanted: Any) -> pd.DataFrame:
    """Select disks in boxes of fixed shape, balanced contact drag as a power of velocity; phi to four digits."""
    rows = table.assign(phi=table["phi"].round(4), alpha=table["alpha"].round(4))
    kinds = {"model": "sp", "ensemble": "fixed-box", "law": "contact", "beta": 1.0, "alpha": round(alpha, 4)}
    return select(rows, **kinds, **wanted)


def steady_flows(table: pd.DataFrame, alpha: float = 1.0, **wanted: Any) -> pd.DataFrame:
    """Select steady flow at a rate, of the number of disks and the accuracy that are averaged."""
    return balanced_disks(table[table["rate"] > 0], alpha, **SETTINGS, **wanted)


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
    label(fit, RATE, r"$\sigma - \sigma_y$  [k]", loc="upper left")
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
    still = of_packings(balanced_disks(tables.flow, phi=JAMMED, **SETTINGS), "rate", "stress")
    return {name: _write_law(yield_law_interval(*each)) for name, each in (("alone", (rates, stress)), ("both", still))}


def _write_law(found: Interval) -> str:
    return f"exponent {write_interval(found[1], 3)}, yield stress {write_interval(scaled(found[0], 1e4), 2)}"


def flow_at_onset(tables: EnsembleTables) -> Sample:
    """Take rates and mean stresses at the packing fraction nearest to onset."""
    rows = steady_flows(tables.flow, phi=ONSET)
    rates, stress = of_packings(rows[rows["rate"] <= HIGHEST], "rate", "stress")
    return Sample([stress], lambda drawn: (rates, average(drawn[0])))


@statistic("flow-at-onset", sample=flow_at_onset, variants=({"highest": 1e-3}, {"highest": 3e-3}))
def slope_at_onset(rates: Array, stress: Array, highest: float = HIGHEST) -> float:
    """Fit the exponent of the stress over the rate."""
    return fit_exponent(rates[rates <= highest], stress[rates <= highest])


def droplets_beside_disks(tables: EnsembleTables) -> Drawing:
    """Flow curves of droplets and disks at the same packing fraction, and their pressure."""
    table = select(tables.flow, law="stokes")
    table = table.assign(rho=table["rho"].round(3))
    fractions = sorted(select(table, model="dp")["rho"].unique())
    out, axes = drawing("dynamics-droplets", 1, len(fractions) + 1, 4.6, 3.9)
    for part, rho in zip(axes, fractions, strict=False):
        scale(part)
        for model in MODEL_STYLE:
            rows, look = table[(table["rho"] == rho) & (table["model"] == model)], model_style(model, linestyle="-")
            draw_mean(out, part, MODEL_STYLE[model]["label"], rows, "rate", "stress", **look)
        text = rf"shear stress $\sigma$ at $\rho$ = {rho:.2f}  [ε/l²]"
        label(part, RATE, text, legend=False)
    last = axes[-1]
    scale(last)
    for model, (rho, line) in product(MODEL_STYLE, zip(fractions, ("-", "--", ":"), strict=False)):
        rows, look = table[(table["rho"] == rho) & (table["model"] == model)], model_style(model, linestyle=line)
        text = rf"{MODEL_STYLE[model]['label']}, $\rho$ = {rho:.2f}"
        draw_mean(out, last, text, rows, "rate", "flow_pressure", **look)
    label(last, RATE, "pressure $p$  [ε/l²]", legend=False)
    out.legend_above(last)
    out.caption = caption(out.name, n=int(table["n"].iloc[0]), made=table["seed"].nunique())
    return out


MOVES = 1e-5  # rate of creep below which a packing is taken to bear a stress
_CREEP: dict[str, Any] = {"color": PINK, "marker": "v"}


class Estimate(NamedTuple):
    """A yield stress by one way, with its look."""

    way: str
    found: Interval
    look: dict[str, Any]


def yield_stress(tables: EnsembleTables) -> Drawing:
    """Yield stress from steady flow, quasi-static shear, start-up and creep, side by side."""
    table = steady_flows(tables.flow, phi=JAMMED)
    slow = balanced_disks(tables.flow, phi=JAMMED, rate=0)
    loaded = balanced_disks(tables.creep, phi=JAMMED)
    out, (flow, creep, ways) = drawing("dynamics-yield", 1, 3, 4.8, 3.9)
    scale(flow, creep)
    found = _flows(out, flow, table, slow)
    found.append(Estimate("creep", _creeps(out, creep, loaded, table), _CREEP))
    for k, each in enumerate(found):
        out.curve(ways, each.way, [k], scaled(each.found, 1e3), band=False, ls="none", **each.look)
    ways.set_xticks(range(len(found)), [each.way.replace(" ", "\n") for each in found])
    ways.set_xlim(-0.5, len(found) - 0.5)
    ways.set_ylim(bottom=0)
    label(flow, RATE, STRESS, loc="upper left")
    label(creep, STRESS, r"rate of creep at the end $\dot\gamma\,\tau_1$")
    label(ways, "way", r"yield stress $\sigma_y$  [$10^{-3}$ k]", legend=False)
    ways.tick_params(axis="x", labelsize=8)
    text = "; ".join(f"{each.way} {write_interval(scaled(each.found, 1e4), 1)}" for each in found)
    settings = {"n": SETTINGS["n"], "jammed": JAMMED, "made": slow["seed"].nunique(), "moves": MOVES}
    out.caption = caption(out.name, time=loaded["final_time"].max(), ways=text, **settings)
    return out


def _flows(out: Drawing, axes: Any, table: pd.DataFrame, slow: pd.DataFrame) -> list[Estimate]:
    rates, stress = of_packings(table, "rate", "stress")
    mean = mean_over_packings([stress])[0]
    out.curve(axes, "steady flow", rates, mean, band=False, color=RED, marker="s", ls="none")
    law, interval = yield_law(rates, stress), yield_law_interval(rates, stress)
    line = np.geomspace(rates.min(), HIGHEST, 60)
    out.curve(axes, f"Herschel-Bulkley, $n$ = {law.exponent:.2f}", line, law(line), **FIT)
    _, peaks = of_packings(table, "rate", "peak_stress")
    top = mean_over_packings([np.where(np.isfinite(peaks), peaks, stress)])[0]
    out.curve(axes, "peak of start-up", rates, top, band=False, color=GREEN, marker="^", ls=":")
    of_slow = (slow["stress"], slow["peak_stress"].fillna(slow["stress"]))
    limit, peak = (mean_over_packings([column.to_numpy(dtype=np.float64)])[0] for column in of_slow)
    ends = np.array([rates.min(), rates.max()])
    out.curve(axes, "quasi-static mean", ends, scaled(limit, np.ones(2)), color=BLUE, ls="--")
    return [
        Estimate("flow, law", interval[0], {"color": BLACK, "marker": "s"}),
        Estimate("flow, slowest", mean[0], {"color": RED, "marker": "s"}),
        Estimate("flow, quasi-static", limit, {"color": BLUE, "marker": "o"}),
        Estimate("start-up, slowest", top[0], {"color": GREEN, "marker": "^"}),
        Estimate("start-up, quasi-static", peak, {"color": ORANGE, "marker": "D"}),
    ]


def _creeps(out: Drawing, axes: Any, loaded: pd.DataFrame, table: pd.DataFrame) -> Interval:
    out.curve(axes, "creep", loaded["stress"] + loaded["residual"], loaded["final_rate"], ls="none", **_CREEP)
    rates, stress = of_packings(table, "rate", "stress")
    line = np.geomspace(MOVES, HIGHEST, 60)
    out.curve(axes, "steady flow, law of (a)", yield_law(rates, stress)(line), line, **FIT)
    axes.axhline(MOVES, color=BLACK, linewidth=0.8, linestyle=":")
    limits = [_threshold(rows) for _, rows in loaded.groupby("seed")]
    return mean_over_packings([np.array(limits)])[0]


def _threshold(rows: pd.DataFrame) -> float:
    """Find the stress between the largest that a packing bears and the next, residual one counted; nan if all flow."""
    total = (rows["stress"] + rows["residual"]).to_numpy(dtype=np.float64)
    order = np.argsort(total)
    total, flows = total[order], rows["final_rate"].to_numpy(dtype=np.float64)[order] > MOVES
    held = np.flatnonzero(~flows)
    if not len(held) or held[-1] + 1 == len(total):
        return np.nan
    return float(np.sqrt(total[held[-1]] * total[held[-1] + 1]))


AMPLITUDE = r"amplitude of the strain $\gamma_0$"
SWEPT = {"n": 64, "background": 1e-2}  # disks of the sweeps of amplitude
PRESSURES = (3e-3, 1e-2, 3e-2)  # of the same
SOFT, YIELDED = 0.7, 0.1  # of the storage modulus at small amplitude that is left; 0.9 is lost in noise of 64 disks


def amplitude_sweeps(tables: EnsembleTables) -> Drawing:
    """G' and G'' against the amplitude at three frequencies, with softening and yielding against pressure."""
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
        label(part, AMPLITUDE, rf"$G'$, dashed $G''$  [k], $\omega\,\tau_1$ = {omega:g}", legend=part is axes[0])
    _draw_limits(out, axes[-1], tables)
    made = {"n": int(table["n"].iloc[0]), "made": table["seed"].nunique()}
    out.caption = caption(out.name, soft=100 * SOFT, yielded=100 * YIELDED, **made)
    return out


def _moduli(tables: EnsembleTables) -> tuple[Array, list[Array]]:
    """Arrange amplitudes and the storage moduli of packings at each pressure, at the lowest frequency."""
    rows = balanced_disks(tables.oscillation, **SWEPT)
    rows = rows[rows["omega"] == rows["omega"].min()]
    each = [of_packings(select(rows, target_pressure=p), "amplitude", "storage") for p in PRESSURES]
    return each[0][0], [storage for _, storage in each]


def _draw_limits(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw the amplitudes of softening and yielding against pressure."""
    scale(axes)
    amplitude, groups = _moduli(tables)
    for share, name, look in ((SOFT, "softening", {"color": RED, "marker": "s"}), (YIELDED, "yielding", _YIELD)):
        found = [bootstrap([g], partial(_limit, amplitude, share)) for g in groups]
        ends = side_by_side(found)
        out.curve(axes, name, PRESSURES, ends, band=False, **look)
        if name == "softening":
            out.slope(axes, paper("flow-softening"), (PRESSURES[0], PRESSURES[-1]), 0.5 * ends.value[0])
    label(axes, "pressure $p$  [k]", AMPLITUDE)


_YIELD = {"color": BLUE, "marker": "o", "markeredgecolor": BLACK}


def of_pressures(tables: EnsembleTables) -> Sample:
    """Take amplitudes and the mean storage moduli at each pressure."""
    amplitude, groups = _moduli(tables)
    return Sample(groups, lambda drawn: (amplitude, [average(each) for each in drawn]))


@statistic("flow-softening", sample=of_pressures)
def power_of_softening(amplitude: Array, storage: list[Array]) -> float:
    """Fit the exponent in pressure of the amplitude at which 70 % of the storage modulus are left."""
    limits = [_falls_to(amplitude, each, SOFT) for each in storage]
    return float(np.polyfit(np.log(PRESSURES), np.log(limits), 1)[0])


def _limit(amplitude: Array, share: float, drawn: list[Array]) -> float:
    return _falls_to(amplitude, average(drawn[0]), share)


def _falls_to(amplitude: Array, storage: Array, share: float) -> float:
    """Find the amplitude at which the storage modulus first falls to a share of its first value; nan if never."""
    ratio = storage / storage[0]
    below = np.flatnonzero(ratio < share)
    if not len(below):
        return np.nan
    k = int(below[0])
    part = np.log(ratio[k - 1] / share) / np.log(ratio[k - 1] / max(ratio[k], 1e-3))
    return float(amplitude[k - 1] * (amplitude[k] / amplitude[k - 1]) ** part)


PARTS = {"storage": "G'", "loss": "G''"}
ALLOWED = 10.0  # %


def equivalent_damping(tables: EnsembleTables) -> Drawing:
    """Error of the equivalent linear damping against frequency and the power of the drag."""
    table = _small_oscillations(tables.oscillation)
    powers = sorted(table["alpha"].unique())
    out, (grid, *parts) = drawing("dynamics-equivalent-damping", 1, 3, 4.8, 4.0)
    scale(grid, y="linear")
    said = []
    for axes, (part, name) in zip(parts, PARTS.items(), strict=True):
        scale(axes, y="linear")
        for k, alpha in enumerate(powers):
            rows = table[table["alpha"] == alpha]
            _, mean = mean_of_rows(rows, "omega", f"{part}_error")
            x = mean_of_rows(rows, "omega", "reduced")[1].value
            text = rf"$\alpha$ = {alpha:.2f}"
            out.curve(axes, text, x, mean, band=False, **sequence(k, len(powers)))
            said.append(f"{name} at alpha {alpha:.2f}: {round(mean.value.min())} to {round(mean.value.max())}")
        axes.axhspan(-ALLOWED, ALLOWED, color="#999999", alpha=0.15, linewidth=0)
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        label(axes, r"$\omega\,\tau_\alpha$", f"error of {name}  [%]", legend=part == "storage")
    _draw_map(out, grid, table)
    label(grid, FREQUENCY, r"power $\alpha$ of the drag", legend=False)
    first = table.iloc[0]
    made = {"n": int(first["n"]), "made": table["seed"].nunique(), "said": "; ".join(said)}
    out.caption = caption(out.name, pressure=first["target_pressure"], amplitude=first["amplitude"], **made)
    return out


def _small_oscillations(table: pd.DataFrame) -> pd.DataFrame:
    """Select rows at the amplitude at which powers were measured, with errors in percent."""
    small = {"n": 64, "target_pressure": 1e-2, "amplitude": 1e-4, "background": 1e-4}
    rows = select(table, **small).dropna(subset=["equivalent_time"]).round({"alpha": 4})
    for part in PARTS:
        rows[f"{part}_error"] = 100 * (rows[f"equivalent_{part}"] / rows[part] - 1)
    size = np.hypot(rows["equivalent_storage"], rows["equivalent_loss"]) / np.hypot(rows["storage"], rows["loss"])
    return rows.assign(reduced=rows["omega"] * rows["equivalent_time"], size_error=100 * (size - 1))


def _draw_map(out: Drawing, axes: Any, table: pd.DataFrame) -> None:
    mean = table.groupby(["alpha", "omega"], as_index=False)["size_error"].mean()
    span = max(float(mean["size_error"].abs().max()), ALLOWED)
    look = {"c": mean["size_error"], "cmap": "PuOr", "vmin": -span, "vmax": span, "edgecolor": BLACK}
    axes.scatter(mean["omega"], mean["alpha"], s=330, marker="s", linewidth=0.5, **look)
    for alpha, rows in mean.groupby("alpha"):
        out.curve(axes, f"alpha {alpha:.2f}", rows["omega"], np.full(len(rows), alpha), ls="none")
    for _, row in mean.iterrows():
        colour = "white" if abs(row["size_error"]) > 0.6 * span else BLACK
        at = (row["omega"], row["alpha"])
        axes.annotate(f"{round(row['size_error']):+d}", at, ha="center", va="center", fontsize=7.5, color=colour)
    axes.margins(0.1, 0.15)


FIGURES = {
    "dynamics-flow-curves": flow_curves,
    "dynamics-yield": yield_stress,
    "dynamics-amplitudes": amplitude_sweeps,
    "dynamics-equivalent-damping": equivalent_damping,
    "dynamics-droplets": droplets_beside_disks,
}
