"""Perimeter elasticity of outlines with a preferred shape, as of vesicles and cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.laws.parameter import WIDEST, Parameter
from jamlab.outline_laws.outline_law import FreePolygon, OutlineLaw, Rings
from jamlab.packing.terms import Terms

CIRCLE = float(2 * np.sqrt(np.pi))  # shape index of a circle, 3.5449


class PerimeterLaw(OutlineLaw):
    """E = (kp/2) sum over droplets (p - p0 sqrt(a0))^2, elasticity of the perimeter p of outlines.

    p0 is the preferred shape index, perimeter over the root of the area, as in vertex models of tissues (Bi, Lopez,
    Schwarz & Manning, Nature Physics 11, 1074 (2015); Merkel & Manning, New J. Phys. 20, 022002 (2018)): 3.545 of a
    circle, 3.722 of a regular hexagon. Edges of droplets may slide along their outline, whose perimeter alone is
    elastic. The line tension of an outline is gamma + kp (p - p0 sqrt(a0)).
    """

    name: ClassVar[str] = "perimeter"
    strength: ClassVar[str] = "kp"
    fix_style: ClassVar[str] = "polygon/perimeter"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "kp": Parameter(
            energy=1,
            length=-2,
            default=0.0,
            may_vanish=True,
            made=(1 / WIDEST, WIDEST),
            meaning="stiffness of perimeters",
        ),
        "p0": Parameter(
            default=CIRCLE,
            least=1e-3,
            largest=100.0,
            meaning="preferred shape index: perimeter at rest over the root of the rest area",
        ),
    }

    def terms(self, rings: Rings, params: Mapping[str, Any]) -> Terms:
        """See `OutlineLaw`. Sites: all vertices of a droplet. An edge of length 0 has no direction and pulls nowhere,
        as in line tension."""
        values, nv, x = self.values(params), rings.sites.shape[1], rings.positions
        after, before = np.roll(np.arange(nv), -1), np.roll(np.arange(nv), 1)
        edge = x[:, after] - x
        length = np.hypot(edge[..., 0], edge[..., 1])
        per_length = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0)
        unit = edge * per_length[..., None]
        excess = length.sum(axis=1) - values["p0"] * np.sqrt(rings.rest_areas)
        slope = unit[:, before] - unit  # dp/dx
        pull = values["kp"] * excess
        hessian = values["kp"] * np.einsum("kai,kbj->kaibj", slope, slope)
        across = np.eye(2) - unit[..., :, None] * unit[..., None, :]
        block = (pull[:, None] * per_length)[..., None, None] * across
        i = np.arange(nv)
        for m, n, sign in ((i, i, 1.0), (after, after, 1.0), (i, after, -1.0), (after, i, -1.0)):
            hessian[:, m, :, n, :] += sign * block.transpose(1, 0, 2, 3)
        energy = 0.5 * values["kp"] * excess**2
        return Terms(self.name, rings.sites, x - x[:, :1], energy, pull[:, None, None] * slope, hessian)

    def slope(self, free: FreePolygon, params: Mapping[str, Any]) -> tuple[Array, Array]:
        """See `OutlineLaw`."""
        values, q = self.values(params), free.perimeter_of_side
        return q * self.tension(free, params), values["kp"] * q**2

    def tension(self, free: FreePolygon, params: Mapping[str, Any]) -> Array:
        """See `OutlineLaw`."""
        values = self.values(params)
        return np.asarray(values["kp"] * (free.perimeter - values["p0"] * np.sqrt(free.rest_areas)))

    def rest_perimeter(self, free: FreePolygon, params: Mapping[str, Any], tension: float) -> Array:
        """See `OutlineLaw`."""
        values = self.values(params)
        return np.asarray(values["p0"] * np.sqrt(free.rest_areas) - tension / values["kp"])


PERIMETER = PerimeterLaw()  # as entry points name it
