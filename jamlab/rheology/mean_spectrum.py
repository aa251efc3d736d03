"""Mean spectra: G*(omega) of packings alike together, with band and table; unlike packings get a curve each.

G* is G*_xy, for simple shear along x of the box. A small packing is anisotropic, so the static modulus averaged
over directions, which `jamlab.measure` calls g, stands beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, elastic_tensor, modulus_along
from jamlab.mechanics.stiffness import pressure
from jamlab.packing.packing import Packing
from jamlab.rheology.complex_modulus import linear_modulus
from jamlab.rheology.damping import Damping

COLUMNS = ("storage", "loss", "error")
LIMITS = ("g0", "eta0", "eta_inf")
_SAME_PRESSURE = 1e-3  # relative: `pack` meets a pressure to 1e-6


@dataclass(frozen=True)
class Spectra:
    """G*_xy(omega) of one or more packings alike, at the same frequencies."""

    # a row for each packing and frequency: `packing`, `omega`, 1/tau_1, and `COLUMNS`; error: bound of the relative one
    curves: pd.DataFrame
    # a row for each packing: `LIMITS`, of shear along x; `g`, relaxed static modulus, mean over directions; `method`;
    # `converged`, whether the packing is at a minimum
    packings: pd.DataFrame
    units: str  # "k" or "eps", of all packings
    label: str = ""  # what the packings have in common, for titles and legends
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
) -> list[Spectra]:
    """G*_xy(omega) of packings: one mean for packings of the same force law, units, sizes, ensemble and pressure.
    `packings`: one or more, at energy minima; `omega, damping, prestress, method`: as in `complex_modulus`. Returns one
    `Spectra` per group, in the order of their first packings; their labels say what the groups differ in."""
    groups = group_packings(packings)
    return [
        collect(group, label, omega, damping, prestress=prestress, method=method)
        for label, group in zip(_labels([group[0] for group in groups]), groups, strict=True)
    ]


def collect(
    packings: Sequence[Packing], label: str, omega: Array, damping: Damping | None, *, prestress: bool, method: str
) -> Spectra:
    """Spectra of packings that are alike, under a label."""
    curves, rows = [], []
    for k, packing in enumerate(packings):
        found = linear_modulus(packing, omega, damping, prestress=prestress, method=method)
        columns = {"omega": found.omega, "storage": found.storage, "loss": found.loss, "error": found.error_bound}
        curves.append(pd.DataFrame({"packing": k} | columns))
        relaxed = elastic_tensor(packing, prestress=prestress).relaxed
        rows.append(
            {name: getattr(found, name) for name in (*LIMITS, "method")}
            | {"g": float(modulus_along(relaxed, AVERAGING_ANGLES).mean()), "converged": packing.converged}
        )
    first = packings[0]
    return Spectra(pd.concat(curves), pd.DataFrame(rows), first.units, label, first.unit_names.stress)


def group_packings(packings: Sequence[Packing]) -> list[list[Packing]]:
    """Gather packings that may be averaged: they differ only in their random start; pressures within 1e-3."""
    groups: list[list[Packing]] = []
    for packing in packings:
        group = next((group for group in groups if _alike(packing, group[0])), None)
        if group is None:
            groups.append([packing])
        else:
            group.append(packing)
    return groups


def _alike(packing: Packing, first: Packing) -> bool:
    close = abs(pressure(packing) - pressure(first)) <= _SAME_PRESSURE * abs(pressure(first))
    return close and dict(_facts(packing)) == dict(_facts(first))


def _facts(packing: Packing) -> Iterator[tuple[str, str]]:
    """Whatever the packings of one mean must share, besides their pressure: what it is, and how a label says it."""
    kind, declared = packing.kind, packing.parameters
    sizes, counts = np.unique(kind.type_sizes(packing), return_counts=True)
    yield from {"model": kind.particles, "units": f"units {packing.units}", "n": f"n = {packing.n}"}.items()
    yield "ensemble", packing.ensemble
    yield "sizes", f"{kind.size_name}s " + " ".join(f"{c} × {s:.4g}" for s, c in zip(sizes[:4], counts, strict=False))
    yield "every size", str([(f"{s:.12g}", int(c)) for s, c in zip(sizes, counts, strict=True)])
    yield "vertices", f"vertices {np.unique(np.bincount(packing.particle)).tolist()}"
    yield from ((name, f"{name} = {value}") for name, value in packing.params.items() if not declared[name].each)


def _labels(firsts: Sequence[Packing]) -> list[str]:
    """Particles, pressure, and whatever differs between groups."""
    facts = [dict(_facts(packing)) for packing in firsts]
    names = dict.fromkeys(name for each in facts for name in each if name not in ("model", "units", "every size"))
    differ = [name for name in names if len({each.get(name) for each in facts}) > 1]
    return [
        ", ".join(
            [each["model"], f"p = {pressure(packing):.4g} {packing.unit_names.stress}"]
            + [each[name] for name in differ if name in each]
        )
        for packing, each in zip(firsts, facts, strict=True)
    ]
