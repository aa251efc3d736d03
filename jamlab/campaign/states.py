"""Make the packings of one task, or take them from a finished task that differs only in what it measures.

After observables were added to a campaign file, its tasks have new names. The files of the old ones stay in the folder;
their frames, and the tables that come out the same, are copied from there. Frames are stored in float64, bit by bit, so
the tables do not depend on the order in which observables were asked for.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from typing import Any

from jamlab.arguments.choices import By
from jamlab.campaign.file import STATES, Compression
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.observable import TaskStates
from jamlab.campaign.task_file import TaskFile
from jamlab.campaign.tasks import Parameters
from jamlab.errors import ConvergenceError, JamlabError, StorageError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import COLUMNS
from jamlab.packing.recipe import Recipe
from jamlab.protocols.compression import compress
from jamlab.protocols.confluence import MOST_CONTACTS, bisect_confluence
from jamlab.protocols.decompression import decompress
from jamlab.protocols.make import make


def make_states(parameters: Parameters, ranks: int = 1) -> TaskStates:
    """Make the packings of a task."""
    missing: list[dict[str, str]] = []
    recipe = replace(parameters.recipe, ranks=ranks)
    if parameters.pressures is not None:
        packings, targets = _at_pressures(parameters, recipe, missing)
    elif parameters.phi is not None:  # random disks, quenched; loose ones too
        packings = [make(replace(recipe, phi=phi)) for phi in parameters.phi]
        targets = [float("nan")] * len(packings)
    else:
        packings = _from_onset(parameters.compress, recipe, missing)
        targets = [float("nan")] * len(packings)
    return TaskStates(packings, targets, [p.converged and p.on_target for p in packings], missing)


def _effort(recipe: Recipe) -> dict[str, Any]:
    return {"force_tolerance": recipe.force_tolerance, "ranks": recipe.ranks}


def _at_pressures(
    parameters: Parameters, recipe: Recipe, missing: list[dict[str, str]]
) -> tuple[list[Packing], list[float]]:
    """Pack at each pressure from a new random start of the same seed, so that states do not depend on each other; with
    `decompress` only until one is met, from which the others are reached one after the other."""
    packings: list[Packing] = []
    targets = []
    for pressure in parameters.pressures or ():
        try:
            if parameters.decompress and packings:
                packings.append(decompress(packings[-1], pressure, **_effort(recipe)))
            else:
                packings.append(make(replace(recipe, pressure=pressure)))
            targets.append(pressure)
        except ConvergenceError as error:
            missing.append({"state": f"pressure {pressure:g}", "reason": str(error)})
    if not packings:
        raise ConvergenceError(missing[0]["reason"])
    return packings, targets


def _from_onset(how: Compression | None, recipe: Recipe, missing: list[dict[str, str]]) -> list[Packing]:
    """Jam and compress; a sweep that breaks off keeps the states made so far."""
    onset = make(recipe)
    if how is None:
        return [onset]
    by = how.by
    fraction = packing_fraction(onset) if by == "rho" else onset.phi
    to = fraction + (how.above_onset or 0.0) if how.to is None else how.to
    if fraction >= to:
        raise ConvergenceError(f"onset lies at {by} = {fraction:.6f}, above to = {to}: raise `to` of the sweep")
    packings = [onset]
    try:
        steps: dict[str, Any] = {"by": by, "step": how.step, "pressure_tolerance": how.pressure_tolerance}
        if how.first_step is not None:
            steps |= {"first_step": how.first_step, "per_decade": how.per_decade}
        for packing in compress(onset, to, **steps, **_effort(recipe)):
            packings.append(packing)
        if how.confluence is not None:
            packings = _add_confluence(packings, how.confluence, by, **_effort(recipe))
    except JamlabError as error:
        missing.append({"state": f"states after {len(packings) - 1}", "reason": str(error)})
    return packings


def _add_confluence(packings: list[Packing], error: float, by: By, **effort: Any) -> list[Packing]:
    """Add the bisection of the place where z first reaches 6; there is none where it never does."""
    full = next((k for k, p in enumerate(packings) if contacts(p).z >= MOST_CONTACTS), 0)
    if not full:
        return packings
    found = bisect_confluence(packings[full - 1], packings[full], error, by=by, **effort)
    return [*packings[:full], *sorted(found, key=lambda p: p.phi), *packings[full:]]


def read_stored(
    folder: CampaignFolder, names: Iterable[str], parameters: Parameters
) -> tuple[TaskFile, TaskStates] | None:
    """Read the finished task with the same packings that holds most of the tables of a task with these parameters, and
    only those, with its packings; None if no such file is whole, so that packings must be made again."""
    files: list[TaskFile] = []
    for name in sorted(names):
        with suppress(StorageError):  # `run` finds a damaged file, and runs its task again
            files.append(folder.read_task(name))
    if not files:
        return None
    file = max(files, key=lambda each: len(_shared_tables(parameters, each.parameters)))
    shared = _shared_tables(parameters, file.parameters)
    states = TaskStates(
        folder.packings(file.task), file.target_pressure.tolist(), file.converged.tolist(), file.missing
    )
    whole = STATES in shared and file.observables.keys() >= {*COLUMNS}  # else an earlier jamlab measured less
    measured = file.observables if whole else {}
    tables = {name: columns for name, columns in file.tables.items() if name in shared}
    return replace(file, observables=measured, tables=tables), states


def _shared_tables(one: Parameters, other: Parameters) -> set[str]:
    """Names of the tables that come out the same of the same packings; the quantities of "states" are fixed by the
    definitions."""
    if one.definitions != other.definitions:
        return set()
    alike = {name for name, observable in one.observables.items() if other.observables.get(name) == observable}
    return {STATES} | alike | {*one.own} & {*other.own}
