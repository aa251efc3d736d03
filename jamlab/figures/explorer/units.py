"""Units of what a page shows, as it writes them in brackets."""

from jamlab.packing.law_parameters import UNIT_OF_FORCE, UNIT_OF_LENGTH, UNIT_OF_STRESS
from jamlab.packing.packing import Packing

_MEANING = {
    ("sp", "k"): "k: stiffness of a contact, d: mean diameter",
    ("sp", "eps"): "ε: energy of a contact, σ: mean diameter",
    ("dp", "eps"): "ε: energy of a contact, l: mean of √a₀ over the two sizes",
}


def unit_labels(packing: Packing) -> dict[str, str]:
    """Quantity -> unit; `meaning` says what the letters stand for."""
    system = packing.model, packing.units
    length = UNIT_OF_LENGTH[system]
    return {
        "length": length,
        "area": f"{length}²",
        "force": UNIT_OF_FORCE[system],
        "stress": UNIT_OF_STRESS[system],
        "meaning": _MEANING[system],
    }
