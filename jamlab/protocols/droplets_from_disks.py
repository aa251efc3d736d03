"""From disks to droplets: hand a jammed packing of soft disks over to the DP model.

The disks share their overlaps half and half, as their power cells cut them. Each becomes a polygon inscribed in what is
left of it, drawn in by half the width of the circulo-lines, so that no two outlines cross and rims just meet where the
disks overlap. Rest areas are chosen so that every free droplet has the area of its disk; then the polygons relax, and
the box is set until they cover what the disks covered.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Law
from jamlab.checks import checked
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError, warn
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.power_cells import radical_height
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.models.droplets import DROPLETS
from jamlab.packing.deformation import at_phi
from jamlab.packing.natural_units import in_natural_units, natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import changed
from jamlab.protocols.compression import SWEEP
from jamlab.protocols.law_arguments import law_given
from jamlab.protocols.random_start import droplet_params
from jamlab.protocols.relaxation import Relaxed
from jamlab.protocols.rest_areas import length_scale, rest_areas_of
from jamlab.protocols.saddles import record, relax_off_saddles
from jamlab.storage.verified_file import versions


@dataclass(frozen=True)
class HandOver:
    """How droplets are made from disks."""

    # beyond, the hand-over is called discontinuous
    z_jump: float = 0.5
    kept: float = 0.75


HAND_OVER = HandOver()


@checked
def droplets_from_disks(
    packing: Packing, *, seed: int = 1, force_tolerance: float | None = None, law: Law | None = None
) -> Packing:
    """Replace disks by droplets at the same true packing fraction, and relax them.

    Args:
        packing: SP, at a minimum; two sizes or more. Best below rho = 0.88; at higher rho disks have contacts that
            droplets do not have (Boromand et al. fig 5).
        seed: seed of the orientations.
        force_tolerance: largest residual force in units of eps/l, default 1e-10.
        law: parameters of the force law that replace the defaults, e.g. {"gamma": 0.3}. The number of vertices is
            proportional to the diameter, (nv_small + nv_large)/2 for a disk of mean diameter; or `vertices`, one number
            or (n,).

    Returns:
        DP packing in units "eps", `onset`, fixed particles and walls as for the disks. Its provenance holds `handover`:
        rho and z of the disks, z of the droplets, the share of contacts that both have, and whether it is
        `continuous`: rho met to 1e-6, z within 0.5, three quarters of the contacts kept. Close to onset droplets may
        unjam; `continuous` is then False.

    Raises:
        InputError: not disks, sticky disks, an unknown parameter, or disks too small for the interaction range delta.
        ConvergenceError: the droplets do not reach the packing fraction of the disks.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> *_, disks = jamlab.compress(onset, to=0.87, step=0.02)
        >>> droplets = jamlab.droplets_from_disks(disks)
        >>> droplets.n == disks.n, droplets.model
        (True, 'dp')
        >>> abs(jamlab.packing_fraction(droplets) - jamlab.packing_fraction(disks)) < 1e-5
        True
    """
    parameters = law_given(law, DROPLETS.name)
    if packing.frame.is_flat:
        raise InputError(
            "flat walls: make the droplets of the packing without them, then with_walls(droplets, flat=True)"
        )
    if packing.law.range:
        raise InputError(
            f"{packing.law}: droplets do not attract each other as disks do; give repulsive disks, "
            'packing.with_state(params={"k": 1.0}), and law={"adhesion": 0.05} for droplets that adhere'
        )
    if not packing.law.springs:
        exponent = packing.params.get("exponent")
        lost = packing.law if exponent is None else f"exponent = {exponent:g}"
        warn(f"{lost} of the disks is not kept: droplets repel by springs")
    began, given = time.perf_counter(), packing
    packing = natural_scales(packing).to_natural(packing)
    droplets = inscribe(packing, seed=seed, **parameters)
    rho = packing_fraction(packing)
    found = relax_at_rho(droplets, rho, SWEEP.met_last, partial(relax_off_saddles, tolerance=force_tolerance))
    before, after = contacts(packing), contacts(found)
    kept = _common(before.pairs, after.pairs)
    continuous = bool(abs(after.z - before.z) <= HAND_OVER.z_jump and kept >= HAND_OVER.kept)
    handover = {"rho": rho, "z_disks": before.z, "z": after.z, "contacts_kept": kept, "continuous": continuous}
    entries = {"protocol": "from disks", "handover": handover, "wall_time": time.perf_counter() - began}
    found = found.with_state(provenance=entries | versions())
    how: dict[str, Any] = {"seed": seed, "force_tolerance": force_tolerance, "law": parameters or None}
    return changed(given, found, "droplets_from_disks", **how)


@in_natural_units()
def relax_at_rho(start: Packing, rho: float, tolerance: float, relax: Callable[[Session], Relaxed]) -> Packing:
    """Relax a packing at nominal packing fractions until the true one, rho, is met to a tolerance."""
    reached = float("nan")
    with Session(start) as session:
        for _ in range(SWEEP.secant_steps):
            found = relax(session)
            state = session.packing()
            reached = packing_fraction(state)
            if abs(reached - rho) <= tolerance:
                return record(session, state, found)
            session.load(at_phi(state, state.phi * rho / reached))
    raise ConvergenceError(
        f"{start.kind.particles} reach rho = {reached:.6f} instead of the requested {rho:.6f}: use another rho"
    )


def inscribe(packing: Packing, *, seed: int = 1, **parameters: Any) -> Packing:
    """Inscribe polygons in disks cut by their power cells, not relaxed; arguments as in `droplets_from_disks`."""
    diameters = packing.disk_diameters
    nv, params = droplet_params(packing.n, 0.5, diameters, **parameters)
    area = np.pi / 4 * diameters**2
    scale = length_scale(nv, area, params)
    params["a0"] = rest_areas_of(nv, scale**2 * area, params)
    positions, box, radius = scale * packing.positions, scale * packing.box, 0.5 * scale * diameters
    half = 0.5 * float(params["delta"])
    near = touching_disks(packing.with_state(positions=positions, box=box, diameters=2 * radius))
    i, j, r = np.concatenate([near.i, near.j]), np.concatenate([near.j, near.i]), np.concatenate([near.r, -near.r])
    distance = np.hypot(*r.T)
    normal = r / distance[:, None]
    height = radical_height(distance, radius[i], radius[j])
    rng = np.random.default_rng([seed, 2])
    shapes = []
    for m, count in enumerate(nv):
        turn = 2 * np.pi * (np.arange(count) + rng.random()) / count
        ray = np.column_stack([np.cos(turn), np.sin(turn)])
        own = i == m
        along = ray @ normal[own].T
        limits = np.divide(height[own] - half, along, out=np.full(along.shape, np.inf), where=along > 0)
        reach = np.minimum(radius[m] - half, limits.min(axis=1, initial=np.inf))
        if reach.min() <= 0:
            raise InputError(
                f"disk {m} has no room for a polygon inside rims of width delta = {params['delta']:g}: convert "
                "at a lower packing fraction, or use a smaller delta"
            )
        shapes.append(positions[m] + reach[:, None] * ray)
    offsets = np.concatenate([[0], np.cumsum(nv)])
    origin = {**packing.provenance, "handed_over": True}
    vertices = np.concatenate(shapes)
    droplets = Packing(DROPLETS.name, box, vertices, params, offsets=offsets, phi_J=packing.phi_J, provenance=origin)
    return droplets.with_state(fixed=packing.fixed, walls=packing.walls)


def _common(one: NDArray[np.int64], two: NDArray[np.int64]) -> float:
    """Contacts in both lists over contacts in either."""
    a, b = ({tuple(sorted(pair)) for pair in pairs.tolist()} for pairs in (one, two))
    return len(a & b) / max(len(a | b), 1)
