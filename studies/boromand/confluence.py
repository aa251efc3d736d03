"""Draw the contacts that are missing below confluence in Boromand et al.: figs 7 and 9."""

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.statistics.power_laws import fit_exponent, power_law
from studies import published_numbers as published
from studies.claims import Kind, halves, write_by, write_list
from studies.conventions import FRACTIONS, SIZES, select_below_confluence
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    FEWEST,
    Ensemble,
    ensemble,
    groups_by,
    has,
    line_in_inverse,
    log_places,
    mean_curve,
    mean_over_packings,
    nearest_size,
    sampled_sizes,
    scaled,
    sizes,
    unmeasured,
    vary_bootstrap,
)
from studies.panels import PAPER, Drawing, drawing, label, model_style, scale, size_style

CONFLUENT = (3e-3, 0.1)  # rho* - rho between which the exponent is fitted


def figure_7(tables: EnsembleTables) -> Drawing:
    """z_conf - z against rho* - rho, and both times N."""
    states = tables.states
    out, axes = drawing("boromand-7", 2, 2, 5.0, 3.9)
    reached = []
    for model, plain, times_n in (("sp", axes[0], axes[1]), ("dp", axes[2], axes[3])):
        scale(plain, times_n)
        curves: dict[int, Ensemble] = {}
        for n in sizes(states, model):
            every = states[(states["model"] == model) & (states["n"] == n)]
            part = select_below_confluence(every)
            if part.empty:
                continue
            reached.append(f"{part['seed'].nunique()} of {every['seed'].nunique()} {model.upper()} of N = {n}")
            e = ensemble(part, model, n, "to_confluence", "missing", log_places(1e-6, 0.13, 4))
            x, y = e.band
            look = {"linestyle": "none"} | size_style(n)
            out.curve(plain, f"N = {n}", x, y, **look)
            out.curve(times_n, f"N = {n}", x * n, scaled(y, n), **look)
            curves[n] = e
        if model == "sp":
            limit = published.MISSING_CONTACTS_LIMIT.value
            out.curve(times_n, f"paper: limit {limit:g}", [1e-3, 30], [limit, limit], **PAPER)
        else:
            out.slope(plain, published.MISSING_CONTACTS_EXPONENT.value, (3e-3, 1e-1), 0.02)
        name = model.upper()
        label(plain, rf"{name}: $\rho^* - \rho$", r"$z_{conf} - z$", legend=bool(curves), loc="lower right")
        label(times_n, rf"{name}: $(\rho^* - \rho)\,N$", r"$(z_{conf} - z)\,N$", legend=bool(curves), loc="upper left")
        sampled = sampled_sizes(states, model)
        shown = {n: e for n, e in curves.items() if n in sampled and len(e.y) >= FEWEST}
        if model == "sp":
            _claim_disks(out, shown)
        else:
            most = max(shown, default=0)
            below = select_below_confluence(states[(states["model"] == model) & (states["n"] == most)])
            fine = (
                ensemble(below, model, most, "to_confluence", "missing", log_places(*CONFLUENT, 10)) if most else None
            )
            _claim_droplets(out, shown, fine)
        _claim_collapse(out, name, shown)
    out.caption = (
        "Missing contacts below confluence, z_conf = 6 at rho* of each packing. Packings that never reach z = 6 are "
        f"left out; those that do: {', '.join(reached)}. Right: both times N. Dashed: limit 2 (SP) and slope 1 (DP) of "
        "the paper."
    )
    return out


def _claim_disks(out: Drawing, curves: dict[int, Ensemble]) -> None:
    """Claim the contacts that disks miss at the smallest distance that any size has."""
    found, words = None, {"how": "no sp packing reaches z = 6"}
    if curves:
        distance, n = min((float(np.nanmin(e.x)), n) for n, e in curves.items())
        found = curves[n].interval(lambda x, y: y[np.nanargmin(x)] * n)
        least = {m: float(curves[m].mean[1][0]) * m for m in sorted(curves)}
        out.keep("(z_conf - z) N at the least distance, SP", list(least.values()), N=least)
        text = ", ".join(f"{value:.2f} at N = {m}" for m, value in least.items())
        words = {"how": f"N = {n}, rho* - rho = {distance:.2g}, rho* of each packing", "shown_by": "boromand-7 b"}
        words["cause"] = f"at the least distance of each size it is {text}"
    text = "(z_conf - z) N nearest to rho*, SP"
    out.claim(
        text, found, published.MISSING_CONTACTS_LIMIT, kind=Kind.IDENTITY, **words
    )  # one contact short is 2 by counting


