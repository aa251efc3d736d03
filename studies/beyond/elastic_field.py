"""A study of non-affine motion as one elastic field: its spectrum, its lengths and the logarithm of N in viscosities.

Three numbers follow from the spectrum n S = c p^(-1/2)/k^2 without a fit: the zero of the correlation of u_y, a share
of the box; the length under Stokes drag, a number times (|G*|/(n omega))^(1/2); and the slope of (eta_0 - eta_F)
p^(1/2) = n <u^2> p^(1/2) over ln N, c/(4 pi).
"""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.ticker import NullFormatter

from jamlab.arrays import Array
from jamlab.plotting import in_unit
from studies.beyond.elastic_sheet import mean_of_zeros, screened_zero, screening
from studies.beyond.elastic_waves import BOTH, PRESSURES, shells_of, tasks, whole_fields
from studies.ensemble_tables import STABILIZED, EnsembleTables
from studies.ensembles import select
from studies.panels import PAPER, Drawing, TextTable, drawing, label, scale, style
from studies.papers.baumgarten.motion import correlations, first_zeros, rows_of
from studies.papers.statements import caption
from studies.study import Study

NAME = "elastic-field"
LONG = 0.5  # 1/d, longest of the waves that c, the longitudinal share and the angle dependence are means over
LARGE = 1024  # least N of these means and of zeros over the box: below, bins are 3 % of the box
SMALL = 30.0  # p N^2 from which packings count: below, finite size changes G
SLOPED = (1e-2, 3.16e-3, 1e-3, 3.16e-4, 1e-4)  # pressures of slopes over ln N
FEW = 3  # packings of a mean
WINDOW = (3.0, 0.1)  # lengths from this many diameters to this share of the box
PUBLISHED = 0.65  # exponent of -ln p in the published collapse of l
WHO = ["n", "pressure", "prestress", "seed"]
QUARTER = 0.25  # published l/L
LOG: dict[str, Any] = {"linestyle": "-", "linewidth": 1.2, "color": "k"}


# numbers --------------------------------------------------------------------------------------------------------------


def over_long_waves(shells: pd.DataFrame) -> pd.DataFrame:
    """Of each packing in slow shear: c = n k^2 (S_T + S_L) p^(1/2) and the share S_L/S_T of waves up to `LONG`, each
    weighted by its 1/k^2."""
    long = shells[(shells["k"] < LONG) & (shells["omega"] == 0)]
    weight = long["waves"] / long["k"] ** 2
    sums = long.assign(weight=weight, across=weight * long["across"], along=weight * long["along"])
    found = sums.groupby(WHO, as_index=False)[["weight", "across", "along"]].sum()
    return found.assign(c=(found["across"] + found["along"]) / found["weight"])


def fourfold(shells: pd.DataFrame) -> float:
    """a of S_T ~ 1 + a cos 4 theta, from the longest waves along the sides of the box and along its diagonals."""
    slow = shells[shells["omega"] == 0]
    sides, diagonals = (slow.loc[slow["shell"] == number, "across"].mean() for number in (1, 2))
    return float((sides - diagonals) / (sides + diagonals))


def chi_squared(y: Array, error: Array, columns: list[Array]) -> tuple[float, Array, Array]:
    """chi^2 of the best sum of columns, its coefficients and their standard errors."""
    weighted = np.column_stack(columns) / error[:, None]
    found = np.linalg.lstsq(weighted, y / error, rcond=None)[0]
    return (
        float(((y / error - weighted @ found) ** 2).sum()),
        found,
        np.sqrt(np.diag(np.linalg.inv(weighted.T @ weighted))),
    )


def means_by_size(rows: pd.DataFrame, value: str) -> pd.DataFrame:
    """Mean and standard error over packings of each N that has `FEW`, of packings with p N^2 above `SMALL`."""
    rows = rows[rows["pressure"] * rows["n"] ** 2 > SMALL]
    means = rows.groupby("n")[value].agg(["mean", "sem", "count"])
    return means[means["count"] >= FEW].reset_index()


def viscosities(tables: EnsembleTables, damping: str, fluid: float) -> pd.DataFrame:
    """(eta_0 - eta_F) p^(1/2) of packings in stabilised boxes without pre-stress, of the campaign."""
    rows = select(tables.spectra, ensemble=STABILIZED, damping=damping, prestress=False)
    rows = rows[(rows["eta_f"] == fluid) if damping == "stokes" else (rows["beta"] == 1)]
    rows = rows.drop_duplicates(["n", "seed", "target_pressure"]).assign(pressure=rows["target_pressure"])
    return rows.assign(y=(rows["eta0"] - fluid) * rows["pressure"] ** 0.5)


