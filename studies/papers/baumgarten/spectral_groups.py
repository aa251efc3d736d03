"""Select the spectra that figures of Baumgarten & Tighe are drawn from, and group them by pressure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.rheology.complex_modulus import ComplexModulus
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import FEWEST, select

SIZE = 32_768  # disks of figs 1, 3 to 6, in boxes of fixed shape as in the paper
SCANNED = {"n": 2048, "target_pressure": 1e-4}  # packings under many values of beta and eta_F
FIXED, STABILIZED = "fixed-box", "shear-stabilized"
LARGE = 25.0  # p N^2 from which packings take part in fits of exponents: below, their size decides, fig 8
LAWS: dict[str, dict[str, Any]] = {
    "contact": {"law": "contact", "beta": 1.0},
    "stokes": {"law": "stokes", "eta_f": 1.0},
    "undamped": {"law": "contact", "beta": 0.0},
}


@dataclass(frozen=True)
class Group:
    """Packings of one pressure under one law."""

    seeds: NDArray[np.int64]  # (packings,) of the packings, ascending
    omega: Array  # (m,) frequencies
    # storage, loss: (packings, m)
    storage: Array
    loss: Array
    # g0, eta0, eta_inf: (packings,)
    g0: Array
    eta0: Array
    eta_inf: Array

    def at(self, kept: NDArray[np.bool_]) -> "Group":
        """Cut the packings to some of the frequencies, (m,) bool."""
        return replace(self, omega=self.omega[kept], storage=self.storage[:, kept], loss=self.loss[:, kept])

    def members(self) -> list[ComplexModulus]:
        """List the spectra of single packings, the form that `jamlab.collapse` takes."""
        none = np.full(self.omega.shape, np.nan)
        return [
            ComplexModulus(self.omega, up, down, float(g0), float(eta0), float(eta_inf), "table", none)
            for up, down, g0, eta0, eta_inf in zip(
                self.storage, self.loss, self.g0, self.eta0, self.eta_inf, strict=True
            )
        ]


def group_by_pressure(table: pd.DataFrame) -> dict[float, Group]:
    """Group rows of one law by pressure, descending; packings with a modulus that is not positive are left out."""
    out = {}
    for p in table["target_pressure"].unique().tolist():
        part = table[table["target_pressure"] == p]
        wide = part.pivot_table(index="seed", columns="omega", values=["storage", "loss"]).dropna()
        up, down = (wide[name].to_numpy(dtype=np.float64) for name in ("storage", "loss"))
        stable: NDArray[np.bool_] = np.asarray((up > 0).all(axis=1) & (down > 0).all(axis=1))
        if not stable.any():
            continue
        seeds = wide.index.to_numpy(dtype=np.int64)[stable]
        ends = part.drop_duplicates("seed").set_index("seed").loc[seeds]
        omega = wide["storage"].columns.to_numpy(dtype=np.float64)
        limits = (ends[name].to_numpy(dtype=np.float64) for name in ("g0", "eta0", "eta_inf"))
        out[p] = Group(seeds, omega, up[stable], down[stable], *limits)
    return dict(sorted(out.items(), reverse=True))


@cache
def spectra(tables: EnsembleTables, law: str, prestress: bool = True, n: int = SIZE) -> dict[float, Group]:
    """Give the spectra of one of the `LAWS` by pressure, descending."""
    return group_by_pressure(select(tables.spectra, n=n, ensemble=FIXED, prestress=prestress, **LAWS[law]))


def sampled(groups: dict[float, Group], large: bool = True) -> dict[float, Group]:
    """Select the pressures with enough packings for an interval, of which p N^2 is large enough for fits."""
    return {p: g for p, g in groups.items() if len(g.g0) >= FEWEST and (not large or p * SIZE**2 >= LARGE)}


def scan(tables: EnsembleTables, law: str, parameter: str) -> dict[float, Group]:
    """Give the spectra at the scanned size and pressure, with pre-stress, by the value of a parameter of damping."""
    rows = select(tables.spectra, law=law, prestress=True, ensemble=FIXED, **SCANNED)
    values: list[float] = sorted(rows[parameter].unique().tolist())
    found = {value: group_by_pressure(rows[rows[parameter] == value]) for value in values}
    return {value: next(iter(groups.values())) for value, groups in found.items() if groups}


def same_packings(groups: Sequence[Group]) -> Array:
    """Arrange (packings, groups) eta_0 of the packings that all groups have: under one law some may not be stable."""
    shared = set.intersection(*(set(g.seeds.tolist()) for g in groups))
    return np.column_stack([g.eta0[np.isin(g.seeds, list(shared))] for g in groups])


def format_power(p: float) -> str:
    """Format a number as 10^n, or a x 10^n, in mathtext."""
    exponent = int(np.floor(np.log10(p) + 1e-9))
    if exponent in (-1, 0, 1):
        return f"{p:.2g}"
    front = p / 10.0**exponent
    return f"10^{{{exponent}}}" if abs(front - 1) < 1e-6 else rf"{front:.2g}\times 10^{{{exponent}}}"
