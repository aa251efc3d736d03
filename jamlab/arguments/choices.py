"""The closed choices among arguments, as types: a type checker refuses a misspelt name, and `checked` does it at run
time from the same list.

Models and laws are open: a package registers more of them. A name of its own is `Registered("dimers")` for a type
checker; at run time it is that text.
"""

from collections.abc import Mapping
from typing import Any, Literal, NewType, TypeAlias

Registered = NewType("Registered", str)

# making a packing
ModelName: TypeAlias = Literal["sp", "dp"] | Registered
ModelOrAuto: TypeAlias = Literal["auto"] | ModelName
LawName: TypeAlias = Literal["adhesive", "harmonic", "hertz", "power", "rim", "sticky"] | Registered
Law: TypeAlias = LawName | Mapping[str, Any]  # parameters, `law` among them where it is named
Units: TypeAlias = Literal["eps", "k"]
Ensemble: TypeAlias = Literal["fixed-box", "shear-stabilized"]
Search: TypeAlias = Literal["bisection", "incremental"]
Start: TypeAlias = Literal["direct", "from-disks"]
By: TypeAlias = Literal["rho", "phi"]
MinimizerStyle: TypeAlias = Literal["cg", "fire"]

# analysis
ShearName: TypeAlias = Literal["simple", "pure"]
Direction: TypeAlias = ShearName | float
ModulusMethod: TypeAlias = Literal["linear-response", "finite-strain", "affine"]
SpectrumMethod: TypeAlias = Literal["auto", "dense", "direct", "reduced"]
FractionMethod: TypeAlias = Literal["exact", "pairs", "nominal"] | Registered
QuantityName: TypeAlias = Literal[  # of `jamlab.measure`
    "rho", "phi", "z", "z_all", "rattlers", "pressure", "energy", "contact_energy", "g", "g_x", "b", "shape_factor",
    "shape_factor_rim", "area", "contact_length", "shortest_edge", "longest_edge", "voids", "void_sides", "void_area",
    "void_shape_factor", "max_force", "psi_6", "psi_6_global",
]  # fmt: skip
EnsembleQuantity: TypeAlias = Literal["z", "g", "b", "rho_J", "d_shape_factor", "void_sides"]  # of `jamlab.estimate`
LeverArms: TypeAlias = Literal["radius", "contact"]

# flow
HeldPressure: TypeAlias = Literal["constant"] | float  # "constant": the pressure of the packing
Against: TypeAlias = Literal["strain", "rate"]

# micrographs
Contrast: TypeAlias = Literal["auto", "dark", "bright"]
Channel: TypeAlias = Literal["grey", "red", "green", "blue"]

# files
AtomStyle: TypeAlias = Literal[
    "atomic", "bond", "angle", "molecular", "charge", "full", "sphere", "bpm/sphere", "dipole"
]
TableName: TypeAlias = Literal[  # of a campaign
    "states", "onset", "spectra", "quasistatic", "correlation", "modes", "voids", "order", "flow", "quasistatic_shear",
    "oscillation", "creep", "plastic_events", "cyclic_shear",
]  # fmt: skip
TableFormat: TypeAlias = Literal["csv", "tsv", "json", "h5", "parquet"]
