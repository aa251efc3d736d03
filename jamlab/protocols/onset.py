"""Jamming onset: compress a random start to a packing that barely touches, by one search for both models.

Boromand et al. 2.3: start at phi = 0.20, compress in steps, minimise the energy after each, and search for the packing
fraction at which the contact energy per disk or vertex is barely above zero. `search="incremental"` does that with the
steps of 1e-4. `search="bisection"` takes larger steps, `step_near` from `phi_near` on, and goes back to the last state
without contacts when one jams; only the last `step_fine` is decompressed. Steps of 1e-2 all the way would raise the
mean phi_J by a quarter of its spread. Of 2e-3 against 1e-4 only 40 onsets each of 32 disks were compared: they bound
the difference of the means to three quarters of the spread (benchmark_onset.py).
"""

from __future__ import annotations

import time
from typing import Any

from jamlab.arguments.choices import Ensemble, Law, ModelName, Search, Start, Units
from jamlab.arguments.table import argument
from jamlab.checks import check_number, checked
from jamlab.engine.deck_defaults import numbers
from jamlab.engine.session import Session
from jamlab.errors import InputError, named, typed
from jamlab.packing.natural_units import in_natural_units, unit_scales
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import Recipe, made_by
from jamlab.processes.progress import Progress
from jamlab.protocols.box_relaxation import minimizer
from jamlab.protocols.compression import MOST_STATES
from jamlab.protocols.law_arguments import law_given
from jamlab.protocols.makings import making_of
from jamlab.protocols.onset_search import OnsetSearch, OnsetWork
from jamlab.protocols.particle_numbers import check_bidisperse
from jamlab.protocols.relaxation import check_tolerance, usual_force_tolerance
from jamlab.protocols.saddles import record
from jamlab.protocols.size_distributions import Sizes, lasting, sizes_record
from jamlab.storage.verified_file import versions

# contact forces at onset, sqrt(2 u) eps/s, are 1e-8 to 4e-7: the rest must stay far below
LARGEST_TOLERANCE = argument("force_tolerance").ends("jam")[1]


@checked
def jam(
    n: int = 64,
    model: ModelName = "sp",
    seed: int = 1,
    *,
    search: Search = "bisection",
    step: float | None = None,
    ensemble: Ensemble = "fixed-box",
    start: Start | None = None,
    force_tolerance: float | None = None,
    ranks: int = 1,
    law: Law | None = None,
    size_ratio: float | None = None,
    fraction_large: float = 0.5,
    sizes: Sizes | None = None,
    units: Units | None = None,
    progress: Progress | None = None,
) -> Packing:
    """Make a packing at jamming onset (Boromand et al., section 2.3).

    Args:
        n: number of particles; must be even for the default sizes.
        model: "sp", disks, or "dp", deformable droplets, or the name of a model of another package, see
            docs/extending/index.md.
        seed: seed of the random start. The same seed gives the same bits on the same machine.
        search: "bisection" (droplets move as rigid bodies if possible), or "incremental" (as published, about forty
            times slower).
        step: first increment of phi, halved at every reversal; default in `onset.parameters`.
        ensemble: "fixed-box": compressed in a square box. "shear-stabilized": the box is also sheared to zero shear
            stress.
        start: DP: "direct", the default: droplets are compressed from phi = 0.20 on. "from-disks": disks around them
            are compressed to 0.80 or to their onset, and then replaced by droplets. These jam 0.002 higher, see
            docs/explanation/quantities.md.
        force_tolerance: largest residual force in units of eps/length, 1e-15 to 1e-9. Default: 1e-12 for disks (less if
            exponent > 2), 1e-10 for droplets.
        ranks: SP: threads of FIRE on one machine; useful above 10 000 disks.
        law: force law, by its name, "harmonic" (exponent 2), "hertz" (exponent 2.5) or that of another package, or by
            parameters that replace the defaults, e.g. {"gamma": 0.3, "contact": "segment/smooth"} of droplets. These
            have numbers of vertices beside them: `nv_small` and `nv_large`, or `vertices`, one number or (n,).
        size_ratio: SP: diameter ratio of large to small disks, 1 to 10 (default: 1.4). DP: given by
            `nv_large`/`nv_small`.
        fraction_large: number fraction of large particles; the mean of the two sizes stays 1.
        sizes: n diameters in any unit, or the name of a distribution, such as "lognormal:0.3", see
            `jamlab.protocols.size_distributions`; n may be odd. DP: sizes are proportional to the square roots of the
            rest areas.
        units: "eps" (default), or "k" of disks: stiffness k and mean diameter 1 instead of energy eps.
        progress: called after each minimisation with (fraction done, text); True: print it.

    Returns:
        Converged packing with `onset` = its own phi. Droplets: `on_rattlers` is True if a rattler or the end of a flat
        edge blocks the sliding of a droplet.

    Raises:
        InputError: an argument is out of range.
        ConvergenceError: no onset was found.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> onset.n, onset.converged, onset.phi == onset.phi_J
        (16, True, True)
        >>> c = jamlab.contacts(onset)
        >>> c.n_contacts - c.isostatic  # contacts above the isostatic number
        0
        >>> droplets = jamlab.jam(8, "dp")
        >>> droplets.params["gamma"], droplets.params["contact"]
        (0.4, 'outline')
    """
    recipe = Recipe(
        protocol="onset",
        n=n,
        model=model,
        seed=seed,
        search=search,
        step=step,
        ensemble=ensemble,
        start=start,
        force_tolerance=force_tolerance,
        ranks=ranks,
        law=law,
        size_ratio=size_ratio,
        fraction_large=fraction_large,
        sizes=sizes,
        units=units,
    )
    return onset_of(recipe, progress)


