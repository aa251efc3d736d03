"""Names of models, units, ensembles and contact forms, the parameters of each force law, and limits on lengths.

Beyond these limits numbers overflow or lose their digits, and searches never end.
"""

from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_choice, is_number
from jamlab.errors import InputError

LONGEST = 1e100  # areas, their squares and ratios then stay far from the ends of float64, 1e308 and 1e-308
FLATTEST = 1e6  # width over height of the box, and tilt over width: a search walks over as many images
FARTHEST = 1e9  # distance from the origin over the size of the box: float64 then keeps seven digits of where in the box
DENSEST = 1e3  # sum of squared sizes over the area of the box: pairs that overlap grow alike; jammed packings are at 1


def check_magnitudes(box: Array, positions: Array, sizes: Array) -> None:
    """Refuse lengths that no computation in float64 can handle, before any begins. `box`: (2, 2), rows are the lattice
    vectors; `positions`: (m, 2); `sizes`: (n,) lengths of the particles, positive."""
    width, height, tilt = float(box[0, 0]), float(box[1, 1]), abs(float(box[1, 0]))
    lengths = [width, height, float(sizes.min()), float(sizes.max())]
    if min(lengths) < 1 / LONGEST or max(lengths) > LONGEST:
        raise InputError(
            f"box {box.tolist()} and sizes from {sizes.min():.6g} to {sizes.max():.6g}: lengths must lie between "
            f"{1 / LONGEST:g} and {LONGEST:g}; choose another unit of length"
        )
    if max(width, height) > FLATTEST * min(width, height) or tilt > FLATTEST * width:
        raise InputError(f"box {box.tolist()} is flatter or more tilted than 1 : {FLATTEST:g}: check its numbers")
    far = np.abs(positions).max(axis=1)
    if far.max() > FARTHEST * max(width, height):
        k = int(far.argmax())
        raise InputError(
            f"positions[{k}] is {positions[k].tolist()}, more than {FARTHEST:g} boxes away: move it into the box"
        )
    filled = float(np.sum(sizes**2)) / (width * height)
    if filled > DENSEST:
        raise InputError(
            f"squared sizes sum up to {filled:.4g} times the area of box {box.tolist()}, more than {DENSEST:g}: "
            "check both"
        )


MODELS = ("sp", "dp")
UNITS = ("eps", "k")
ENSEMBLES = ("fixed-box", "shear-stabilized")
NEGATIVE_G = "below 0: at this box shape the packing would shear by itself; ensemble='shear-stabilized' lets it"
CONTACT_FORMS = ("outline", "segment", "segment/smooth")  # in the order of ContactForm of plugin/contact_law.h
LARGEST = 1e50  # of a parameter: energies and stiffnesses then stay far from the ends of float64
FORCE_LAW = {  # parameters that each model and unit system needs
    ("sp", "eps"): ("eps",),
    ("sp", "k"): ("k",),
    ("dp", "eps"): ("gamma", "ka", "eps", "delta", "eta", "contact", "a0"),
}
# model -> parameter -> default, least, largest. What a packing does not say has the default; `jam`, `pack`, campaigns
# and the command line take these by name. Disks of an exponent above 10 that barely touch have no stiffness left.
OPTIONAL: dict[str, dict[str, tuple[float, float, float]]] = {"sp": {"exponent": (2.0, 2.0, 10.0)}, "dp": {}}
# of the two papers, for labels: ε and the mean diameter σ, ε and l (droplets), k and the mean diameter d
UNIT_OF_LENGTH = {("sp", "k"): "d", ("sp", "eps"): "σ", ("dp", "eps"): "l"}
UNIT_OF_FORCE = {("sp", "k"): "k d", ("sp", "eps"): "ε/σ", ("dp", "eps"): "ε/l"}
UNIT_OF_STRESS = {("sp", "k"): "k", ("sp", "eps"): "ε/σ²", ("dp", "eps"): "ε/l²"}


def check_params(model: str, units: str, params: dict[str, Any]) -> None:
    """Refuse force-law parameters that are missing, unknown by name, no positive numbers or out of range."""
    if (model, units) not in FORCE_LAW:
        raise InputError(f"model {model} has no units {units!r}")
    unknown = params.keys() - {*FORCE_LAW[model, units], *OPTIONAL[model]}
    if unknown:
        raise InputError(f"params[{min(unknown)!r}]: the force law of model {model} in units {units} has no such name")
    for name, (_, least, largest) in OPTIONAL[model].items():
        if name in params and not (is_number(params[name]) and least <= params[name] <= largest):
            raise InputError(f"params[{name!r}] is {params[name]!r}: must be a number from {least:g} to {largest:g}")
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
