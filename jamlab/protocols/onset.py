"""Jamming onset: compress a random start to a packing that barely touches, by one search for both models.

Boromand et al. 2.3: start at phi = 0.20, compress in steps, minimise the energy after each, and search for the packing
fraction at which the contact energy per disk or vertex is barely above zero. `search="incremental"` does that with the
steps of 1e-4. `search="bisection"` takes larger steps, `step_near` from `phi_near` on, and goes back to the last state
without contacts when one jams; only the last `step_fine` is decompressed. Steps of 1e-2 all the way would raise the
mean phi_J by a quarter of its spread; with 2e-3 its distribution is that of the paper (benchmark_onset.py).
"""

import time
from collections.abc import Mapping
from typing import Any

from jamlab.checks import check_choice, check_number, checked
from jamlab.engine.deck_defaults import numbers
from jamlab.engine.session import Session
from jamlab.errors import InputError, typed
from jamlab.model_words import MODEL_NAMES
from jamlab.packing.ensembles import ENSEMBLES
from jamlab.packing.kinds import MODELS
from jamlab.packing.natural_units import in_natural_units, unit_scales
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress
from jamlab.protocols.box_relaxation import minimizer
from jamlab.protocols.compression import MOST_STATES
from jamlab.protocols.law_arguments import check_law_arguments
from jamlab.protocols.onset_search import OnsetSearch, OnsetWork
from jamlab.protocols.particle_numbers import check_bidisperse
from jamlab.protocols.random_start import place_loose
from jamlab.protocols.relaxation import check_tolerance, descent_of, force_tolerance
from jamlab.protocols.rigid_search import RigidSearch, may_be_rigid
from jamlab.protocols.saddles import record
from jamlab.protocols.size_distributions import Sizes, sizes_record
from jamlab.storage.verified_file import versions

SEARCHES = ("bisection", "incremental")
STARTS = ("from-disks", "direct")
# versions, see jamlab.campaign.tasks; droplets: 5 slides along several modes at a time,
# 4 lets what stops a sliding droplet press and count, 3 searches over rigid bodies, 2 ends at a minimum, 1
# ended at some saddles; stiffening disks, whose exponent is not 2: 1 left forces beside the contact forces
ONSET_PROTOCOL = {"disks": 1, "droplets": 5, "stiffening": 2}
_ROUNDING = 1e-16  # of a force of the area elasticity, over ka: 1.6e-16 and 3.6e-16 at most for N = 8 and 64
LARGEST_TOLERANCE = 1e-9  # contact forces at onset, sqrt(2 u) eps/s, are 1e-8 to 4e-7: the rest must stay far below


@checked
def jam(
    n: int = 64,
    model: str = "sp",
    seed: int = 1,
    *,
    search: str = "bisection",
    step: float | None = None,
    ensemble: str = "fixed-box",
    start: str = "from-disks",
    tolerance: float | None = None,
    ranks: int = 1,
    size_ratio: float | None = None,
    fraction_large: float = 0.5,
    sizes: "Sizes | None" = None,
    progress: Progress | None = None,
    **parameters: Any,
) -> Packing:
    """Make a packing at jamming onset in units "eps" (Boromand et al., section 2.3).

    Args:
        n: number of particles; must be even for the default sizes.
        model: "sp" or "disks"; "dp" or "droplets".
        seed: seed of the random start. The same seed gives the same bits on the same machine.
        search: "bisection" (droplets move as rigid bodies if possible), or "incremental" (as published, about forty
            times slower).
        step: first increment of phi, halved at every reversal; default in `onset.parameters`.
        ensemble: "fixed-box": compressed in a square box. "shear-stabilized": the box is also sheared to zero shear
            stress.
        start: DP: "from-disks": disks are compressed and then replaced by droplets, which is faster and gives the same
            distribution of onsets. "direct": droplets are compressed from the beginning.
        tolerance: largest residual force in units of eps/length, 1e-15 to 1e-9. Default: 1e-12 for disks (less if
            exponent > 2), 1e-10 for droplets.
        ranks: SP: threads of FIRE on one machine; useful above 10 000 disks.
        size_ratio: SP: diameter ratio of large to small disks, 1 to 10 (default: 1.4). DP: given by
            `nv_large`/`nv_small`.
        fraction_large: number fraction of large particles; the mean of the two sizes stays 1.
        sizes: n diameters in any unit, or the name of a distribution, such as "lognormal:0.3", see
            `jamlab.protocols.size_distributions`; n may be odd. DP: sizes are proportional to the square roots of the
            rest areas.
        progress: called after each minimisation with (fraction done, text); True: print it.
        parameters: force-law parameters that replace the defaults, e.g. `contact="segment/smooth"` for droplets; DP:
            `vertices`, one number or (n,).

    Returns:
        Converged packing with `onset` = its own phi. Droplets: `on_rattlers` is True if a rattler or the end of a flat
        edge blocks the sliding of a droplet.

    Raises:
        InputError: an argument is out of range.
        ConvergenceError: no onset was found.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> onset.n, onset.converged, onset.phi == onset.onset
        (16, True, True)
        >>> c = jamlab.contacts(onset)
        >>> c.n_contacts - c.isostatic  # contacts beyond what statics asks for
        0
        >>> droplets = jamlab.jam(model="dp", n=8, seed=1)
        >>> droplets.params["gamma"], droplets.params["contact"]
        (0.4, 'outline')
    """
    protocol = numbers("onset")
    model = MODEL_NAMES.get(model.lower(), model)
    _check(model, search, ensemble, start, size_ratio, parameters)
    first_step = _first_step(step, search, protocol)
    check_tolerance(tolerance, LARGEST_TOLERANCE)
    if sizes is None:
        check_bidisperse(n, seed, protocol["phi_start"], fraction_large)
    began = time.perf_counter()
    highest = protocol["phi_carried" if start == "from-disks" else "phi_start"]
    placed = place_loose(model, n, seed, protocol, highest, parameters, size_ratio, fraction_large, sizes)
    if placed.law.range:
        raise InputError("sticky disks have no onset at zero contact energy: use pack, or compress")
    entries: dict[str, Any] = {
        "protocol": "onset",
        "protocol_version": ONSET_PROTOCOL[placed.kind.particles if placed.law.springs else "stiffening"],
        "search": search,
        "start": start,
        "seed": seed,
        "step": first_step,
    }
    entries |= sizes_record(sizes, placed.kind.sizes(placed))
    how = (search == "incremental", ensemble, tolerance, ranks, OnsetWork(model, progress))
    found = _onset_above(placed, first_step, *how)
    found = found._trusted(params=placed.params, **found.known)
    return found.with_state(provenance=entries | {"wall_time": time.perf_counter() - began, **versions()})


