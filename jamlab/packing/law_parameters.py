"""Names of models, units, ensembles and contact forms, and the parameters that each force law needs."""

from typing import Any

from jamlab.checks import check_choice, is_number
from jamlab.errors import InputError

MODELS = ("sp", "dp")
UNITS = ("eps", "k")
ENSEMBLES = ("fixed-box", "shear-stabilized")
CONTACT_FORMS = ("outline", "segment", "segment/smooth")
LARGEST = 1e50  # of a parameter: energies and stiffnesses then stay far from the ends of float64
FORCE_LAW = {  # parameters that each model and unit system needs
    ("sp", "eps"): ("eps",),
    ("sp", "k"): ("k",),
    ("dp", "eps"): ("gamma", "ka", "eps", "delta", "eta", "contact", "a0"),
}
# of the two papers, for labels: ε and the mean diameter σ, ε and l (droplets), k and the mean diameter d
UNIT_OF_LENGTH = {("sp", "k"): "d", ("sp", "eps"): "σ", ("dp", "eps"): "l"}
UNIT_OF_FORCE = {("sp", "k"): "k d", ("sp", "eps"): "ε/σ", ("dp", "eps"): "ε/l"}
UNIT_OF_STRESS = {("sp", "k"): "k", ("sp", "eps"): "ε/σ²", ("dp", "eps"): "ε/l²"}


def check_params(model: str, units: str, params: dict[str, Any]) -> None:
    """Refuse force-law parameters that are missing, unknown by name, no positive numbers or beyond `LARGEST`.

    Raises:
        InputError: naming the parameter and its value.
    """
    if (model, units) not in FORCE_LAW:
        raise InputError(f"model {model} has no units {units!r}")
    for name in FORCE_LAW[model, units]:
        if name not in params:
            raise InputError(f"params of model {model} in units {units} lack {name!r}")
        value = params[name]
        if name == "contact":
            check_choice("contact form", value, CONTACT_FORMS)
        elif name != "a0" and not (is_number(value) and (value > 0 or (value == 0 and name in ("eta", "gamma")))):
            raise InputError(f"params[{name!r}] is {value!r}: must be a positive number")
        elif name not in ("contact", "a0") and value and not 1 / LARGEST <= value <= LARGEST:
            raise InputError(
                f"params[{name!r}] is {value!r}: must lie between {1 / LARGEST:g} and {LARGEST:g}; choose other units"
            )
