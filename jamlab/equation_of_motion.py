"""Linear equation of motion of a packing under oscillating shear, Baumgarten & Tighe eqs 10-12.

(K + i omega B) Q = dS A e_gamma with the Hessian K of the energy and the Hessian B of the Rayleigh function (their
eq 10 prints a dot on the first Q). At unit strain Q = (q, 1), and q follows from (K_qq + s B_qq) q = -(k + s b),
s = i omega, with the columns k, b of gamma.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from jamlab.damping import ContactDamping, Damping, damping_matrix
from jamlab.elasticity import backbone
from jamlab.errors import ConvergenceError, InputError
from jamlab.hessian import stiffness
from jamlab.packing import Packing
from jamlab.positive_solver import positive_solver
from jamlab.sparse_solver import SymmetricFactors

Array = NDArray[np.float64]

_LARGEST_RESIDUAL = 1e-6  # of a static solution; beyond it the network is floppy
_PROXIMAL_STEPS = 30
_FASTEST = 1e6  # shift of the fast limit over the rate at which dissipation outweighs elasticity
_NAMED = 6  # negative eigenvalues looked at for the message


def dynamical_matrices(
    packing: Packing, damping: Damping | None = None, prestress: bool = True
) -> tuple[sparse.csc_array, sparse.csc_array]:
    """Hessian K and damping matrix B of a packing, Baumgarten & Tighe eq 11, sparse and symmetric.

    Coordinates. SP, (3n + 1, 3n + 1): 2i, 2i + 1 = non-affine u_x, u_y of particle i; 2n + i = its rotation theta,
    counter-clockwise; last = shear strain gamma of x -> x + gamma y. DP, (2 n_vertices + 1, 2 n_vertices + 1): u_x, u_y
    of every vertex, then gamma; K holds perimeter, area and contact terms.

    Args:
        packing: SP or DP. Rattlers are kept: `equation_of_motion` leaves them out.
        damping: default balanced contact damping, `ContactDamping(beta=1)`.
        prestress: False sets the contact forces in K to zero (their eq 4). SP only.

    Raises:
        InputError: a packing of polygons without pre-stress: line tension is nothing but pre-stress.
    """
    if packing.model == "dp" and not prestress:
        raise InputError(
            "prestress = False: deformable polygons are held by line tension, which is pre-stress; use prestress=True"
        )
    k = stiffness(packing, prestress=prestress)
    spins = packing.n if packing.model == "sp" else 0
    column = sparse.coo_array(np.concatenate([k.ue[:, 0, 1], np.zeros(spins)])[:, None])
    corner = np.array([[k.ee[0, 1, 0, 1]]])
    inner = sparse.block_diag([k.uu, sparse.coo_array((spins, spins))]) if spins else k.uu
    hessian = sparse.block_array([[inner, column], [column.T, sparse.coo_array(corner)]], format="csc")
    return hessian, damping_matrix(packing, damping or ContactDamping())


@dataclass(frozen=True)
class EquationOfMotion:
    """K and B on the coordinates to solve for, m of them; gamma is kept apart.

    The first `moving` coordinates are displacements, the others rotations, which no energy depends on.

    Attributes:
        k, b: (m + 1, m + 1) sparse, the last row and column belong to gamma.
        k_qq, b_qq: (m, m) sparse blocks.
        k_qg, b_qg: (m,) columns of gamma.
        moving: number of displacements among the coordinates.
        drifting: True if drag acts on rigid translation. Then translations are zero modes of K alone and no particle
            may be held, which would be a force; otherwise site 0 is held.
        area: A of the cell.
    """

    k: sparse.csc_array
    b: sparse.csc_array
    k_qq: sparse.csc_array
    b_qq: sparse.csc_array
    k_qg: Array
    b_qg: Array
    moving: int
    drifting: bool
    area: float

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

    def shifted(self, shift: float) -> sparse.csc_array:
        """(m, m) K + s B with rotations scaled by sqrt(s), which is positive definite for every s > 0.

        Torques have to be divided, and rotations come out multiplied, by sqrt(s). Without torques that eliminates
        the rotations exactly.
        """
        if self.moving == self.size:
            return (self.k_qq + shift * self.b_qq).tocsc()
        scale = np.ones(self.size)
        scale[: self.moving] = np.sqrt(shift)
        diagonal = sparse.diags_array(scale)
        return (self.k_qq + diagonal @ self.b_qq @ diagonal).tocsc()


class ShiftedSolver:
    """Solves (K + s B) q = f for one real s > 0 after the other.

    Args:
        motion: equation of motion.
    """

    def __init__(self, motion: EquationOfMotion) -> None:
        self._motion = motion
        self._solver = positive_solver()
        self._root = 0.0

    def factorise(self, shift: float) -> None:
        """Take a shift s, 1/tau_1."""
        self._solver.factorise(self._motion.shifted(shift))
        self._root = float(np.sqrt(shift))

    def solve(self, load: Array) -> Array:
        """(m,) response to forces and torques (m,), less drift."""
        moving = self._motion.moving
        q = self._solver.solve(np.concatenate([load[:moving], load[moving:] / self._root]))
        q[moving:] /= self._root
        return self._motion.without_drift(q)


@dataclass(frozen=True)
class Limits:
    """Response at unit strain when the strain is infinitely slow or fast.

    Attributes:
        slow: (m,) q of least energy; rotations dissipate least.
        fast: (m,) q of least dissipation, and among those of least energy.
        g0: G'(omega -> 0).
        eta_inf: lim G''/omega, omega -> infinity; 0 where drag leaves a way to flow without dissipation.
        eta0: lim G''/omega, omega -> 0.
    """

    slow: Array
    fast: Array
    g0: float
    eta_inf: float
    eta0: float


def equation_of_motion(packing: Packing, damping: Damping, prestress: bool = True) -> EquationOfMotion:
    """Equation of motion of the backbone of a packing; rattlers are left out.

    Args:
        packing: SP or DP at an energy minimum.
        damping: viscous law.
        prestress: see `dynamical_matrices`.

    Raises:
        ConvergenceError: every particle rattles.
        InputError: see `dynamical_matrices`.
    """
    network, _ = backbone(packing)
    k, b = dynamical_matrices(network, damping, prestress)
    sites = len(network.positions)
    drifting = not isinstance(damping, ContactDamping)
    # without drag on sliding, and under Stokes drag, rotations enter nowhere
    spinning = isinstance(damping, ContactDamping) and damping.beta > 0 and network.model == "sp"
    first = 0 if drifting else 2
    free = np.arange(first, 3 * sites if spinning else 2 * sites)
    kept = np.append(free, k.shape[0] - 1)
    k, b = k[kept][:, kept], b[kept][:, kept]
    return EquationOfMotion(
        k=k,
        b=b,
        k_qq=k[:-1][:, :-1].tocsc(),
        b_qq=b[:-1][:, :-1].tocsc(),
        k_qg=k[:-1][:, [-1]].toarray()[:, 0],
        b_qg=b[:-1][:, [-1]].toarray()[:, 0],
        moving=2 * sites - first,
        drifting=drifting,
        area=packing.area,
    )


def limits(motion: EquationOfMotion) -> Limits:
    """Slow and fast limit of the response, and the moduli that follow from them.

    Raises:
        ConvergenceError: K has a negative eigenvalue, which is named, or another zero mode than translations.
    """
    slow = _slow(motion)
    fast = _fast(motion)
    strained_slow, strained_fast = np.append(slow, 1.0), np.append(fast, 1.0)
    dissipation = float(strained_fast @ (motion.b @ strained_fast))
    magnitude = float(np.abs(strained_fast) @ (abs(motion.b) @ np.abs(strained_fast)))
    if dissipation <= float(np.finfo(np.float64).eps) * magnitude:  # nothing is left but rounding
        dissipation = 0.0
    return Limits(
        slow=slow,
        fast=fast,
        g0=float(strained_slow @ (motion.k @ strained_slow)) / motion.area,
        eta_inf=dissipation / motion.area,
        eta0=float(strained_slow @ (motion.b @ strained_slow)) / motion.area,
    )


def held_stiffness(motion: EquationOfMotion) -> tuple[sparse.csc_array, int]:
    """K of the displacements with site 0 held, and the number of coordinates in front that are held only here."""
    held = 2 if motion.drifting else 0
    return motion.k_qq[held : motion.moving, held : motion.moving].tocsc(), held


def _slow(motion: EquationOfMotion) -> Array:
    matrix, held = held_stiffness(motion)
    solver = positive_solver()
    try:
        solver.factorise(matrix, check=True)
    except ConvergenceError as error:
        raise _unstable(matrix) from error
    right = -motion.k_qg[held : motion.moving]
    response = solver.solve(right)
    response += solver.solve(right - matrix @ response)
    scale = np.abs(right).max()
    residual = np.abs(right - matrix @ response).max()
    if not residual <= _LARGEST_RESIDUAL * scale:
        raise ConvergenceError(f"the packing has a floppy mode: its static response leaves {residual / scale:.2g}")
    q = np.zeros(motion.size)
    q[held : motion.moving] = response
    q = motion.without_drift(q)
    if motion.size > motion.moving:
        torque = (motion.b_qq @ q + motion.b_qg)[motion.moving :]
        solver.factorise(motion.b_qq[motion.moving :, motion.moving :].tocsc())
        q[motion.moving :] = -solver.solve(torque)
    return q


def _fast(motion: EquationOfMotion) -> Array:
    """Least dissipation, by proximal steps: B alone may be singular, K + s B is not.

    The first step is the exact response at s, so what B leaves free takes least energy; every further step keeps that
    and divides the imbalance of B by about 1 + s over the fastest rate.
    """
    moving = motion.moving
    shift = _FASTEST * motion.k_qq.diagonal()[:moving].max() / motion.b_qq.diagonal()[:moving].max()
    solver = ShiftedSolver(motion)
    solver.factorise(shift)
    q = -solver.solve(motion.k_qg + shift * motion.b_qg)
    last = np.inf
    for _ in range(_PROXIMAL_STEPS):
        step = solver.solve(shift * (motion.b_qq @ q + motion.b_qg))
        size = float(np.abs(step).max())
        if not size < 0.5 * last:  # rounding is reached
            break
        q = q - step
        last = size
    return q


def _unstable(matrix: sparse.csc_array) -> ConvergenceError:
    """What to say about a matrix that is not positive definite."""
    factors = SymmetricFactors(matrix)
    if not factors.negative:
        return ConvergenceError("the packing has a floppy mode: its Hessian is singular")
    return ConvergenceError(
        f"the packing is unstable: its Hessian has {factors.negative} negative mode(s), an eigenvalue is "
        f"{_negative_eigenvalue(matrix, factors):.3g}; it is not at a minimum of its energy"
    )


def _negative_eigenvalue(matrix: sparse.csc_array, factors: SymmetricFactors) -> float:
    """The lowest of the negative eigenvalues next to zero, by Lanczos iteration on the inverse."""
    size = matrix.shape[0]
    if size <= 4 * _NAMED:
        return float(np.linalg.eigvalsh(matrix.toarray())[0])
    inverse = linalg.LinearOperator((size, size), matvec=factors.solve, dtype=np.float64)
    wanted = min(_NAMED, factors.negative)
    found = linalg.eigsh(matrix, k=wanted, sigma=0.0, which="SA", OPinv=inverse, return_eigenvectors=False)
    return float(found.min())
