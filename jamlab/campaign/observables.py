"""The observables of a campaign: `OBSERVABLES` by name; here those of geometry and linear response.

A new observable is a class here, or in a file `..._observable.py` of its own, and a name in `TableName` of
`jamlab.arguments.choices`.
"""

import importlib
import pkgutil
from pathlib import Path
from typing import Any, ClassVar, get_args

import numpy as np
from pydantic import Field

from jamlab.arguments.choices import TableName
from jamlab.campaign.observable import DAMPING, STATE, Driven, Frequencies, Observable, Prestress, Row
from jamlab.errors import BoundaryError, InputError
from jamlab.geometry.hexatic_order import hexatic_order
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.nonaffine_response import nonaffine_response
from jamlab.packing.model import Model
from jamlab.packing.packing import Packing
from jamlab.rheology.complex_modulus import linear_modulus
from jamlab.rheology.displacement_correlation import displacement_correlations
from jamlab.rheology.mode_character import MOTIONS, mode_character
from jamlab.rheology.relaxation_spectrum import DENSE

SPECTRUM_ERROR = 1e-3  # relative, of G*, from which on it is not converged


class Linear(Driven):
    """An observable of the linear response at finite frequency, with and without prestress."""

    prestress: Prestress = Field(default=[True])

    @staticmethod
    def serves(kind: Model[Any]) -> bool:
        return kind.sites == 1

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        laws = super().cases()
        return [(how | {"prestress": p}, columns | {"prestress": p}) for how, columns in laws for p in self.prestress]


class SpectraOfStates(Linear):
    """The complex modulus over frequency; nan and not converged where a packing is unstable."""

    name = "spectra"
    _OF_MODULUS: ClassVar = ("storage", "loss", "g0", "eta0", "eta_inf", "error_bound")
    columns = (*STATE, *DAMPING, "prestress", "omega", *_OF_MODULUS, "converged")

    omega: Frequencies

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        spectrum = linear_modulus(packing, self.omega, how["law"], prestress=how["prestress"])
        found = {name: getattr(spectrum, name) for name in self._OF_MODULUS}
        return [{"omega": spectrum.omega, **found, "converged": spectrum.error_bound <= SPECTRUM_ERROR}]

    def refused(self) -> list[Row]:
        return [{"omega": np.array(self.omega)}]


class Quasistatic(Observable):
    """Medians and means of lengths of the linear motion in slow shear, see `NonaffineResponse`; nan where unstable."""

    name = "quasistatic"
    _KINDS: ClassVar = ("normal", "tangential", "nonaffine", "nonaffine_tangential")
    _MEDIANS: ClassVar = tuple(f"median_{kind}" for kind in _KINDS)
    _MEANS: ClassVar = tuple(f"mean_{kind}" for kind in _KINDS)
    columns = (*STATE, "prestress", *_MEDIANS, *_MEANS)

    prestress: Prestress = Field(default=[True])

    @staticmethod
    def serves(kind: Model[Any]) -> bool:
        return kind.sites == 1

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        return [({"prestress": p}, {"prestress": p}) for p in self.prestress]

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        motion = nonaffine_response(packing, prestress=how["prestress"])
        lengths = np.abs([motion.normal, motion.tangential, motion.nonaffine_tangential])
        parts = (lengths[0], lengths[1], np.hypot(*motion.nonaffine.T), lengths[2])
        medians = dict(zip(self._MEDIANS, map(np.median, parts), strict=True))
        return [medians | dict(zip(self._MEANS, map(np.mean, parts), strict=True))]

    def refused(self) -> list[Row]:
        return [{}]


class Correlation(Linear):
    """Correlation of displacements over distance, at some frequencies; no rows where a packing is unstable."""

    name = "correlation"
    columns = (*STATE, *DAMPING, "prestress", "omega", "delta", "c", "box")

    correlation_omega: Frequencies

    def amount(self) -> float:
        return len(self.cases()) * len(self.correlation_omega)

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        omega, box = self.correlation_omega, packing.box[0, 0]
        found = displacement_correlations(packing, omega, how["law"], prestress=how["prestress"])
        curves = zip(omega, found, strict=True)
        return [{"omega": w, "delta": c.delta, "c": c.correlation, "box": box} for w, c in curves]


class ModesOfStates(Driven):
    """Relaxation modes of droplets, a row each; none where a packing is unstable."""

    name = "modes"
    _OF_MODES: ClassVar = ("rates", "strengths", *MOTIONS, "sliding")  # attributes of `ModeCharacter`
    columns = (*STATE, *DAMPING, *_OF_MODES)

    @staticmethod
    def serves(kind: Model[Any]) -> bool:
        return kind.has_outlines

    def check(self, sites: float) -> None:
        super().check(sites)
        if 2 * sites > DENSE.size:
            most = DENSE.size // 2
            raise ValueError(f"observable 'modes' of {sites:g} vertices: at most {most}; lower n or their vertices")

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        found = mode_character(packing, how["law"])
        return [{name: getattr(found, name) for name in self._OF_MODES}]


class VoidsOfStates(Observable):
    """Voids that do not percolate, a row each; no rows of a packing whose outlines cross."""

    name = "voids"
    refusal = BoundaryError  # of outlines that cross
    _OF_VOIDS: ClassVar = ("sides", "area", "perimeter", "shape_factor")
    columns = ("state", "rho", "rho_J", *_OF_VOIDS, "particle_area")

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        found = voids(packing)
        closed = found.percolating == 0
        row: Row = {name: getattr(found, name)[closed] for name in self._OF_VOIDS}
        return [row | {"particle_area": (packing.area - found.area.sum()) / packing.n}] if closed.any() else []


class OrderOfStates(Observable):
    """Bond-orientational order of every state over Delaunay neighbours, and the shares of particles with 5, 6 and 7.

    psi_6 is the mean of |psi_6| over particles, psi_6_global |mean of psi_6|; both are 1 in a triangular crystal, of
    which 1 - share_6 counts the disclinations.
    """

    name = "order"
    refusal = InputError  # of particles that lie on each other
    _NEIGHBOURS: ClassVar = (5, 6, 7)
    columns = (*STATE, "rho", "psi_6", "psi_6_global", *(f"share_{k}" for k in (5, 6, 7)))

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        found = hexatic_order(packing)
        shares = {f"share_{k}": float(np.mean(found.neighbors == k)) for k in self._NEIGHBOURS}
        return [{"psi_6": found.mean_local, "psi_6_global": found.global_order} | shares]

    def refused(self) -> list[Row]:
        return [{}]


def _observables() -> dict[str, type[Observable]]:
    """Classes with a table, of this file and of those in its folder that are named as it is, in the order of tables."""
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        if module.name.endswith(("_observable", "_observables")):
            importlib.import_module(f"{__package__}.{module.name}")
    kinds: list[type[Observable]] = [Observable]
    for kind in kinds:
        kinds += kind.__subclasses__()
    found = {kind.name: kind for kind in kinds if "name" in vars(kind)}
    return {name: found[name] for name in TABLES if name in found}


TABLES: tuple[TableName, ...] = get_args(TableName)  # "states", "onset" and one of each observable
OBSERVABLES: dict[str, type[Observable]] = _observables()
