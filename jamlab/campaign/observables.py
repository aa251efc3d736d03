"""The observables of a campaign: `OBSERVABLES` by name; here those of geometry and linear response.

A new observable is a class here, or in a file of its own, and a place in `OBSERVABLES`.
"""

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from jamlab.arrays import Array
from jamlab.campaign.flow_observables import Creep, Oscillation, SteadyFlow
from jamlab.campaign.observable import (
    FLAG,
    LAW,
    STATE,
    WHOLE,
    Driven,
    Frequencies,
    Observable,
    Prestress,
    Row,
    Schema,
    TaskStates,
    Tolerances,
    floats,
)
from jamlab.errors import BoundaryError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.hexatic_order import hexatic_order
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.nonaffine_response import nonaffine_response
from jamlab.packing.packing import Packing
from jamlab.rheology.complex_modulus import linear_modulus
from jamlab.rheology.displacement_correlation import displacement_correlations
from jamlab.rheology.mode_character import MOTIONS, mode_character
from jamlab.rheology.relaxation_spectrum import LARGEST_DENSE


class Onset(Observable):
    """The packing at onset, of every task that begins there, whatever it measures."""

    name, defined_by = "onset", ("contacts", "packing fraction")
    stored: ClassVar[Schema] = {
        **floats("rho_J", "phi_J", "z_J"),
        **{"n_contacts": WHOLE, "rattlers": WHOLE, "converged": FLAG},
    }
    columns = (*stored, "seconds")

    def measure(self, states: TaskStates, pressure: Array, tolerances: Tolerances) -> list[Row]:
        packing = states.packings[0]
        network = contacts(packing)
        counts = {"n_contacts": network.n_contacts, "rattlers": int(network.rattlers.sum())}
        fractions = {"rho_J": packing_fraction(packing), "phi_J": packing.phi, "z_J": network.z}
        return [{**fractions, **counts, "converged": states.converged[0]}]


class Linear(Driven):
    """An observable of the linear response at finite frequency, with and without prestress."""

    prestress: Prestress = Field(default=[True])

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        laws = super().cases()
        return [(how | {"prestress": p}, columns | {"prestress": p}) for how, columns in laws for p in self.prestress]


class Spectra(Linear):
    """The complex modulus over frequency; nan and not converged where a packing is unstable."""

    name, defined_by = "spectra", ("contacts", "spectra")
    _OF_MODULUS: ClassVar = ("storage", "loss", "g0", "eta0", "eta_inf", "error")
    stored: ClassVar[Schema] = {**STATE, **LAW, "prestress": FLAG, **floats("omega", *_OF_MODULUS), "converged": FLAG}

    omega: Frequencies

    def one(self, packing: Packing, tolerances: Tolerances, **how: Any) -> list[Row]:
        spectrum = linear_modulus(packing, self.omega, how["law"], prestress=how["prestress"])
        found = {name: getattr(spectrum, name) for name in self._OF_MODULUS[:-1]} | {"error": spectrum.error_bound}
        return [{"omega": spectrum.omega, **found, "converged": spectrum.error_bound <= tolerances.spectrum_error}]

    def refused(self) -> list[Row]:
        return [{"omega": np.array(self.omega)}]

    def depends_on(self, tolerances: Tolerances) -> Any:
        return self, tolerances.spectrum_error


class Quasistatic(Observable):
    """Medians and means of the linear motion in slow shear, `sheared` without its affine part; nan where unstable."""

    name, only, defined_by = "quasistatic", "sp", ("contacts", "slow shear")
    _KINDS: ClassVar = ("approach", "sliding", "nonaffine", "sheared")
    _MEANS: ClassVar = tuple(f"mean_{kind}" for kind in _KINDS)
    stored: ClassVar[Schema] = {**STATE, "prestress": FLAG, **floats(*_KINDS, *_MEANS)}

    prestress: Prestress = Field(default=[True])

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        return [({"prestress": p}, {"prestress": p}) for p in self.prestress]

    def one(self, packing: Packing, tolerances: Tolerances, **how: Any) -> list[Row]:
        motion = nonaffine_response(packing, prestress=how["prestress"])
        lengths = np.abs([motion.normal, motion.tangential, motion.nonaffine_tangential])
        parts = (lengths[0], lengths[1], np.hypot(*motion.nonaffine.T), lengths[2])
        medians = dict(zip(self._KINDS, map(np.median, parts), strict=True))
        return [medians | dict(zip(self._MEANS, map(np.mean, parts), strict=True))]

    def refused(self) -> list[Row]:
        return [{}]


