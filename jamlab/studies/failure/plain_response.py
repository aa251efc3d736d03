"""Moduli of disks, static and over frequency, from plain physics: dense matrices by complex steps and plain loops."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.packing.packing import Packing
from jamlab.studies.failure.plain_physics import STEP, energy_and_forces, spring, touching_disks

Array = NDArray[Any]  # float64, or extended precision

_LEAST_CONTACTS = 3  # of a disk that is held
_NO_STIFFNESS = 1e-13  # of the largest eigenvalue: translations leave 1e-16 and less


def plain_hessian(packing: Packing) -> Array:
    """(2n + 4, 2n + 4) second derivatives of the energy of disks, by complex steps of the forces.

    Coordinates: x and y of every disk, then the displacement gradient E_xx, E_xy, E_yx, E_yy of box and disks.
    """
    size = packing.positions.size
    columns = [(np.zeros((2, 2)), site) for site in np.eye(size).reshape(size, -1, 2)]
    columns += [(np.eye(4)[k].reshape(2, 2), np.zeros_like(packing.positions)) for k in range(4)]
    hessian = np.empty((size + 4, size + 4))
    for column, (gradient, shift) in enumerate(columns):
        stretch = np.eye(2) + 1j * STEP * gradient
        positions = packing.positions @ stretch.T + 1j * STEP * shift
        _, forces = energy_and_forces(packing, positions, packing.box @ stretch.T)
        hessian[:size, column] = -forces.imag.ravel() / STEP
    hessian[size:, :size] = hessian[:size, size:].T
    hessian[size:, size:] = _affine_stiffness(packing)
    return hessian


def plain_moduli(packing: Packing) -> Array:
    """(2, 2, 2, 2) relaxed elastic tensor of disks at an energy minimum without rattlers, by a dense pseudo-inverse.

    Raises:
        numpy.linalg.LinAlgError: no disk is held, or the packing is not stable.
    """
    packing = without_loose_disks(packing)
    size = packing.positions.size
    hessian = plain_hessian(packing)
    values, modes = np.linalg.eigh(hessian[:size, :size])
    soft = values < _NO_STIFFNESS * values[-1]
    if soft.sum() != 2:
        raise np.linalg.LinAlgError(f"{soft.sum()} modes without stiffness, translations are 2")
    along = modes[:, ~soft].T @ hessian[:size, size:]
    relaxed = hessian[size:, size:] - along.T @ (along / values[~soft, None])
    return np.asarray(relaxed.reshape(2, 2, 2, 2) / packing.area)


def plain_shear_modulus(packing: Packing) -> float:
    """G of disks for simple shear along x."""
    return float(plain_moduli(packing)[0, 1, 0, 1])


def _affine_stiffness(packing: Packing) -> Array:
    """(4, 4) d2U/dE dE of disks: of every contact, force law and direction written out."""
    found = touching_disks(packing, packing.positions, packing.box)
    r, s = found.r, found.reach
    distance = np.hypot(*r.T)
    stiffness, push = spring(packing, s), spring(packing, s) * (s - distance)
    n = r / distance[:, None]
    across = np.eye(2)[None] - n[:, :, None] * n[:, None, :]
    second = stiffness[:, None, None] * n[:, :, None] * n[:, None, :] - (push / distance)[:, None, None] * across
    # half: every contact is found from both its sides
    return np.asarray(0.5 * np.einsum("mik,mj,ml->ijkl", second, r, r).reshape(4, 4))


def without_loose_disks(packing: Packing) -> Packing:
    """Take out disks with fewer than three contacts, again and again.

    Raises:
        numpy.linalg.LinAlgError: none is left.
    """
    found = touching_disks(packing, packing.positions, packing.box)
    held = np.ones(packing.n, dtype=bool)
    while True:
        bearing = held[found.i] & held[found.j]
        few = held & (np.bincount(found.i[bearing], minlength=packing.n) < _LEAST_CONTACTS)
        if not few.any():
            break
        held &= ~few
    if not held.any():
        raise np.linalg.LinAlgError("no disk is held")
    return packing.select(held)


def plain_drag(packing: Packing, beta: float = 1.0, background: float = 0.0) -> Array:
    """(3n + 1, 3n + 1) damping matrix of disks, tau_1 = 1, Baumgarten & Tighe eqs 5 and 6, arms = radii.

    Coordinates: velocities beside the affine flow, angular velocities, rate of x -> x + gamma y. Background: drag of
    every disk against the affine flow, over k tau_1.
    """
    assert packing.diameters is not None
    n, found = packing.n, touching_disks(packing, packing.positions, packing.box)
    total = np.zeros((3 * n + 1, 3 * n + 1))
    for i, j, r, s in zip(found.i, found.j, found.r, found.reach, strict=True):
        normal = r / np.hypot(*r)
        for direction, weight in ((normal, 1.0), (np.array([-normal[1], normal[0]]), beta)):
            row = np.zeros(3 * n + 1)
            row[2 * i : 2 * i + 2] += direction
            row[2 * j : 2 * j + 2] -= direction
            row[-1] = r[1] * direction[0]
            if direction is not normal:
                row[2 * n + i] -= 0.5 * packing.diameters[i]
                row[2 * n + j] -= 0.5 * packing.diameters[j]
            stiffness = float(spring(packing, np.array([s]))[0])
            total += 0.5 * weight * stiffness * np.outer(row, row)  # half: found from both sides
    total[: 2 * n, : 2 * n] += background * packing.params[packing.units] * np.eye(2 * n)
    return total


def plain_complex_modulus(packing: Packing, omega: float, beta: float = 1.0) -> complex:
    """G* of disks without rattlers, simple shear along x, contact damping: dense elimination in extended precision.

    Raises:
        numpy.linalg.LinAlgError: no disk is held.
    """
    packing = without_loose_disks(packing)
    n = packing.n
    shear = np.r_[0 : 2 * n, 2 * n + 1]  # of E only E_xy
    k = np.zeros((3 * n + 1, 3 * n + 1))
    used = np.r_[0 : 2 * n, 3 * n]
    k[np.ix_(used, used)] = plain_hessian(packing)[np.ix_(shear, shear)]
    matrix = k.astype(np.clongdouble) + 1j * np.longdouble(omega) * plain_drag(packing, beta)
    if beta == 0:  # rotations meet no drag
        matrix[range(2 * n, 3 * n), range(2 * n, 3 * n)] = 1.0
    return complex(_eliminate(matrix[2:, 2:]) / np.longdouble(packing.area))


def _eliminate(matrix: Array) -> Any:
    """The last element after elimination of all others, the largest pivot of a column first."""
    matrix = matrix.copy()
    last = len(matrix) - 1
    for k in range(last):
        best = k + int(np.abs(matrix[k:last, k]).argmax())
        matrix[[k, best]] = matrix[[best, k]]
        matrix[k + 1 :, k:] -= np.outer(matrix[k + 1 :, k] / matrix[k, k], matrix[k, k:])
    return matrix[last, last]
