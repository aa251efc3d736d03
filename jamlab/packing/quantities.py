"""What is measured of a packing: names, symbols, dimensions and words, once for tables, files, console and pages.

`jamlab.measure` computes them; a new one is a line here and its function there.
"""

from typing import NamedTuple

NUMBER, LENGTH, AREA, ENERGY, FORCE, STRESS = (0, 0), (0, 1), (0, 2), (1, 0), (1, -1), (1, -2)


class Quantity(NamedTuple):
    """One number of a packing."""

    symbol: str  # heading of tables on the console
    dimension: tuple[int, int]  # powers of energy and of length
    words: str
    shown: str = ""  # format on the console; "" if only files and --json hold it
    standard: bool = True  # measured where nothing else is asked for


_OF_POLYGONS = "of polygons, nan for disks"
_CLOSED = "mean over voids that do not percolate, nan where outlines of polygons cross"
MEASURED: dict[str, Quantity] = {
    "rho": Quantity("ρ", NUMBER, "true packing fraction; DP: rims included", ".6g"),
    "phi": Quantity("φ", NUMBER, "nominal packing fraction", ".6g"),
    "z": Quantity("z", NUMBER, "contacts per particle without rattlers; nan without a backbone", ".4f"),
    "z_all": Quantity("z all", NUMBER, "contacts per particle, of all that press, over all particles", ".4f"),
    "rattlers": Quantity("rattlers", NUMBER, "number of rattlers", ".0f"),
    "pressure": Quantity(
        "pressure", STRESS, "-dU/dA: (S_xx + S_yy)/2, between walls S_yy; positive in compression", ".5g"
    ),
    "energy": Quantity("U", ENERGY, "total energy"),
    "contact_energy": Quantity("U contact", ENERGY, "energy of contacts per disk or vertex"),
    "g": Quantity("G", STRESS, "relaxed shear modulus, mean over directions; nan between walls", ".5g"),
    "g_x": Quantity("G_xy", STRESS, "relaxed shear modulus G_xy, for shear along x of the box", ".5g"),
    "b": Quantity("B", STRESS, "relaxed bulk modulus -A dp/dA", ".5g"),
    "shape_factor": Quantity(
        "𝒜", NUMBER, "mean shape factor, disks cut by their power cells; DP: bare polygons", ".5g"
    ),
    "shape_factor_rim": Quantity("𝒜 rim", NUMBER, "mean shape factor; DP: polygons with their rims"),
    "area": Quantity("a/a0", NUMBER, "mean of area over area at rest"),
    "contact_length": Quantity("contact length", LENGTH, f"mean over pairs {_OF_POLYGONS}"),
    "shortest_edge": Quantity("shortest edge", LENGTH, f"shortest edge {_OF_POLYGONS}"),
    "longest_edge": Quantity("longest edge", LENGTH, f"longest edge {_OF_POLYGONS}"),
    "voids": Quantity("voids", NUMBER, "number of voids, nan where outlines of polygons cross"),
    "void_sides": Quantity("void sides", NUMBER, f"particles around a void, {_CLOSED}", ".4f"),
    "void_area": Quantity("void area", AREA, f"area of a void, {_CLOSED}"),
    "void_shape_factor": Quantity("void 𝒜", NUMBER, f"shape factor of a void, {_CLOSED}"),
    "max_force": Quantity("max force", FORCE, "residual force: distance of the packing from a minimum", ".1e"),
    "psi_6": Quantity("ψ6", NUMBER, "mean of |psi_6|", standard=False),
    "psi_6_global": Quantity("Ψ6", NUMBER, "|mean of psi_6|", standard=False),
}
QUANTITIES = tuple(MEASURED)
COLUMNS = tuple(name for name, quantity in MEASURED.items() if quantity.standard)
