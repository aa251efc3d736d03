"""Arguments of sweeps of packing fraction, and of other changes of packings."""

from typing import get_args

from jamlab.arguments.argument import Argument, FromDeck
from jamlab.arguments.choices import By

SWEEPS = (
    Argument(
        "to",
        "Last packing fraction.",
        "number",
        least=0,
        highest=2,
        above=True,
        otherwise={
            "jamlab demo": 0.95,
            "deck": 0.9,
            **dict.fromkeys(("in.sp.shear", "in.dp.shear", "in.sp.bulk"), 0.0),
        },
        habits=(
            "phi_target target_phi phi_max final last phi_final final_phi phi_end end volume_fraction "
            "area_fraction packing_fraction density target phi rho"
        ),
        limits_otherwise={**dict.fromkeys(("in.sp.shear", "in.dp.shear", "in.sp.bulk"), (0, 2))},
    ),
    Argument(
        "by",
        "Packing fraction of `to` and `step`, true (rho) or nominal (phi); of means the columns that define groups.",
        "choice",
        choices=get_args(By),
        choices_otherwise=dict.fromkeys(("Campaign.aggregate", "jamlab campaign aggregate"), ()),
        default="rho",
        otherwise=dict.fromkeys(("Campaign.aggregate", "jamlab campaign aggregate"), ("model", "n")),
        text_otherwise={
            "compress": "Packing fraction of `to` and `step`: true (rho) or nominal (phi).",
            "Campaign.aggregate": "Column that defines groups.",
        },
    ),
    Argument(
        "first_step",
        "First step of a sweep, from which steps grow up to `step`.",
        "number",
        least=0,
        highest=1,
        above=True,
        default=None,
        unset="all steps alike",
        otherwise={"deck": 1e-06},
        limits_otherwise={"deck": (0, 1)},
        habits="nearest",
    ),
    Argument(
        "per_decade",
        "States per decade of distance from the start, while steps grow.",
        "integer",
        least=1,
        highest=1000,
        default=FromDeck("sweep", "per_decade"),
        unset="as in the decks",
    ),
    Argument(
        "pressure_tolerance",
        "Relative error of pressure to which steps of a sweep are adapted.",
        "number",
        least=0,
        highest=1,
        above=True,
        default=None,
        unset="steps as they are",
        habits="step_error error",
    ),
    Argument(
        "confluence",
        "Error of the packing fraction at which z reaches 6, which is then bisected.",
        "number",
        least=1e-9,
        highest=1,
        default=None,
        unset="not sought",
    ),
    Argument(
        "packing",
        "A packing; of jamlab analyze a file for that of the picture.",
        otherwise={"jamlab analyze": None},
        unset="none is written",
    ),
    Argument("packings", "Packings, one or several."),
    Argument("whole", "The packing with its rattlers, to which positions belong."),
    Argument("other", "Another packing of the same particles."),
    Argument(
        "particles",
        "Which particles: one truth value for each, or numbers.",
        "array",
        otherwise=dict.fromkeys(("mean_square_displacement", "overlap"), None),
        unset="all that are free",
    ),
)
