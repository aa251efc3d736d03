"""Arguments of functions that analyse packings, spectra and tables."""

import math
from typing import get_args

from jamlab.arguments.argument import REQUIRED, Argument, InWords
from jamlab.arguments.choices import SpectrumMethod

ANALYSIS = (
    Argument(
        "omega",
        "Angular frequency, one or several.",
        "number",
        "ω",
        unit="1/tau_1",
        least=0,
        default=REQUIRED,
        otherwise={**dict.fromkeys(("choose_flow", "sweep"), None), "sweep.oscillation": REQUIRED, "deck": 0.1},
        unset="no observable needs it",
        limits_otherwise=dict.fromkeys(("oscillate", "sweep.oscillation", "deck", "jamlab oscillate"), (1e-08, 1000.0)),
        habits="omega_min omega_max f omegas frequency frequencies freq w",
        highest=1e100,
    ),
    Argument(
        "omega_min",
        "Lowest angular frequency.",
        "number",
        unit="1/tau_1",
        least=0,
        above=True,
        default=1e-06,
        habits=(
            "freq_min frequency_min min_freq omega omega_max min_frequency fmin w_min omega_low f_min start_frequency"
        ),
    ),
    Argument(
        "omega_max",
        "Highest angular frequency.",
        "number",
        unit="1/tau_1",
        least=0,
        above=True,
        default=100.0,
        habits="freq_max frequency_max max_freq max_frequency fmax w_max omega_high f_max end_frequency",
    ),
    Argument(
        "points",
        "Number of frequencies, of equal ratio.",
        "integer",
        least=2,
        highest=10_000,
        default=41,
        otherwise={"sweep.omega": REQUIRED},
    ),
    Argument(
        "method",
        "How it is computed.",
        "choice",
        choices_otherwise={"jamlab gstar": get_args(SpectrumMethod)},
        default="auto",
        habits="solver algorithm",
        otherwise={"bulk_modulus": "linear-response", "shear_modulus": "linear-response", "packing_fraction": "exact"},
    ),
    Argument(
        "direction",
        "Direction of shear: simple (along x), pure, or an angle of simple shear, such as 0.5 or 30deg.",
        unit="radian",
        metavar="{simple,pure,ANGLE}",
        default="simple",
        otherwise={
            "shear_modulus": None,
            **dict.fromkeys(("ContactDamping.matrix", "DragLaw.matrix", "StokesDrag.matrix"), REQUIRED),
        },
        unset="mean over directions",
        habits="theta angle direction_angle phi_angle",
    ),
    Argument(
        "prestress",
        "Keep the contact forces in the Hessian.",
        "flag",
        default=True,
        otherwise={"sweep": None},
        unset="with them",
    ),
    Argument(
        "count",
        "Number of modes.",
        "integer",
        least=1,
        default=10,
        unset="all modes",
        habits="n_eigs n_eigenvalues n_modes neigs nev num n k num_modes how_many",
    ),
    Argument(
        "k", "Order of the bond-orientational order.", "integer", least=1, default=6, habits="order n fold l symmetry"
    ),
    Argument("spacing", "Distance between points of outlines, in mean diameters.", "number", default=0.05),
    Argument("rim", "Include the rims of droplets.", "flag", default=False),
    Argument("quantity", "Quantity whose mean is estimated, such as z, g or b.", "choice"),
    Argument(
        "workers",
        "Processes side by side; in Python also an executor.",
        "integer",
        least=1,
        highest=1024,
        default=1,
        otherwise=dict.fromkeys(
            ("Campaign.run", "Campaign.start", "jamlab campaign run", "jamlab campaign resume", "jamlab campaign plan"),
            None,
        ),
        unset="all cores",
        habits=(
            "ncores jobs np cpus n_cpu n_jobs nproc num_workers njobs n_workers processes threads "
            "nthreads n_threads cores omp_num_threads parallel"
        ),
    ),
    Argument(
        "confidence",
        "Share of the interval in which the mean lies.",
        "number",
        least=0,
        highest=1,
        default=0.95,
        above=True,
    ),
    Argument("resamples", "Number of resamples by the bootstrap.", "integer", least=0, default=200),
    Argument(
        "pressures",
        "Pressures.",
        "array",
        unit="natural units",
        each="pressure",
        otherwise={"sweep": None},
        unset="another protocol is given",
    ),
    Argument(
        "spectra", "Spectra of the packings of each pressure.", default=None, unset="those of the campaign or table"
    ),
    Argument("force", "Amplitude of the force on a contact.", "number", least=0, above=True),
    Argument("stiffness", "Stiffness of a contact.", "number", least=0, above=True, default=1.0),
    Argument(
        "matrix",
        "A matrix that is at hand already.",
        default=None,
        otherwise={"DragLaw.gears": REQUIRED, "StokesDrag.gears": REQUIRED},
        unset="computed",
    ),
    Argument(
        "table",
        "Name of a table; of decks the file of the table.",
        "choice",
        default="states",
        otherwise={"choose": None, "deck": "${out}.txt"},
        unset="that of jamlab",
    ),
    Argument("values", "Columns of which means are taken.", "array"),
    Argument("along", "Column along which means are taken.", "text", default=None, unset="over all rows"),
    Argument(
        "bins",
        "Bins: their edges, or of a density their number.",
        "array",
        default=None,
        unset="each value on its own",
        otherwise={"Modes.density": 40, "density_of_states": 40},
    ),
    Argument("ax", "Axes of matplotlib to draw in.", default=None, unset="a new figure"),
    Argument(
        "quantities",
        "What is measured, by name.",
        "array",
        default=InWords("the standard ones"),
        otherwise={"PackingAnalysis": ("rho", "z")},
        habits="columns names keys properties",
    ),
    Argument(
        "threshold",
        "Smallest overlap of a contact.",
        "number",
        default=0.0,
        habits="eps cutoff r_cut rc distance tolerance",
    ),
    Argument("against", "Abscissa of the figure: strain or its rate.", "choice", default="strain"),
    Argument("label", "Words in the legend of the figure.", "text", default=""),
    Argument("fastest", "Highest rate of modes that count.", "number", unit="1/tau_1", default=math.inf),
    Argument("slowest", "Lowest rate of modes that count.", "number", unit="1/tau_1", default=0.0),
    Argument("unit", "Unit of numbers, in words.", "text"),
    Argument("curves", "Flow curves of packings, or a campaign or its table."),
    Argument(
        "select",
        "Of a campaign or table, columns and their values in the rows that count.",
        default=None,
        unset="all rows",
    ),
)
