"""Select the rows of spectra that figures are drawn from, and group them by law and pressure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.rheology.complex_modulus import ComplexModulus
from studies.ensembles import FEWEST, enough

FIXED, STABILIZED = "fixed-box", "shear-stabilized"
LARGE = 25.0  # p N^2 from which packings take part in fits of exponents: below, their size decides, fig 8


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
            ComplexModulus(self.omega, storage, loss, float(g0), float(eta0), float(eta_inf), "table", none)
            for storage, loss, g0, eta0, eta_inf in zip(
                self.storage, self.loss, self.g0, self.eta0, self.eta_inf, strict=True
            )
        ]


def cut_to_shared_frequencies(groups: dict[float, Group]) -> dict[float, Group]:
    """Cut all groups to the frequencies that they share."""
    shared = set.intersection(*(set(g.omega) for g in groups.values()))
    out = {}
    for p, g in groups.items():
        kept = np.array([w in shared for w in g.omega])
        out[p] = g.at(kept)
    return out


def same_packings(groups: Sequence[Group]) -> Array:
    """Arrange (packings, groups) eta_0 of the packings that all groups have: under one law some may not be stable."""
    shared = set.intersection(*(set(g.seeds.tolist()) for g in groups))
    return np.column_stack([g.eta0[np.isin(g.seeds, list(shared))] for g in groups])


def select_limits(table: pd.DataFrame) -> pd.DataFrame:
    """Reduce a table to one row per packing and law, without frequencies; packings with G_0 <= 0 are left out."""
    keys = ["n", "seed", "ensemble", "target_pressure", "law", "beta", "eta_f", "prestress"]
    return table[table["g0"] > 0].drop_duplicates(keys)[[*keys, "g0", "eta0", "eta_inf"]]


def select_law(
    table: pd.DataFrame, law: str, ensemble: str = FIXED, /, *, prestress: bool | None = None, **parameters: float
) -> pd.DataFrame:
    """Select the rows of one law, in one ensemble: fixed boxes as in the paper, or others where they are few."""
    found = table[table["law"] == law]
    if prestress is not None:
        found = found[found["prestress"].astype(bool) == prestress]
    for name, value in parameters.items():
        found = found[np.isclose(found[name], value)]
    if found.empty:
        what = ", ".join(f"{k} = {v:g}" for k, v in parameters.items())
        raise InputError(f"no row with {law} damping {what}, prestress = {prestress}: run a campaign that has it")
    return select_ensemble(found, ensemble)


def select_ensemble(table: pd.DataFrame, ensemble: str = FIXED) -> pd.DataFrame:
    """Select the packings of one ensemble, size by size; where it has too few of a size, those of the other. A packing
    of the same seed is another one in the other ensemble, with another modulus: none is averaged over both."""
    chosen = {}
    for n, part in table.groupby("n"):
        held = enough(part, "ensemble")
        chosen[n] = ensemble if ensemble in held else held[0]
    kept: NDArray[np.bool_] = (table["ensemble"] == table["n"].map(chosen)).to_numpy()
    return table.loc[kept]


def select_spectra(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of the largest size with many frequencies and enough packings for an interval."""
    count = table.groupby("n")["omega"].nunique()
    full = count.index[count >= max(0.5 * count.max(), 3)]
    if full.empty:
        raise InputError("no spectrum has three frequencies: run a campaign with more")
    return select_largest(table.loc[table["n"].isin(full)])


def select_largest(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of the largest size with enough packings for an interval, else of that with the most."""
    largest: NDArray[np.bool_] = (table["n"] == enough(table, "n")[-1]).to_numpy()
    return table.loc[largest]


def select_sweep(table: pd.DataFrame, parameter: str) -> pd.DataFrame:
    """Select the rows of the size and pressure with most values of a parameter of damping; the largest size of several.
    Scans of the parameter may be had at another size than the spectra of every pressure."""
    count = table.groupby(["n", "target_pressure"])[parameter].nunique()
    n, p = max(count.index[count == count.max()])
    chosen: NDArray[np.bool_] = ((table["n"] == n) & (table["target_pressure"] == p)).to_numpy()
    return table.loc[chosen]


def group_by_pressure(table: pd.DataFrame) -> dict[float, Group]:
    """Group rows of one law by pressure, descending; packings with a modulus that is not positive are left out."""
    out = {}
    for p in table["target_pressure"].unique():
        part = table.loc[table["target_pressure"] == p]
        wide = part.pivot_table(index="seed", columns="omega", values=["storage", "loss"]).dropna()
        up, down = (wide[name].to_numpy(dtype=np.float64) for name in ("storage", "loss"))
        stable: NDArray[np.bool_] = (up > 0).all(axis=1) & (down > 0).all(axis=1)
        if not stable.any():
            continue
        seeds = wide.index.to_numpy(dtype=np.int64)[stable]
        ends = part.drop_duplicates("seed").set_index("seed").loc[seeds]
        omega = wide["storage"].columns.to_numpy(dtype=np.float64)
        out[float(p)] = Group(
            *(seeds, omega, up[stable], down[stable]),
            *(ends[c].to_numpy(dtype=np.float64) for c in ("g0", "eta0", "eta_inf")),
        )
    return dict(sorted(out.items(), reverse=True))


def select_sampled(groups: dict[float, Group]) -> dict[float, Group]:
    """Select the groups with enough packings for an interval; at low pressure some are not stable, or were not met."""
    most = max((len(g.g0) for g in groups.values()), default=0)
    return {p: g for p, g in groups.items() if len(g.g0) >= min(FEWEST, most)}


def select_large(groups: dict[float, Group], n: int) -> dict[float, Group]:
    """Select the groups for fits of exponents: p N^2 is large enough, and there are enough packings."""
    return {p: g for p, g in select_sampled(groups).items() if p * n**2 >= LARGE}


def format_power(p: float) -> str:
    """Format a number as 10^n, or a x 10^n, in mathtext."""
    exponent = int(np.floor(np.log10(p) + 1e-9))
    if exponent in (-1, 0, 1):
        return f"{p:.2g}"
    front = p / 10.0**exponent
    return f"10^{{{exponent}}}" if abs(front - 1) < 1e-6 else rf"{front:.2g}\times 10^{{{exponent}}}"
