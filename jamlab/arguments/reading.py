"""Arguments of functions that read packings from files of other programs, and of `Packing`."""

from jamlab.arguments.argument import REQUIRED, Argument

READING = (
    Argument(
        "path",
        "File to read or write.",
        "path",
        otherwise=dict.fromkeys(
            ("creep", "flow_curve", "oscillate", "quasistatic_shear", "relax_stress", "shear", "stop_flow"), None
        ),
        unset="none is written",
        habits="save output out_csv filename file fname outfile filepath dest",
    ),
    Argument(
        "source",
        "Packings, or a file of them; of pictures their files.",
        otherwise={"track_droplets": None},
        unset="labels are given",
    ),
    Argument("u", "Universe of MDAnalysis, or atoms of it."),
    Argument(
        "frame",
        "Frame of a file; -1 is the last.",
        "integer",
        default=-1,
        habits="step snapshot index i frame_number i_frame",
        otherwise={"jamlab convert": None},
        unset="all",
    ),
    Argument(
        "frames",
        "Frames, as a slice or numbers.",
        default=None,
        unset="all",
        habits=(
            "start stop step first last frame save_every n_frames frames_every every dump_every output_every every_n"
        ),
    ),
    Argument(
        "box",
        "Sides of the box, or its two lattice vectors.",
        "array",
        default=None,
        unset="as the file says",
        otherwise={**dict.fromkeys(("Packing", "droplets_from_outlines", "jamlab droplets"), REQUIRED)},
        metavar="LX,LY|AX,AY,BX,BY",
    ),
    Argument(
        "radii",
        "Radius of all disks, of each, or of each type.",
        "array",
        default=None,
        unset="as the file says",
        metavar="RADIUS|TYPE=RADIUS,...",
    ),
    Argument("relaxed", "Whether the packing is at a minimum.", "flag", default=False),
    Argument("outlines", "Outlines of droplets, (n, 2) each.", "array"),
    Argument(
        "vertices",
        "Vertices of every droplet, with edges of equal length.",
        "integer",
        least=3,
        default=None,
        unset="as they are",
        habits="n_vertices nv num_vertices",
    ),
    Argument("wrapped", "Whether the box cuts outlines.", "flag", default=False),
    Argument("rims", "Whether outlines are those of droplets with their rims.", "flag", default=False),
    Argument(
        "free_areas", "Area of each droplet that nothing touches.", "array", default=None, unset="that of its outline"
    ),
    Argument("rest_areas", "Rest area of each droplet.", "array", default=None, unset="free_areas"),
    Argument("positions", "Positions of disks or vertices, (n, 2).", "array"),
    Argument("diameters", "Diameter of each disk.", "array", default=None, unset="of droplets"),
    Argument("offsets", "Where the vertices of each droplet begin.", "array", default=None, unset="of disks"),
    Argument("fixed", "Which particles are held.", "array", default=None, unset="none"),
    Argument("rounding", "Relative rounding of positions in the file they are from.", "number", default=0.0),
    Argument("provenance", "How the packing was made.", default=None, unset="as before", otherwise={"Packing": {}}),
    Argument("phi_J", "Nominal packing fraction at onset.", "number", "φ_J", default=None, unset="unknown"),
    Argument("max_force", "Largest residual force.", "number", default=None, unset="unknown"),
    Argument(
        "converged",
        "Whether it is at a minimum; of tables whether other rows are left out.",
        "flag",
        default=True,
        otherwise={"Packing": False},
    ),
    Argument("on_target", "Whether it has the pressure or packing fraction aimed at.", "flag", default=True),
    Argument("on_rattlers", "Whether the Hessian sees only rattlers that move.", "flag", default=False),
    Argument("verbose", "Show the progress of MDAnalysis.", "flag", default=False),
    Argument(
        "observables",
        "What is measured or written, by name.",
        default=None,
        unset="none",
        otherwise={"sweep": ["states"]},
        habits="format fmt to_csv csv output_format columns fields quantities properties observable metrics",
    ),
    Argument(
        "every",
        "Stride: every k-th state.",
        "integer",
        least=1,
        default=1,
        habits="save_every dump_every output_every every_n",
    ),
    Argument(
        "atom_style",
        "Atom style of a LAMMPS data file.",
        "choice",
        default=None,
        unset="as the file says",
        habits="style",
    ),
    Argument("params", "Parameters of the force law, by name."),
    Argument("rattlers", "Include particles without contacts that bear load.", "flag", default=True),
)
