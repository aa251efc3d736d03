"""What is written down about how a packing was made."""

from typing import Any

from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import FORCE_TOLERANCE, Relaxed


def record(packing: Packing, found: Relaxed, **entries: Any) -> Packing:
    """The packing with what its minimisation reached, and further entries, in its provenance."""
    reached = {
        "max_force": found.evaluation.max_force,
        "force_tolerance": FORCE_TOLERANCE[packing.model],
        "converged": found.converged,
    }
    return packing.with_state(provenance=reached | entries)