class Correlation(Linear):
    """Correlation of displacements over distance, at some frequencies; no rows where a packing is unstable."""

    name, defined_by = "correlation", ("contacts", "correlation")
    stored: ClassVar[Schema] = {**STATE, **LAW, "prestress": FLAG, **floats("omega", "delta", "c", "box")}

    correlation_omega: Frequencies

    def one(self, packing: Packing, tolerances: Tolerances, **how: Any) -> list[Row]:
        omega, box = self.correlation_omega, packing.box[0, 0]
        found = displacement_correlations(packing, omega, how["law"], prestress=how["prestress"])
        curves = zip(omega, found, strict=True)
        return [{"omega": w, "delta": c.delta, "c": c.correlation, "box": box} for w, c in curves]


class Modes(Driven):
    """Relaxation modes of droplets, a row each; none where a packing is unstable."""

    name, only, defined_by = "modes", "dp", ("contacts", "modes")
    _OF_MODES: ClassVar = ("rates", "strengths", *MOTIONS, "sliding")  # attributes of `ModeCharacter`
    stored: ClassVar[Schema] = {**STATE, **LAW, **floats(*_OF_MODES)}

    def check(self, sites: float) -> None:
        super().check(sites)
        if 2 * sites > LARGEST_DENSE:
            most = LARGEST_DENSE // 2
            raise ValueError(f"observable 'modes' of {sites:g} vertices: at most {most}; lower n or their vertices")

    def one(self, packing: Packing, tolerances: Tolerances, **how: Any) -> list[Row]:
        found = mode_character(packing, how["law"])
        return [{name: getattr(found, name) for name in self._OF_MODES}]


class VoidsOfStates(Observable):
    """Voids that do not percolate, a row each; no rows of a packing whose outlines cross."""

    name, defined_by = "voids", ("voids",)
    refusal = BoundaryError  # of outlines that cross
    stored: ClassVar[Schema] = {"state": WHOLE, "sides": WHOLE, **floats("area", "perimeter", "shape", "particle_area")}
    columns = ("state", "rho", "onset", "sides", "area", "perimeter", "shape", "particle_area")

    def one(self, packing: Packing, tolerances: Tolerances, **how: Any) -> list[Row]:
        found = voids(packing)
        closed = found.percolating == 0
        row: Row = {name: getattr(found, name)[closed] for name in ("sides", "area", "perimeter", "shape")}
        return [row | {"particle_area": (packing.area - found.area.sum()) / packing.n}] if closed.any() else []


class Order(Observable):
    """Bond-orientational order of every state over Delaunay neighbours, and how many particles have 5, 6 and 7 of them.
    psi_6 is the mean of |psi_6| over particles and psi_6_overall |mean of psi_6|, both 1 in a triangular crystal;
    share_k is the part of the particles with k neighbours, so that 1 - share_6 is the density of disclinations."""

    name, defined_by = "order", ("order",)
    _NEIGHBORS: ClassVar = (5, 6, 7)
    stored: ClassVar[Schema] = {**STATE, **floats("psi_6", "psi_6_overall", *(f"share_{k}" for k in _NEIGHBORS))}
    columns = ("rho", *stored)

    def one(self, packing: Packing, tolerances: Tolerances, **how: Any) -> list[Row]:
        found = hexatic_order(packing)
        shares = {f"share_{k}": float(np.mean(found.neighbors == k)) for k in self._NEIGHBORS}
        return [{"psi_6": found.mean_local, "psi_6_overall": found.global_order, **shares}]


OBSERVABLES: dict[str, type[Observable]] = {
    o.name: o for o in (Spectra, Quasistatic, Correlation, Modes, VoidsOfStates, Order, SteadyFlow, Oscillation, Creep)
}
TABLES = ("states", "onset", *OBSERVABLES)
