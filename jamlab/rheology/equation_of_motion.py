"""Linear equation of motion of a packing under oscillating shear, Baumgarten & Tighe eqs 10-12.

(K + i omega B) Q = dS A e_gamma with the Hessian K of the energy and the Hessian B of the Rayleigh function. At unit
strain Q = (q, 1), and q follows from (K_qq + s B_qq) q = -(k + s b), s = i omega, with the columns k, b of gamma.

With masses, K + i omega B - omega^2 M. The coordinates q are displacements relative to the affine flow, and their
momenta are peculiar, so gamma has no mass: A. Lemaitre and C. Maloney, J. Stat. Phys. 123, 415 (2006).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np

from jamlab.arguments.choices import Direction
from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.laws.pair_law import PairLaw
from jamlab.mechanics.force_network import ForceNetwork
from jamlab.mechanics.masses import Masses, mass_matrix_diagonal, particle_masses
from jamlab.mechanics.stiffness import solved_coordinates, stiffness, stress
from jamlab.packing.packing import Packing
from jamlab.packing.shear_direction import shear_direction
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw, nothing_along_walls

if TYPE_CHECKING:
    from scipy import sparse

    Matrices = tuple[sparse.csc_array, sparse.csc_array]
    InertialMatrices = tuple[sparse.csc_array, sparse.csc_array, sparse.csc_array]


@overload
def dynamical_matrices(
    packing: Packing,
    damping: DragLaw | None = None,
    *,
    prestress: bool = True,
    direction: Direction = "simple",
    masses: None = None,
) -> Matrices: ...
@overload
def dynamical_matrices(
    packing: Packing,
    damping: DragLaw | None = None,
    *,
    prestress: bool = True,
    direction: Direction = "simple",
    masses: Masses,
) -> InertialMatrices: ...
@checked
def dynamical_matrices(
    packing: Packing,
    damping: DragLaw | None = None,
    *,
    prestress: bool = True,
    direction: Direction = "simple",
    masses: Masses | None = None,
) -> Matrices | InertialMatrices:
    """Hessian K and damping matrix B of a packing, Baumgarten & Tighe eq 11, sparse and symmetric; with masses M too.

    Coordinates. SP, (3n + 1, 3n + 1): 2i, 2i + 1 = non-affine u_x, u_y of particle i; 2n + i = its rotation theta,
    counter-clockwise; last = shear strain gamma, by default x -> x + gamma y. DP, (2 n_vertices + 1, 2 n_vertices
    + 1): u_x, u_y of every vertex, then gamma; K holds perimeter, area and contact terms. M is diagonal: masses,
    moments of inertia m R^2/2 of uniform disks, and 0 of gamma, since momenta are relative to the affine flow.

    Args:
        packing: SP or DP. Rattlers are included. Fixed particles have zero rows in K and their drag in B.
        damping: default balanced contact damping, `ContactDamping(beta=1)`.
        prestress: False sets the contact forces in K to zero (eq 4). SP only.
        direction: shear direction, see `complex_modulus`.
        masses: as in `complex_modulus`; None: no M.

    Returns:
        K and B, or K, B and M.

    Raises:
        InputError: droplets with prestress=False, because line tension is a pre-stress; a mass that is not positive.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> k, b = jamlab.dynamical_matrices(p, damping=jamlab.StokesDrag(eta_f=1.0))
        >>> k.shape == b.shape == (3 * p.n + 1, 3 * p.n + 1)
        True
    """
    k, b = _assemble(packing, damping or ContactDamping(), prestress, packing, direction)
    if masses is None:
        return k, b
    from scipy import sparse

    diagonal = mass_matrix_diagonal(packing, particle_masses(packing, masses))
    return k, b, sparse.diags_array(diagonal, format="csc")


def _assemble(
    packing: Packing, damping: DragLaw, prestress: bool, whole: Packing, direction: Direction
) -> tuple[sparse.csc_array, sparse.csc_array]:
    """K and B of `dynamical_matrices`."""
    from scipy import sparse

    k, spins = stiffness(packing, prestress=prestress), packing.kind.rotations(packing)
    shear = shear_direction(packing, direction)
    column = np.concatenate([shear.couplings(k.ue), np.zeros(spins)])
    corner = shear.modulus(k.ee, packing.area * stress(packing) if prestress else np.zeros((2, 2)))
    inner = sparse.block_diag([k.uu, sparse.coo_array((spins, spins))]) if spins else k.uu
    return _bordered(inner, column, corner), damping.matrix(packing, whole, direction)


def _bordered(inner: sparse.csc_array, column: Array, corner: float) -> sparse.csc_array:
    """Add the row and column of gamma."""
    from scipy import sparse

    edge = sparse.coo_array(column[:, None])
    return sparse.block_array([[inner, edge], [edge.T, sparse.coo_array([[corner]])]], format="csc")


@dataclass(frozen=True)
class BorderedMatrix:
    """A symmetric matrix (m + 1, m + 1) whose last row and column, those of gamma, are stored apart."""

    inner: sparse.csc_array  # (m, m)
    edge: Array  # (m,)
    corner: float

    def __matmul__(self, q: Array) -> Array:
        """Product with (m + 1,) or (m + 1, j); the transpose, which is the matrix itself, multiplies row by row."""
        last = self.edge @ q[:-1] + self.corner * q[-1]
        return np.concatenate([self.inner.T @ q[:-1] + np.multiply.outer(self.edge, q[-1]), last[None]])

    def __abs__(self) -> BorderedMatrix:
        return BorderedMatrix(abs(self.inner), np.abs(self.edge), abs(self.corner))

    def toarray(self) -> Array:
        """All elements."""
        return np.asarray(_bordered(self.inner, self.edge, self.corner).toarray())


@dataclass(frozen=True)
class Traces:
    """What is added to matrices that have no inverse, and what counts as 0."""

    # of the drag on each coordinate, that solvers add to motions that no contact resists; answers are refined
    # without it
    drag: float = 1e-10
    stiffness: float = 1e-13  # likewise, of the largest
    rounding: float = 1e-13  # of the sum of the drag on each coordinate


TRACES = Traces()


@dataclass(frozen=True)
class EquationOfMotion:
    """K and B on the coordinates to solve for, m of them; gamma is kept apart. The first `moving` coordinates are
    displacements, the others rotations, which no energy depends on; of particles that turn without
    drag, `DragLaw.gears`, one is held, unless they have masses. Fixed particles are not among them; walls move with
    gamma."""

    # k_qq, b_qq: (m, m) sparse
    k_qq: sparse.csc_array
    b_qq: sparse.csc_array
    # k_qg, b_qg: (m,) columns of gamma
    k_qg: Array
    b_qg: Array
    # k_gg, b_gg: element of gamma
    k_gg: float
    b_gg: float
    moving: int  # number of displacements among the coordinates
    # True if drag or inertia acts on rigid translation. Then translations are zero modes of K alone and no particle may
    # be held, which would be a force; otherwise site 0 is held, unless some are fixed.
    drifting: bool
    displaced: Indices  # (moving,) coordinates 2 i, 2 i + 1 of the packing that the first ones are
    area: float  # A of the cell
    # ratio of tangential to normal damping, the beta of contact damping; 1 if drag has no such parts
    contrast: float = 1.0
    floppy: float = PairLaw.floppy
    loose: bool = False  # whether chains of disks may roll past each other without elastic force or drag
    mass: Array | None = None  # (m,) masses and moments of inertia; None: motion is overdamped

    @property
    def k_solved(self) -> sparse.csc_array:
        """k_qq to factorise beside B, with a trace of stiffness where there may be none."""
        if not self.loose:
            return self.k_qq
        from scipy import sparse

        trace = np.where(np.arange(self.size) < self.moving, TRACES.stiffness * self.k_qq.diagonal().max(), 0.0)
        return self.k_qq + sparse.diags_array(trace, format="csc")

    @property
    def b_solved(self) -> sparse.csc_array:
        """b_qq to factorise beside K, with a trace of drag where there may be none."""
        if not self.loose:
            return self.b_qq
        from scipy import sparse

        return self.b_qq + TRACES.drag * sparse.diags_array(self.b_qq.diagonal(), format="csc")

    @property
    def k(self) -> BorderedMatrix:
        """(m + 1, m + 1): the last row and column belong to gamma."""
        return BorderedMatrix(self.k_qq, self.k_qg, self.k_gg)

    @property
    def b(self) -> BorderedMatrix:
        """(m + 1, m + 1): the last row and column belong to gamma."""
        return BorderedMatrix(self.b_qq, self.b_qg, self.b_gg)

    @property
    def size(self) -> int:
        """Number of coordinates m."""
        return int(self.k_qq.shape[0])

    @property
    def translations(self) -> Array:
        """(m, 2) rigid translation along x and along y."""
        axes = np.zeros((self.size, 2))
        axes[0 : self.moving : 2, 0] = axes[1 : self.moving : 2, 1] = 1.0
        return axes

    def without_drift(self, q: Array) -> Array:
        """q (m,) or (m, j) less the rigid translation that feels a net drag; without drag on translations q itself."""
        if not self.drifting:
            return q
        axes = self.translations
        drag = self.b_qq @ axes
        moved: Array = q - axes @ np.linalg.solve(axes.T @ drag, drag.T @ q)
        return moved


def equation_of_motion(
    network: ForceNetwork,
    damping: DragLaw,
    *,
    prestress: bool = True,
    direction: Direction = "simple",
    masses: Array | None = None,
) -> EquationOfMotion:
    """Set up the equation of motion of a packing at an energy minimum, without rattlers; see `dynamical_matrices`.
    `masses`: (n,) of the packing without them; None: motion is overdamped."""
    packing = network.packing
    if len(packing.positions) == 1:
        raise InputError(
            "a single disk has no degrees of freedom besides the box, so G* does not relax; use "
            "jamlab.shear_modulus and the last element of jamlab.dynamical_matrices"
        )
    k, b = _assemble(packing, damping, prestress, network.whole, direction)
    sites = len(packing.positions)
    drifting = packing.frame.all_free and (masses is not None or _drags_along(b, np.arange(2 * sites)))
    if packing.frame.slips and not _drags_along(b, 2 * np.flatnonzero(packing.frame.free_sites)):
        raise InputError(nothing_along_walls(packing, damping))
    displaced = np.arange(2 * sites) if drifting else solved_coordinates(packing)
    turning = np.flatnonzero(packing.frame.free[: packing.kind.rotations(packing)])
    turning = turning[b.diagonal()[2 * sites + turning] > 0]  # else rotations enter nowhere
    solved = displaced
    if len(turning):
        held = damping.gears(packing, b) if masses is None else []
        solved = np.concatenate([displaced, 2 * sites + np.setdiff1d(turning, held)])
    carried = np.zeros(k.shape[0])  # by the strain: nothing but itself, and walls
    carried[: 2 * sites] = (packing.frame.wall_offsets @ shear_direction(packing, direction).generator.T).ravel()
    carried[-1] = 1.0
    (k_qq, k_qg, k_gg), (b_qq, b_qg, b_gg) = _cut(k, solved, carried), _cut(b, solved, carried)
    law, contrast = packing.law, damping.contrast
    matrices = k_qq, b_qq, k_qg, b_qg, k_gg, b_gg
    moving = len(displaced), drifting, displaced
    mass = None if masses is None else mass_matrix_diagonal(packing, masses)[solved]
    return EquationOfMotion(*matrices, *moving, packing.area, contrast, law.floppy, law.range > 0, mass)


def _drags_along(matrix: sparse.csc_array, together: Indices) -> bool:
    """Whether drag resists that coordinates move together, by more than sums over contacts round off."""
    part = matrix[together][:, together]
    return bool(abs(part.sum()) > TRACES.rounding * part.diagonal().sum())


def _cut(matrix: sparse.csc_array, solved: Indices, carried: Array) -> tuple[sparse.csc_array, Array, float]:
    """The coordinates to solve for of a bordered matrix, their column of what the strain carries along, and its own
    element."""
    column = matrix @ carried
    return matrix[solved][:, solved].tocsc(), column[solved], float(carried @ column)
