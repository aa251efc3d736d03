"""Mean spectra: G*(omega) of packings of one kind, with band and table.

G* is G*_xy, for simple shear along x of the box. A small packing is anisotropic, so the static modulus averaged
over directions, which `jamlab.measure` calls g, stands beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.mechanics.elasticity import linear_response, mean_shear_modulus
from jamlab.mechanics.negative_moduli import warn_of_negative_rows
from jamlab.mechanics.stiffness import pressure
from jamlab.packing.packing import Packing
from jamlab.rheology.complex_modulus import linear_modulus
from jamlab.rheology.damping import Damping

COLUMNS = ("storage", "loss", "error")
LIMITS = ("g0", "eta0", "eta_inf")
_SAME_PRESSURE = 1e-3  # relative: `pack` meets a pressure to 1e-6


@dataclass(frozen=True)
class Spectra:
    """G*_xy(omega) of one or more packings of one kind, at the same frequencies."""

    # a row for each packing and frequency: `packing`, `omega`, 1/tau_1, and `COLUMNS`; error: bound of the relative one
    curves: pd.DataFrame
    # a row for each packing: `LIMITS`, of shear along x; `g`, relaxed static modulus, mean over directions; `method`;
    # `converged`, whether the packing is at a minimum
    packings: pd.DataFrame
    units: str  # "k" or "eps", of all packings
    unit: str = ""  # of stress, for axes

    @property
    def omega(self) -> Array:
        """(m,) angular frequencies, 1/tau_1."""
        return np.asarray(self.all_of("omega")[0])

    @property
    def method(self) -> str:
        """Solvers used."""
        return ", ".join(sorted(set(self.packings["method"])))

    def all_of(self, name: str) -> Array:
        """(packings, m) values of a column of `curves`."""
        return np.asarray(self.curves[name]).reshape(len(self.packings), -1)

    def band(self, name: str) -> tuple[Array, Array, Array]:
        """Mean over packings, and mean minus and plus the standard error; the band of one packing has no width."""
        values = self.all_of(name)
        mean = values.mean(axis=0)
        spread = values.std(axis=0, ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.zeros_like(mean)
        return mean, mean - spread, mean + spread

    def means(self) -> pd.DataFrame:
        """Mean over packings at each frequency, with standard errors if there are several."""
        table = pd.DataFrame({"omega": self.omega} | {name: self.band(name)[0] for name in COLUMNS})
        for name in ("storage", "loss") if len(self.packings) > 1 else ():
            mean, _, high = self.band(name)
            table[f"{name}_stderr"] = high - mean
        return table


def mean_spectra(
    packings: Sequence[Packing],
    omega: Array,
    damping: Damping | None = None,
    *,
    prestress: bool = True,
    method: str = "auto",
) -> Spectra:
    """G*_xy(omega) of packings at energy minima that differ only in their random start; other arguments as in
    `complex_modulus`."""
    check_one_kind(packings)
    curves, rows = [], []
    for k, packing in enumerate(packings):
        found = linear_modulus(packing, omega, damping, prestress=prestress, method=method)
        columns = {"omega": found.omega, "storage": found.storage, "loss": found.loss, "error": found.error_bound}
        curves.append(pd.DataFrame({"packing": k} | columns))
        relaxed = linear_response(packing, prestress=prestress).relaxed
        rows.append(
            {name: getattr(found, name) for name in (*LIMITS, "method")}
            | {"g": mean_shear_modulus(packing, relaxed), "converged": packing.converged}
        )
    each, first = pd.DataFrame(rows), packings[0]
    warn_of_negative_rows({"G_xy": each["g0"], "G": each["g"]}, "packings")
    return Spectra(pd.concat(curves), each, first.units, first.unit_names.stress)


def check_one_kind(packings: Sequence[Packing]) -> None:
    """Refuse packings that differ in more than their random start; pressures may differ by 1e-3."""
    first = _kind(packings[0])
    for k, packing in enumerate(packings):
        kind = _kind(packing)
        wrong = next((name for name in kind | first if kind.get(name) != first.get(name)), None)
        if wrong is None and abs(pressure(packing) / pressure(packings[0]) - 1) > _SAME_PRESSURE:
            wrong, kind, first = "pressure", {"pressure": pressure(packing)}, {"pressure": pressure(packings[0])}
        if wrong:
            raise InputError(
                f"packing {k} has {wrong} = {kind.get(wrong)}, packing 0 has {first.get(wrong)}: a mean is over "
                "packings of one kind; take one kind at a time"
            )


def _kind(packing: Packing) -> dict[str, Any]:
    """Whatever the packings of one mean must share, besides their pressure."""
    sizes, counts = np.unique(packing.kind.type_sizes(packing), return_counts=True)
    facts: dict[str, Any] = {name: getattr(packing, name) for name in ("model", "units", "n", "ensemble")}
    facts["sizes"] = [(f"{size:.12g}", int(count)) for size, count in zip(sizes, counts, strict=True)]
    facts["vertices"] = np.unique(np.bincount(packing.particle)).tolist()
    return facts | {name: v for name, v in packing.params.items() if not packing.parameters[name].each}