def _claim_collapse(out: Drawing, model: str, curves: dict[int, Ensemble]) -> None:
    """Claim that (z_conf - z) N is one curve of (rho* - rho) N: its exponent in N where (rho* - rho) N = 1. Nearest to
    rho* one contact is missing, which makes it 2 at every N by counting."""
    n, (found, every), cause = sorted(curves), unmeasured(), ""
    if len(n) > 1:
        groups = [curves[m].curves for m in n]

        def exponent(drawn: list[Array], scaled_distance: float = 1.0) -> float:
            mean = [mean_curve(part) for part in drawn]
            values = [m * np.interp(scaled_distance / m, x, y) for m, (x, y) in zip(n, mean, strict=True)]
            return float(np.polyfit(np.log(n), np.log(values), 1)[0])

        found, every = vary_bootstrap(groups, exponent, *({"scaled_distance": x} for x in (0.25, 2.0, 4.0)))
        each = {m: fit_exponent(*curves[m].between(*CONFLUENT).mean) for m in n}
        out.keep(f"exponent of z_conf - z, {model}", list(each.values()), N=each)
        cause = f"6 - z has an exponent of {write_by(each, '.2f')} in rho* - rho, and only 1 scales so"
    words = {"how": f"N = {write_list(n)}, (rho* - rho) N = 1", "cause": cause, "shown_by": "boromand-7 b and d"}
    text = f"exponent of (z_conf - z) N in N, {model}"
    out.claim(text, found, published.COLLAPSE_OF_SIZES, family=every, **words)


def _claim_droplets(out: Drawing, curves: dict[int, Ensemble], fine: Ensemble | None = None) -> None:
    """Claim the exponent of missing contacts of droplets in the largest size."""
    slope, every, words = None, None, {"how": "no dp packing reaches z = 6"}
    if curves:
        n = max(curves)

        def exponent(x: Array, y: Array, low: float = CONFLUENT[0], high: float = CONFLUENT[1]) -> float:
            return float(power_law(x, y, low=low, high=high).exponents[0])

        slope, every = curves[n].varied(exponent, *halves(*CONFLUENT))
        if fine is not None:
            every["10 places a decade"] = fine.interval(exponent)
        words = {"how": f"N = {n}, {CONFLUENT[0]:g} < rho* - rho < {CONFLUENT[1]:g}", "shown_by": "boromand-7 c and d"}
        words["cause"] = _explain_exponent(out, curves)
    text = "exponent of z_conf - z in rho* - rho, DP"
    out.claim(text, slope, published.MISSING_CONTACTS_EXPONENT, family=every, **words)


def _explain_exponent(out: Drawing, curves: dict[int, Ensemble]) -> str:
    """Write the exponents in each size, and keep that of the largest where five contacts or more are missing."""
    each = {n: fit_exponent(*e.between(*CONFLUENT).mean) for n, e in curves.items()}
    x, y = curves[max(curves)].mean
    many = (y * max(curves) > 10) & (x < CONFLUENT[1])
    far = ""
    if many.sum() > 2:
        value = out.keep("exponent of z_conf - z where five or more are missing, DP", fit_exponent(x[many], y[many]))
        far = f"; {value:.3g} where five or more are missing"
    return f"the last contact holds z at 6 - 2/N': the exponent is {write_by(each, '.3g')}{far}"


def _approach_to_unity(states: pd.DataFrame, n: int) -> Ensemble:
    """Arrange 6 - z of droplets over 1 - rho, up to z = 6."""
    near = select_below_confluence(states[(states["model"] == "dp") & (states["n"] == n)])
    return ensemble(near.assign(left=1 - near["rho"]), "dp", n, "left", "missing", log_places(5e-3, 0.13, 8))


def _near_unity(x: Array, y: Array, low: float = 5e-3, high: float = 0.1) -> float:
    return float(power_law(x, y, low=low, high=high).exponents[0])


def _keep_confluence(out: Drawing, states: pd.DataFrame) -> str:
    """Keep where droplets of each size reach z = 6, and the exponent in 1 - rho there: whether rho* tends to 1."""
    full = states[(states["model"] == "dp") & (states["z"] >= 6)]
    measured = [n for n in sampled_sizes(states, "dp") if n in set(full["n"])]
    if not measured:
        return ""
    first = full.groupby(["n", "seed"])["rho"].min().groupby("n").mean()
    reached = out.keep("1 - rho where z = 6, DP", [1 - first[n] for n in measured], N=measured)
    slopes = [_approach_to_unity(states, n).interval(_near_unity) for n in measured]
    out.keep("exponent of z_conf - z in 1 - rho, DP", slopes, N=measured)
    ends = f"z = 6 is reached at 1 - rho = {write_list(reached, '.4f')}"
    return f"{ends}, and the exponent is {write_list(slopes, '.2f')}, at N = {write_list(measured)}"


