"""The packing fraction at which a packing reaches six contacts per particle, the most in two dimensions."""

from __future__ import annotations

from collections.abc import Iterator

from jamlab.arguments.choices import By
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress, fraction_by

MOST_CONTACTS = 6.0  # per particle: Euler's relation for a periodic network of triangles


@checked
def bisect_confluence(
    below: Packing,
    above: Packing,
    error: float,
    *,
    by: By = "rho",
    force_tolerance: float | None = None,
    ranks: int = 1,
) -> Iterator[Packing]:
    """Halve the gap between a packing with z < 6 and one with z >= 6 until it is smaller than an error. Every state is
    reached from the densest one known to be below, in one step, so distances to the packing fraction rho* at which z =
    6 come out spaced evenly in their logarithm: what (6 - z) N against rho* - rho asks for, Boromand et al. fig 7.

    Args:
        below: from a sweep, with z < 6.
        above: a later state of it, with z >= 6.
        error: of rho*, or of phi* with `by`; `by, force_tolerance, ranks`: see `compress`. Yields one Packing per
            halving.
    """
    low, high = (fraction_by(p, by) for p in (below, above))
    if not contacts(below).z < MOST_CONTACTS <= contacts(above).z or high <= low:
        raise InputError(
            f"z = {contacts(below).z:.4g} at {by} = {low:.6f} and {contacts(above).z:.4g} at {high:.6f}: give two"
            " states of a compression between which z reaches 6"
        )
    while high - low > error:
        middle = 0.5 * (low + high)
        (packing,) = compress(below, middle, high - low, by=by, force_tolerance=force_tolerance, ranks=ranks)
        reached = fraction_by(packing, by)
        yield packing
        if not (packing.converged and packing.on_target and low < reached < high):
            return
        if contacts(packing).z < MOST_CONTACTS:
            below, low = packing, reached
        else:
            high = reached
