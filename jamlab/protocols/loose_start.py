"""Loose packings that a search for onset starts from; disks carry droplets until these might touch."""

from typing import Any

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import droplet_cell, droplet_params, free_diameters, place_droplets, random_disks
from jamlab.protocols.relaxation import relax

_TOUCHING = 1e-12  # energy per disk above which the disks that hold the droplets have jammed


def place_loose(
    model: str,
    n: int,
    seed: int,
    protocol: dict[str, float],
    highest: float,
    parameters: dict[str, Any],
    ratio: float | None = None,
    large: float = 0.5,
) -> Packing:
    """Place random particles without contacts: disks at phi_start, droplets at `highest` or where their disks jam.

    Polygons on random places would start with crossed outlines, which no contact form can undo. So disks that just hold
    the droplets are pushed apart and compressed first; as long as they do not jam, the droplets in them cannot touch.
    """
    phi = protocol["phi_start"]
    if model == "sp":
        return random_disks(n, seed, phi=phi, ratio=ratio, large=large)
    nv, params = droplet_params(n, large, **parameters)
    side = droplet_cell(nv, params, phi)
    disks = random_disks(n, seed, phi=phi, large=large)
    scale = side / disks.box[0, 0]
    holders = disks.with_state(
        box=disks.box * scale, positions=disks.positions * scale, diameters=free_diameters(nv, params)
    )
    steps = max(0, int(np.ceil((highest - phi) / protocol["step"] - 1e-9)))
    loose: Packing | None = None
    with Session(holders) as session:
        for reached in np.linspace(phi, max(phi, highest), steps + 1):
            session.load(at_phi(loose or holders, holders.phi * reached / phi))
            if relax(session).evaluation.energy > _TOUCHING * n:
                break
            loose = session.packing()
    if loose is None:
        raise ConvergenceError(f"droplets could not be placed without overlap at phi = {phi:.3f}: lower phi_start")
    return place_droplets(loose.positions, loose.box, nv, params, seed)
