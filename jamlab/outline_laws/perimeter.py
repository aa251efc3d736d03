"""Perimeter elasticity of outlines with a preferred shape, as of vesicles and cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.laws.parameter import WIDEST, Parameter
from jamlab.outline_laws.outline_law import FreePolygon, OutlineLaw, PolygonRings
from jamlab.packing.terms import Terms

CIRCLE = float(2 * np.sqrt(np.pi))  # shape index of a circle, 3.5449


class PerimeterLaw(OutlineLaw):
    """E = (kp/2)(p - P)^2 + (kl nv/2) sum over edges (l - P/nv)^2 of each droplet, with P = p0 sqrt(a0).

    The first part is the elasticity of the perimeter p of vertex models of tissues (Bi, Lopez, Schwarz & Manning,
    Nature Physics 11, 1074 (2015); Merkel & Manning, New J. Phys. 20, 022002 (2018)), the second the elasticity of
    edges of deformable particles (Boromand, Signoriello, Ye, O'Hern & Shattuck, Phys. Rev. Lett. 121, 248003 (2018)).
    Both are the same where all edges of an outline have one length. Vertices slide along an outline of which the
    perimeter alone is elastic; elastic edges keep them apart, which outlines without line tension need.

    p0 is the preferred shape index, perimeter over the root of the area: 3.545 of a circle, 3.722 of a regular hexagon.
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
        "kl": Parameter(
            energy=1,
            length=-2,
            default=0.0,
            may_vanish=True,
            made=(1 / WIDEST, WIDEST),
            meaning="stiffness of edges, over the number of vertices",
        ),
        "p0": Parameter(
            default=CIRCLE,
            least=1e-3,
            largest=100.0,
            meaning="preferred shape index: perimeter at rest over the root of the rest area",
        ),
    }

    def acts(self, params: Mapping[str, Any]) -> bool:
        """See `OutlineLaw`."""
        return bool(params.get("kp", 0.0) or params.get("kl", 0.0))

    def terms(self, rings: PolygonRings, params: Mapping[str, Any]) -> Terms:
        """See `OutlineLaw`. Sites: all vertices of a droplet. An edge of length 0 has no direction and pulls nowhere,
        as in line tension."""
        values, nv, x = self.values(params), rings.sites.shape[1], rings.positions
        after, before = np.roll(np.arange(nv), -1), np.roll(np.arange(nv), 1)
        edge = x[:, after] - x
        length = np.hypot(edge[..., 0], edge[..., 1])
        per_length = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0)
        unit = edge * per_length[..., None]
        rest = values["p0"] * np.sqrt(rings.rest_areas)
        excess, off = length.sum(axis=1) - rest, length - rest[:, None] / nv
        slope = unit[:, before] - unit  # dp/dx
        pull = values["kp"] * excess[:, None] + values["kl"] * nv * off
        gradient = pull[:, before, None] * unit[:, before] - pull[..., None] * unit
        hessian = values["kp"] * np.einsum("kai,kbj->kaibj", slope, slope)
        along = unit[..., :, None] * unit[..., None, :]
        block = (pull * per_length)[..., None, None] * (np.eye(2) - along) + values["kl"] * nv * along
        i = np.arange(nv)
        for m, n, sign in ((i, i, 1.0), (after, after, 1.0), (i, after, -1.0), (after, i, -1.0)):
            hessian[:, m, :, n, :] += sign * block.transpose(1, 0, 2, 3)
        energy = 0.5 * values["kp"] * excess**2 + 0.5 * values["kl"] * nv * np.sum(off**2, axis=1)
        return Terms(self.name, rings.sites, x - x[:, :1], energy, gradient, hessian)

    def slope(self, free: FreePolygon, params: Mapping[str, Any]) -> tuple[Array, Array]:
        """See `OutlineLaw`."""
        q = free.perimeter_of_side
        return q * self.tension(free, params), self._stiffness(params) * q**2

    def tension(self, free: FreePolygon, params: Mapping[str, Any]) -> Array:
        """See `OutlineLaw`."""
        rest = self.values(params)["p0"] * np.sqrt(free.rest_areas)
        return np.asarray(self._stiffness(params) * (free.perimeter - rest))

    def rest_perimeter(self, free: FreePolygon, params: Mapping[str, Any], tension: float) -> Array:
        """See `OutlineLaw`."""
        rest = self.values(params)["p0"] * np.sqrt(free.rest_areas)
        return np.asarray(rest - tension / self._stiffness(params))

    def _stiffness(self, params: Mapping[str, Any]) -> float:
        """Of a perimeter whose edges are equal."""
        values = self.values(params)
        return float(values["kp"] + values["kl"])


PERIMETER = PerimeterLaw()  # as entry points name it
