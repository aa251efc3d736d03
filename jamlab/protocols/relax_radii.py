"""Relax disks over their positions and their radii, and give the sizes back in the order that the radii have come to.

Radii that may change a little for the time of a quench let it end far deeper (C. Brito, E. Lerner and M. Wyart, Phys.
Rev. X 8, 031050 (2018); G. Kapteijns, W. Ji, C. Brito, M. Wyart and E. Lerner, Phys. Rev. E 99, 012106 (2019)). There,
and in ideal disk packings (V. Bolton-Lum, R. C. Dennis, P. Morse and E. Corwin, arXiv:2404.07492), the radii stay as
they come out. Here the sizes of the packing are given back by rank, so that they are the same as before.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.packing.natural_units import natural_scales, stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import changed
from jamlab.protocols.relaxation import check_tolerance
from jamlab.protocols.thermal_history import quenched

RADII_PROTOCOL = 1  # version, see jamlab.campaign.tasks


@dataclass(frozen=True)
class Descent:
    """Steps of L-BFGS over positions and radii."""

    steps: int = 3000
    pairs: int = 20  # of steps and forces that it remembers
    force: float = 1e-6  # largest that is left, natural units: the order of the radii has come to rest long before
    difference: float = 1e-5  # of a distance of contact, relative, by which dU/ds is found of any law


DESCENT = Descent()


@checked
def relax_radii(
    packing: Packing,
    radius_stiffness: float = 3e-3,
    *,
    pressure: float | None = None,
    force_tolerance: float | None = None,
) -> Packing:
    """Relax disks over positions and radii, give their sizes back by rank, and relax: a stable packing of the same
    sizes.

    The energy has a term (kappa/2) d0^2 (d/d0 - d0/d)^2 of each diameter (Kapteijns et al.), and the area of all disks
    stays. At its minimum the smallest disk gets the smallest of the given diameters, and so on, to the last bit.

    Args:
        packing: SP, of any law; jammed, of more than one size.
        radius_stiffness: kappa over the stiffness of contacts; the softer, the further sizes go. Fixed disks keep
            theirs.
        pressure: at which the packing is relaxed in the end, with a box that is free; default: the box keeps its area.
        force_tolerance: largest residual force, as in `jamlab.relax`.

    Returns:
        The minimum. It has no `phi_J`: it jams elsewhere than the packing given. `provenance["resized"]` is the share
        of disks that have another size than before.

    Raises:
        InputError: droplets, or an argument out of range.
        ConvergenceError: the pressure was not reached.

    Example:
        >>> p = jamlab.pack(n=32, phi=0.9, seed=1, sizes="lognormal:0.2")
        >>> q = jamlab.relax_radii(p)
        >>> bool(jamlab.evaluate(q).energy < 0.6 * jamlab.evaluate(p).energy)
        True
        >>> sorted(q.disk_diameters) == sorted(p.disk_diameters)
        True
    """
    began = time.perf_counter()
    if packing.model != "sp":
        raise InputError(f"model {packing.model!r}: radii are those of disks, sp; use jamlab.anneal(packing)")
    packing.kind.check_apart(packing)
    packing.kind.check_for_lammps(packing)  # refuses two disks at one place
    check_tolerance(force_tolerance, 1e-3)
    if pressure is not None:
        check_number("pressure", pressure, np.inf)
    scales = natural_scales(packing)
    soft = _softened(scales.to_natural(packing), radius_stiffness)
    hot = scales.from_natural(soft)
    resized = float((hot.disk_diameters != packing.disk_diameters).mean())
    entries: dict[str, Any] = {"protocol": "relax_radii", "protocol_version": RADII_PROTOCOL, "resized": resized}
    found = quenched(packing, hot, force_tolerance, pressure, began, **entries, radius_stiffness=radius_stiffness)
    how = {"radius_stiffness": radius_stiffness, "pressure": pressure, "force_tolerance": force_tolerance}
    return changed(packing, found, "relax_radii", **how)


def _softened(packing: Packing, softness: float) -> Packing:
    """The packing at its minimum over positions and radii, with its own sizes in the order of those radii."""
    from scipy.optimize import minimize

    free, sizes = packing.frame.free, packing.disk_diameters
    energy = radii_energy(packing, softness)
    start = np.append(packing.positions[free].ravel(), np.zeros(free.sum()))
    how = {"maxiter": DESCENT.steps, "maxcor": DESCENT.pairs, "gtol": DESCENT.force, "ftol": 0.0}
    found = minimize(energy, start, jac=True, method="L-BFGS-B", options=how).x
    positions, diameters = packing.positions.copy(), sizes.copy()
    positions[free] = found[: 2 * free.sum()].reshape(-1, 2)
    own = sizes[free]
    reached = own * np.exp(found[2 * free.sum() :])
    ranked = np.empty_like(own)
    ranked[np.lexsort([own, reached])] = np.sort(own)
    diameters[free] = ranked
    return packing._trusted(positions=positions, diameters=diameters)


def radii_energy(packing: Packing, softness: float) -> Callable[[Array], tuple[float, Array]]:
    """Energy, and its derivatives, of positions (n, 2) and logarithms (n,) of the diameters of free disks, over those
    given, which are scaled until all have the area that they had."""
    free, sizes, law = packing.frame.free, packing.disk_diameters, packing.law
    own, n = sizes[free], int(free.sum())
    area, kappa = float((own**2).sum()), softness * stiffness_scale(packing)

    def energy(state: Array) -> tuple[float, Array]:
        positions, diameters = packing.positions.copy(), sizes.copy()
        positions[free] = state[: 2 * n].reshape(n, 2)
        grown = own * np.exp(state[2 * n :])
        diameters[free] = grown = grown * np.sqrt(area / float((grown**2).sum()))
        near = touching_disks(packing._trusted(positions=positions, diameters=diameters))
        distance = np.hypot(*near.r.T)
        contact = 0.5 * (diameters[near.i] + diameters[near.j])
        value, slope, _ = law(contact, distance)
        step, least = DESCENT.difference, 0.0 if law.range else distance  # laws that end at contact are 0 beyond
        less, more = (law(np.maximum(contact * (1 + sign * step), least), distance)[0] for sign in (-1, 1))
        growth = 0.5 * (more - less) / (2 * step * contact)  # of U with one of the two diameters
        push = (slope / distance)[:, None] * near.r
        forces, work = np.zeros_like(positions), np.zeros(len(positions))
        for sign, sites in ((-1, near.i), (1, near.j)):
            np.add.at(forces, sites, sign * push)
            work += np.bincount(sites, growth, len(positions))
        ratio = grown / own
        held = 0.5 * kappa * own**2 * (ratio - 1 / ratio) ** 2
        by_log = work[free] * grown + kappa * own**2 * (ratio**2 - ratio**-2)
        by_log -= grown**2 / area * by_log.sum()
        return float(value.sum() + held.sum()), np.concatenate([forces[free].ravel(), by_log])

    return energy
