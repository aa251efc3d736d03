"""Viscous force laws of Baumgarten & Tighe and their damping matrices."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.energy_terms import disk_law
from jamlab.errors import InputError
from jamlab.neighbors import periodic_pairs
from jamlab.packing import Packing

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactDamping:
    """Drag on the relative velocity at every contact, Baumgarten & Tighe eqs 5 and 6.

    R = (tau_1/2) sum k_ij [(du_par')^2 + beta (du_perp' - R_i theta_i' - R_j theta_j')^2]; k_ij is the stiffness of the
    contact, which is k in their units.

    Attributes:
        beta: damping of sliding over damping of approach; 1 is "balanced".
        tau: tau_1, the relaxation time of two disks.
    """

    beta: float = 1.0
    tau: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.beta) and self.beta >= 0):
            raise InputError(f"beta = {self.beta}: must be 0 or more")
        _check_time(self.tau)


@dataclass(frozen=True)
class StokesDrag:
    """Drag against the affine flow on every particle, Baumgarten & Tighe eqs 7 and 8.

    R = (k tau_1/2) sum |u_i' - v_aff(r_i)|^2 + (eta_F/2) gamma'^2 A.

    Attributes:
        eta_f: viscosity of the fluid, units k tau_1.
        tau: tau_1; the drag coefficient is k tau_1.
    """

    eta_f: float = 1.0
    tau: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.eta_f) and self.eta_f >= 0):
            raise InputError(f"eta_f = {self.eta_f}: must be 0 or more")
        _check_time(self.tau)


Damping = ContactDamping | StokesDrag


def _check_time(tau: float) -> None:
    if not (np.isfinite(tau) and tau > 0):
        raise InputError(f"tau = {tau}: must be a positive time")


def damping_matrix(packing: Packing, damping: Damping) -> sparse.csc_array:
    """(3n + 1, 3n + 1) Hessian B of the Rayleigh function R of a packing of disks.

    Coordinates: 2i, 2i + 1 = non-affine velocity of disk i; 2n + i = angular velocity of disk i, counter-clockwise;
    last = shear rate of x -> x + gamma y. Positions move as u + gamma y x^, so the drag against the affine flow acts
    on u alone.
    """
    if isinstance(damping, StokesDrag):
        return _stokes(packing, damping)
    return _contact(packing, damping)


def _stokes(packing: Packing, damping: StokesDrag) -> sparse.csc_array:
    n = packing.n
    diagonal = np.zeros(3 * n + 1)
    diagonal[: 2 * n] = _drag_stiffness(packing) * damping.tau
    diagonal[-1] = damping.eta_f * packing.area
    return sparse.diags_array(diagonal, format="csc")


def _drag_stiffness(packing: Packing) -> float:
    """k of units "k"; eps over the squared mean diameter, 1, in units "eps"."""
    return float(packing.params["k"] if packing.units == "k" else packing.params["eps"])


def _contact(packing: Packing, damping: ContactDamping) -> sparse.csc_array:
    assert packing.diameters is not None
    n = packing.n
    near = periodic_pairs(packing.positions, packing.box, float(packing.diameters.max()))
    touching = np.hypot(*near.r.T) < 0.5 * (packing.diameters[near.i] + packing.diameters[near.j])
    i, j, r = near.i[touching], near.j[touching], near.r[touching]
    distance = np.hypot(*r.T)
    _, _, stiffness = disk_law(packing, np.column_stack([i, j]), distance)
    normal = r / distance[:, None]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    radius = 0.5 * packing.diameters

    # one row per contact: approach and sliding as linear functions of all rates
    rows = np.arange(len(i))
    flow = r[:, 1]  # affine velocity difference along x at unit shear rate
    last = np.full(len(i), 3 * n)

    def difference(direction: Array, spin: bool) -> sparse.csr_array:
        columns = [2 * i, 2 * i + 1, 2 * j, 2 * j + 1, last]
        values = [-direction[:, 0], -direction[:, 1], direction[:, 0], direction[:, 1], flow * direction[:, 0]]
        if spin:
            columns += [2 * n + i, 2 * n + j]
            values += [-radius[i], -radius[j]]
        entries = (np.concatenate(values), (np.tile(rows, len(values)), np.concatenate(columns)))
        return sparse.coo_array(entries, shape=(len(i), 3 * n + 1)).tocsr()

    weight = sparse.diags_array(stiffness * damping.tau)
    approach = difference(normal, spin=False)
    matrix = approach.T @ weight @ approach
    if damping.beta > 0:
        slide = difference(tangent, spin=True)
        matrix = matrix + damping.beta * (slide.T @ weight @ slide)
    return sparse.csc_array(matrix)
