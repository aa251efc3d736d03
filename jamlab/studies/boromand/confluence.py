"""Figure 7 of [B]: contacts that are missing below confluence."""

import numpy as np
import pandas as pd

from jamlab.statistics import published_numbers as published
from jamlab.statistics.power_laws import power_law
from jamlab.studies import conventions
from jamlab.studies.boromand.contacts_and_modulus import between
from jamlab.studies.claims import Claim, claim
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import Ensemble, ensemble, log_places, sampled_sizes, sizes
from jamlab.studies.panels import PAPER, Drawing, drawing, label, scale, size_style

CONFLUENT = (3e-3, 0.1)  # rho* - rho between which the exponent is fitted
COUNTED = "one contact short of z = 6 is (6 - z) N' = 2 by counting in both models: 0 for droplets excludes 2 for disks"


def figure_7(tables: EnsembleTables) -> Drawing:
    """z_conf - z against rho* - rho, and both times N."""
    states = tables.states
    out, axes = drawing("boromand-7", 2, 2, 5.0, 3.9)
    reached = []
    for model, plain, scaled in (("sp", axes[0], axes[1]), ("dp", axes[2], axes[3])):
        scale(plain)
        scale(scaled)
        curves: dict[int, Ensemble] = {}
        for n in sizes(states, model):
            every = states[(states["model"] == model) & (states["n"] == n)]
            part = select_below_confluence(every)
            if part.empty:
                continue
            reached.append(f"{part['seed'].nunique()} of {every['seed'].nunique()} {model.upper()} of N = {n}")
            e = ensemble(part, model, n, "to_confluence", "missing", log_places(1e-6, 0.13, 4))
            x, y = e.band()
            out.curve(plain, f"N = {n}", x, y.value, y.low, y.high, linestyle="none", **size_style(n))
            out.curve(
                scaled, f"N = {n}", x * n, *(v * n for v in (y.value, y.low, y.high)), linestyle="none", **size_style(n)
            )
            curves[n] = e
        if model == "sp":
            limit = published.MISSING_CONTACTS_LIMIT["sp"].value
            out.curve(scaled, f"paper: limit {limit:g}", [1e-3, 30], [limit, limit], **PAPER)
        else:
            out.slope(plain, published.MISSING_CONTACTS_EXPONENT.value, (3e-3, 1e-1), 0.02)
        name = model.upper()
        label(plain, rf"{name}: $\rho^* - \rho$", r"$z_{conf} - z$", legend=bool(curves), loc="lower right")
        label(scaled, rf"{name}: $(\rho^* - \rho)\,N$", r"$(z_{conf} - z)\,N$", legend=bool(curves), loc="upper left")
        sampled = sampled_sizes(states, model)
        out.claims += _confluence_claims(out.name, model, {n: e for n, e in curves.items() if n in sampled})
    out.caption = (
        "Missing contacts below confluence, z_conf = 6 at rho* of each packing. Packings that never reach z = 6 are "
        f"left out; those that do: {', '.join(reached)}. Right: both times N. Dashed: limit 2 (SP) and slope 1 (DP) of "
        "the paper."
    )
    return out


def select_below_confluence(states: pd.DataFrame) -> pd.DataFrame:
    """Select states of one size below the first with z >= 6; adds to_confluence = rho* - rho and missing = 6 - z."""
    full = states[states["z"] >= 6].groupby("seed")["rho"].min().rename("rho_star")
    s = states.join(full, on="seed").dropna(subset=["rho_star"])
    s = s[(s["rho"] < s["rho_star"]) & (s["z"] < 6)]
    return s.assign(to_confluence=s["rho_star"] - s["rho"], missing=6 - s["z"])


def _confluence_claims(name: str, model: str, curves: dict[int, Ensemble]) -> list[Claim]:
    """Missing contacts at the smallest distance that any size has, and their exponent in the largest."""
    found = slope = None
    how = ending = f"no {model} packing reaches z = 6"
    words: dict[str, str] = {}
    if curves:
        distance, n = min((float(np.nanmin(e.x)), n) for n, e in curves.items())
        found = curves[n].interval(lambda x, y: y[np.nanargmin(x)] * n)
        how = f"N = {n}, rho* - rho = {distance:.2g}, rho* of each packing"
        missing = ", ".join(f"{float(curves[m].mean[1][0]) * m:.2f} at N = {m}" for m in sorted(curves))
        words = {"cause": f"at the least distance of each size it is {missing}", "shown_by": "boromand-7 b"}
        largest = max(curves)
        slope = curves[largest].interval(lambda x, y: power_law(x, y, low=CONFLUENT[0], high=CONFLUENT[1]).exponents[0])
        ending = f"N = {largest}, {CONFLUENT[0]:g} < rho* - rho < {CONFLUENT[1]:g}"
    if model == "dp":
        words = {"contradiction": COUNTED, "shown_by": "boromand-7 d"}
    paper, exponent = published.MISSING_CONTACTS_LIMIT[model], published.MISSING_CONTACTS_EXPONENT
    limit = claim(name, f"(z_conf - z) N nearest to rho*, {model.upper()}", found, paper, how=how, **words)
    if model == "sp":
        return [limit]
    text = "exponent of z_conf - z in rho* - rho, DP"
    cause = _exponents_of_sizes(curves)
    return [limit, claim(name, text, slope, exponent, how=ending, cause=cause, shown_by="boromand-7 c and d")]


def _exponents_of_sizes(curves: dict[int, Ensemble]) -> str:
    """Exponents in each size, and of the largest where five contacts or more are missing."""
    if not curves:
        return ""
    each = {n: conventions.fit_exponent(*between(e, *CONFLUENT).mean) for n, e in curves.items()}
    x, y = curves[max(curves)].mean
    many = (y * max(curves) > 10) & (x < CONFLUENT[1])
    far = f"; {conventions.fit_exponent(x[many], y[many]):.3g} where five or more are missing" if many.sum() > 2 else ""
    found, names = ", ".join(f"{v:.3g}" for v in each.values()), ", ".join(str(n) for n in each)
    return f"the last contact holds z at 6 - 2/N': the exponent is {found} at N = {names}{far}"