def by_logarithm(means: pd.DataFrame, slope: float) -> dict[str, float]:
    """chi^2 of A + B ln N with the slope of the spectrum, with a free one, of a constant and of a power of N."""
    x, y, error = (means[name].to_numpy(dtype=float) for name in ("n", "mean", "sem"))
    ones, logs = np.ones(len(x)), np.log(x / 1024.0)
    free, coefficients, errors = chi_squared(y, error, [ones, logs])
    power, *_ = chi_squared(np.log(y), error / y, [ones, logs])
    return {
        "sizes": len(x),
        "B": coefficients[1],
        "error": errors[1],
        "theory": chi_squared(y - slope * logs, error, [ones])[0],
        "free": free,
        "constant": chi_squared(y, error, [ones])[0],
        "power": power,
    }


def stokes_lengths(tables: EnsembleTables, n: int) -> pd.DataFrame:
    """Lengths l under Stokes drag of the campaign, of the mean C, beside G* less the fluid, at each p and omega."""
    found = []
    known = rows_of(tables, "stokes", n=n)
    spectra = select(tables.spectra, n=n, damping="stokes", eta_f=1.0, prestress=True, ensemble="fixed-box")
    for pressure in np.unique(known["pressure"]):
        part = known[known["pressure"] == pressure]
        omega = np.sort(part["omega"].unique())
        mean = select(spectra, target_pressure=float(pressure)).groupby("omega")[["storage", "loss"]].mean()
        at = np.log(mean.index.to_numpy())
        storage = np.interp(np.log(omega), at, mean["storage"])
        drag = np.interp(np.log(omega), at, mean["loss"] / mean.index - 1.0)
        columns = {"storage": storage, "loss": omega * drag, "length": first_zeros(correlations(part))}
        box = float(part["box"].mean())
        found.append(pd.DataFrame({"pressure": pressure, "omega": omega, **columns, "box": box, "density": n / box**2}))
    return with_screening(pd.concat(found))


def own_lengths(whole: pd.DataFrame, n: int, prestress: int) -> pd.DataFrame:
    """The same of the packings of this study: means over packings of the zeros of C."""
    rows = whole[(whole["n"] == n) & (whole["omega"] > 0) & (whole["prestress"] == prestress)]
    columns = ["storage", "loss", "length", "box", "density"]
    means = rows.groupby(["pressure", "omega"], as_index=False)[columns].mean()
    return with_screening(means.assign(loss=means["loss"] - means["omega"]))


def with_screening(rows: pd.DataFrame) -> pd.DataFrame:
    """Add the screening length, the phase of G* and what theory makes of both; keep lengths of the window."""
    modulus = rows["storage"] + 1j * rows["loss"]
    screen = np.sqrt(np.abs(modulus) / (rows["density"] * rows["omega"]))
    phase = np.angle(modulus)
    kept = (rows["length"] > WINDOW[0]) & (rows["length"] < WINDOW[1] * rows["box"])
    found = rows.assign(screen=screen, phase=phase, ratio=rows["length"] / screen)[kept]
    return found.assign(theory=[screened_zero(round(float(each), 4)) for each in found["phase"]])


def scatter(rows: pd.DataFrame) -> dict[str, float]:
    """Standard deviations of ln l: from a number times l_s, from theory, from the published collapse on its best power
    law, and from the collapse with the best power of -ln p."""
    y, x = np.log(rows["length"].to_numpy()), np.log((rows["omega"] / rows["pressure"] ** 0.5).to_numpy())
    logs = np.log(-np.log(rows["pressure"].to_numpy()))
    ones, free = np.ones(len(y)), len(y)

    def left(values: Array, columns: list[Array]) -> float:
        square, *_ = chi_squared(values, ones, columns)
        return float(np.sqrt(square / (free - len(columns))))

    from_theory = y - np.log((rows["theory"] * rows["screen"]).to_numpy())
    return {
        "l_s": left(y - np.log(rows["screen"].to_numpy()), [ones]),
        "theory": float(np.sqrt((from_theory**2).mean())),
        "published": left(y + PUBLISHED * logs, [ones, x]),
        "best logarithm": left(y, [ones, x, logs]),
    }


def share_and_angle(shells: pd.DataFrame, pressure: float) -> tuple[float, float]:
    """S_L/S_T of long waves and a of 1 + a cos 4 theta, without pre-stress, of large packings."""
    own = shells[(shells["pressure"] == pressure) & (shells["prestress"] == 0) & (shells["n"] >= LARGE)]
    long = over_long_waves(own)
    return round(float(long["along"].sum() / long["across"].sum()), 3), round(fourfold(own), 2)


