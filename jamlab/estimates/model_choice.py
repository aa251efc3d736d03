"""The least model that a scene needs: disks or droplets, contact form, number of vertices, chosen by what they cost.

The choice comes from the table behind `jamlab.estimate`. One packing asks another question than a mean over packings:
how far z, G, A and the voids of a way are from those of default droplets (Boromand et al. with the parameters of
`dp.parameters`) that the same disks carry, seed by seed. What a way is off by on average is corrected for; a third of
that, and the distance from it that few packings exceed, is its expected error. Default droplets are the last resort.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from jamlab.arguments.choices import Ensemble, Law, ModelOrAuto, Units
from jamlab.arrays import Array
from jamlab.checks import check_choice, check_number, checked
from jamlab.errors import InputError, warn
from jamlab.estimates import ways
from jamlab.estimates.choice import Choice, Why, judge, write_bounds
from jamlab.estimates.ways import WAYS, N, WayRecord, Ways
from jamlab.models.disks import DISKS
from jamlab.models.droplets import DROPLETS
from jamlab.packing.kinds import MODELS
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress, part_of
from jamlab.protocols.law_arguments import law_given
from jamlab.protocols.onset import jam
from jamlab.protocols.particle_numbers import check_count
from jamlab.protocols.size_distributions import Sizes
from jamlab.statistics.confidence import between, exceeded_by_few, neighbours

CHOICE_QUANTITIES = {
    "z": "contacts per particle without rattlers, absolute",
    "g": "relaxed shear modulus, mean over directions, relative to its mean size over packings",
    "d_shape_factor": "mean excess shape factor A - A_J (A_J: free particle), absolute",
    "void_sides": "mean number of sides of a void, absolute",
}


@dataclass(frozen=True)
class Offer:
    """Which ways are offered."""

    failures: float = 0.1  # of the packings of a level: a way that fails more often is not offered there
    transfer: float = 1 / 3  # part of a mean error that may be another in packings of another size


OFFER = Offer()


@checked
def choose(
    rho: float, error: Mapping[str, float], n: int = 64, *, model: ModelOrAuto = "auto", table: Ways | None = None
) -> Choice:
    """Choose the cheapest way to make packings whose error is expected to be small enough.

    Args:
        rho: true packing fraction of the scene.
        error: largest accepted error of each quantity of `CHOICE_QUANTITIES`, against default droplets on the same
            packing, such as {"z": 0.05}.
        n: even number of particles; errors of single packings scale as n^-1/2.
        model: "auto", or the name of a model to choose within.
        table: replaces the shipped table, see `jamlab.estimates.ways.read_ways`.

    Raises:
        InputError: an unknown quantity or model, an odd n, an error that is not positive or cannot be met, or rho
            outside the table.
        StorageError: the table was made with other parameters than `dp.parameters`.

    Example:
        >>> choice = jamlab.choose(rho=0.87, error={"z": 0.25}, n=64)
        >>> choice.way.model, choice.bound["z"] <= 0.25
        ('sp', True)
        >>> choice.options[["error_z", "why"]].round(2).to_numpy().tolist()[:2]
        [[0.15, 'taken'], [0.0, 'more expensive']]
    """
    _check(error, model)
    check_count(n)
    table = ways.read_ways() if table is None else table
    reference = ways.reference_record(table, ways.default_way(N), rho)
    records = [record for record in list_records(table) if model in ("auto", record.way.model)]
    if not records:  # of a model of another package
        known = dict.fromkeys(record.way.model for record in list_records(table))
        raise InputError(f"model {model!r} is not in the table of errors: use one of auto, {', '.join(known)}")
    rows = [_option(record, reference, rho, error, n) for record in records]
    options, row = judge(rows, "seconds")
    if row is None:
        shares = [max(option[f"error_{name}"] / limit for name, limit in error.items()) for option in rows]
        best = rows[int(np.argmin(shares))]
        asked = ", ".join(f"{name} within {limit:g}" for name, limit in error.items())
        nearest = f"; {best['way']} comes nearest with {write_bounds({k: best[f'error_{k}'] for k in error})}"
        close = nearest if min(shares) < np.inf else ""
        raise InputError(f"no entry of the reference table meets {asked} at rho = {rho:g} with n = {n}{close}")
    best = rows[row]
    # none of G, whose errors are over a mean that vanishes towards onset
    correction = dict.fromkeys(CHOICE_QUANTITIES, 0.0)
    for name in ("z", "d_shape_factor", "void_sides") if records[row] is not reference else ():
        means = [each.mean() if len(each) else np.nan for each in errors_of(records[row], reference, name)]
        correction[name] = -between(records[row].levels, means, rho)
    bound, seconds = {name: best[f"error_{name}"] for name in error}, best["seconds"]
    return Choice(way=best["way"], bound=bound, options=options, seconds=seconds, packings=1, correction=correction)


def list_records(table: Ways) -> list[WayRecord]:
    """Ways that serve a scene: packings as large as the reference, with its minima, on the same disks."""
    return [r for r in table.values() if r.way.n == N and r.way.force_tolerance is None and r.way.start != "droplets"]


def errors_of(record: WayRecord, reference: WayRecord, quantity: str) -> list[Array]:
    """Value of a way minus that of a reference, packing by packing, at each level; of "g" over the mean of its size."""
    _, one, two = np.intersect1d(record.seeds, reference.seeds, return_indices=True)
    mine, true = record.values[quantity][one], reference.values[quantity][two]
    scale = np.nanmean(np.abs(true), axis=0) if quantity == "g" else np.ones(len(record.levels))
    return [column[np.isfinite(column)] for column in ((mine - true) / scale).T]


def expected_error(errors: Array, n_table: int, n: int, quantum: float = 0.0) -> float:
    """Error that 95 % of new packings of n particles stay below once the mean of the errors is taken off. The distance
    from the mean of the other packings that few of m packings of n_table particles exceed, at least `quantum`, the
    least step of the quantity, scaled with n^-1/2. Infinite for fewer packings than promise anything."""
    others = max(len(errors) - 1, 1)
    distance = np.abs(errors - np.mean(errors)) * len(errors) / others if len(errors) else errors
    return max(exceeded_by_few(distance), quantum) * float(np.sqrt(n_table / n))


def _check(error: Mapping[str, float], model: ModelOrAuto) -> None:
    if model != "auto":
        MODELS.get(model)  # refuses one that is unknown
    if not error:
        raise InputError(
            f"error = {{}}: give the largest accepted error of one or more of {', '.join(CHOICE_QUANTITIES)}"
        )
    for name, limit in error.items():
        check_choice("error of", name, CHOICE_QUANTITIES)
        check_number(f"error of {name}", limit, np.inf)


def _succeeds(record: WayRecord, reference: WayRecord, rho: float) -> bool:
    """Whether a way gives a packing where default droplets do, at the levels on both sides of rho."""
    _, one, two = np.intersect1d(record.seeds, reference.seeds, return_indices=True)
    there = np.isfinite(reference.values["z"][two])
    failed = (there & ~np.isfinite(record.values["z"][one])).sum(axis=0)
    beside = list(neighbours(record.levels, rho)[:2])
    return bool((failed[beside] <= OFFER.failures * there.sum(axis=0)[beside]).all())


def _option(
    record: WayRecord, reference: WayRecord, rho: float, largest: Mapping[str, float], n: int
) -> dict[str, Any]:
    """Errors and cost of a way at rho, between the levels of the table."""
    error = dict.fromkeys(largest, 0.0)
    for name in largest if record is not reference else ():
        levels = errors_of(record, reference, name)
        mean = between(record.levels, [abs(each.mean()) if len(each) else np.inf for each in levels], rho)
        far = [expected_error(each, N, n, ways.QUANTUM.get(name, 0.0) / N) for each in levels]
        error[name] = between(record.levels, far, rho) + (1.0 if name == "g" else OFFER.transfer) * mean
    why = None
    if not _succeeds(record, reference, rho):
        why = Why.FAILS
    elif not np.isfinite(list(error.values())).all():
        why = Why.UNKNOWN
    elif any(error[name] > limit for name, limit in largest.items()):
        why = Why.LARGE
    seconds = between(record.levels, record.seconds.mean(axis=0), rho) * n / N
    columns = {f"error_{name}": value for name, value in error.items()}
    return {"way": replace(record.way, n=n), **columns, "seconds": seconds, "why": why}


@checked
def scene(
    rho: float,
    n: int = 64,
    seed: int = 1,
    *,
    error: Mapping[str, float],
    model: ModelOrAuto = "auto",
    step: float = WAYS.step,
    ensemble: Ensemble = "fixed-box",
    force_tolerance: float | None = None,
    ranks: int = 1,
    law: Law | None = None,
    size_ratio: float | None = None,
    fraction_large: float = 0.5,
    sizes: Sizes | None = None,
    units: Units | None = None,
    progress: Progress | None = None,
) -> Packing:
    """Make a packing at rho with the cheapest model that is expected to meet every error.

    Disks are jammed and compressed. If droplets are needed, they replace the disks at rho, or at 0.88 if rho is higher,
    and are compressed further.

    Args:
        rho: true packing fraction.
        n: even number of particles.
        seed: seed of the random start.
        error: largest accepted error of each quantity, e.g. {"z": 0.05}.
        model: "auto", or the name of a model.
        step: step of rho in the compressions.
        ensemble: "fixed-box", or of disks "shear-stabilized".
        force_tolerance: largest residual force, as in `jamlab.jam`.
        ranks: threads of FIRE while the particles are disks; useful above 10 000.
        law: force law of the model that `model` names, as in `jamlab.jam`.
        size_ratio, fraction_large, sizes: of the disks, as in `jamlab.jam`; droplets have the sizes of their disks.
        units: "eps" (default), or "k" of disks.
        progress: called after each minimisation with (fraction done, text); True: print it.

    Returns:
        The packing. Its provenance contains the choice (`model_choice`), its expected errors (`model_error`), and
        corrections to add to measured quantities (`model_correction`). They hold for two sizes of ratio 1.4, default
        laws and a fixed box.

    Warns:
        JamlabWarning: the law, the sizes or the ensemble differ from those that the expected errors hold for.

    Raises:
        InputError: see `jamlab.choose`; an argument that the chosen model does not have.
        ConvergenceError: no onset below rho, or a state of the compression did not converge.

    Example:
        >>> p = jamlab.scene(rho=0.87, n=16, seed=1, error={"z": 0.5})
        >>> p.model, p.n
        ('sp', 16)
    """
    if law is not None and model == "auto":
        raise InputError(f"law = {law!r}: parameters belong to a model, which is not chosen yet; give model too")
    choice = choose(rho, error, n, model=model)
    way = replace(choice.way, force_tolerance=force_tolerance)
    own = law_given(law, way.model)
    _check_scene(way.model, ensemble, units)
    of_droplets = way.model == DROPLETS.name
    odd = {"law": bool(own), "size_ratio": size_ratio is not None, "sizes": sizes is not None}
    odd |= {"fraction_large": fraction_large != 0.5, "ensemble": ensemble != "fixed-box"}
    if any(odd.values()):
        differ = ", ".join(name for name, other in odd.items() if other)
        warn(f"{differ}: the expected errors are those of packings with the default values")
    how: dict[str, Any] = {"size_ratio": size_ratio, "fraction_large": fraction_large, "sizes": sizes, "units": units}
    how |= {"ensemble": ensemble, "force_tolerance": force_tolerance, "ranks": ranks}
    first, rest = part_of(progress, 0.0, 0.4), part_of(progress, 0.4, 1.0)
    onset = jam(n, DISKS.name, seed, law=None if of_droplets else own, progress=first, **how)
    packing = ways.bring_on(way, onset, rho, step, law=own if of_droplets else None, ranks=ranks, progress=rest)
    entries = {"model_error": choice.bound, "model_correction": choice.correction}
    return packing.with_state(provenance={"model_choice": str(choice.way), **entries})


def _check_scene(model: str, ensemble: str, units: str | None) -> None:
    """Refuse what droplets that take the place of disks do not have."""
    if model != DROPLETS.name:
        return
    if units not in (None, "eps"):
        raise InputError(f"units = {units!r}: the chosen model is dp, whose units are eps; leave it out")
    if ensemble != "fixed-box":
        raise InputError(
            f"ensemble = {ensemble!r}: droplets take the place of disks in a fixed box; use model='sp', or "
            "jam(n, 'dp', ensemble='shear-stabilized') and compress"
        )
