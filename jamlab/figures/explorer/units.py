"""Units of what a page shows, as it writes them in brackets."""

from jamlab.packing.packing import Packing
from jamlab.rheology.mean_spectrum import UNIT_OF_STRESS

_LENGTH = {("sp", "k"): "d", ("sp", "eps"): "σ", ("dp", "eps"): "l"}
_FORCE = {("sp", "k"): "k d", ("sp", "eps"): "ε/σ", ("dp", "eps"): "ε/l"}
_MEANING = {
    ("sp", "k"): "k: stiffness of a contact, d: mean diameter",
    ("sp", "eps"): "ε: energy of a contact, σ: mean diameter",
    ("dp", "eps"): "ε: energy of a contact, l: mean of √a₀ over the two sizes",
}


def unit_labels(packing: Packing) -> dict[str, str]:
    """Quantity -> unit; `meaning` says what the letters stand for."""
    system = packing.model, packing.units
    length = _LENGTH[system]
    return {
        "length": length,
        "area": f"{length}²",
        "force": _FORCE[system],
        "stress": UNIT_OF_STRESS[system],
        "meaning": _MEANING[system],
    }