def zeros_of_boxes(whole: pd.DataFrame) -> pd.DataFrame:
    """Mean of l/L over packings of each N, p and pre-stress in slow shear, with its standard error."""
    slow = whole[(whole["omega"] == 0) & whole["ratio"].notna()]
    means = slow.groupby(["prestress", "pressure", "n"])["ratio"].agg(["mean", "sem", "count"]).reset_index()
    return means[means["count"] >= FEW]


def slopes(tables: EnsembleTables, shells: pd.DataFrame) -> pd.DataFrame:
    """`by_logarithm` under both laws at some pressures, with c/(4 pi) of the nearest pressure of this study."""
    long = over_long_waves(shells)
    long = long[(long["prestress"] == 0) & (long["n"] >= LARGE)]
    found = []
    for damping, fluid in (("stokes", 1.0), ("contact", 0.0)):
        every = viscosities(tables, damping, fluid)
        for pressure in SLOPED:
            near = min(PRESSURES, key=lambda each: abs(np.log(each / pressure)))
            own = long[long["pressure"] == near]
            means = means_by_size(every[np.isclose(every["pressure"], pressure)], "y")
            if len(means) > 2:
                heights = own["c"].to_numpy(dtype=np.float64) / (4 * np.pi)
                c, error = float(heights.mean()), float(heights.std(ddof=1)) / len(heights) ** 0.5
                row = {"damping": damping, "pressure": pressure, "c": c, "c_error": error}
                found.append(row | by_logarithm(means, c if damping == "stokes" else 0.0))
    return pd.DataFrame(found)


# drawing --------------------------------------------------------------------------------------------------------------


def draw_elastic_field(tables: EnsembleTables) -> Drawing:
    """Draw the spectrum, both lengths, the screening of waves and viscosities over N, beside theory without a fit."""
    rows = tables.read(NAME)
    whole, shells = whole_fields(rows), shells_of(rows)
    out, (a, b, c, d, e, f) = drawing(NAME, 2, 3, 4.6, 3.9)
    _draw_spectrum(out, a, shells)
    _draw_zeros(out, b, whole)
    _draw_lengths(out, [c, d], tables, whole)
    _draw_screening(out, e, whole, shells)
    _draw_viscosities(out, f, tables, shells)
    out.text = [_numbers(tables, whole, shells)]
    counts = whole[whole["omega"] == 0].groupby("n")["seed"].nunique()
    made = ", ".join(f"{count} of {n}" for n, count in counts.items())
    out.caption = caption(NAME, made=made, long=LONG, few=FEW, low=WINDOW[0], high=WINDOW[1])
    return out


def _draw_spectrum(out: Drawing, axes: Any, shells: pd.DataFrame) -> None:
    scale(axes)
    slow = shells[(shells["omega"] == 0) & (shells["prestress"] == 0)]
    for index, pressure in enumerate(PRESSURES):
        part = slow[slow["pressure"] == pressure]
        seeds = part.groupby("n")["seed"].nunique()
        n = int(seeds.index[seeds >= FEW].max())
        means = part[part["n"] == n].groupby("shell")[["k", "across", "along"]].mean()
        name, look = f"$p = {pressure:g}$ k, $N = {n}$", style(index)
        out.curve(axes, name, means["k"], means["across"], **look)
        look = look | {"linestyle": ":", "fillstyle": "none"}
        out.curve(axes, f"{name}, along", means["k"], means["along"], label=None, **look)
    axes.text(0.7, 0.2, "across $k$", fontsize=9)
    axes.text(0.9, 0.017, "along $k$ (dotted)", fontsize=9)
    axes.set(xlim=(0.05, 8.0), ylim=(1e-3, 40.0))
    label(axes, in_unit("wavenumber $k$", "1/d"), in_unit(r"$n\,k^2 S(k)\,p^{1/2}$", "k$^{1/2}$"), loc="upper left")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _draw_zeros(out: Drawing, axes: Any, whole: pd.DataFrame) -> None:
    scale(axes, y="linear")
    means = zeros_of_boxes(whole)
    for prestress, fill in ((0, "full"), (1, "none")):
        for index, pressure in enumerate(PRESSURES):
            own = select(means, prestress=prestress, pressure=pressure)
            x = own["n"] * 1.07 ** (2 * index - 3 + prestress)  # beside each other
            name = f"$p = {pressure:g}$ k{', pre-stress' if prestress else ''}"
            look = style(index) | {"linestyle": "none", "fillstyle": fill}
            out.curve(axes, name, x, own["mean"], label=None if prestress else "", **look)
            axes.errorbar(x, own["mean"], own["sem"], fmt="none", ecolor=look["color"], elinewidth=1.0)
    ends = [0.6 * means["n"].min(), 1.7 * means["n"].max()]
    out.curve(axes, f"theory: {mean_of_zeros()[0]:.3f}", ends, [mean_of_zeros()[0]] * 2, **LOG)
    out.curve(axes, "published: 1/4", ends, [QUARTER] * 2, **PAPER)
    axes.set_ylim(0.05, 0.36)
    label(axes, "number of disks $N$", r"zero of $C$ over the box, $l/L$", loc="upper right", ncols=2)


