"""Record on a packing what its minimisation reached and how it was made."""

from typing import Any

from jamlab.mechanics.elasticity import unstable_directions
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import Relaxed


def record(packing: Packing, found: Relaxed, **entries: Any) -> Packing:
    """Mark a packing as the minimum found, unless its Hessian has a negative eigenvalue: balanced forces alone may be
    those of a saddle. `packing`: the state that the minimisation ended in; `found`: what it reached; `entries`: further
    entries of the provenance. Returns the packing with `max_force`, `converged` and `tolerance` set."""
    converged = found.converged
    if converged and not found.off_saddles:
        unstable = unstable_directions(packing)
        converged = unstable is None or unstable[1] >= 0
    return packing.with_state(
        max_force=found.evaluation.max_force, converged=converged, tolerance=found.tolerance, provenance=entries
    )
