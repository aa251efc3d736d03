"""Arguments of `Session` and `BoxStrains`, which take commands of LAMMPS."""

from typing import get_args

from jamlab.arguments.argument import Argument
from jamlab.arguments.choices import MinimizerStyle

SESSIONS = (
    Argument("line", "A command of LAMMPS.", "text"),
    Argument("settings", "Variables of LAMMPS, by name."),
    Argument("alike", "Give the bits of particles built anew.", "flag", default=False),
    Argument("anew", "Build the particles anew.", "flag", default=False),
    Argument(
        "steps",
        "Iterations of a minimiser at most.",
        "integer",
        least=1,
        otherwise={"deck": 100000},
        limits_otherwise={"deck": (1, 1000000000.0)},
    ),
    Argument(
        "stretch",
        "Iterations before a minimiser starts anew.",
        "integer",
        least=1,
        default=None,
        unset="all of steps",
        otherwise={"in.sp.minimize": 100000},
        limits_otherwise={"deck": (1, 1000000000.0)},
    ),
    Argument("pace", "Step of the minimiser over the usual one.", "number", default=1.0),
    Argument("fire", "Numbers of FIRE for each particle.", "array", default=None, unset="those of jamlab"),
    Argument("numbers", "Numbers of a minimiser.", "array"),
    Argument("box_strains", "Strains of the box that are minimised too.", default=None, unset="the box is fixed"),
    Argument("columns", "Number of columns.", "integer", least=1),
    Argument("size", "Length of a vector.", "integer", least=1),
    Argument("displacement", "Displacements, (n, 2).", "array"),
    Argument("area", "Area of the box.", "number"),
    Argument(
        "minimizer",
        "Minimiser: cg (line search on the force) or fire.",
        "choice",
        choices=get_args(MinimizerStyle),
        otherwise={"deck": "cg", **dict.fromkeys(("in.dp.jam", "in.dp.shear", "in.dp.startup"), "fire")},
        habits="style min_style algorithm",
    ),
)
