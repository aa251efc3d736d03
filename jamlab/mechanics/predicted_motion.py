"""Where the sites of a packing go: by linear response to another packing fraction, or along modes that give way."""

from __future__ import annotations

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.mechanics.elasticity import linear_response
from jamlab.mechanics.factors import SOFT, UnstableError
from jamlab.mechanics.force_network import force_network
from jamlab.packing.area_change import compression
from jamlab.packing.deformation import at_phi
from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing


def follow(packing: Packing, phi: float) -> Packing:
    """Predict the packing at another nominal packing fraction by linear response. Near onset a prediction keeps all
    overlaps in proportion, so that no contact opens or closes; an affine guess would change most of them. Rattlers move
    with the box; so does all of a packing that has no stable response."""
    moved = at_phi(packing, phi)
    try:
        tensor = linear_response(packing)
    except ConvergenceError:
        return moved
    strain = compression(packing).gradient(packing.phi / phi) - np.eye(2)
    held = force_network(packing).held & packing.frame.free_sites
    response = np.einsum("nkij,ij->nk", tensor.displacements, strain)
    positions = moved.positions.copy()
    positions[held] = (packing.positions @ (np.eye(2) + strain).T + response)[held]
    return moved.with_state(positions=positions)


@per_packing
def unstable_directions(packing: Packing, named: int = SOFT.named) -> tuple[Array, float, int] | None:
    """Displacements (k, n_sites, 2), the largest 1, along modes that give way, the lowest first, its eigenvalue, 0
    where rounding hides it, and how many give way, of which k may be fewer, beyond `named`; None for a minimum, for a
    loose packing, and for forces so large beside the pressure that no Hessian tells."""
    try:
        linear_response(packing, named=named)
    except UnstableError as error:
        modes = error.modes.reshape(len(error.modes), -1, 2)
        directions = np.zeros((len(modes), *packing.positions.shape))
        # with one site fixed, all others may move where its own droplet slides
        directions[:, force_network(packing).held] = modes - packing.frame.drift(modes, axis=1)
        return directions / np.abs(directions).max(axis=(1, 2), keepdims=True), error.eigenvalue, error.count
    except ConvergenceError:
        return None
    return None
