"""Measure mu, lambda and Delta of Baumgarten & Tighe by the collapse of spectra, with exponents of G_0 beside them."""

import numpy as np
import pandas as pd

from jamlab.errors import InputError
from jamlab.rheology.critical_scaling import collapse
from jamlab.statistics import published_numbers as published
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.power_laws import power_law
from jamlab.studies.baumgarten.spectral_groups import (
    LARGE,
    cut_to_shared_frequencies,
    group_by_pressure,
    select_large,
    select_law,
)
from jamlab.studies.claims import Claim, claim
from jamlab.studies.ensembles import FEWEST

RESAMPLES = 60  # each is a fit: seconds for a figure


def exponent_claims(name: str, table: pd.DataFrame, law: str, parameters: dict[str, float]) -> list[Claim]:
    """Claims on mu, lambda and Delta, with the half-widths that `jamlab.collapse` gives.

    Args:
        table: spectra of one law and size, with pre-stress and without.
        parameters: of the law.
    """
    n = int(table["n"].iloc[0])
    kind = "contact" if "beta" in parameters else "stokes"
    stressed = select_law(table, kind, prestress=True, **parameters)
    groups = select_large(group_by_pressure(stressed), n)
    values: list[tuple[float, float]] = [(np.nan, np.nan)] * 3
    how = f"needs three pressures with p N^2 > {LARGE:g} and {FEWEST} packings each"
    cause = ""
    if len(groups) >= 3 and min(len(g.g0) for g in groups.values()) >= FEWEST:
        try:
            members = [g.members() for g in cut_to_shared_frequencies(groups).values()]
            fit = collapse(list(groups), members, resamples=RESAMPLES)
            values = [(fit.mu, fit.mu_error), (fit.lam, fit.lam_error), (fit.exponent, fit.exponent_error)]
            stable, asked = sum(len(g.g0) for g in groups.values()), stressed["seed"].nunique() * len(groups)
            how = (
                f"N = {n}, collapse of {len(groups)} pressures, omega < 0.1, {stable} of {asked} packings stable, "
                f"spread {fit.spread:.2g} in ln G*"
            )
            cause = _static_exponents(table, kind, parameters, n)
        except InputError as error:
            how = str(error)
    names = ("mu: G_0 ~ p^mu", "lambda: tau* ~ p^-lambda", "Delta: G* ~ omega^Delta")
    return [
        claim(
            name,
            f"{text}, {law}",
            Interval(np.array(v), np.array(v - e), np.array(v + e)),
            paper,
            how=f"{how}; {cause}" if cause else how,
            cause=cause if paper is published.MU else "",
            shown_by=f"{name} a",
        )
        for text, (v, e), paper in zip(names, values, (published.MU, published.LAMBDA, published.DELTA), strict=True)
    ]


def _static_exponents(table: pd.DataFrame, kind: str, parameters: dict[str, float], n: int) -> str:
    """Exponents of G_0 itself in p, with pre-stress and without it, as text."""
    found = []
    for prestress in (True, False):
        try:
            rows = select_law(table, kind, prestress=prestress, **parameters)
        except InputError:
            continue
        groups = select_large(group_by_pressure(rows), n)
        slope = power_law(list(groups), [g.g0.mean() for g in groups.values()]).exponents[0]
        found.append(f"{slope:.2f} {'with' if prestress else 'without'} pre-stress")
    return f"G_0 alone rises with p^{' and '.join(found)}"