def _draw_lengths(out: Drawing, panels: list[Any], tables: EnsembleTables, whole: pd.DataFrame) -> None:
    scale(panels[0])
    for axes, x, y in ((panels[0], "screen", "length"), (panels[1], "degrees", "ratio")):
        for n, prestress in ((32768, 1), (8192, 1), (8192, 0)):
            found = stokes_lengths(tables, n) if n == max(BOTH) else own_lengths(whole, n, prestress)
            found = found.assign(degrees=np.degrees(found["phase"]))
            for index, pressure in enumerate(PRESSURES):
                part = found[np.isclose(found["pressure"], pressure)]
                name = f"$p = {pressure:g}$ k, $N = {n}$"
                look = style(index) | {"linestyle": "none", "fillstyle": "full" if n == max(BOTH) else "none"}
                look |= {"alpha": 0.5} if not prestress else {}
                shown = name if n == max(BOTH) or pressure == min(PRESSURES) else None
                out.curve(axes, f"{name}, pre-stress {prestress}", part[x], part[y], label=shown, **look)
    ends = np.array([4.0, 30.0])
    still, critical = screened_zero(0.0), screened_zero(round(np.pi / 4, 4))
    out.curve(panels[0], f"theory, slow: {still:.2f} $l_s$", ends, still * ends, **LOG)
    out.curve(panels[0], f"theory, critical: {critical:.2f} $l_s$", ends, critical * ends, **LOG | {"linestyle": "--"})
    degrees = np.linspace(0.0, 45.0, 10)
    theory = [screened_zero(round(float(each), 4)) for each in np.radians(degrees)]
    out.curve(panels[1], "theory", degrees, theory, **LOG)
    panels[1].set_ylim(0.3, 0.9)
    label(
        panels[0],
        in_unit(r"$l_s = (|G^*|/n\omega)^{1/2}$", "d"),
        in_unit("length $l$", "d"),
        loc="upper left",
        fontsize=7.5,
    )
    label(panels[1], in_unit("phase of $G^*$", "degrees"), r"$l/l_s$", legend=False)


def _draw_screening(out: Drawing, axes: Any, whole: pd.DataFrame, shells: pd.DataFrame) -> None:
    scale(axes)
    n = 8192
    fields = whole[(whole["n"] == n) & (whole["prestress"] == 0)]
    waves = shells[(shells["n"] == n) & (shells["prestress"] == 0)]
    for index, pressure in enumerate(PRESSURES):
        own = fields[fields["pressure"] == pressure]
        for omega in np.unique(own.loc[own["omega"] > 0, "omega"]):
            fast = own[own["omega"] == omega]
            modulus = fast["storage"].mean() + 1j * (fast["loss"].mean() - omega)
            screen = float(np.sqrt(abs(modulus) / (fast["density"].mean() * omega)))
            if not 4.0 < screen < 25.0:
                continue
            part = waves[(waves["pressure"] == pressure) & waves["seed"].isin(fast["seed"])]
            mean = part[np.isclose(part["omega"], omega)].groupby("shell")[["k", "across"]].mean()
            ratio = mean["across"] / part[part["omega"] == 0].groupby("shell")["across"].mean()
            short = (mean["k"] * screen > 5) & (mean["k"] < 3.0)  # waves that drag does not screen
            named = None if axes.get_legend_handles_labels()[1].count(f"$p = {pressure:g}$ k") else ""
            look = style(index) | {"linestyle": "none", "alpha": 0.7}
            kept = mean["k"] < 3.0
            series = f"$p = {pressure:g}$ k"
            out.curve(
                axes, series, (mean["k"] * screen)[kept], (ratio / ratio[short].mean())[kept], label=named, **look
            )
    k = np.geomspace(0.3, 20, 60)
    for phase, line in ((0.0, "-"), (30.0, "--")):
        name = f"theory, phase {phase:g}°"
        out.curve(
            axes, name, k, screening(k, complex(np.exp(1j * np.radians(phase))), 1.0), **LOG | {"linestyle": line}
        )
    label(axes, r"$k\,l_s$", r"$S_T(k, \omega)/S_T(k, 0)$, over short waves", loc="lower right")


