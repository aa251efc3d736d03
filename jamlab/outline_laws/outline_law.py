"""The base class of laws of outlines, their registry, and the free droplet that they make.

A law of outlines is an energy of the shape of one droplet. It adds to line tension and area elasticity, goes with every
law of contacts, and acts where its strength is above 0. Laws are entry points of the group `jamlab.outline_laws`, of
jamlab or of another package.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import EngineError, InputError
from jamlab.laws.parameter import Parameter
from jamlab.packing.terms import Terms
from jamlab.registry import EXTENDING, Registry


@dataclass(frozen=True)
class PolygonRings:
    """Polygons of equal numbers of vertices.

    Attributes:
        positions: (k, nv, 2) vertices, counter-clockwise.
        sites: (k, nv) their numbers in `Packing.positions`.
        rest_areas: (k,) a0.
    """

    positions: Array
    sites: Indices
    rest_areas: Array


@dataclass(frozen=True)
class FreePolygon:
    """Regular polygons that nothing touches: (k,) arrays of one shape.

    Attributes:
        nv: numbers of vertices.
        rest_areas: a0.
        side: root of the area.
    """

    nv: Array
    rest_areas: Array
    side: Array

    @property
    def perimeter_of_side(self) -> Array:
        """Perimeter over the root of the area, sqrt(4 nv tan(pi/nv))."""
        return np.asarray(np.sqrt(4 * self.nv * np.tan(np.pi / self.nv)))

    @property
    def perimeter(self) -> Array:
        return self.perimeter_of_side * self.side


class OutlineLaw(ABC):
    """A law of outlines, known by its `name` in `OUTLINE_LAWS`. Its parameters have defaults, its strength 0."""

    name: ClassVar[str]
    strength: ClassVar[str]  # the parameter above 0 where the law acts
    parameters: ClassVar[Mapping[str, Parameter]]
    fix_style: ClassVar[str] = ""  # of the plugin, which `lammps_inputs/parts/dp` uses; "": LAMMPS does not know it

    def acts(self, params: Mapping[str, Any]) -> bool:
        """Whether the law acts in packings with these parameters."""
        return bool(params.get(self.strength, 0.0))

    def values(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Its parameters, with defaults for those that `params` leaves out."""
        return {name: params.get(name, each.default) for name, each in self.parameters.items()}

    @abstractmethod
    def terms(self, rings: PolygonRings, params: Mapping[str, Any]) -> Terms:
        """Energy terms, with gradients and Hessians."""

    @abstractmethod
    def slope(self, free: FreePolygon, params: Mapping[str, Any]) -> tuple[Array, Array]:
        """dE/ds and d2E/ds2 of a regular polygon of area s^2, (k,) each."""

    @abstractmethod
    def tension(self, free: FreePolygon, params: Mapping[str, Any]) -> Array:
        """(k,) line tension that holds the regular polygon round as this law does; negative: it buckles outlines."""

    def rest_perimeter(self, free: FreePolygon, params: Mapping[str, Any], tension: float) -> Array | None:
        """(k,) perimeter at which this law balances a line tension, of a droplet that is not round; None: at none."""
        return None


def _check(name: str, law: OutlineLaw) -> None:
    if not isinstance(law, OutlineLaw):
        raise InputError(
            f"law of outlines {name!r} is {law!r}: register an object of a class derived from "
            f"jamlab.outline_laws.outline_law.OutlineLaw, see {EXTENDING}"
        )
    if law.strength not in law.parameters or law.parameters[law.strength].default != 0.0:
        raise InputError(f"law of outlines {name!r}: its strength {law.strength!r} must be a parameter of default 0")
    if lacking := [each for each, parameter in law.parameters.items() if parameter.default is None]:
        raise InputError(f"law of outlines {name!r}: its parameter {lacking[0]!r} must have a default")


OUTLINE_LAWS: Registry[OutlineLaw] = Registry("jamlab.outline_laws", "law of outlines", _check)


def outline_parameters() -> dict[str, Parameter]:
    """Parameters of all laws of outlines, by name."""
    found: dict[str, Parameter] = {}
    for name, law in OUTLINE_LAWS.each().items():
        if twice := found.keys() & law.parameters.keys():
            raise InputError(f"law of outlines {name!r}: another law has a parameter {min(twice)!r}; rename it")
        found |= law.parameters
    return found


def laws_that_act(params: Mapping[str, Any]) -> list[OutlineLaw]:
    """The laws of outlines of packings with these parameters."""
    return [law for law in OUTLINE_LAWS.each().values() if law.acts(params)]


def require_fixes(params: Mapping[str, Any]) -> None:
    """Refuse laws of outlines that act, and of which LAMMPS has no fix."""
    for law in laws_that_act(params):
        if not law.fix_style:
            raise EngineError(
                f"law of outlines {law.name!r} has no fix of LAMMPS, which forces need: write `fix_style` in class "
                f"{type(law).__name__}, see {EXTENDING}"
            )


# a free droplet -------------------------------------------------------------------------------------------------------

_STEPS = 100  # of Newton; 5 to 8 are enough
_SAME = 1e-15  # relative change that is rounding


def rest_shape(nv: Array, params: Mapping[str, Any], area: Array) -> tuple[Array, Array, Array]:
    """Area, perimeter and tension of free droplets where laws of outlines act, (k,) each.

    The regular polygon balances line tension gamma, area elasticity and the laws: dE/ds = 0 of its area s^2. Its
    tension is gamma and what the laws add. Where it is negative, the regular polygon is no minimum: the droplet
    buckles. Then area and perimeter are those at which area elasticity and perimeter are at rest, without the small
    change that bending makes, and the tension is 0.

    Args:
        nv: (k,) numbers of vertices.
        params: of the packing.
        area: (k,) without laws of outlines.
    """
    gamma, ka, a0 = float(params["gamma"]), float(params["ka"]), np.asarray(params["a0"], dtype=np.float64)
    laws = laws_that_act(params)
    side = np.sqrt(area)
    for _ in range(_STEPS):
        free = FreePolygon(np.asarray(nv), a0, side)
        slope = gamma * free.perimeter_of_side + 2 * ka * side * (side**2 - a0)
        curvature = 2 * ka * (3 * side**2 - a0)
        for law in laws:
            own, own_curvature = law.slope(free, params)
            slope, curvature = slope + own, curvature + own_curvature
        if np.any(curvature <= 0):
            break
        step = np.maximum(-slope / curvature, -0.5 * side)
        side = side + step
        if np.all(np.abs(step) <= _SAME * side):
            break
    if np.any(curvature <= 0) or np.any(side**2 < 1e-6 * a0):
        k = int(np.argmin(side**2 / a0))
        acting = ", ".join(f"{law.strength} = {params.get(law.strength, 0.0):g}" for law in laws)
        raise InputError(
            f"{acting}, gamma = {gamma:g} at ka = {ka:g}: a free droplet of rest area {a0[k]:g} has no size; use a "
            "larger ka, or smaller strengths"
        )
    free = FreePolygon(np.asarray(nv), a0, side)
    tension = gamma + sum(law.tension(free, params) for law in laws)
    tension = np.broadcast_to(tension, side.shape)
    area, perimeter = side**2, free.perimeter
    if np.any(buckled := tension < 0):
        found = [each for law in laws if (each := law.rest_perimeter(free, params, gamma)) is not None]
        area = np.where(buckled, a0, area)
        perimeter = np.where(buckled, found[0] if found else perimeter, perimeter)
        tension = np.where(buckled, 0.0, tension)
    return np.asarray(area), np.asarray(perimeter), np.asarray(tension)
