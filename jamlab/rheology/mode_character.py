"""How droplets move in the relaxation modes of a packing: as a whole, along their outlines, or by a change of shape.

Every Maxwell element of G*(omega) belongs to a generalised mode K v = lambda B v (`relaxation_spectrum`). The motion of
the vertices in a mode is the sum of four parts that are orthogonal under the weights 1/n_v of `StokesDrag`, so that
every droplet counts alike: translation and rotation of whole droplets, which fit it best; and of what is left, that
along the outline, by which vertices slide past their neighbours, and that across it, which changes the shape.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.mechanics.force_network import force_network
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.equation_of_motion import EquationOfMotion, equation_of_motion
from jamlab.rheology.relaxation_spectrum import RelaxationModes, build_strengths, find_all_modes
from jamlab.rheology.slow_and_fast_limits import find_limits

# version, see jamlab.campaign.tasks; 1 took Stokes drag from the mean size of the backbone, 2 had motions without rate
MODES_DEFINITION = 3
MOTIONS = ("translation", "rotation", "along", "across")


@dataclass(frozen=True)
class ModeCharacter(Result):
    """Relaxation modes of a packing of droplets, each with its part of G* and the way droplets move in it.

    Attributes:
        rates: (m,) lambda, ascending, 1/tau_1.
        strengths: (m,) g of its Maxwell element, unit of stress.
        translation: (m,) share of the motion that moves droplets as a whole, relative to the packing.
        rotation: (m,) share that turns them as a whole.
        along: (m,) share of the remaining motion along their own outlines.
        across: (m,) share of the remaining motion across their outlines; the four shares add up to 1.
        sliding: (m,) share of the dissipation by tangential motion at contacts; the rest is normal. nan under a drag
            law that does not tell the two apart, such as Stokes drag.
        unit: unit of stress, for labels.
    """

    _rows = ("rates", "strengths", "translation", "rotation", "along", "across", "sliding")

    rates: Array
    strengths: Array
    translation: Array
    rotation: Array
    along: Array
    across: Array
    sliding: Array
    unit: str = field(default="", repr=False)

    def share(self, name: str, slowest: float = 0.0, fastest: float = np.inf) -> float:
        """Share of a motion, or of sliding, in modes of some rates, each weighted by its strength.

        Args:
            name: "translation", "rotation", "along", "across" or "sliding".
            slowest, fastest: rates of the modes that count; nan if there is none.

        Raises:
            InputError: no such share.
        """
        if name not in (*MOTIONS, "sliding"):
            raise InputError(f"share {name!r}: use one of {', '.join(MOTIONS)}, sliding")
        kept = (self.rates >= slowest) & (self.rates < fastest)
        weight = self.strengths[kept]
        return float(weight @ getattr(self, name)[kept] / weight.sum()) if kept.any() else float("nan")


@checked
def mode_character(packing: Packing, damping: DragLaw | None = None) -> ModeCharacter:
    """Compute the relaxation modes of a packing of droplets and the character of their motion, without rattlers.

    Args:
        packing: DP at an energy minimum, up to 1024 vertices: the solver is dense.
        damping: linear drag law, default `ContactDamping()`.

    Raises:
        InputError: disks, which have no outline to move, or too many vertices.
        ConvergenceError: the packing is not jammed, not at a minimum or not stable.

    Example:
        >>> p = list(jamlab.compress(jamlab.jam(8, "dp"), to=0.9, step=0.02))[-1]
        >>> m = jamlab.mode_character(p, jamlab.StokesDrag(eta_f=1.0))
        >>> slow, fast = m.share("across", fastest=1), m.share("across", slowest=100)
        >>> slow < 0.2 < 0.6 < fast  # shapes relax fast
        True
    """
    damping, _ = damping or ContactDamping(), packing.polygons.offsets  # disks only translate and rotate
    network = force_network(packing)
    network.check_at_rest()
    motion = equation_of_motion(network, damping)
    limits = find_limits(motion)
    found, basis = find_all_modes(motion, limits)
    strengths = build_strengths(found, motion.area)
    parts = motion_shares(network.packing, _displacements(network.packing, motion, basis @ found.vectors))
    return ModeCharacter(
        rates=found.rates,
        strengths=strengths,
        **dict(zip(MOTIONS, parts, strict=True)),
        sliding=_sliding_share(network.packing, damping, found, motion),
        unit=packing.unit_names.stress,
    )


def _displacements(packing: Packing, motion: EquationOfMotion, vectors: Array) -> Array:
    """(sites, 2, modes) of all vertices, relative to the mean over droplets."""
    sites = len(packing.positions)
    u = np.zeros((2 * sites, vectors.shape[1]))
    u[motion.displaced] = vectors[: motion.moving]
    moved = u.reshape(sites, 2, -1)
    return moved - packing.frame.drift(_mean_over_vertices(packing, moved))


def _mean_over_vertices(packing: Packing, values: Array) -> Array:
    """(n, ...) mean of (sites, ...) over the vertices of each droplet."""
    count = np.diff(packing.polygons.offsets).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(np.add.reduceat(values, packing.polygons.offsets[:-1], axis=0) / count)


def motion_shares(packing: Packing, u: Array) -> tuple[Array, Array, Array, Array]:
    """Shares of translation, rotation, motion along and across outlines, (m,) each, in displacements (sites, 2, m) of
    the vertices of droplets, of which none is zero everywhere."""
    of = packing.particle
    centre = _mean_over_vertices(packing, u)
    arm = packing.positions - _mean_over_vertices(packing, packing.positions)[of]
    turned = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    inertia = _mean_over_vertices(packing, np.sum(arm**2, axis=1))
    rest = u - centre[of]
    turning = _mean_over_vertices(packing, np.einsum("ia,iam->im", turned, rest)) / inertia[:, None]
    rest = rest - turned[:, :, None] * turning[of][:, None, :]
    before = np.empty_like(packing.polygons.successor)
    before[packing.polygons.successor] = np.arange(len(before))
    tangent = packing.positions[packing.polygons.successor] - packing.positions[before]
    tangent /= np.hypot(*tangent.T)[:, None]
    along = np.einsum("ia,iam->im", tangent, rest)
    squares = (
        np.sum(centre**2, axis=(0, 1)),
        inertia @ turning**2,
        _mean_over_vertices(packing, along**2).sum(axis=0),
        _mean_over_vertices(packing, np.sum(rest**2, axis=1) - along**2).sum(axis=0),
    )
    total = sum(squares)
    return squares[0] / total, squares[1] / total, squares[2] / total, squares[3] / total


def _sliding_share(packing: Packing, damping: DragLaw, found: RelaxationModes, motion: EquationOfMotion) -> Array:
    """(m,) 1 - v^T B_0 v / v^T B v, with B_0 of approach alone."""
    if (on_approach := damping.on_approach()) is None:
        return np.full(len(found.rates), np.nan)
    moved = motion.displaced
    approach = on_approach.matrix(packing, packing, "simple")[moved][:, moved]
    v = found.vectors
    whole, part = (np.einsum("im,im->m", v, matrix @ v) for matrix in (motion.b_qq, approach))
    share = np.divide(part, whole, out=np.ones_like(part), where=whole > 0)
    return np.asarray(np.clip(1.0 - share, 0.0, 1.0))
