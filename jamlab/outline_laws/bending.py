"""Bending stiffness of outlines, as of vesicles and cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.laws.parameter import WIDEST, Parameter
from jamlab.outline_laws.outline_law import FreePolygon, OutlineLaw, PolygonRings
from jamlab.packing.terms import Terms

_BUCKLES = 2.5  # line tension -2.5 kappa/R^2 of a ring under the pressure 3 kappa/R^3 that buckles it


class BendingLaw(OutlineLaw):
    """E = (kappa/2) sum over vertices (theta - theta_0)^2/l, bending of outlines.

    theta is the signed turning angle of the outline at a vertex, l half the length of both its edges, theta_0 = theta0
    2 pi/nv. Deformable particles whose edges have a rest length l_0 bend by (k_b/2) sum (theta - theta_0)^2 (Treado et
    al., Phys. Rev. Materials 5, 055605 (2021); Wang et al., arXiv:2108.09616): this is the same for edges of equal
    length, with kappa = k_b l_0. Without rest lengths that form leaves sharp corners free, because an angle that is
    shared out among ever shorter edges costs ever less. With the length an outline costs what a smooth one does,
    (kappa/2) times the integral of the squared curvature (Helfrich, Z. Naturforsch. C 28, 693 (1973)): pi kappa/R of a
    ring of radius R. A corner that two vertices share, with an edge of no length between them, costs what one vertex
    does, so stiff outlines need elastic edges (`PerimeterLaw`, kl) to keep vertices apart.
    """

    name: ClassVar[str] = "bending"
    strength: ClassVar[str] = "kappa"
    fix_style: ClassVar[str] = "polygon/bending"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "kappa": Parameter(
            energy=1,
            length=1,
            default=0.0,
            may_vanish=True,
            made=(1 / WIDEST, WIDEST),
            meaning="bending stiffness of outlines",
        ),
        "theta0": Parameter(
            default=1.0,
            least=1e-9,
            largest=100.0,
            may_vanish=True,
            meaning="preferred turning angle of a vertex, over 2 pi/nv: 0 straight, 1 regular polygon",
        ),
    }

    def terms(self, rings: PolygonRings, params: Mapping[str, Any]) -> Terms:
        """See `OutlineLaw`. Sites: the vertex before, the vertex, the next one."""
        values, (k, nv) = self.values(params), rings.sites.shape
        before, after = np.roll(np.arange(nv), 1), np.roll(np.arange(nv), -1)
        x = rings.positions
        a, b = (x - x[:, before]).reshape(-1, 2), (x[:, after] - x).reshape(-1, 2)
        sites = np.stack([rings.sites[:, before], rings.sites, rings.sites[:, after]], axis=-1).reshape(-1, 3)
        energy, gradient, hessian = bending(a, b, values["kappa"], values["theta0"] * 2 * np.pi / nv)
        local = np.stack([np.zeros_like(a), a, a + b], axis=1)
        to_edges = np.kron(np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]]), np.eye(2))
        gradient = gradient @ to_edges
        hessian = to_edges.T @ hessian @ to_edges
        count = k * nv
        return Terms(self.name, sites, local, energy, gradient.reshape(count, 3, 2), hessian.reshape(count, 3, 2, 3, 2))

    def slope(self, free: FreePolygon, params: Mapping[str, Any]) -> tuple[Array, Array]:
        """See `OutlineLaw`: the energy of a regular polygon goes as 1/s."""
        values, turn = self.values(params), 2 * np.pi / free.nv
        energy = 0.5 * values["kappa"] * (turn * (1 - values["theta0"])) ** 2 * free.nv**2 / free.perimeter
        return -energy / free.side, 2 * energy / free.side**2

    def tension(self, free: FreePolygon, params: Mapping[str, Any]) -> Array:
        """See `OutlineLaw`: the stiffness of a smooth ring against an elliptic shape."""
        return np.asarray(_BUCKLES * self.values(params)["kappa"] * (2 * np.pi / free.perimeter) ** 2)


def bending(a: Array, b: Array, kappa: float, turn: float) -> tuple[Array, Array, Array]:
    """Energy (k,), gradient (k, 4) and Hessian (k, 4, 4) of (kappa/2)(theta - turn)^2/l by two edges a, b (k, 2)."""
    length_a, length_b = np.hypot(*a.T), np.hypot(*b.T)
    if not (np.all(length_a > 0) and np.all(length_b > 0)):
        raise InputError("an edge of a droplet with bending stiffness has length 0, and no direction: move its ends")
    theta = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.einsum("ki,ki->k", a, b))
    off, length = theta - turn, 0.5 * (length_a + length_b)
    d_angle, dd_angle = np.zeros((len(a), 4)), np.zeros((len(a), 4, 4))
    d_length, dd_length = np.zeros((len(a), 4)), np.zeros((len(a), 4, 4))
    for sign, edge, size, own in ((-1.0, a, length_a, slice(0, 2)), (1.0, b, length_b, slice(2, 4))):
        (x, y), square = edge.T, size**2
        unit = edge / size[:, None]
        d_angle[:, own] = sign * np.column_stack([-y, x]) / square[:, None]
        mixed, other = 2 * x * y / square**2, (y**2 - x**2) / square**2
        dd_angle[:, own, own] = sign * np.stack([mixed, other, other, -mixed], axis=-1).reshape(-1, 2, 2)
        d_length[:, own] = 0.5 * unit
        dd_length[:, own, own] = 0.5 * (np.eye(2) - unit[:, :, None] * unit[:, None, :]) / size[:, None, None]
    energy = 0.5 * kappa * off**2 / length
    along, across = kappa * off / length, energy / length  # dE/dtheta, -dE/dl
    gradient = along[:, None] * d_angle - across[:, None] * d_length
    both = d_angle[:, :, None] * d_length[:, None, :]
    hessian = (
        (kappa / length)[:, None, None] * d_angle[:, :, None] * d_angle[:, None, :]
        + along[:, None, None] * dd_angle
        - (along / length)[:, None, None] * (both + both.transpose(0, 2, 1))
        - across[:, None, None] * dd_length
        + (2 * across / length)[:, None, None] * d_length[:, :, None] * d_length[:, None, :]
    )
    return energy, gradient, hessian


BENDING = BendingLaw()  # as entry points name it
