"""Change the box and carry the particles along: isotropic compression, shear, any homogeneous deformation."""

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.packing import Packing


def at_phi(packing: Packing, phi: float) -> Packing:
    """The packing scaled to nominal packing fraction phi. Centres move with the box; disks keep their diameters and
    polygons their shapes, so that droplets are pushed together, not squeezed."""
    if not 0 < phi <= 2:
        raise InputError(f"phi = {phi}: a packing fraction must lie between 0 and 2")
    factor = float(np.sqrt(packing.phi / phi))
    centres = packing.centroids
    moved = packing.positions + ((factor - 1) * centres)[packing.particle]
    return packing._trusted(box=factor * packing.box, positions=moved)


def sheared(packing: Packing, strain: float) -> Packing:
    """The packing after the affine simple shear x -> x + strain * y of box and every position."""
    return deformed(packing, simple_shear(strain, 0.0))[0]


def deformed(packing: Packing, gradient: Array) -> tuple[Packing, Array]:
    """The packing after the affine map r -> F r of box and every position, turned so that box[0, 1] stays 0.
    `gradient`: (2, 2) F, with positive determinant. Returns the packing, and the (2, 2) rotation R that was applied
    after F: a vector v of the packing returned is R^T v in the frame of the one given, a tensor S is R^T S R."""
    box = packing.box @ gradient.T
    along = box[0] / np.hypot(*box[0])
    rotation = np.array([[along[0], along[1]], [-along[1], along[0]]])
    box = box @ rotation.T
    box[0, 1] = 0.0  # rounding
    return packing._trusted(box=box, positions=packing.positions @ (rotation @ gradient).T), rotation


def simple_shear(strain: float, angle: float) -> Array:
    """(2, 2) deformation gradient 1 + strain a b^T with a = (cos, sin) of `angle` and b = a turned by 90 degrees."""
    a = np.array([np.cos(angle), np.sin(angle)])
    return np.asarray(np.eye(2) + strain * np.outer(a, [-a[1], a[0]]))


def shear_gradient(strain: Array) -> Array:
    """(2, 2) deformation gradient of a shear at constant area: exp of a symmetric traceless strain."""
    size = float(np.sqrt(-np.linalg.det(strain)))
    return np.asarray(np.cosh(size) * np.eye(2) + (np.sinh(size) / size if size else 1.0) * strain)
