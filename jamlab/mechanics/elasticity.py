"""Static elastic moduli by linear response: the affine (Born) part minus what non-affine relaxation takes back.

With the energy's second derivatives K_uu, K_uE, K_EE (see `jamlab.hessian`) the elastic tensor is
C = (K_EE - K_uE^T K_uu^-1 K_uE)/A. One factorisation gives every modulus in every direction.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.stiffness import Stiffness, forces, stiffness, stress
from jamlab.mechanics.symmetric_factors import SymmetricFactors
from jamlab.packing.deformation import at_phi, deformed
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]


# G(angle) holds harmonics up to 4 angle, so three equally spaced angles average exactly
AVERAGING_ANGLES = np.pi * np.arange(3) / 3


@dataclass(frozen=True)
class ElasticTensor:
    """Response of a packing to a homogeneous displacement gradient E.

    Attributes:
        affine: (2, 2, 2, 2) K_EE/A, all sites follow the strain.
        relaxed: (2, 2, 2, 2) C, sites relax; d2(U/A)/dE dE at force balance.
        displacements: (n_sites, 2, 2, 2) non-affine displacement du[i]/dE[k, l]; 0 for rattlers.
    """

    affine: Array
    relaxed: Array
    displacements: Array


def elastic_tensor(packing: Packing, *, prestress: bool = True) -> ElasticTensor:
    """Affine and relaxed elastic tensor, rattlers left out.

    Args:
        packing: SP or DP at an energy minimum.
        prestress: see `jamlab.mechanics.energy_terms.energy_terms`.

    Raises:
        ConvergenceError: no backbone, or a negative mode: the state is not a minimum.
    """
    network, sites = backbone(packing)
    check_at_rest(network)
    k = stiffness(network, prestress=prestress)
    right = k.ue.reshape(-1, 4)
    held = solve_held(k, right)
    response = (held.T @ right).reshape(2, 2, 2, 2)
    displacements = np.zeros((len(packing.positions), 2, 2, 2))
    displacements[sites] = -held.reshape(-1, 2, 2, 2)
    return ElasticTensor(k.ee / packing.area, (k.ee - response) / packing.area, displacements)


def modulus_along(c: Array, angles: Array) -> Array:
    """(m,) shear moduli of an elastic tensor c, (2, 2, 2, 2), for shear along m directions, radian."""
    a = np.column_stack([np.cos(angles), np.sin(angles)])
    b = np.column_stack([-np.sin(angles), np.cos(angles)])
    return np.asarray(np.einsum("ni,nj,ijkl,nk,nl->n", a, b, c, a, b))


def compression_modulus(c: Array, pressure: float) -> float:
    """Bulk modulus B = -A dp/dA of an elastic tensor c at a pressure: (C_iikk + 2 p)/4.

    C is the curvature of U in the displacement gradient; the area is quadratic in it, which brings in the pressure.
    """
    return float(0.25 * np.einsum("iikk->", c) + 0.5 * pressure)


def follow(packing: Packing, phi: float) -> Packing:
    """The packing at another nominal packing fraction, as linear response predicts it.

    Near onset a prediction keeps all overlaps in proportion, so that no contact opens or closes; an affine guess would
    change most of them. Rattlers move with the box; so does all of a packing that has no stable response.
    """
    moved = at_phi(packing, phi)
    try:
        tensor = elastic_tensor(packing)
    except ConvergenceError:
        return moved
    strain = float(np.sqrt(packing.phi / phi)) - 1
    held = ~contacts(packing).rattlers[packing.particle]
    response = np.einsum("nkii->nk", tensor.displacements)
    positions = moved.positions.copy()
    positions[held] = ((1 + strain) * packing.positions + strain * response)[held]
    return moved.with_state(positions=positions)


def follow_shear(packing: Packing, strain: Array, tensor: ElasticTensor) -> Packing:
    """The packing after a small shear at constant area, sites displaced as linear response predicts.

    Args:
        packing: at an energy minimum.
        strain: (2, 2) symmetric, traceless; the box is mapped by its matrix exponential, so its area stays.
        tensor: `elastic_tensor(packing)`.
    """
    size = float(np.sqrt(-np.linalg.det(strain)))
    if size == 0:
        return packing
    gradient = np.cosh(size) * np.eye(2) + np.sinh(size) / size * strain
    moved, rotation = deformed(packing, gradient)
    response = np.einsum("nkij,ij->nk", tensor.displacements, strain)
    return moved.with_state(positions=moved.positions + response @ rotation.T)


def check_at_rest(packing: Packing) -> None:
    """Refuse a packing whose forces do not balance: response to strain is that of a minimum.

    Raises:
        ConvergenceError: the largest force is above 1 % of the pressure, or positions are rounded to fewer digits than
            float64 has.
    """
    if packing.rounding:
        raise ConvergenceError(
            f"positions are known to {packing.rounding:.2g} only, so the packing is at no energy minimum: relax it "
            "first, jamlab.relaxed(packing)"
        )
    imbalance, pressure = np.hypot(*forces(packing).T).max(), 0.5 * np.trace(stress(packing))
    if imbalance > 0.01 * pressure:
        raise ConvergenceError(
            f"the packing is not at an energy minimum: a force of {imbalance:.2g} is left at pressure {pressure:.2g}"
        )


def backbone(packing: Packing) -> tuple[Packing, NDArray[np.int64]]:
    """The packing without its rattlers, and the indices of the sites that remain.

    Raises:
        ConvergenceError: if every particle rattles: the packing is not jammed.
    """
    loose = contacts(packing).rattlers
    if loose.all():
        raise ConvergenceError("every particle rattles: the packing is not jammed and has no elastic modulus")
    sites = np.flatnonzero(~loose[packing.particle])
    changes: dict[str, Any] = {"positions": packing.positions[sites]}
    if packing.diameters is not None:
        changes["diameters"] = packing.diameters[sites]
    if packing.offsets is not None:
        changes["offsets"] = np.concatenate([[0], np.cumsum(np.diff(packing.offsets)[~loose])])
        changes["params"] = {**packing.params, "a0": packing.params["a0"][~loose]}
    return packing.with_state(**changes), sites


def solve_held(k: Stiffness, right: Array) -> Array:
    """Solve K_uu x = right with the first site held, which takes out the two translations.

    Raises:
        ConvergenceError: K_uu has a negative or another zero mode.
    """
    solution = np.zeros_like(right)
    factors = SymmetricFactors(k.uu[2:, 2:])
    if factors.negative:
        raise ConvergenceError(
            f"the packing is unstable: its Hessian has {factors.negative} negative mode(s), it is not at a minimum"
        )
    solution[2:] = factors.solve(right[2:])
    residual = np.abs(k.uu @ solution - right)[2:].max() / max(np.abs(right).max(), np.finfo(float).tiny)
    if not residual <= 1e-6:
        raise ConvergenceError(f"the Hessian is too close to singular for a modulus: relative residual {residual:.2g}")
    return solution
