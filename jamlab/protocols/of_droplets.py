"""How packings of deformable droplets are made.

Polygons on random places would start with crossed outlines, which no contact form can undo. So disks that just hold the
droplets are pushed apart and compressed first; as long as they do not jam, the droplets in them cannot touch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import numbers
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError, named
from jamlab.laws.laws import law_class
from jamlab.laws.pair_law import PairLaw
from jamlab.models.droplets import DROPLETS
from jamlab.packing.deformation import at_phi
from jamlab.packing.natural_units import in_natural_units
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import Recipe
from jamlab.protocols.descent_of_droplets import DescentOfDroplets
from jamlab.protocols.makings import Making
from jamlab.protocols.onset_search import OnsetSearch, SearchState
from jamlab.protocols.random_start import (
    droplet_cell,
    droplet_params,
    free_diameters,
    place_droplets,
    random_disks,
)
from jamlab.protocols.relaxation import relax_session, usual_force_tolerance
from jamlab.protocols.rigid_search import RigidSearch, may_be_rigid
from jamlab.protocols.size_distributions import diameters_of
from jamlab.protocols.units_of_recipes import units_of


@dataclass(frozen=True)
class Placing:
    """Droplets that are placed in disks."""

    touching: float = 1e-12  # energy per disk above which the disks that hold the droplets have jammed
    approach: float = (
        0.5  # of neighbours in a step of phi at most, half of its part of phi times their distance, over delta
    )
    rounding: float = 1e-16  # of a force of the area elasticity, over ka: 1.6e-16 and 3.6e-16 at most for N = 8 and 64


PLACING = Placing()


class MakingOfDroplets(Making):
    """See `Making`."""

    name = DROPLETS.name
    descent = DescentOfDroplets()
    # 8 relaxes droplets at length that stall after a slide, 7 takes rigid bodies down by L-BFGS, 6 by steps that know
    # which contacts they close, 5 slides along several modes at a time, 4 lets what stops a sliding droplet press and
    # count, 3 searches over rigid bodies, 2 ends at a minimum, 1 ended at some saddles
    version = 8
    stiffening_version = 2  # files of campaigns hold it
    # 5 asks what rattlers stop before it goes by steps, 3 and 4 as 4 and 5 above, 2 leaves saddles
    compression_version = 5
    starts = ("direct", "from-disks")
    outlines = ("eps", "nv_small", "nv_large", "vertices")
    way = ((0.2, 0.80, 0.85), (0.0, 0.1, 0.9))
    settled = 1e-6  # tells a state jammed by step_fine from a loose one
    # rho is known to 0.1 % of a step of 0.005 after 12 to 60 steps of L-BFGS of 70 to 700, two states of 22 to 0.8 %
    rough = 0.01
    loose = 5e-8  # forces that are left could not make up u_contact, F^2 delta^2/(2 eps)

    def check_stiffness(self, law: Mapping[str, Any], tolerance: float) -> None:
        if (left := PLACING.rounding * law.get("ka", 0.0) / law["eps"]) > tolerance:
            raise InputError(
                f"ka = {law['ka'] / law['eps']:g} eps: rounding of area forces is {left:.1g}, above the force "
                f"tolerance {tolerance:g}: use ka up to {tolerance / PLACING.rounding:.1g} eps"
            )

    def check(self, recipe: Recipe) -> None:
        self.check_start(recipe)
        _, params = self._polygons(recipe)
        law = law_class(params, "rims").of(params, "eps")
        if law.range:
            raise InputError(
                f"{law}: what attracts has no onset at zero contact energy; use droplets_from_disks(disks, law=...), "
                "or jam without adhesion and relax(p.with_state(params={**p.params, 'adhesion': ...}))"
            )
        usual = usual_force_tolerance(self.name)
        self.check_stiffness(params, usual if recipe.force_tolerance is None else recipe.force_tolerance)

    def check_start(self, recipe: Recipe) -> None:
        if (ratio := recipe.size_ratio) is not None:
            raise InputError(
                f"{named('size_ratio', ratio)}: "
                "the size ratio of droplets follows from their vertices; give nv_small and "
                f"nv_large, or sizes, such as 'bidisperse:{ratio:g},0.5'"
            )

    def _polygons(self, recipe: Recipe) -> tuple[NDArray[np.int64], dict[str, Any]]:
        """(n,) vertices, and parameters of the law."""
        units_of(recipe, "eps", DROPLETS.unit_names)  # refuses others
        drawn = None if recipe.sizes is None else diameters_of(recipe)
        return droplet_params(recipe.n, recipe.fraction_large, drawn, **recipe.parameters)

    def start(self, recipe: Recipe) -> Packing:
        protocol, n, seed, large = numbers("onset"), recipe.n, recipe.seed, recipe.fraction_large
        phi, highest = protocol["phi_start"], protocol["phi_carried" if recipe.start == "from-disks" else "phi_start"]
        drawn = None if recipe.sizes is None else diameters_of(recipe)
        nv, params = self._polygons(recipe)
        side = droplet_cell(nv, params, phi)
        disks = random_disks(n, seed, phi=phi, large=large, sizes=drawn)
        scale = side / disks.box[0, 0]
        holders = disks.with_state(
            box=disks.box * scale, positions=disks.positions * scale, diameters=free_diameters(nv, params)
        )
        steps = max(0, int(np.ceil((highest - phi) / protocol["search_step"] - 1e-9)))
        loose = carried_up(holders, np.linspace(phi, max(phi, highest), steps + 1))
        if loose is None:
            raise ConvergenceError(f"droplets could not be placed without overlap at phi = {phi:.3f}: lower phi_start")
        return place_droplets(loose.positions, loose.box, nv, params, seed)

    def version_of(self, law: PairLaw) -> int:
        return self.version

    def find_onset(self, search: OnsetSearch, loose: Packing, step: float) -> tuple[SearchState, str]:
        if not may_be_rigid(loose):  # nothing notices outlines that pass through each other in one step
            longest = 2 * PLACING.approach * float(loose.params["delta"]) * loose.phi
            return super().find_onset(search, loose, min(step, longest))
        return RigidSearch(search, search.protocol).run(loose, step), "rigid"


@in_natural_units()
def carried_up(holders: Packing, fractions: Array) -> Packing | None:
    """Disks pushed apart at one packing fraction after the other until they jam; None if they do so at the first."""
    loose: Packing | None = None
    with Session(holders) as session:
        for reached in fractions:
            session.load(at_phi(loose or holders, holders.phi * reached / fractions[0]))
            if relax_session(session).evaluation.energy > PLACING.touching * holders.n:
                break
            loose = session.packing()
    return loose


MAKING = MakingOfDroplets()  # as entry points name it
