"""From a picture: droplets as measured become a periodic patch of disks or polygons, at a minimum."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from jamlab.arguments.choices import Law, ModelName
from jamlab.arrays import Array
from jamlab.checks import check_choice
from jamlab.errors import InputError
from jamlab.models.disks import DISKS
from jamlab.models.droplets import DROPLETS
from jamlab.packing.deformation import at_phi
from jamlab.packing.kinds import MODELS
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.droplets_from_disks import droplets_from_disks, relax_at_rho
from jamlab.protocols.relaxation import relax_session
from jamlab.storage.verified_file import versions


@dataclass(frozen=True)
class Patch:
    """How droplets of a picture become a periodic patch."""

    fewest: int = 8  # droplets: fewer are their own neighbours in a periodic patch
    rho_tolerance: float = 1e-4  # a picture tells rho to 0.02
    # rho, beyond which disks have contacts that droplets have not; droplets are compressed from there
    hand_over: float = 0.87
    step: float = 0.01  # of rho in that compression


PATCH = Patch()


def packing_of_picture(
    centres: Array, areas: Array, cells: Array, rho: float, model: ModelName, seed: int = 1, law: Law | None = None
) -> Packing:
    """Turn measured droplets into a packing at the packing fraction of the picture.

    The patch is a rectangle as large as the cells of the droplets together, in the middle of them and of their aspect.
    What sticks out of it on one side comes in on the other, where as much room is; the seam is not as in the picture,
    and relaxes. Disks keep the areas of the droplets. Polygons are inscribed in relaxed disks
    (`jamlab.droplets_from_disks`), at a lower packing fraction if need be, and compressed.

    Args:
        centres: (n, 2) of droplets that are whole, y up.
        areas, cells: (n,) of droplets and of their cells.
        rho: packing fraction to be met.
        model: name of the model: disks, in units "k" with lengths in mean diameters, or droplets.
        seed: of the orientations of polygons.
        law: of polygons, as in `jamlab.droplets_from_disks`.
    """
    MODELS.get(model)  # refuses one that is unknown
    check_choice("model", model, (DISKS.name, DROPLETS.name))
    if len(areas) < PATCH.fewest:
        raise InputError(f"the picture has {len(areas)} whole droplets, but a periodic packing needs {PATCH.fewest}")
    if not 0 < rho <= 1:
        raise InputError(f"rho is {rho:.4g}: a packing needs a packing fraction above 0, at most 1")
    handed_over = model == DROPLETS.name
    if law is not None and not handed_over:
        raise InputError(f"law = {law!r}: disks of a picture are springs; leave it out")
    began = time.perf_counter()
    diameters = 2 * np.sqrt(areas / np.pi)
    unit = float(diameters.mean())
    extent = np.ptp(centres, axis=0) + unit
    size = extent * np.sqrt(cells.sum() / extent.prod())
    low = centres.min(axis=0) + 0.5 * np.ptp(centres, axis=0) - 0.5 * size
    box = np.diag(size / unit)
    start = Packing(DISKS.name, box, np.mod(centres - low, size) / unit, {"k": 1.0}, "k", diameters / unit)
    first = min(rho, PATCH.hand_over) if handed_over else rho
    disks = relax_at_rho(at_phi(start, first), first, PATCH.rho_tolerance, relax_session)
    entries = {"protocol": "from a picture", "wall_time": time.perf_counter() - began}
    done = disks.with_state(provenance=entries | versions())
    if not handed_over:
        return done
    droplets = droplets_from_disks(done, seed=seed, law=law)
    if rho > PATCH.hand_over:
        *_, droplets = compress(droplets, to=rho, step=PATCH.step)
    return droplets