@in_natural_units(units=unit_scales)
def _onset_above(
    placed: Packing,
    first_step: float,
    by_paper: bool,
    ensemble: str,
    tolerance: float | None,
    ranks: int,
    work: OnsetWork,
) -> Packing:
    """The onset that a loose packing is compressed to."""
    protocol = numbers("onset")
    loose = _without_last_digits(placed)
    # of disks as small beside their contact forces as that of springs
    usual = force_tolerance(loose.model) * loose.law.beside_springs(protocol["u_contact"])
    force = usual if tolerance is None else tolerance
    check_stiffness(loose.params, force)
    with Session(loose, ranks=ranks) as session:
        searched = OnsetSearch(session, protocol, minimizer(ensemble), force, work)
        rigid = not by_paper and may_be_rigid(loose)
        if by_paper:
            onset = searched.by_paper(loose, first_step)
        elif rigid:
            onset = RigidSearch(searched, protocol).run(loose, first_step)
        else:
            onset = searched.by_bisection(loose, first_step)
        method = "rigid" if rigid else descent_of(session).name(session)
    packing = onset.packing.with_state(onset=onset.phi, ensemble=ensemble)
    return record(session, packing, onset.found, minimizer=method)


def _check(model: str, search: str, ensemble: str, start: str, ratio: float | None, parameters: dict[str, Any]) -> None:
    check_choice("model", model, MODELS.names())
    check_choice("search", search, SEARCHES)
    check_choice("ensemble", ensemble, ENSEMBLES)
    check_choice("start", start, STARTS)
    check_law_arguments(jam, model, parameters)
    if search == "incremental" and ensemble != "fixed-box":
        raise InputError(
            f"ensemble = {ensemble!r}: the incremental search has a fixed box, use "
            + typed("search='bisection'", "--search bisection")
        )
    if model == "sp" and start != "from-disks":
        raise InputError(f"start = {start!r}: start applies to droplets only; leave it out")
    if model == "dp" and ratio is not None:
        raise InputError(
            f"size_ratio = {ratio!r}: the size ratio of droplets follows from their vertices; give nv_small and "
            f"nv_large, or sizes, such as 'bidisperse:{ratio:g},0.5'"
        )


def _without_last_digits(packing: Packing) -> Packing:
    """The packing with strengths to 14 digits: the same in whichever units they were given."""
    names = {"eps", "gamma", "ka"} & packing.params.keys()
    return packing.with_state(params=packing.params | {name: float(f"{packing.params[name]:.14g}") for name in names})


def check_stiffness(law: dict[str, Any], tolerance: float | None) -> None:
    """Refuse droplets so stiff beside their contacts that rounding of their own forces exceeds those of contacts."""
    force = force_tolerance("dp") if tolerance is None else tolerance
    if (left := _ROUNDING * law.get("ka", 0.0) / law["eps"]) > force:
        raise InputError(
            f"ka = {law['ka']:g} eps: rounding of area forces is {left:.1g}, above the force tolerance {force:g}: "
            f"use ka up to {force / _ROUNDING:.1g} eps"
        )


def _first_step(step: float | None, search: str, protocol: Mapping[str, float]) -> float:
    if step is None:
        return protocol["step" if search == "bisection" else "step_paper"]
    check_number("step", step, 0.5)
    least = max(protocol["increment_least"], 1 / MOST_STATES)
    if step < least:
        raise InputError(f"step = {step:g}: needs up to {1 / step:.0g} states; use {least:g} or more")
    return step
