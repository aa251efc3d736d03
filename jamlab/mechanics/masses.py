"""Masses of particles: given one by one, as one number for all, or as a density of area.

The vertices of a droplet share its mass alike. A disk that turns is uniform, so its moment of inertia is m R^2/2.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jamlab.arrays import Array, ArrayLike
from jamlab.checks import finite_array
from jamlab.errors import InputError
from jamlab.packing.packing import Packing

Masses = ArrayLike | Mapping[str, Any]  # what `masses` takes

DENSITY = "density"
CONTRAST = 1e4  # heaviest over lightest: 1e-9 of a stiffness times this is below the stiffness of the softest modes
LARGEST, LEAST = 1e100, 1e-100  # squares of frequencies times masses stay within float64


def particle_masses(packing: Packing, masses: Masses) -> Array:
    """(n,) mass of every particle. `masses`: (n,), one for all, or {"density": mass per area}: of disks pi d^2/4, of
    droplets the rest area a0. Fixed particles do not move, whatever their mass."""
    if isinstance(masses, Mapping):
        if set(masses) != {DENSITY}:
            raise InputError(f"masses = {dict(masses)!r}: give {{{DENSITY!r}: mass per area}}, or a mass per particle")
        found = _each(packing, f"masses[{DENSITY!r}]", masses[DENSITY]) * _rest_areas(packing)
    else:
        found = _each(packing, "masses", masses)
    free = packing.frame.free
    outside = np.flatnonzero(free & ~((found >= LEAST) & (found <= LARGEST)))
    if len(outside):
        raise InputError(
            f"masses: particle {outside[0]} has the mass {found[outside[0]]:.6g}: must be positive, from {LEAST:g} to "
            f"{LARGEST:g}; leave out masses for overdamped motion"
        )
    return found


def comparable_masses(packing: Packing, masses: Masses) -> Array:
    """`particle_masses` where one threshold tells zero modes of light and of heavy particles from soft ones."""
    found = particle_masses(packing, masses)
    free = found[packing.frame.free]
    if free.max() > CONTRAST * free.min():
        raise InputError(
            f"masses from {free.min():.6g} to {free.max():.6g}: modes that cost nothing cannot be told from slow ones "
            f"of heavy particles; give masses of a ratio of at most {CONTRAST:g}, or fix the heavy particles by "
            "packing.with_state(fixed=...)"
        )
    return found


def _each(packing: Packing, name: str, values: Any) -> Array:
    """(n,) from one number or n of them."""
    if np.ndim(values) == 0:
        return np.full(packing.n, finite_array(name, np.atleast_1d(values), (1,))[0])
    array = finite_array(name, values, (None,))
    if len(array) != packing.n:
        raise InputError(
            f"{name}: {len(array)} numbers for {packing.n} particles: give one a particle, or one number for all"
        )
    return array


def _rest_areas(packing: Packing) -> Array:
    sizes = packing.kind.sizes(packing)
    return np.asarray(sizes**2 * (1.0 if packing.diameters is None else 0.25 * np.pi))


def site_masses(packing: Packing, masses: Array) -> Array:
    """(n_sites,) mass at every disk or vertex, from those of particles (n,)."""
    return np.asarray((masses / np.bincount(packing.particle))[packing.particle])


def mass_matrix_diagonal(packing: Packing, masses: Array) -> Array:
    """(m,) diagonal of the mass matrix in the coordinates of `dynamical_matrices`: displacements, rotations, strain.

    Fixed particles have 0. So has the strain: peculiar motion, relative to the affine flow, is what has inertia."""
    free, turning = packing.frame.free_sites, packing.kind.rotations(packing)
    moving = np.repeat(np.where(free, site_masses(packing, masses), 0.0), 2)
    if not turning:
        return np.append(moving, 0.0)
    spins = np.where(packing.frame.free, 0.125 * masses * packing.disk_diameters**2, 0.0)
    return np.concatenate([moving, spins, [0.0]])
