"""Complex shear modulus G*(omega) of packings of disks, Baumgarten & Tighe eqs 10-13.

(K + i omega B) Q = dS A e_gamma and G* = dS/gamma (their eq 13 is printed upside down, their eq 10 with a stray dot).
Eliminating everything but gamma gives G* = (M_gg - M_gq M_qq^-1 M_qg)/A with M = K + i omega B.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from jamlab.damping import ContactDamping, Damping, damping_matrix
from jamlab.elasticity import backbone
from jamlab.errors import ConvergenceError, InputError
from jamlab.hessian import stiffness
from jamlab.packing import Packing
from jamlab.sparse_solver import SymmetricFactors

Array = NDArray[np.float64]

METHODS = ("auto", "direct")


@dataclass(frozen=True)
class ComplexModulus:
    """Shear response over frequency, in the packing's unit of stress and with times in tau_1.

    Attributes:
        omega: (m,) angular frequencies, 1/tau_1.
        storage: (m,) G'.
        loss: (m,) G''.
        g0: static modulus, G'(omega -> 0).
        eta0: lim G''/omega at low frequency.
        eta_inf: lim G''/omega at high frequency.
        method: solver used.
        error: (m,) estimate of |error of G*|/|G*|, from one step of iterative refinement.
    """

    omega: Array
    storage: Array
    loss: Array
    g0: float
    eta0: float
    eta_inf: float
    method: str
    error: Array


def dynamical_matrices(
    packing: Packing, damping: Damping | None = None, prestress: bool = True
) -> tuple[sparse.csc_array, sparse.csc_array]:
    """Hessian K and damping matrix B of a packing of disks, Baumgarten & Tighe eq 11, each (3n + 1, 3n + 1) sparse.

    Coordinates: 2i, 2i + 1 = non-affine u_x, u_y of particle i; 2n + i = its rotation theta, counter-clockwise; last =
    shear strain gamma of x -> x + gamma y.

    Args:
        packing: SP.
        damping: default balanced contact damping, `ContactDamping(beta=1)`.
        prestress: False sets the contact forces in K to zero (their eq 4).

    Raises:
        InputError: for packings of polygons.
    """
    if packing.model != "sp":
        raise InputError("G*(omega) of deformable polygons is not available yet: use a packing of disks (model sp)")
    n = packing.n
    k = stiffness(packing, prestress=prestress)
    column = sparse.coo_array(np.concatenate([k.ue[:, 0, 1], np.zeros(n)])[:, None])
    corner = np.array([[k.ee[0, 1, 0, 1]]])
    spin = sparse.coo_array((n, n))
    inner = sparse.block_diag([k.uu, spin])
    hessian = sparse.block_array([[inner, column], [column.T, sparse.coo_array(corner)]], format="csc")
    return hessian, damping_matrix(packing, damping or ContactDamping())


def complex_modulus(
    packing: Packing,
    omega: ArrayLike,
    damping: Damping | None = None,
    prestress: bool = True,
    method: str = "auto",
) -> ComplexModulus:
    """G*(omega) of a packing of disks; rattlers are left out.

    Args:
        packing: SP at an energy minimum.
        omega: (m,) angular frequencies, positive, in units 1/tau_1.
        damping: `ContactDamping` (default, beta = 1) or `StokesDrag`.
        prestress: False replaces contacts by unstressed springs.
        method: "direct": one complex symmetric sparse factorisation per frequency. "auto" is "direct".

    Raises:
        InputError: a frequency that is not positive, an unknown method, a packing of polygons.
        ConvergenceError: the packing is not jammed or not stable.
    """
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}: use one of {', '.join(METHODS)}")
    damping = damping or ContactDamping()
    try:
        frequencies = np.atleast_1d(np.asarray(omega, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError(f"omega = {omega!r}: frequencies must be numbers") from None
    if frequencies.ndim != 1:
        raise InputError(f"omega has shape {frequencies.shape}: give one number or one row of frequencies")
    bad = frequencies[~(np.isfinite(frequencies) & (frequencies > 0))]
    if len(bad):
        raise InputError(f"omega = {bad[0]}: frequencies must be positive and finite")

    network, _ = backbone(packing) if packing.model == "sp" else (packing, None)
    k, b = dynamical_matrices(network, damping, prestress)
    free = _free_coordinates(network.n, damping)
    n_u = int(np.count_nonzero(free < 2 * network.n))
    k_qq, b_qq = k[free][:, free], b[free][:, free]
    k_qg, b_qg = (m[free][:, [-1]].toarray()[:, 0] for m in (k, b))
    k_gg, b_gg = float(k[-1, -1]), float(b[-1, -1])

    displaced = _static_response(k_qq[:n_u, :n_u], k_qg[:n_u], held=isinstance(damping, ContactDamping))
    spun = _least_dissipation(b_qq, b_qg, displaced)
    area = packing.area
    eta_inf_column = _solve_real(b_qq, b_qg) if b_qg.any() else np.zeros_like(b_qg)

    modulus = np.empty(len(frequencies), dtype=np.complex128)
    error = np.empty(len(frequencies))
    for index, w in enumerate(frequencies):
        matrix = (k_qq + 1j * w * b_qq).tocsc()
        column = k_qg + 1j * w * b_qg
        factors = SymmetricFactors(matrix)
        q = factors.solve(column)
        correction = factors.solve(column - matrix @ q)
        q += correction
        value = (k_gg + 1j * w * b_gg - column @ q) / area
        modulus[index] = value
        error[index] = abs(column @ correction) / area / abs(value)
    return ComplexModulus(
        omega=frequencies,
        storage=modulus.real.copy(),
        loss=modulus.imag.copy(),
        g0=float((k_gg + k_qg[:n_u] @ displaced) / area),
        eta0=float((b_gg + 2 * b_qg @ spun + spun @ (b_qq @ spun)) / area),
        eta_inf=float((b_gg - b_qg @ eta_inf_column) / area),
        method="direct",
        error=error,
    )


def _free_coordinates(n: int, damping: Damping) -> NDArray[np.int64]:
    """Coordinates to solve for.

    Contact damping leaves translations free: hold particle 0. Stokes drag does not, and holding one would be a force.
    Without sliding friction rotations enter nowhere.
    """
    if isinstance(damping, ContactDamping):
        return np.arange(2, 3 * n if damping.beta > 0 else 2 * n)
    return np.arange(2 * n)


def _static_response(k_uu: sparse.csc_array, k_ug: Array, *, held: bool) -> Array:
    """du/dgamma at zero frequency. Under Stokes drag the mean displacement is zero."""
    start = 0 if held else 2
    factors = SymmetricFactors(k_uu[start:, start:])
    if factors.negative:
        raise ConvergenceError(
            f"the packing is unstable: its Hessian has {factors.negative} negative mode(s), it is not at a minimum"
        )
    response = np.zeros(len(k_ug))
    response[start:] = -factors.solve(k_ug[start:])
    if not held:
        response -= np.tile(response.reshape(-1, 2).mean(axis=0), len(response) // 2)
    return response


def _least_dissipation(b_qq: sparse.csc_array, b_qg: Array, displaced: Array) -> Array:
    """All rates at low frequency: displacements follow the static response, rotations dissipate least."""
    n_u, size = len(displaced), len(b_qg)
    rates = np.concatenate([displaced, np.zeros(size - n_u)])
    if size > n_u:
        torque = (b_qq @ rates + b_qg)[n_u:]
        rates[n_u:] = -SymmetricFactors(b_qq[n_u:, n_u:]).solve(torque)
    return rates


def _solve_real(matrix: sparse.csc_array, right: Array) -> Array:
    solution: Array = SymmetricFactors(matrix).solve(right)
    return solution
