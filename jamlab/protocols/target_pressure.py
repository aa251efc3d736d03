"""Pack disks at a target pressure, from a random start."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from jamlab.arguments.choices import Ensemble, Law, Units
from jamlab.checks import check_number, checked, is_number
from jamlab.engine.deck_defaults import numbers
from jamlab.engine.ranks import check_ranks
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError, named
from jamlab.laws.pair_law import HIGHEST_OVERLAP, PairLaw
from jamlab.models.disks import DISKS
from jamlab.packing.box_strains import BoxStrains
from jamlab.packing.deformation import at_phi
from jamlab.packing.natural_units import in_natural_units, natural_stress
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import STRESS
from jamlab.packing.recipe import Recipe, made_by
from jamlab.processes.progress import Progress, told
from jamlab.protocols.box_relaxation import minimizer, relax_disks_and_box
from jamlab.protocols.decompression import LEAST_NOISE, PRESSURE_PROTOCOL, check_force, check_met, come_down
from jamlab.protocols.descent import quench
from jamlab.protocols.law_arguments import law_given
from jamlab.protocols.random_start import disks_of, law_of_disks
from jamlab.protocols.relaxation import QUENCH_PROTOCOL, check_tolerance, relax_session, usual_force_tolerance
from jamlab.protocols.saddles import record, relax_off_saddles
from jamlab.protocols.size_distributions import Sizes, diameters_of, lasting, sizes_record
from jamlab.storage.verified_file import versions

HIGHEST_PRESSURE = HIGHEST_OVERLAP  # of springs, in k
_BEFORE_BOX = 1e-3  # k d, largest force of disks that attract before their box is set free
# Force over pressure on the way to the target, and how near, |log(p/target)|, that must come before the next is tried,
# or the box set free. The way changes the ensemble: by steps of p -> 0.6 p, relaxed to 1e-2, phi of 50 packings (n =
# 512, p = 1e-4) ends higher by 6e-4 +- 2e-4, with one level less lower by 1.5e-4 +- 1e-4; two levels more change it by
# 2e-5 +- 2e-5.
_LADDER = ((3e-2, 2.0), (1e-2, 0.5))
# times the pressure, if a random start does not meet it: one of them is met first, and the packing decompressed
_ABOVE = (10.0, 100.0, 1000.0)


@checked
def pack(
    n: int,
    pressure: float | None = None,
    seed: int = 1,
    *,
    phi: float | None = None,
    ensemble: Ensemble = "fixed-box",
    ranks: int = 1,
    force_tolerance: float | None = None,
    law: Law | None = None,
    size_ratio: float | None = None,
    fraction_large: float = 0.5,
    sizes: Sizes | None = None,
    units: Units | None = None,
    progress: Progress | None = None,
) -> Packing:
    """Make a packing of disks at a pressure or a packing fraction.

    Random disks are quenched above onset and decompressed until p = (S_xx + S_yy)/2 is close to the target. Then the
    enthalpy U + p A is minimised over positions and box size, and over box shear in the shear-stabilized ensemble. If
    this fails near onset, a packing at 10, 100 or 1000 times the pressure is decompressed. Sticky disks are quenched at
    a fixed packing fraction first.

    If `phi` is given, random disks are quenched to the next energy minimum in a box of that area. Below onset this
    state has no contacts; sticky disks form a network under tension.

    Args:
        n: number of disks; must be even for the default sizes.
        pressure: target pressure, units of k, 1e-8 to 0.3 (sticky disks: from -0.3; for a stickiness s above 0.1
            up to 0.5 - 2 s). Give `pressure` or `phi`.
        seed: seed of the random start.
        phi: nominal packing fraction, up to 2.
        ensemble: "fixed-box" or "shear-stabilized" (box sheared to zero shear stress).
        ranks: threads of FIRE; useful above 10 000 disks.
        force_tolerance: largest residual force in units of k d, from 1e-15 to 1e-4 p d. Default: 1e-12.
        law: force law, by its name, "harmonic" (exponent 2), "hertz" (exponent 2.5) or that of another package, or by
            parameters that replace the defaults, e.g. {"stickiness": 0.02} of sticky disks.
        size_ratio: diameter ratio of large to small disks, 1 to 10 (default: 1.4).
        fraction_large: number fraction of large disks; d stays the mean of the two diameters.
        sizes: n diameters in any unit, or the name of a distribution, such as "lognormal:0.3", see
            `jamlab.protocols.size_distributions`; n may be odd.
        units: "k" (default), or "eps": energy eps and mean diameter 1. Then pressures are in units of eps/d^2.
        progress: called after each minimisation with (nan, text); True: print it.

    Returns:
        Converged packing. The relative error of the pressure is at most 1e-6 (sticky disks: 1e-6 of the mean contact
        force over d). `provenance["pressure"]` is the value; after a decompression `provenance["from_pressure"]` is
        the pressure at its start.

    Raises:
        InputError: an argument is out of range.
        ConvergenceError: the pressure was not reached, for example beyond the tensile strength.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> p.converged, p.units
        (True, 'k')
        >>> round(jamlab.measure(p, ["pressure"])["pressure"], 8)
        0.01
    """
    if (phi is None) == (pressure is None):
        both = "" if pressure is None else f"pressure = {pressure:g} and phi = {phi:g}: "
        raise InputError(f"{both}give pressure or phi")
    recipe = Recipe(
        protocol="phi" if pressure is None else "pressure",
        n=n,
        pressure=pressure,
        seed=seed,
        phi=phi,
        law=law,
        units=units,
        ensemble=ensemble,
        sizes=sizes,
        size_ratio=size_ratio,
        fraction_large=fraction_large,
        ranks=ranks,
        force_tolerance=force_tolerance,
    )
    return packed_by(recipe, progress)


def check_packed(recipe: Recipe) -> None:
    """Refuse a recipe of which no packing at a pressure or a packing fraction can be made."""
    law_given(recipe.law, recipe.model)
    diameters_of(recipe)
    if recipe.phi is not None:
        check_tolerance(recipe.force_tolerance, LEAST_NOISE * HIGHEST_PRESSURE)
        check_number("phi", recipe.phi, 2.0)
        law_of_disks(recipe, "k")
    else:
        check_pressure(recipe)


def packed_by(recipe: Recipe, progress: Progress | None = None) -> Packing:
    """The packing at a pressure or a packing fraction that a recipe makes; errors as of `pack`."""
    check_packed(recipe)
    recipe, sizes = lasting(recipe), recipe.sizes
    diameters = diameters_of(recipe)
    entries = {"protocol": "pressure", "protocol_version": PRESSURE_PROTOCOL, "seed": recipe.seed}
    entries |= sizes_record(sizes, diameters)

    def start(fraction: float) -> Packing:
        return disks_of(recipe, fraction, diameters, "k").with_state(ensemble=recipe.ensemble)

    if recipe.phi is not None:
        entries |= {"protocol": "quench", "protocol_version": QUENCH_PROTOCOL}
        found = _quenched(start(recipe.phi), recipe.force_tolerance, recipe.ranks, entries)
    else:
        found = _at_pressure(recipe, start, entries, progress)
    return made_by(found, recipe)


def _at_pressure(
    recipe: Recipe, start: Callable[[float], Packing], entries: dict[str, Any], progress: Progress | None
) -> Packing:
    """Disks at the pressure of a recipe, or decompressed to it; `start` gives random ones at a packing fraction."""
    search, (force, law), ranks = numbers("pressure"), check_pressure(recipe), recipe.ranks
    pressure = float(recipe.pressure or 0.0)

    def at(target: float) -> Packing:
        began, extra = time.perf_counter(), 0.0 if law.range else 2 * law.linear_in_phi(target)
        placed = start(search["phi_jammed"] + extra)
        packing, reached = _from_random(placed, target, force, ranks, progress)
        known = {"pressure": reached, "wall_time": time.perf_counter() - began}
        return packing._trusted(provenance={**entries, **known, **packing.provenance}, **packing.known)

    try:
        return at(pressure)
    except ConvergenceError:
        if law.range:
            raise
        for times in _ABOVE:
            if law.linear_in_phi(times * pressure) < HIGHEST_PRESSURE:
                with suppress(ConvergenceError):
                    return come_down(at(times * pressure), pressure, force, ranks)
        raise


@in_natural_units()
def _quenched(given: Packing, tolerance: float | None, ranks: int, entries: dict[str, Any]) -> Packing:
    """The minimum next to random disks at their packing fraction, jammed or not."""
    check_ranks(ranks, given.kind)
    began = time.perf_counter()
    with Session(given, ranks=ranks) as session:
        found = relax_off_saddles(session, tolerance)
        packing = session.packing()
    return record(session, packing, found, **entries, wall_time=time.perf_counter() - began, **versions())


@in_natural_units(STRESS, pressure=STRESS)
def _from_random(
    given: Packing, pressure: float, force: float, ranks: int, progress: Progress | None
) -> tuple[Packing, float]:
    """The packing at a pressure that random disks come to, and the pressure met."""
    search = numbers("pressure")
    with Session(given, ranks=ranks) as session:
        if given.law.range:
            relax_session(session, _BEFORE_BOX)
        else:
            _walk(session, pressure, search, progress)
        found = relax_disks_and_box(session, BoxStrains(minimizer(given.ensemble).strains, pressure), force)
        packing = session.packing()
    lower = "a pressure nearer to 0" if given.law.range else "come down from a higher pressure by jamlab.decompress"
    check_met(packing, found, pressure, f"try another seed, or {lower}")
    if progress is not None:
        told(progress)(1.0, f"packing fraction {packing.phi:.4f}")
    return record(session, packing, found, **versions()), found.evaluation.pressure


def check_pressure(recipe: Recipe) -> tuple[float, PairLaw]:
    """Force tolerance of a recipe, small beside its pressure, and its force law; disks have mean diameter 1.

    Raises:
        InputError: the pressure is out of range, for this tolerance or for this law.
    """
    pressure: Any = recipe.pressure
    tolerance, law = recipe.force_tolerance, law_of_disks(recipe, "k")
    least, highest = law.pressures
    if law.range:
        if not (is_number(pressure) and least <= pressure <= highest):
            raise InputError(
                f"{named('pressure', pressure)}: must be a number from {least:g} to {highest:.4g} for {law}; "
                "beyond, disks pass through each other"
            )
        check_tolerance(tolerance, LEAST_NOISE * HIGHEST_PRESSURE)
        return usual_force_tolerance(DISKS.name) if tolerance is None else tolerance, law
    unit = natural_stress(law)
    check_number("pressure", pressure, max(HIGHEST_PRESSURE * unit, highest))
    force = check_force(pressure, tolerance, DISKS.name, unit)
    if pressure > highest:
        raise InputError(
            f"{named('pressure', pressure, 'g')}: "
            f"must be at most {highest:.4g} for {law}: beyond, disks pass through each other"
        )
    return force, law


def _walk(
    session: Session,
    pressure: float,
    search: Mapping[str, float],
    progress: Progress | None,
) -> None:
    """Quench and decompress until the pressure is near the target, known better and better on the way."""
    law = session.law
    target = law.linear_in_phi(pressure)  # secants are taken of what is linear in phi
    slope, rise, level = search["slope"], target, 0
    loose = search["loose"] * pressure
    before: tuple[float, float] | None = None
    for _ in range(int(search["tries"])):
        noise, wanted = _LADDER[level]
        state = quench(session, noise, floor=loose)
        packing, reached = session.packing(), state.pressure
        if progress is not None:
            told(progress)(float("nan"), f"packing fraction {packing.phi:.4f}")
        if abs(np.log(max(reached, loose) / pressure)) <= wanted:
            level += 1
            if level == len(_LADDER):
                return
            continue
        if reached < loose:  # too far down, or it found a denser minimum: up again by growing steps
            phi, rise, before, level = packing.phi + rise, 2 * rise, None, 0
        else:
            overlap = law.linear_in_phi(reached)
            if before is not None and packing.phi != before[0]:
                secant = (overlap - before[1]) / (packing.phi - before[0])
                slope = min(max(secant, search["slope_least"]), search["slope_most"])
            before = (packing.phi, overlap)
            rise = target
            phi = packing.phi + max(target - overlap, -search["fall"] * overlap) / slope
        session.load(at_phi(packing, phi))
    raise ConvergenceError(
        f"pressure {pressure:g} not reached with n = {packing.n}: the search ended at {reached:g}; use another seed"
    )
