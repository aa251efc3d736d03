"""Make a packing from its recipe."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from inspect import signature
from typing import Any

from jamlab.checks import check_arguments, checked
from jamlab.errors import ConvergenceError, InputError, named
from jamlab.geometry.contact_network import remove_rattlers
from jamlab.geometry.walls import with_walls
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import Recipe
from jamlab.processes.progress import Progress
from jamlab.protocols.anneal import ANNEAL_PROTOCOL, anneal
from jamlab.protocols.compression import compress, go_on
from jamlab.protocols.decompression import decompress
from jamlab.protocols.droplets_from_disks import droplets_from_disks
from jamlab.protocols.onset import check_onset, onset_of
from jamlab.protocols.relax import relax
from jamlab.protocols.relax_radii import RADII_PROTOCOL, relax_radii
from jamlab.protocols.swap_sizes import SWAP_PROTOCOL, swap_sizes
from jamlab.protocols.target_pressure import check_packed, packed_by


@checked
def make(recipe: Recipe, *, progress: Progress | None = None) -> Packing:
    """Make the packing of a recipe, and everything that was done to it afterwards.

    Args:
        recipe: `packing.recipe`, or one of your own.
        progress: called after each minimisation with (fraction done, text); True: print it.

    Returns:
        The packing: the same bits as before on the same machine with the same versions.

    Raises:
        InputError: an argument out of range, or a change that cannot be repeated.
        ConvergenceError: as of the function that made the packing.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> dense = list(jamlab.compress(onset, to=0.9, step=0.02))[-1]
        >>> jamlab.make(dense.recipe) == dense
        True
        >>> from dataclasses import replace
        >>> hertz = jamlab.make(replace(dense.recipe, seed=2, law="hertz"))
        >>> hertz.params["exponent"], round(jamlab.packing_fraction(hertz), 3)
        (2.5, 0.9)
    """
    check_recipe(recipe)
    first = replace(recipe, changes=())
    packing = onset_of(first, progress) if recipe.protocol == "onset" else packed_by(first, progress)
    for name, arguments in recipe.changes:
        change = _state_of_sweep if name == "compress" else CHANGES[name]
        found = change(packing, **arguments)
        packing = found if isinstance(found, Packing) else found.packing
    return packing


def check_recipe(recipe: Recipe) -> None:
    """Refuse a recipe of which nothing can be made, before any work begins."""
    (check_onset if recipe.protocol == "onset" else check_packed)(recipe)
    for name, arguments in recipe.changes:
        _check(name, arguments)


def _check(name: str, arguments: Mapping[str, Any]) -> None:
    """Refuse a change that cannot be repeated."""
    if name not in CHANGES:
        raise InputError(f"changes: {name!r} cannot be repeated: known are {', '.join(CHANGES)}")
    own = dict(arguments)
    if name == "compress":
        state, repeatable = own.pop("state", -1), own.pop("repeatable", False)
        if not isinstance(state, int) or isinstance(state, bool) or not (state == -1 or state > 0):
            raise InputError(f"changes: compress: {named('state', state)}: must be a whole number above 0, or -1")
        if not isinstance(repeatable, bool):
            raise InputError(f"changes: compress: {named('repeatable', repeatable)}: must be True or False")
    if "progress" in own:
        raise InputError(f"changes: {name}: progress is no part of a recipe; give it to `jamlab.make`")
    try:
        signature(CHANGES[name]).bind(None, **own)
    except TypeError as error:
        raise InputError(f"changes: {name}: {error}; give the arguments of `jamlab.{name}`") from None
    check_arguments(CHANGES[name], own)


def _state_of_sweep(packing: Packing, *, state: int = -1, repeatable: bool = False, **how: Any) -> Packing:
    """One state of `compress`, by its number from 1; -1: the last. `repeatable`: see `go_on`."""
    reached = packing
    count = 0
    for reached in go_on(packing, packing, 0, **{"step": _STEP, **how}, repeatable=repeatable):
        count += 1
        if count == state:
            return reached
    if state != -1 or not count:
        raise ConvergenceError(f"the sweep has {count} states, and state {state} is asked for; use a smaller number")
    return reached


_STEP = signature(compress).parameters["step"].default
CHANGES: Mapping[str, Callable[..., Any]] = {
    "compress": compress,
    "decompress": decompress,
    "relax": relax,
    "relax_radii": relax_radii,
    "swap_sizes": swap_sizes,
    "anneal": anneal,
    "droplets_from_disks": droplets_from_disks,
    "with_walls": with_walls,
    "remove_rattlers": remove_rattlers,
}
# versions of those that have one of their own, see jamlab.campaign.tasks
CHANGE_VERSIONS = {"swap_sizes": SWAP_PROTOCOL, "relax_radii": RADII_PROTOCOL, "anneal": ANNEAL_PROTOCOL}
