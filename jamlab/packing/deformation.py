"""Maps of box and particles: to a packing fraction, to positions, any homogeneous deformation."""

from __future__ import annotations

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError, named
from jamlab.packing.area_change import compression
from jamlab.packing.packing import Packing
from jamlab.packing.shear_direction import shear_direction


def at_phi(packing: Packing, phi: float) -> Packing:
    """The packing compressed to nominal packing fraction phi, see `compression`. Disks keep their diameters and
    polygons their shapes, so that droplets are pushed together, not squeezed."""
    if not 0 < phi <= 2:
        raise InputError(f"{named('phi', phi)}: a packing fraction must lie between 0 and 2")
    gradient = compression(packing).gradient(packing.phi / phi)
    moved = packing.positions + packing.centroids[packing.particle] @ (gradient - np.eye(2)).T
    frame = packing.frame
    moved[frame.fixed_sites] = frame.carried(gradient)[frame.fixed_sites]
    return packing._trusted(box=packing.box @ gradient.T, positions=moved)


def at_positions(packing: Packing, positions: Array) -> Packing:
    """The packing at float64 positions of the right shape, which are refused unless they are finite and every particle
    is whole there."""
    if not np.isfinite(positions).all():
        return packing.with_state(positions=positions)  # which names the first of them
    moved = packing._trusted(positions=positions)
    moved.kind.check_moved(moved)
    return moved


def sheared(packing: Packing, strain: float) -> Packing:
    """The packing after the affine simple shear x -> x + strain * y of box and every position."""
    return deformed(packing, shear_direction(packing, "simple").gradient(strain))[0]


def deformed(packing: Packing, gradient: Array) -> tuple[Packing, Array]:
    """The packing after the affine map r -> F r of box and every free site, turned so that box[0, 1] stays 0; fixed
    ones follow by `Frame.carried`. `gradient`: (2, 2) F, with positive determinant. Returns the packing, and the (2, 2)
    rotation R that was applied after F: a vector v of the packing returned is R^T v in the frame of the one given, a
    tensor S is R^T S R."""
    box = packing.box @ gradient.T
    along = box[0] / np.hypot(*box[0])
    rotation = np.array([[along[0], along[1]], [-along[1], along[0]]])
    box = box @ rotation.T
    box[0, 1] = 0.0  # rounding
    return packing._trusted(box=box, positions=packing.frame.carried(gradient, rotation)), rotation
