"""Variables of decks that no function has: names of files, and numbers of method."""

from typing import get_args

from jamlab.arguments.argument import Argument
from jamlab.arguments.choices import MinimizerStyle

DECKS = (
    Argument("data", "Data file of the packing.", "path"),
    Argument("dir", "Folder of the deck.", "path", default="."),
    Argument("quote", "Sign around names of files.", "text"),
    Argument("strict", "End at a state that is no minimum.", "choice", choices=("yes", "no")),
    Argument("section", "Section of the deck that goes on.", "text"),
    Argument("d1", "Diameter of small disks.", "number"),
    Argument("d2", "Diameter of large disks.", "number"),
    Argument(
        "search_step",
        "First increment of packing fraction in the search for onset.",
        "number",
        least=0,
        highest=0.5,
        above=True,
    ),
    Argument("move", "Length by which a disk is moved in a finite difference.", "number"),
    Argument("u_jammed", "Contact energy per particle or vertex above which a state is jammed.", "number"),
    Argument("u_contact", "Contact energy per particle or vertex above which there are contacts.", "number"),
    Argument("increment_least", "Increment of packing fraction below which a search gives up.", "number"),
    Argument("minimizer", "Minimiser of LAMMPS.", "choice", choices=get_args(MinimizerStyle)),
    Argument("skin", "Skin of neighbour lists; sets speed only.", "number"),
    Argument("longest_edge", "Length that no edge of a droplet outgrows.", "number"),
    Argument("timestep", "Time step of FIRE.", "number"),
    Argument("dmax", "Longest move of a coordinate.", "number"),
    Argument("tmax", "Longest step of FIRE over timestep.", "number"),
    Argument("solver", "Residual of the solver of velocities over the driving force.", "number"),
    Argument("short_edge", "Length over which the tension of a shrinking edge fades.", "number"),
    Argument("even", "Stiffness in the drag of every contact; 0: of each its own.", "number"),
    Argument("least", "Contacts of a disk that is held.", "integer"),
    Argument("halvings", "Halvings of the strain at most.", "integer"),
    Argument("doubt", "Error of G over G above which no modulus is printed.", "number"),
    Argument("phi_jammed", "Packing fraction at which random disks are safely jammed.", "number"),
    Argument("slope", "First guess of dp/dphi over the stiffness of a random packing.", "number"),
    Argument("slope_least", "Least slope of a secant within a basin.", "number"),
    Argument("slope_most", "Largest slope of a secant within a basin.", "number"),
    Argument("fall", "Part of the pressure that is taken away in one go at most.", "number"),
    Argument("loose", "Part of the target below which contacts count as lost.", "number"),
    Argument("miss", "Relative error of the pressure at the end.", "number"),
    Argument("tries", "Changes of packing fraction, or steps of shear, at most.", "integer"),
    Argument("residual", "Shear stress over pressure at the end.", "number"),
)
