"""Record on a packing what its minimisation reached and how it was made."""

from typing import Any

from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import Relaxed


def record(packing: Packing, found: Relaxed, **entries: Any) -> Packing:
    """Mark a packing as the minimum found. `packing`: the state that the minimisation ended in; `found`: what it
    reached; `entries`: further entries of the provenance. Returns the packing with `max_force` and `converged` set, and
    the tolerance used as `force_tolerance` in its provenance."""
    return packing.with_state(
        max_force=found.evaluation.max_force,
        converged=found.converged,
        provenance={"force_tolerance": found.tolerance, **entries},
    )
