"""Viscous force laws of Baumgarten & Tighe and their damping matrices, for disks and droplets."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.checks import is_number
from jamlab.errors import InputError
from jamlab.geometry.contact_network import Meetings, find_meetings
from jamlab.geometry.vertex_contacts import VertexContacts
from jamlab.mechanics.energy_terms import disk_law
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactDamping:
    """Drag on the relative velocity at every contact, Baumgarten & Tighe eqs 5 and 6.

    R = (tau_1/2) sum k_ij [(du_par')^2 + beta (du_perp' - R_i theta_i' - R_j theta_j')^2]; k_ij is the stiffness of the
    contact, which is k in their units. DP: the sum runs over all meetings of a vertex with an edge, du' is the velocity
    of the vertex relative to the point of the edge that it meets, and there are no rotations.

    Attributes:
        beta: damping of sliding over damping of approach; 1 is "balanced".
        tau: tau_1, the relaxation time of two disks.
    """

    beta: float = 1.0
    tau: float = 1.0

    def __post_init__(self) -> None:
        if not (is_number(self.beta) and self.beta >= 0):
            raise InputError(f"beta = {self.beta!r}: must be a number, 0 or more")
        _check_time(self.tau)


@dataclass(frozen=True)
class StokesDrag:
    """Drag against the affine flow on every particle, Baumgarten & Tighe eqs 7 and 8.

    R = (k tau_1/2) sum |u_i' - v_aff(r_i)|^2 + (eta_F/2) gamma'^2 A. DP: the sum runs over vertices, each with its
    share 1/n_v of the drag on its polygon, so a polygon that only moves as a whole feels what a disk feels.

    Attributes:
        eta_f: viscosity of the fluid, units k tau_1.
        tau: tau_1; the drag coefficient is k tau_1, k = eps in units "eps" (lengths there are 1).
    """

    eta_f: float = 1.0
    tau: float = 1.0

    def __post_init__(self) -> None:
        if not (is_number(self.eta_f) and self.eta_f >= 0):
            raise InputError(f"eta_f = {self.eta_f!r}: must be a number, 0 or more")
        _check_time(self.tau)


Damping = ContactDamping | StokesDrag


def _check_time(tau: float) -> None:
    if not (is_number(tau) and tau > 0):
        raise InputError(f"tau = {tau!r}: must be a positive time")


def damping_matrix(packing: Packing, damping: Damping, meetings: Meetings | None = None) -> sparse.csc_array:
    """Hessian B of the Rayleigh function R, (3n + 1, 3n + 1) for disks, (2 n_vertices + 1, ...) for droplets.

    Coordinates: 2i, 2i + 1 = non-affine velocity of site i (disk or vertex); SP: 2n + i = angular velocity of disk i,
    counter-clockwise; last = shear rate of x -> x + gamma y. Positions move as u + gamma y x^, so the drag against the
    affine flow acts on u alone.

    Args:
        packing: SP or DP.
        damping: viscous law.
        meetings: what `find_meetings` finds in the packing, if it is known already.

    Raises:
        InputError: a vertex lies on an edge, so that their contact has no direction.
    """
    if isinstance(damping, StokesDrag):
        return _assemble_stokes(packing, damping)
    meetings = meetings or find_meetings(packing)
    if isinstance(meetings, Pairs):
        return _assemble_contacts(_join_disks(packing, meetings), damping)
    return _assemble_contacts(_join_vertices(packing, meetings), damping)


def _assemble_stokes(packing: Packing, damping: StokesDrag) -> sparse.csc_array:
    sites = len(packing.positions)
    share = 1.0 / np.bincount(packing.particle)[packing.particle]  # 1 for disks
    diagonal = np.zeros(_size(packing))
    diagonal[: 2 * sites] = np.repeat(_drag_stiffness(packing) * damping.tau * share, 2)
    diagonal[-1] = damping.eta_f * packing.area
    return sparse.diags_array(diagonal, format="csc")


def _size(packing: Packing) -> int:
    return 2 * len(packing.positions) + (packing.n if packing.model == "sp" else 0) + 1


def _drag_stiffness(packing: Packing) -> float:
    """k of units "k"; eps over the squared unit of length in units "eps"."""
    return float(packing.params["k"] if packing.units == "k" else packing.params["eps"])


@dataclass(frozen=True)
class _Joints:
    """Relative velocity at m contacts as a linear function of all rates.

    Attributes:
        size: number of coordinates.
        normal: (m, 2) unit vectors.
        flow: (m,) affine velocity difference along x at unit shear rate.
        stiffness: (m,).
        sites: (m, j) that each contact joins.
        weights: (m, j) of their velocities in the difference.
        spins: (m, 2) angular coordinates, or None.
        radii: (m, 2) lever arms of the rotations, or None.
    """

    size: int
    normal: Array
    flow: Array
    stiffness: Array
    sites: NDArray[np.int64]
    weights: Array
    spins: NDArray[np.int64] | None = None
    radii: Array | None = None


def _join_disks(packing: Packing, touching: Pairs) -> _Joints:
    assert packing.diameters is not None
    pairs, r = np.column_stack([touching.i, touching.j]), touching.r
    distance = np.hypot(*r.T)
    _, _, stiffness = disk_law(packing, pairs, distance)
    return _Joints(
        size=_size(packing),
        normal=r / distance[:, None],
        flow=r[:, 1],
        stiffness=stiffness,
        sites=pairs,
        weights=np.tile([-1.0, 1.0], (len(pairs), 1)),
        spins=2 * packing.n + pairs,
        radii=0.5 * packing.diameters[pairs],
    )


def _join_vertices(packing: Packing, found: VertexContacts) -> _Joints:
    """Vertex against the point (1 - t) tail + t head of the edge."""
    distance, t = found.distance, found.place
    if not np.all(distance > 0):
        raise InputError("a vertex lies on an edge of another polygon: their contact has no direction to damp")
    return _Joints(
        size=_size(packing),
        normal=found.separation / distance[:, None],
        flow=found.separation[:, 1],
        stiffness=np.full(len(t), packing.params["eps"] / packing.params["delta"] ** 2),
        sites=np.column_stack([found.vertex, found.tail, packing.successor[found.tail]]),
        weights=np.column_stack([np.ones_like(t), t - 1.0, -t]),
    )


def _assemble_contacts(joints: _Joints, damping: ContactDamping) -> sparse.csc_array:
    normal = joints.normal
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    weight = sparse.diags_array(joints.stiffness * damping.tau)
    approach = _relate_velocities(joints, normal, spin=False)
    matrix = approach.T @ weight @ approach
    if damping.beta > 0:
        slide = _relate_velocities(joints, tangent, spin=True)
        matrix = matrix + damping.beta * (slide.T @ weight @ slide)
    return sparse.csc_array(matrix)


def _relate_velocities(joints: _Joints, direction: Array, spin: bool) -> sparse.csr_array:
    """(m, size) one row per contact: its velocity difference along a direction (m, 2), from all rates."""
    m = len(direction)
    columns = [2 * joints.sites, 2 * joints.sites + 1, np.full((m, 1), joints.size - 1)]
    values = [joints.weights * direction[:, [0]], joints.weights * direction[:, [1]]]
    values.append((joints.flow * direction[:, 0])[:, None])
    if spin and joints.spins is not None and joints.radii is not None:
        columns.append(joints.spins)
        values.append(-joints.radii)
    entry, column = np.hstack(values), np.hstack(columns)
    rows = np.repeat(np.arange(m), entry.shape[1])
    return sparse.coo_array((entry.ravel(), (rows, column.ravel())), shape=(m, joints.size)).tocsr()
