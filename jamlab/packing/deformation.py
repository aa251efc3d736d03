"""Change the box and carry the particles along: isotropic compression, shear, any homogeneous deformation.

During minimisation a box may take strains e_a under an outer pressure p. Box and sites then follow exp(sum of e_a M_a),
and the enthalpy H = U + p A changes by dH/de_a = A (p 1 - S) : M_a.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import finite_array, is_number
from jamlab.errors import InputError
from jamlab.packing.packing import Packing
from jamlab.packing.strain_map import ALONG_Y, SIMPLE_SHEAR, carried, check_admitted


def at_phi(packing: Packing, phi: float) -> Packing:
    """The packing compressed to nominal packing fraction phi, see `compression`. Disks keep their diameters and
    polygons their shapes, so that droplets are pushed together, not squeezed."""
    if not 0 < phi <= 2:
        raise InputError(f"phi = {phi}: a packing fraction must lie between 0 and 2")
    gradient = compression(packing).gradient(packing.phi / phi)
    moved = packing.positions + packing.centroids[packing.particle] @ (gradient - np.eye(2)).T
    if packing.fixed is not None:
        moved[packing.fixed_sites] = carried(packing, gradient)[packing.fixed_sites]
    return packing._trusted(box=packing.box @ gradient.T, positions=moved)


def at_positions(packing: Packing, positions: Array) -> Packing:
    """The packing at float64 positions of the right shape; of disks, nothing but their being finite is checked."""
    checks = packing.kind.deforms or not np.isfinite(positions).all()
    return packing.with_state(positions=positions) if checks else packing._trusted(positions=positions)


def sheared(packing: Packing, strain: float) -> Packing:
    """The packing after the affine simple shear x -> x + strain * y of box and every position."""
    return deformed(packing, shear_direction(packing, "simple").gradient(strain))[0]


def deformed(packing: Packing, gradient: Array) -> tuple[Packing, Array]:
    """The packing after the affine map r -> F r of box and every free site, turned so that box[0, 1] stays 0; fixed
    ones follow by `carried`. `gradient`: (2, 2) F, with positive determinant. Returns the packing, and the (2, 2)
    rotation R that was applied after F: a vector v of the packing returned is R^T v in the frame of the one given, a
    tensor S is R^T S R."""
    box = packing.box @ gradient.T
    along = box[0] / np.hypot(*box[0])
    rotation = np.array([[along[0], along[1]], [-along[1], along[0]]])
    box = box @ rotation.T
    box[0, 1] = 0.0  # rounding
    return packing._trusted(box=box, positions=carried(packing, gradient, rotation)), rotation


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


Direction = str | float  # see `shear_direction`
_GENERATORS = {"simple": SIMPLE_SHEAR, "pure": np.diag([0.5, -0.5])}


def shear_direction(packing: Packing, direction: Direction, angle: float = 0.0) -> ShearDirection:
    """Read a direction in which a packing is sheared, which its boundary conditions must admit. "simple": along x, with
    the gradient along y. "pure": without rotation, longer along x and shorter along y, by half the strain each. A
    number: simple shear along (cos, sin) of that angle, radian. `angle`: by which all of this is turned."""
    name, turn = (direction, 0.0) if isinstance(direction, str) else ("simple", direction)
    if name not in _GENERATORS or not is_number(turn):
        raise InputError(f'direction = {direction!r}: give "simple", "pure" or an angle in radians')
    c, s = np.cos(turn + angle), np.sin(turn + angle)
    found = ShearDirection(_GENERATORS[name], np.eye(2)).turned(np.array([[c, -s], [s, c]]))
    check_admitted(packing, found.generator, f"shear in the direction {direction!r}{f' + {angle:g}' if angle else ''}")
    return found


@dataclass(frozen=True, eq=False)
class Compression:
    """The change of area of a packing: a strain e = log of the area maps r to exp(e M) r, tr M = 1."""

    generator: Array  # (2, 2) M, diagonal

    def gradient(self, areas: float) -> Array:
        """(2, 2) deformation gradient that multiplies the area by `areas`."""
        return np.diag(np.sqrt(areas) ** (2 * np.diag(self.generator)))

    def pressure(self, stress: Array) -> float:
        """p = -dU/dA of a stress (2, 2)."""
        return float(np.sum(stress * self.generator))

    def modulus(self, curvature: Array, stress: Array) -> float:
        """B = -A dp/dA from d2(U/A) in the displacement gradient, (2, 2, 2, 2), and the stress (2, 2): the area of
        exp(e M) is quadratic in the displacement gradient, which brings in the stress."""
        m = self.generator
        beside = self.pressure(stress) - float(np.sum(stress * (m @ m)))
        return float(np.einsum("ij,ijkl,kl->", m, curvature, m)) + beside


ISOTROPIC, _BETWEEN_WALLS = Compression(0.5 * np.eye(2)), Compression(ALONG_Y)


def compression(packing: Packing) -> Compression:
    """How the area of a packing changes, with the pressure and the bulk modulus that belong to it: isotropic, and
    between walls along y alone, since walls keep their shape."""
    return _BETWEEN_WALLS if packing.walls else ISOTROPIC


def shear_gradient(strain: Array) -> Array:
    """(2, 2) deformation gradient of a shear at constant area: exp of a traceless strain."""
    size = float(np.sqrt(max(-np.linalg.det(strain), 0.0)))  # 0 of simple shear
    return np.asarray(np.cosh(size) * np.eye(2) + (np.sinh(size) / size if size else 1.0) * strain)


# strains that a box may take while its packing is relaxed -----------------------------------------------------------

# upper triangles: they leave the first lattice vector along x
COMPRESSION = np.eye(2)[None]
SHEARS = np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [0.0, 0.0]]])
PURE_SHEARS = np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]])  # without rotation


@dataclass(frozen=True)
class BoxStrains:
    """Strains that a box may take during minimisation, and the outer pressure.

    Attributes:
        strains: (m, 2, 2) upper triangular strain matrices M_a: COMPRESSION, SHEARS or both in one array.
        pressure: outer pressure; irrelevant if no strain changes the area.

    Example:
        >>> stretch = jamlab.BoxStrains(np.array([[[1.0, 0.0], [0.0, -1.0]]]))
        >>> stretch.pressure
        0.0
    """

    strains: Array
    pressure: float = 0.0

    def __post_init__(self) -> None:
        strains = finite_array("strains", self.strains, (None, 2, 2))
        if not len(strains) or strains[:, 1, 0].any():
            raise InputError(
                "strains must be upper triangular matrices, one or more: a box keeps its first edge along x"
            )
        object.__setattr__(self, "strains", strains)

    @property
    def may_shear(self) -> bool:
        """Whether a strain leaves the area."""
        return any(not np.trace(m) for m in self.strains)

    def gradient(self, stress: Array, area: float) -> Array:
        """(m,) dH/de_a at a stress (2, 2)."""
        return np.asarray(area * np.einsum("aij,ij->a", self.strains, self.pressure * np.eye(2) - stress))

    def excess(self, stress: Array) -> float:
        """Largest part of a stress (2, 2) along one of the strains that nothing balances."""
        lengths = np.sqrt(np.einsum("aij,aij->a", self.strains, self.strains))
        return float(np.abs(self.gradient(stress, 1.0) / lengths).max())

    def deformation(self, strain: Array) -> Array:
        """(2, 2) deformation gradient exp(sum of the strains), their amplitudes (m,)."""
        (a, b), (_, d) = np.einsum("a,aij->ij", strain, self.strains)
        half = 0.5 * (a - d)
        middle = np.exp(0.5 * (a + d)) * (np.sinh(half) / half if half else 1.0)
        return np.array([[np.exp(a), b * middle], [0.0, np.exp(d)]])

    def move(self, packing: Packing, displacement: Array, strain: Array) -> Packing:
        """The packing after strains of box and sites, amplitudes (m,), and displacements (n_sites, 2)."""
        f = self.deformation(strain)
        return packing.with_state(box=packing.box @ f.T, positions=carried(packing, f) + displacement)