def _claim_confluent_limit(out: Drawing, states: pd.DataFrame) -> None:
    """Claim 1 - rho* in the limit of large packings, linear in 1/N; the family leaves a size out."""
    full = states[(states["model"] == "dp") & (states["z"] >= 6)]
    first = full.groupby(["n", "seed"])["rho"].min()
    n = [m for m in sampled_sizes(states, "dp") if m in set(full["n"]) and m in SIZES]
    found, every, how = None, None, "needs two sizes that reach z = 6"
    if len(n) > 1:
        groups = [1 - first[m].to_numpy(dtype=np.float64) for m in n]

        def limit(groups: list[Array], without: int = len(n)) -> float:
            kept = [k for k in range(len(n)) if k != without]
            return line_in_inverse([n[k] for k in kept], [groups[k] for k in kept])[0]

        ends = [{"without": 0}, {"without": len(n) - 1}] if len(n) > 2 else []
        found, every = vary_bootstrap(groups, limit, *ends)
        how = f"linear in 1/N, N = {write_list(n)}"
    words = {"how": how, "cause": "1 - rho* hardly falls with N", "shown_by": "boromand-9 a"}
    out.claim("1 - rho* of large N, DP", found, published.CONFLUENT_LIMIT, family=every, **words)


def _claim_distance(out: Drawing, states: pd.DataFrame) -> None:
    """Claim how far from onset packings are confluent, that is where they reach z = 6; family: sizes, and rho = 1."""
    for model in ("sp", "dp"):
        first = states[(states["model"] == model) & (states["z"] >= 6)].groupby(["n", "seed"])["d_rho"].min()
        n = [m for m in sampled_sizes(states, model) if m in first.index and m in SIZES]
        found, every, how = None, {}, f"no {model} packing reaches z = 6"
        if n:
            each = {m: mean_over_packings([first[m].to_numpy()])[0] for m in n}
            found, how = each.pop(n[0]), f"N = {n[0]}, where z = 6"
            every = {f"N = {m}": each[m] for m in n[1:]}
            onset = states[(states["model"] == model) & (states["state"] == 0)]
            left = mean_over_packings([1 - rho for rho in groups_by(onset, "n", "rho", n)])
            every |= {f"rho = 1, N = {m}": left[k] for k, m in enumerate(n)}
        text, words = f"drho at confluence, {model.upper()}", {"how": how, "shown_by": "boromand-9 a"}
        out.claim(text, found, published.AT_CONFLUENCE, family=every, **words)


def figure_9(tables: EnsembleTables) -> Drawing:
    """z(rho) and rho(A) of polygons, the curves that the paper lays over its experiments."""
    states = tables.states
    out, (a, b) = drawing("boromand-9", 1, 2, 5.0, 4.0)
    slope, how, cause, every = None, "no dp packings", "", None
    for model in ("sp", "dp"):
        if not has(states, model):
            continue
        n = nearest_size(states, model, 64)
        x, y = ensemble(states, model, n, "rho", "z", FRACTIONS).band
        out.curve(a, f"{model.upper()}, N = {n}", x, y, **model_style(model, linestyle="-"))
        x, y = ensemble(states, model, n, "rho", "excess", FRACTIONS).band
        out.curve(b, f"{model.upper()}, N = {n}", y.value, x, **model_style(model, linestyle="-"))
        if model == "dp":
            how, cause = f"N = {n}, rho > 0.9", _keep_confluence(out, states)
            e = _approach_to_unity(states, n)
            slope, every = e.varied(_near_unity, *halves(5e-3, 0.1))
    label(a, r"true packing fraction $\rho$", "coordination z", loc="upper left")
    label(
        b, r"$\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)", r"true packing fraction $\rho$", loc="lower right"
    )
    _claim_distance(out, states)
    text, words = "exponent of z_conf - z in 1 - rho, DP", {"how": how, "cause": cause, "shown_by": "boromand-9 a"}
    out.claim(text, slope, published.MISSING_CONTACTS_EXPONENT, family=every, **words)
    _claim_confluent_limit(out, states)
    how = "the points of emulsions and foams are printed in no table, and the stored text has no picture"
    for curve in ("z over rho", "rho over A - 1"):
        out.claim(f"{curve}: droplets less experiments", None, published.EXPERIMENTS, how=how)
    out.caption = (
        "The curves that the paper compares with micrographs. Its experimental points are printed in no table and are "
        "not redrawn: read your own with `jamlab.read_points` and `jamlab.micrograph`."
    )
    return out