def _draw_viscosities(out: Drawing, axes: Any, tables: EnsembleTables, shells: pd.DataFrame) -> None:
    scale(axes, y="linear")
    found = slopes(tables, shells)
    for damping, fluid, fill in (("stokes", 1.0, "full"), ("contact", 0.0, "none")):
        every = viscosities(tables, damping, fluid)
        for index, pressure in enumerate(PRESSURES[:-1]):
            means = means_by_size(every[np.isclose(every["pressure"], pressure)], "y")
            if means.empty:
                continue
            look = style(index) | {"linestyle": "none", "fillstyle": fill}
            name = f"{damping.title()}, $p = {pressure:g}$ k"
            out.curve(axes, name, means["n"], means["mean"], **look)
            axes.errorbar(means["n"], means["mean"], means["sem"], fmt="none", ecolor=look["color"], elinewidth=1.0)
            if damping == "stokes":
                slope = float(select(found, damping=damping, pressure=pressure)["c"].iloc[0])
                logs = np.log(means["n"] / 1024.0)
                weight = 1 / means["sem"] ** 2
                height = float((weight * (means["mean"] - slope * logs)).sum() / weight.sum())
                line = {"color": look["color"], "linewidth": 1.2}
                out.curve(axes, f"theory, {name}", means["n"], height + slope * logs, label=None, **line)
    axes.set_ylim(0.0, 0.5)
    label(
        axes,
        "$N$",
        in_unit(r"$(\eta_0 - \eta_F)\,p^{1/2}$", r"k$^{3/2}\tau_1$"),
        loc="upper left",
        ncols=2,
        fontsize=7.5,
    )


def _numbers(tables: EnsembleTables, whole: pd.DataFrame, shells: pd.DataFrame) -> TextTable:
    """The three statements beside the data."""
    rows = []
    means = zeros_of_boxes(whole)
    for prestress in (0, 1):
        own = means[(means["prestress"] == prestress) & (means["n"] >= LARGE)]
        pooled = float((own["mean"] * own["count"]).sum() / own["count"].sum())
        error = float(np.sqrt(((own["sem"] * own["count"]) ** 2).sum()) / own["count"].sum())
        refined = [mean_of_zeros(*share_and_angle(shells, p))[0] for p in own["pressure"]]
        tests = [
            float((((own["mean"] - wanted) / own["sem"]) ** 2).sum())
            for wanted in (mean_of_zeros()[0], refined, QUARTER)
        ]
        name = "l/L, mean of zeros" + (", pre-stress" if prestress else "")
        theory = f"{mean_of_zeros()[0]:.3f}; with S_L and angles {min(refined):.3f} to {max(refined):.3f}"
        chi = f"{tests[0]:.0f}; {tests[1]:.0f}; 1/4: {tests[2]:.0f} of {len(own)}"
        rows.append((name, theory, f"{pooled:.4f}({round(1e4 * error):d})", chi))
    found = stokes_lengths(tables, max(BOTH))
    left, off = scatter(found), found["ratio"] / found["theory"]
    theory = f"{found['theory'].min():.2f} to {found['theory'].max():.2f}"
    here = (
        f"{found['ratio'].mean():.3f}, s.d. {found['ratio'].std():.3f}; over theory {off.min():.2f} to {off.max():.2f}"
    )
    rows.append((f"l/l_s, N = {max(BOTH)}, {len(found)} lengths", theory, here, ""))
    words = ", ".join(f"{name} {value:.3f}" for name, value in left.items())
    rows.append(("s.d. of ln l", "", words, ""))
    for row in slopes(tables, shells).to_dict("records"):
        data = f"{row['B']:.4f}({round(1e4 * row['error']):d})"
        others = f"free {row['free']:.1f}, constant {row['constant']:.0f}, power {row['power']:.1f}"
        chi = f"{row['theory']:.1f}; {others} of {row['sizes']:d}"
        theory = f"{row['c']:.4f}({round(1e4 * row['c_error']):d})" if row["damping"] == "stokes" else "0"
        rows.append((f"B, {row['damping']}, p = {row['pressure']:g}", theory, data, chi))
    return TextTable(("number", "theory", "data", "chi² of theory; others"), rows, words=True)


STUDY = Study(NAME, "Non-affine displacements as one transverse elastic field", tasks(), draw_elastic_field)
