"""Mean spectra: G*(omega) of packings alike together, with band and table; unlike packings get a curve each.

G* is G*_xy, that of simple shear along x of the box. A small packing is anisotropic, so the static modulus averaged
over directions, which `jamlab.measure` calls g, stands beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, elastic_tensor, modulus_along
from jamlab.mechanics.stiffness import pressure
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.rheology.complex_modulus import ComplexModulus, linear_modulus
from jamlab.rheology.damping import Damping

COLUMNS = ("storage", "loss", "error")
LIMITS = ("g0", "eta0", "eta_inf")
_SAME_PRESSURE = 1e-3  # relative: `pack` meets a pressure to 1e-6


@dataclass(frozen=True)
class Spectra:
    """G*_xy(omega) of one or more packings alike, at the same frequencies."""

    members: tuple[ComplexModulus, ...]  # one spectrum per packing
    units: str  # "k" or "eps", of all packings
    converged: tuple[bool, ...]  # whether each packing is at a minimum
    # relaxed static modulus of each packing, mean over directions; the `g0` of a member is that along x
    g: tuple[float, ...]
    label: str = ""  # what the packings have in common, for titles and legends
    unit: str = ""  # of stress, for axes

    __repr__ = short_repr

    @property
    def omega(self) -> Array:
        """(m,) angular frequencies, 1/tau_1."""
        return self.members[0].omega

    @property
    def mean_g(self) -> float:
        """Static modulus, mean over directions and packings."""
        return float(np.mean(self.g))

    def all_of(self, name: str) -> Array:
        """(packings, m) values of "storage", "loss" or "error"."""
        return np.array([getattr(s, name) for s in self.members])

    def limit(self, name: str) -> float:
        """Mean of "g0", "eta0" or "eta_inf"."""
        return float(np.mean([getattr(s, name) for s in self.members]))

    def band(self, name: str) -> tuple[Array, Array, Array]:
        """Mean over packings, and mean minus and plus the standard error; the band of one packing has no width."""
        values = self.all_of(name)
        mean = values.mean(axis=0)
        spread = values.std(axis=0, ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.zeros_like(mean)
        return mean, mean - spread, mean + spread

    @property
    def method(self) -> str:
        """Solvers used."""
        return ", ".join(sorted({s.method for s in self.members}))

    @property
    def description(self) -> str:
        """Label, the numbers of packings and of those that are not at a minimum, and the solver."""
        count = len(self.members)
        text = f"{count} packings" if count > 1 else "1 packing"
        bad = self.converged.count(False)
        label = f"{self.label}, " if self.label else ""
        return f"{label}{text}, {self.method}" + (f", {bad} NOT CONVERGED" if bad else "")

    def rows(self) -> tuple[list[str], list[list[str]]]:
        """Column names and cells of a table."""
        names = ["ω τ1", "G'_xy", "G''_xy", "error"]
        columns = [self.omega, *(self.band(name)[0] for name in COLUMNS)]
        if len(self.members) > 1:
            names += ["± G'_xy", "± G''_xy"]
            columns += [high - mean for mean, _, high in map(self.band, ("storage", "loss"))]
        return names, [[f"{value:.4g}" for value in row] for row in zip(*columns, strict=True)]

    def summary(self) -> dict[str, Any]:
        """Plain numbers: limits and mean curves, of each packing too if there are several."""
        content: dict[str, Any] = {
            "label": self.label,
            "units": self.units,
            "converged": all(self.converged),
            "method": self.method,
            "shear": "G*_xy: g0, storage and loss are for shear along x of the box; g is the mean over directions",
            "omega": self.omega.tolist(),
            "g": self.mean_g,
        }
        content |= {name: self.limit(name) for name in LIMITS}
        content |= {name: self.band(name)[0].tolist() for name in COLUMNS}
        if len(self.members) > 1:
            content["packings"] = [
                {"g": g, **{k: getattr(s, k) for k in LIMITS}, **{k: getattr(s, k).tolist() for k in COLUMNS}}
                for s, g in zip(self.members, self.g, strict=True)
            ]
        return content


def mean_spectra(
    packings: Sequence[Packing],
    omega: Array,
    damping: Damping | None = None,
    *,
    prestress: bool = True,
    method: str = "auto",
) -> list[Spectra]:
    """G*_xy(omega) of packings: one mean for those of the same force law, units, sizes, ensemble and pressure.
    `packings`: one or more, at energy minima; `omega, damping, prestress, method`: as in `complex_modulus`. Returns one
    `Spectra` per group, in the order of their first packings; their labels say what the groups differ in."""
    groups = group_packings(packings)
    found = []
    for label, members in zip(_labels([group[0] for group in groups]), groups, strict=True):
        spectra = tuple(linear_modulus(p, omega, damping, prestress=prestress, method=method) for p in members)
        tensors = [elastic_tensor(p, prestress=prestress).relaxed for p in members]
        means = tuple(float(modulus_along(c, AVERAGING_ANGLES).mean()) for c in tensors)
        unit = members[0].unit_names.stress
        found.append(Spectra(spectra, members[0].units, tuple(p.converged for p in members), means, label, unit))
    return found


def group_packings(packings: Sequence[Packing]) -> list[list[Packing]]:
    """Gather packings that may be averaged: all alike but for their random start; pressures within 1e-3."""
    groups: list[list[Packing]] = []
    for packing in packings:
        for group in groups:
            first = group[0]
            close = abs(pressure(packing) - pressure(first)) <= _SAME_PRESSURE * abs(pressure(first))
            if close and _facts(packing) == _facts(first):
                group.append(packing)
                break
        else:
            groups.append([packing])
    return groups


def _facts(packing: Packing) -> dict[str, str]:
    """Whatever the packings of one mean must share, besides their pressure: what it is -> how a label says it."""
    kind, declared = packing.kind, packing.parameters
    sizes, counts = np.unique(kind.type_sizes(packing), return_counts=True)
    law = {name: f"{name} = {value}" for name, value in packing.params.items() if not declared[name].each}
    vertices = np.unique(np.bincount(packing.particle)).tolist()
    return {
        "model": kind.particles,
        "units": f"units {packing.units}",
        "n": f"n = {packing.n}",
        "ensemble": packing.ensemble,
        "sizes": f"{kind.size_name}s " + " ".join(f"{c} × {s:.4g}" for s, c in zip(sizes[:4], counts, strict=False)),
        "every size": str([(f"{s:.12g}", int(c)) for s, c in zip(sizes, counts, strict=True)]),
        "vertices": f"vertices {vertices}",
        **law,
    }


def _labels(firsts: Sequence[Packing]) -> list[str]:
    """Particles, pressure, and whatever differs between groups."""
    facts = [_facts(p) for p in firsts]
    names = [name for name in dict.fromkeys(name for f in facts for name in f) if name not in ("model", "every size")]
    differ = [name for name in names if len({f.get(name) for f in facts}) > 1]
    labels = []
    for packing, fact in zip(firsts, facts, strict=True):
        unit = packing.unit_names.stress
        more = [fact[name] for name in differ if name in fact and name != "units"]
        labels.append(", ".join([fact["model"], f"p = {pressure(packing):.4g} {unit}", *more]))
    return labels
