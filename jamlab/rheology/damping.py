"""Viscous force laws of Baumgarten & Tighe and their damping matrices, for disks and droplets."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, ClassVar, get_args

import numpy as np

from jamlab.arguments.choices import Direction, LeverArms
from jamlab.arrays import Array
from jamlab.checks import checked_class
from jamlab.errors import InputError
from jamlab.mechanics.factors import FLOPPY
from jamlab.packing.natural_units import stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.rheology.drag_law import DragLaw, contact_velocities, parameter, slips

if TYPE_CHECKING:
    from scipy import sparse


@dataclass(frozen=True)
class DragLimits:
    """Arguments of the drag, and what of it is rounding."""

    beta: float = 1e12  # both dampings stand in one matrix of 16 digits
    gears: float = FLOPPY**0.5  # sliding over turning of disks below which the drag on it is rounding
    alpha: float = 0.4  # below, `fix overdamped` does not find the velocities; films have 1/2 or 2/3


DRAG_LIMITS = DragLimits()


@checked_class
@dataclass(frozen=True)
class ContactDamping(DragLaw):
    """Drag on the relative velocity at every contact, Baumgarten & Tighe eqs 5 and 6.

    R = (tau_1/2) sum k_ij [(du_par')^2 + beta (du_perp' - a_i theta_i' - a_j theta_j')^2]; k_ij is the stiffness of the
    contact (k in units of the paper), and a_i, a_j are lever arms.

    SP: in the paper the lever arms are the radii. Their sum exceeds the distance r of the centres, so a rigid rotation
        of two overlapping disks dissipates energy, and G'' depends on the orientation of the packing to the order of
        the overlap. Lever arms to the middle of the overlap, R - (R_i + R_j - r)/2, dissipate nothing in a rotation.

    DP: the sum runs over all contacts of a vertex with an edge. du' is the velocity of the vertex relative to the point
        of contact on the edge, theta' is the local rotation of either outline, and both lever arms are half the
        distance of vertex and edge. A rigid rotation dissipates nothing.

    alpha below 1 is the drag of thin films, eq 9: R = sum k_ij/(alpha + 1) (tau_1^2 [...])^((alpha + 1)/2) with the
    same bracket, lengths in mean sizes. It is available for simulated flow (`shear`, `oscillate`, ...), but
    not for matrices and `complex_modulus`.

    Attributes:
        beta: ratio of tangential to normal damping; 1 is "balanced".
        tau: tau_1, the relaxation time of two disks.
        alpha: exponent of the drag in the relative velocity, 0.4 to 1; 1 is linear.
        lever_arms: SP: "radius", as in the paper, or "contact". DP: always "contact".

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> free, rubbing = (jamlab.complex_modulus(p, 1.0, jamlab.ContactDamping(beta)) for beta in (0.0, 1.0))
        >>> bool(rubbing.loss[0] > free.loss[0])
        True
    """

    name: ClassVar[str] = "contact"
    beta: float = parameter(
        1.0,
        "ratio of tangential to normal damping",
        least=0.0,
        largest=DRAG_LIMITS.beta,
        must=f"a number from 0 to {DRAG_LIMITS.beta:g}; at larger values normal damping is lost to rounding",
    )
    tau: float = parameter(1.0, "relaxation time of two disks, tau_1", positive=True, must="a positive time")
    alpha: float = parameter(
        1.0,
        "exponent of the drag in the relative velocity; 1 is linear",
        least=DRAG_LIMITS.alpha,
        largest=1.0,
        must=f"a number from {DRAG_LIMITS.alpha:g} to 1 (linear drag); films with mobile surfactants have 2/3, with "
        "immobile surfactants 1/2",
    )
    lever_arms: LeverArms = parameter("radius", "where lever arms of disks end", choices=get_args(LeverArms))

    def __str__(self) -> str:
        power = "" if self.alpha == 1 else f", α = {self.alpha:g}"
        arms = "" if self.lever_arms == "radius" else ", arms to the middle of contacts"
        return f"contact damping, β = {self.beta:g}{power}{arms}" + _name_time(self.tau)

    @property
    def contrast(self) -> float:
        """`beta`, by the name that all drag laws share."""
        return self.beta

    def on_approach(self) -> ContactDamping:
        """The law without tangential damping."""
        return replace(self, beta=0.0, alpha=1.0)

    def matrix(self, packing: Packing, whole: Packing, direction: Direction) -> sparse.csc_array:
        """Hessian B of the Rayleigh function in the coordinates of `dynamical_matrices`: a sum over contacts
        of the dissipation of normal and tangential motion. `direction`: of the shear whose rate comes last."""
        from scipy import sparse

        if self.alpha != 1:
            raise InputError(
                f"alpha = {self.alpha:g}: only linear drag, alpha = 1, has a damping matrix and a modulus "
                "over frequency; use jamlab.nonlinear_modulus for an equivalent linear drag, or jamlab.oscillate"
            )
        approach, slide, stiffness = contact_velocities(packing, direction, self.lever_arms)
        weight = sparse.diags_array(stiffness * self.tau)
        matrix = approach.T @ weight @ approach
        if self.beta > 0:
            matrix = matrix + self.beta * (slide.T @ weight @ slide)
        return sparse.csc_array(matrix)

    def power(self, packing: Packing, rates: Array) -> float:
        """Power that the drag dissipates, (alpha + 1) times the Rayleigh function; see `DragLaw`."""
        approach, slide, stiffness = slips(packing, rates, self.lever_arms)
        squares = self.tau**2 * (approach**2 + self.beta * slide**2)
        return float(stiffness @ squares ** (0.5 * (self.alpha + 1.0))) / self.tau

    def resists_shear(self, packing: Packing) -> bool:
        """Whether an affine flow dissipates: any contact does."""
        return True

    def gears(self, packing: Packing, matrix: sparse.csc_array | None = None) -> list[int]:
        """One disk of each group that turns like gears: where all loops of contacts are even no drag resists that.

        Along a tree of contacts every disk turns so that none slides; a group is free if the others do not slide then.
        """
        from scipy import sparse
        from scipy.sparse.csgraph import breadth_first_order

        levers = packing.kind.jacobian(packing, self.lever_arms, np.zeros((2, 2))).levers
        if levers is None:  # nothing turns
            return []
        levers = np.where(levers == 0, 1.0, levers)  # of flat walls, which do not turn
        touching, free, n = packing.kind.pairs(packing), list[int](), packing.n
        keys = np.concatenate([touching.i * n + touching.j, touching.j * n + touching.i])
        ratios = np.concatenate([levers[:, 0] / levers[:, 1], levers[:, 1] / levers[:, 0]])
        by_key = np.argsort(keys)
        network = sparse.csr_array((np.ones(len(touching.i)), (touching.i, touching.j)), shape=(n, n))
        turn = np.zeros(n)
        for first in range(n):
            if turn[first] == 0:
                order, before = breadth_first_order(network, first, directed=False)
                others = order[1:]
                along = np.searchsorted(keys, before[others].astype(np.int64) * n + others, sorter=by_key)
                turn[first], turn[others] = 1.0, -ratios[by_key[along]]
                before[first] = first
                while (before[others] != first).any():  # each step knows the way to the root twice as far
                    turn[others] *= turn[before[others]]
                    before[others] = before[before[others]]
                own = np.isin(touching.i, order)
                sliding = levers[own, 0] * turn[touching.i[own]] + levers[own, 1] * turn[touching.j[own]]
                held = packing.frame.fixed[order].any()  # they do not turn
                if not held and np.abs(sliding).max(initial=0.0) <= DRAG_LIMITS.gears * np.abs(levers[own]).max(
                    initial=1.0
                ):
                    free.append(first)
        return free

    def lammps_variables(self) -> dict[str, float | str]:
        """Variables of `lammps_inputs/parts/flow`."""
        return asdict(self)


@checked_class
@dataclass(frozen=True)
class StokesDrag(DragLaw):
    """Drag on the velocity of every particle relative to the affine flow, Baumgarten & Tighe eqs 7 and 8.

    R = (k tau_1/2) sum |u_i' - v_aff(r_i)|^2 + (eta_F/2) gamma'^2 A. DP: the sum runs over vertices, each with 1/n_v of
    the drag on its polygon, so a rigidly moving polygon has the drag of a disk.

    Attributes:
        eta_f: viscosity of the fluid, units k tau_1.
        tau: tau_1; the drag coefficient is k tau_1. In units "eps", k is eps over the squared mean size of all
            particles, rattlers included.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> s = jamlab.complex_modulus(p, [1e3, 2e3], jamlab.StokesDrag(eta_f=1.0))
        >>> bool(np.isclose(s.eta_inf, 1.0))  # at high frequency all disks follow the fluid
        True
    """

    name: ClassVar[str] = "stokes"
    at_contacts: ClassVar[bool] = False  # type: ignore[misc]
    alpha: ClassVar[float] = 1.0  # type: ignore[misc]
    eta_f: float = parameter(1.0, "viscosity of the fluid, k tau_1", least=0.0)
    tau: float = parameter(1.0, "relaxation time of two disks, tau_1", positive=True, must="a positive time")

    def __str__(self) -> str:
        return f"Stokes drag, η_F = {self.eta_f:g}" + _name_time(self.tau)

    def matrix(self, packing: Packing, whole: Packing, direction: Direction) -> sparse.csc_array:
        """As in `ContactDamping`: drag on every site, and drag of the fluid on the shear rate. `whole`: the packing
        with its rattlers, whose mean size is the unit of drag."""
        from scipy import sparse

        return sparse.diags_array(self._diagonal(packing, whole), format="csc")

    def _diagonal(self, packing: Packing, whole: Packing) -> Array:
        sites = len(packing.positions)
        share = 1.0 / np.bincount(packing.particle)[packing.particle]  # 1 for disks
        diagonal = np.zeros(2 * sites + packing.kind.rotations(packing) + 1)
        stiffness = stiffness_scale(whole)
        diagonal[: 2 * sites] = np.repeat(stiffness * self.tau * share * packing.frame.free_sites, 2)
        diagonal[-1] = stiffness * self.eta_f * packing.area
        return diagonal

    def power(self, packing: Packing, rates: Array) -> float:
        """Power that the drag dissipates; see `DragLaw`."""
        return float(self._diagonal(packing, packing) @ rates**2)

    def lammps_variables(self) -> dict[str, float | str]:
        """All drag is background drag; contacts have none."""
        return {"tau": self.tau, "background_drag": 1.0, "eta_f": self.eta_f}


def _name_time(tau: float) -> str:
    return "" if tau == 1 else f", τ1 = {tau:g}"
