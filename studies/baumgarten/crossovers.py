"""Claim where the regimes of G* end in Baumgarten & Tighe: at frequencies of order p, and of order 1."""

from collections.abc import Callable
from functools import partial

import numpy as np

from jamlab.arrays import Array
from jamlab.rheology.critical_scaling import CRITICAL, HIGHEST
from jamlab.statistics.power_laws import power_law
from studies import published_numbers as published
from studies.baumgarten.spectral_groups import Group
from studies.claims import write_interval
from studies.ensembles import bootstrap, part_of, unmeasured, vary_bootstrap
from studies.panels import Drawing

_CLAIMS = (
    ("exponent in p of the crossover to affine motion", published.CROSSOVER_TO_AFFINE, "a"),
    ("decades of omega/p where the quasistatic regime ends", published.QUASISTATIC_ENDS, "b"),
    ("decades of omega where the critical regime ends", published.CRITICAL_ENDS, "a"),
)


def claim_crossovers(out: Drawing, groups: dict[float, Group], unstressed: dict[float, Group]) -> None:
    """Claim where the law omega^0.5 through G'' at one frequency meets eta_0 omega and eta_inf omega, at the lowest
    pressure, and how the second goes with pressure; the family holds other frequencies, and the highest pressure.
    Beside them stand those of the same packings without pre-stress."""
    wide, plain = ({p: g for p, g in held.items() if CRITICAL * p < HIGHEST} for held in (groups, unstressed))
    varied = unmeasured()
    if len(wide) > 2:
        varied = vary_bootstrap(_drawn(wide), _numbers(wide), {"at": 0.05}, {"at": 0.2}, {"pressure": 0})
    without = bootstrap(_drawn(plain), _numbers(plain)) if len(plain) > 2 else None
    how = f"{len(wide)} pressures down to p = {min(wide, default=np.nan):g}, root law through G'' at {HIGHEST:g}"
    for k, (text, paper, panel) in enumerate(_CLAIMS):
        found, every = part_of(varied, k)
        words = {"how": how, "shown_by": f"baumgarten-3 {panel}"}
        if without is not None:
            words["cause"] = (
                f"without pre-stress it is {write_interval(out.keep(f'{text}, no pre-stress', without[k]))}"
            )
        out.claim(text, found, paper, family=every, **words)


def _drawn(groups: dict[float, Group]) -> list[Array]:
    """(packings, 2 + frequencies) eta_0, eta_inf and G'' at each pressure."""
    return [np.column_stack([g.eta0, g.eta_inf, g.loss]) for g in groups.values()]


def _numbers(groups: dict[float, Group]) -> Callable[..., Array]:
    """What computes the three numbers from packings that are drawn."""
    return partial(_ends, list(groups), [g.omega for g in groups.values()])


def _ends(p: list[float], omega: list[Array], drawn: list[Array], at: float = HIGHEST, pressure: int = -1) -> Array:
    """Compute the three numbers of `_CLAIMS` of packings (eta_0, eta_inf, G'')."""
    means = [packings.mean(axis=0) for packings in drawn]
    roots = np.array([np.interp(at, w, mean[2:]) / at**0.5 for w, mean in zip(omega, means, strict=True)])
    slow, fast = np.square(roots / np.array([mean[:2] for mean in means]).T)
    return np.array([power_law(p, fast).exponents[0], np.log10(slow[pressure] / p[pressure]), np.log10(fast[pressure])])
