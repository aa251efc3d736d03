"""The strains that a packing takes, and where they carry its sites.

A deformation gradient F of the box carries a free site from x to F x, from where it relaxes. The centre c of a fixed
droplet goes to F c. Its outline is sheared with the box and keeps its area, as fixed disks keep their diameters: x = c
+ s goes to F c + F s/sqrt(det F). Walls keep their shape: the wall at a lattice plane of height h moves with that
plane, by F_xy h along x and (F_yy - 1) h along y. So only two strains are defined between walls: simple shear along x,
and compression along y at constant width.

Energies of strained packings, stress, pressure and linear response follow from this one map: S = -(1/A) dU/dF.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing

SIMPLE_SHEAR = np.array([[0.0, 1.0], [0.0, 0.0]])  # along x, with its gradient along y
ALONG_Y = np.array([[0.0, 0.0], [0.0, 1.0]])
_ANY = np.eye(4).reshape(4, 2, 2)
_BETWEEN_WALLS = np.array([SIMPLE_SHEAR, ALONG_Y])
_ROUNDING = 1e-12  # of a generator, over its largest element


def admitted_strains(packing: Packing) -> Array:
    """(m, 2, 2) generators of the displacement gradients that the boundary conditions define: any in a periodic box,
    with or without fixed particles; simple shear along x and compression along y between walls."""
    return _BETWEEN_WALLS if packing.walls else _ANY


def admits(packing: Packing, generators: Array) -> bool:
    """Whether strains (2, 2) or (m, 2, 2) are all among the admitted ones."""
    basis, wanted = admitted_strains(packing).reshape(-1, 4), np.reshape(generators, (-1, 4))
    left = wanted - wanted @ basis.T @ basis  # the basis is orthonormal
    return bool(np.abs(left).max() <= _ROUNDING * np.abs(wanted).max())


def undefined(what: str) -> str:
    """Say why something is not defined."""
    return f"{what} is not defined between walls, which take simple shear along x and compression along y alone"


def check_admitted(packing: Packing, generators: Array | Sequence[Array], what: str) -> None:
    """Refuse strains that the boundary conditions do not define. `what` needs them."""
    if not admits(packing, np.asarray(generators)):
        raise InputError(
            f"{undefined(what)}: use direction='simple', shear_modulus(p) (g_x) and bulk_modulus(p) (b), or remove the "
            "walls with packing.with_state(walls=False, fixed=None)"
        )


@per_packing
def wall_offsets(packing: Packing) -> Array:
    """(n_sites, 2) d: a displacement gradient E moves a site at x by E (x + d). A site of a wall has, with d, the
    height of the lattice plane next to its particle; others have d = 0."""
    offsets = np.zeros((len(packing.positions), 2))
    if packing.walls:
        height, fixed = packing.box[1, 1], packing.fixed_sites
        plane = height * np.round(packing.centroids[:, 1] / height)[packing.particle]
        offsets[fixed, 1] = (plane - packing.positions[:, 1])[fixed]
    return offsets


@per_packing
def kept_shapes(packing: Packing) -> Array:
    """(n_sites, 2) s: sites of fixed droplets from their centre; 0 for disks, free droplets and walls."""
    shapes = np.zeros((len(packing.positions), 2))
    if packing.fixed is not None and not packing.walls:
        fixed = packing.fixed_sites
        shapes[fixed] = (packing.positions - packing.centroids[packing.particle])[fixed]
    return shapes


def carried(packing: Packing, gradient: Array, rotation: Array | None = None) -> Array:
    """(n_sites, 2) positions after a deformation gradient F of the box, and a rotation (2, 2) of everything."""
    turn = np.eye(2) if rotation is None else rotation
    moved = packing.positions @ (turn @ gradient).T
    if packing.fixed is not None:
        moved += wall_offsets(packing) @ (turn @ (gradient - np.eye(2))).T
        kept = 1.0 / np.sqrt(np.linalg.det(gradient)) - 1.0
        moved += kept_shapes(packing) @ (turn @ gradient).T * kept
    return moved


def shapes_of_stress(packing: Packing, gradient: Array) -> float:
    """Sum of dU/dx s over the fixed droplets: what their constant area leaves out of the virial, `gradient` (n_sites,
    2) being dU/dx of all sites. It adds half of itself over the area of the box to both normal stresses."""
    return float(np.sum(gradient * kept_shapes(packing)))


def shapes_of_curvature(packing: Packing, gradient: Array, couplings: Array, pull: Array) -> tuple[Array, Array]:
    """What the constant area of fixed droplets adds to K_uE and K_EE of sites that all follow the strain.

    To second order F s/sqrt(det F) is s + E s - (tr E/2) (s + E s) - (det E/2) s + (3/8) (tr E)^2 s.

    Args:
        packing: DP.
        gradient: (n_sites, 2) dU/dx.
        couplings: (2 n_sites, 2, 2) K_uE of the affine map.
        pull: (2 n_sites,) K_uu s.

    Returns:
        (2 n_sites, 2, 2) and (2, 2, 2, 2) to be added.
    """
    shapes, one = kept_shapes(packing), np.eye(2)
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    moment, both = gradient.T @ shapes, np.multiply.outer(one, one)
    mixed = np.einsum("i,ikl->kl", shapes.ravel(), couplings) + moment
    trace = float(np.trace(moment))
    found = 0.25 * float(pull @ shapes.ravel()) * both + 0.75 * trace * both
    found -= 0.5 * (np.multiply.outer(one, mixed) + np.multiply.outer(mixed, one))
    found -= 0.5 * trace * np.einsum("km,ln->klmn", turn, turn)
    return -0.5 * np.multiply.outer(pull, one), found
