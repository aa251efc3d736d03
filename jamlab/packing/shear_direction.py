"""Shears at constant area: directions, deformation gradients, and the stress and modulus that belong to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arguments.choices import Direction, ShearName
from jamlab.arrays import Array
from jamlab.checks import is_number
from jamlab.errors import InputError
from jamlab.packing.packing import Packing
from jamlab.packing.strain_map import SIMPLE_SHEAR


@dataclass(frozen=True, eq=False)
class ShearDirection:
    """A shear at constant area: a strain g maps r to exp(g M) r."""

    generator: Array  # (2, 2) M, traceless
    axes: Array  # (2, 2) rows: unit vectors along and across the direction

    def gradient(self, strain: float) -> Array:
        """(2, 2) deformation gradient exp(g M) of a strain g."""
        return shear_gradient(strain * self.generator)

    def turned(self, rotation: Array) -> ShearDirection:
        """The same shear in a frame whose axes are the rows of a rotation (2, 2)."""
        return ShearDirection(rotation @ self.generator @ rotation.T, self.axes @ rotation.T)

    def conjugate(self, stress: Array) -> float:
        """Shear stress (tension positive) that does work on the strain, of a stress (2, 2) positive in compression."""
        return -float(np.sum(stress * self.generator))

    def couplings(self, couplings: Array) -> Array:
        """(m,) derivatives along the strain of m forces, from those (m, 2, 2) in the displacement gradient."""
        return np.asarray(np.einsum("nij,ij->n", couplings, self.generator))

    def modulus(self, curvature: Array, stress: Array) -> float:
        """d2(U/A)/dg2 from that in the displacement gradient, (2, 2, 2, 2), and the stress (2, 2), which works on the
        second order of exp(g M)."""
        m = self.generator
        return float(np.einsum("ij,ijkl,kl->", m, curvature, m) - np.sum(stress * (m @ m)))


_GENERATORS: dict[ShearName, Array] = {"simple": SIMPLE_SHEAR, "pure": np.diag([0.5, -0.5])}


def shear_direction(packing: Packing, direction: Direction) -> ShearDirection:
    """Read a direction in which a packing is sheared, which its boundary conditions must admit. "simple": along x, with
    the gradient along y. "pure": without rotation, longer along x and shorter along y, by half the strain each. A
    number: simple shear along (cos, sin) of that angle, radian."""
    name, turn = (direction, 0.0) if isinstance(direction, str) else ("simple", direction)
    if name not in _GENERATORS or not is_number(turn):
        raise InputError(f'direction = {direction!r}: give "simple", "pure" or an angle in radians')
    c, s = np.cos(turn), np.sin(turn)
    found = ShearDirection(_GENERATORS[name], np.eye(2)).turned(np.array([[c, -s], [s, c]]))
    packing.frame.check_admitted(found.generator, f"shear in the direction {direction!r}")
    return found


def shear_gradient(strain: Array) -> Array:
    """(2, 2) deformation gradient of a shear at constant area: exp of a traceless strain."""
    size = float(np.sqrt(max(-np.linalg.det(strain), 0.0)))  # 0 of simple shear
    return np.asarray(np.cosh(size) * np.eye(2) + (np.sinh(size) / size if size else 1.0) * strain)
