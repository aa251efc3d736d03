"""Say why an ensemble plan is what it is, in statements that can be read one by one, each from the table of ways."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from jamlab.engine.deck_defaults import defaults
from jamlab.estimates.ensemble_way import EnsembleWay
from jamlab.estimates.way_errors import relative_cost, scatter
from jamlab.estimates.way_table import ONSET, WayRecord
from jamlab.protocols.onset import LARGEST_TOLERANCE
from jamlab.protocols.relaxation import force_tolerance

if TYPE_CHECKING:
    from jamlab.estimates.ensemble_plan import EnsemblePlan


def choice_words(
    best: EnsemblePlan, good: Sequence[EnsemblePlan], others: Sequence[EnsemblePlan], limit: float
) -> list[str]:
    """What the cheapest way takes, what the next would, and of which others too little is known.

    Args:
        best: of `good`.
        good: ways that serve.
        others: that do not, as the error of their own mean is above the limit.
        limit: what that may take of the error asked for.
    """
    rank = "the only way" if len(good) == 1 else f"cheapest of {len(good)} ways"
    said = [f"{best.way}: {rank} to this error, {best.packings} packings in {best.seconds:.0f} s"]
    dearer = min((p for p in good if p is not best), key=lambda p: p.seconds, default=None)
    if dearer is not None:
        said.append(f"the next would be {dearer.packings} packings of {dearer.way}, in {dearer.seconds:.0f} s")
    if others:
        known = ", ".join(f"{p.way} ({p.bias_error:.2g})" for p in others)
        said.append(f"not taken, as their means are known no better than {limit:.2g} however many are made: {known}")
    return said


def absence_words(unknown: int, loose: int, quantity: str, rho: float) -> list[str]:
    """How many further ways have too few packings in the table, and how many too few with a value."""
    said = []
    if unknown:
        said.append(f"the table has too few packings of {_ways(unknown)}")
    if loose:
        at = "" if quantity == ONSET else f" at rho = {rho:g}"
        said.append(f"too few packings of {_ways(loose)} have {quantity}{at}")
    return said


def _ways(count: int) -> str:
    return f"{count} other way" + "s" * (count > 1)


def finish_words(table: Mapping[EnsembleWay, WayRecord], way: EnsembleWay, quantity: str, rho: float) -> list[str]:
    """What another contact form and looser minima cost, and what they cannot save of droplets from the start.

    Another form is never offered: it costs more, and is no nearer to the packings whose mean is wanted.
    """
    said = []
    where = "at onset" if quantity == ONSET else f"at rho = {rho:g}"
    for record in table.values():
        usual = table.get(replace(record.way, contact=None, tolerance=None))
        if usual is None or usual is record or record.way.nv != way.nv:
            continue
        other, default = _finishes(record.way, quantity)
        cost = round(100 * (relative_cost(record, usual, quantity, rho) - 1))
        much, as_than = (f"{abs(cost)} % {'more' if cost > 0 else 'less'}", "than") if cost else ("as much", "as")
        said.append(f"a packing of {usual.way} {where} costs {much} with {other} {as_than} with {default}")
    if way.start == "droplets":
        searched = table[way].seconds[:, 0].mean() / scatter(table[way], quantity, rho).seconds
        share = f"{100 * searched:.0f} % of the time of a packing of {way}"
        said.append(f"looser minima do not shorten the search for onset, {share}")
    if way.nv is not None:
        said.append("droplets with contacts segment have no minima to end in")
    return said


def _finishes(way: EnsembleWay, quantity: str) -> tuple[str, str]:
    """Contact form and largest force at minima of a way where they are not the default ones, and these."""
    own, default = [], []
    if way.contact:
        own.append(f"contacts {way.contact}")
        default.append(f"contacts {defaults('dp')['contact']}")
    if way.tolerance:
        onset = f" ({min(way.tolerance, LARGEST_TOLERANCE):g} at onset)" if quantity == ONSET else ""
        own.append(f"forces to {way.tolerance:g}{onset}")
        default.append(f"forces to {_default_forces(way)}")
    return " and ".join(own), " and ".join(default)


def _default_forces(way: EnsembleWay) -> str:
    if way.start == "carried":
        return f"{force_tolerance('sp'):g} (disks) and {force_tolerance('dp'):g} (droplets)"
    return f"{force_tolerance(way.model):g}"