def check_onset(recipe: Recipe) -> None:
    """Refuse a recipe of which no packing at onset can be made."""
    if recipe.search == "incremental" and recipe.ensemble != "fixed-box":
        raise InputError(
            f"{named('ensemble', recipe.ensemble)}: the incremental search has a fixed box, use "
            + typed("search='bisection'", "--search bisection")
        )
    law_given(recipe.law, recipe.model)
    first_step_of(recipe)
    check_tolerance(recipe.force_tolerance, LARGEST_TOLERANCE)
    if recipe.sizes is None:
        check_bidisperse(recipe.n, recipe.seed, numbers("onset")["phi_start"], recipe.fraction_large)
    making_of(recipe.model).check(recipe)


def onset_of(recipe: Recipe, progress: Progress | None = None) -> Packing:
    """The packing at onset that a recipe makes; errors as of `jam`."""
    check_onset(recipe)
    making, first_step, by_paper = making_of(recipe.model), first_step_of(recipe), recipe.search == "incremental"
    began = time.perf_counter()
    recipe, sizes = lasting(recipe), recipe.sizes
    placed = making.start(recipe)
    if placed.law.range:
        raise InputError(f"{placed.law}: what attracts has no onset at zero contact energy; use pack, or compress")
    entries: dict[str, Any] = {
        "protocol": "onset",
        "protocol_version": making.version_of(placed.law),
        "search": recipe.search,
        "start": recipe.start,
        "seed": recipe.seed,
        "step": first_step,
    }
    entries |= sizes_record(sizes, placed.kind.sizes(placed))
    how = (by_paper, recipe.ensemble, recipe.force_tolerance, recipe.ranks, OnsetWork(making.way, progress))
    found = onset_above(placed, first_step, *how)
    found = found._trusted(params=placed.params, **found.known)
    found = found.with_state(provenance=entries | {"wall_time": time.perf_counter() - began, **versions()})
    return made_by(found, recipe)


@in_natural_units(units=unit_scales)
def onset_above(
    placed: Packing,
    first_step: float,
    by_paper: bool,
    ensemble: Ensemble,
    tolerance: float | None,
    ranks: int,
    work: OnsetWork,
) -> Packing:
    """The onset that a loose packing is compressed to."""
    protocol, making = numbers("onset"), making_of(placed.model)
    loose = _without_last_digits(placed)
    # of disks as small beside their contact forces as that of springs
    usual = usual_force_tolerance(loose.model) * loose.law.beside_springs(protocol["u_contact"])
    force = usual if tolerance is None else tolerance
    making.check_stiffness(loose.params, force)
    with Session(loose, ranks=ranks) as session:
        searched = OnsetSearch(session, protocol, minimizer(ensemble), force, work)
        if by_paper:
            onset, method = searched.by_paper(loose, first_step), making.descent.name(session)
        else:
            onset, method = making.find_onset(searched, loose, first_step)
    packing = onset.packing.with_state(phi_J=onset.phi, ensemble=ensemble)
    return record(session, packing, onset.found, minimizer=method)


def _without_last_digits(packing: Packing) -> Packing:
    """The packing with strengths to 14 digits: the same in whichever units they were given."""
    names = {
        name for name, each in packing.parameters.items() if each.energy and not each.each and name in packing.params
    }
    return packing.with_state(params=packing.params | {name: float(f"{packing.params[name]:.14g}") for name in names})


def first_step_of(recipe: Recipe) -> float:
    """First increment of phi of a recipe."""
    protocol, step = numbers("onset"), recipe.step
    if step is None:
        return protocol["step_paper" if recipe.search == "incremental" else "search_step"]
    check_number("step", step, 0.5)
    least = max(protocol["increment_least"], 1 / MOST_STATES)
    if step < least:
        raise InputError(f"{named('step', step, 'g')}: needs up to {1 / step:.0g} states; use {least:g} or more")
    return step
