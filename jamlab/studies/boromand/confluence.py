"""Draw the contacts that are missing below confluence in Boromand et al., fig 7."""

from functools import partial

import numpy as np

from jamlab.arrays import Array
from jamlab.statistics import published_numbers as published
from jamlab.statistics.power_laws import power_law
from jamlab.studies.claims import Kind, halves, vary, write_by, write_list
from jamlab.studies.conventions import fit_exponent, select_below_confluence
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import Ensemble, bootstrap, ensemble, log_places, mean_curve, sampled_sizes, scaled, sizes
from jamlab.studies.panels import PAPER, Drawing, drawing, label, scale, size_style

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
        shown = {n: e for n, e in curves.items() if n in sampled}
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
        text, found, published.MISSING_CONTACTS_LIMIT, Kind.IDENTITY, **words
    )  # one contact short is 2 by counting


def _claim_collapse(out: Drawing, model: str, curves: dict[int, Ensemble]) -> None:
    """Claim that (z_conf - z) N is one curve of (rho* - rho) N: its exponent in N where (rho* - rho) N = 1.

    Nearer to rho* one contact is missing, which makes it 2 at every N by counting.
    """
    n, found, every = sorted(curves), None, {}
    if len(n) > 1:
        groups = [curves[m].curves for m in n]

        def exponent(drawn: list[Array], scaled_distance: float = 1.0) -> float:
            mean = [mean_curve(part) for part in drawn]
            values = [m * np.interp(scaled_distance / m, x, y) for m, (x, y) in zip(n, mean, strict=True)]
            return float(np.polyfit(np.log(n), np.log(values), 1)[0])

        found = bootstrap(groups, exponent)
        every = vary(partial(exponent, groups), {"scaled_distance": 2.0}, {"scaled_distance": 4.0})
    words = {"how": f"N = {write_list(n)}, (rho* - rho) N = 1", "shown_by": "boromand-7 b and d"}
    words["cause"] = "far from rho* z is a function of rho* - rho, whatever N: z N rises with N"
    text = f"exponent of (z_conf - z) N in N, {model}"
    out.claim(text, found, published.COLLAPSE_OF_SIZES, Kind.MEASURED, every, **words)


def _claim_droplets(out: Drawing, curves: dict[int, Ensemble], fine: Ensemble | None = None) -> None:
    """Claim the exponent of missing contacts of droplets in the largest size."""
    slope, every, words = None, None, {"how": "no dp packing reaches z = 6"}
    if curves:
        n = max(curves)

        def exponent(x: Array, y: Array, low: float = CONFLUENT[0], high: float = CONFLUENT[1]) -> float:
            return float(power_law(x, y, low=low, high=high).exponents[0])

        slope = curves[n].interval(exponent)
        every = vary(partial(exponent, *curves[n].mean), *halves(*CONFLUENT))
        if fine is not None:
            every |= vary(lambda points: exponent(*fine.mean), {"points": "10 a decade"})
        words = {"how": f"N = {n}, {CONFLUENT[0]:g} < rho* - rho < {CONFLUENT[1]:g}", "shown_by": "boromand-7 c and d"}
        words["cause"] = _explain_exponent(out, curves)
    text = "exponent of z_conf - z in rho* - rho, DP"
    out.claim(text, slope, published.MISSING_CONTACTS_EXPONENT, Kind.MEASURED, every, **words)


def _explain_exponent(out: Drawing, curves: dict[int, Ensemble]) -> str:
    """Keep the exponents in each size, and that of the largest where five contacts or more are missing."""
    each = {n: fit_exponent(*e.between(*CONFLUENT).mean) for n, e in curves.items()}
    out.keep("exponent of z_conf - z, DP", list(each.values()), N=each)
    x, y = curves[max(curves)].mean
    many = (y * max(curves) > 10) & (x < CONFLUENT[1])
    far = ""
    if many.sum() > 2:
        value = out.keep("exponent of z_conf - z where five or more are missing, DP", fit_exponent(x[many], y[many]))
        far = f"; {value:.3g} where five or more are missing"
    return f"the last contact holds z at 6 - 2/N': the exponent is {write_by(each, '.3g')}{far}"
