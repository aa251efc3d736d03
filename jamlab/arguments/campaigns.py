"""Keys of campaign files, and arguments of `Campaign`."""

from typing import get_args

from jamlab.arguments.argument import REQUIRED, Argument, InWords
from jamlab.arguments.choices import TableFormat

CAMPAIGNS = (
    Argument(
        "name",
        "Name of a campaign, sweep, table or deck.",
        "text",
        otherwise={"Campaign.table": "states", "ShearRun.steady": "stress", "jamlab decks": None},
        unset="all are listed",
        text_otherwise={
            "jamlab decks": "Name of a deck to show, such as in.sp.jam.",
            "sweep": "Name of the sweep, for `--only` and for tables.",
        },
    ),
    Argument(
        "sweep",
        "Name of a sweep; in a campaign file the sweeps.",
        "text",
        default=None,
        unset="all",
        otherwise={"campaign": REQUIRED},
        text_otherwise={"Campaign.aggregate": "Name of a sweep.", "Campaign.export": "Name of a sweep."},
    ),
    Argument("seeds", "Seeds: their number, a list, or { first, last }.", "array", each="seed", least=0),
    Argument("first", "First seed of a range.", "integer", least=0),
    Argument("last", "Last seed of a range.", "integer", least=0),
    Argument("compress", "A sweep from onset, with the arguments of jamlab.compress.", default=None, unset="none"),
    Argument(
        "decompress", "Start at random only at the highest pressure and decompress from there.", "flag", default=False
    ),
    Argument("onset", "Make only the packings at onset.", "flag", default=None, unset="none, another protocol"),
    Argument(
        "chunk",
        "Seeds of a task that are made together and kept in one file.",
        "integer",
        least=1,
        highest=10_000,
        default=None,
        unset="a number that follows from the time they take",
    ),
    Argument("lowest", "Lowest of numbers of equal ratio.", "number", least=0, above=True, highest=1e100),
    Argument("highest", "Highest of numbers of equal ratio.", "number", least=0, above=True, highest=1e100),
    Argument(
        "correlation_omega",
        "Angular frequencies of displacement correlations.",
        "array",
        unit="1/tau_1",
        default=None,
        unset="none",
        least=0,
        highest=1e100,
    ),
    Argument(
        "oscillation",
        "Oscillations of every state, with the arguments of jamlab.oscillate.",
        default=None,
        unset="none",
    ),
    Argument("creep", "Creep of every state, with the arguments of jamlab.creep.", default=None, unset="none"),
    Argument(
        "share",
        "Share (k, n): every n-th task, from the k-th on.",
        default=(1, 1),
        metavar="K/N",
        otherwise={**dict.fromkeys(("jamlab campaign run", "jamlab campaign resume"), "1/1")},
        text_otherwise={
            "jamlab campaign run": "Run every N-th task only, from the K-th on, as in a job array.",
            "jamlab campaign resume": "Run every N-th task only, from the K-th on, as in a job array.",
        },
    ),
    Argument("only", "Name of a sweep.", default=None, unset="all", metavar="NAME"),
    Argument("retry_failed", "Run failed tasks again.", "flag", default=False),
    Argument(
        "pilot",
        "Run one task of each sweep, model and n only.",
        "flag",
        default=False,
        text_otherwise={
            "jamlab campaign run": "Run one task of each sweep, model and n only, which tells the time of all."
        },
    ),
    Argument(
        "verify",
        "Check every file.",
        "flag",
        default=True,
        otherwise={"Campaign.status": False},
        text_otherwise={"Campaign.run": "Check finished files first."},
    ),
    Argument("done", "Function that is called with the outcome of each task.", default=None, unset="none"),
    Argument("task", "Name of a task.", "text"),
    Argument(
        "tables",
        "Name of a table.",
        "array",
        default=(),
        unset="all",
        each="table",
        metavar="NAME",
        otherwise={"jamlab campaign export": None},
    ),
    Argument("format", "Format of tables.", "choice", choices=get_args(TableFormat), default="csv"),
    Argument(
        "scheduler",
        "Address or file of a Dask scheduler, or slurm, pbs, sge, lsf, oar, moab or htcondor.",
        "text",
        default=None,
        unset="this machine",
        metavar="WHERE",
        otherwise={
            **dict.fromkeys(("Campaign.cluster", "Campaign.job_script"), REQUIRED),
            **dict.fromkeys(("jamlab campaign run", "jamlab campaign resume"), None),
        },
    ),
    Argument(
        "jobs",
        "Largest number of jobs at a time, which a batch system needs.",
        "integer",
        least=1,
        default=None,
        unset="not given",
    ),
    Argument("tell", "Function that is called with messages.", default=InWords("jamlab.errors.warn")),
    Argument(
        "flow",
        "Steady flow of every state, with the arguments of jamlab.flow_curve; of stop_flow the flow.",
        otherwise={"sweep": None},
        text_otherwise={"sweep": "Steady flow of every state, with the arguments of jamlab.flow_curve."},
        unset="none",
    ),
    Argument("stokes", "Values of eta_f of Stokes drag.", "array", default=[], least=0, highest=1e100),
    Argument(
        "plastic_events",
        "Plastic events of every state under quasi-static shear, with its arguments.",
        default=None,
        unset="none",
    ),
    Argument(
        "cyclic_shear",
        "Cyclic quasi-static shear of every state, with the arguments of jamlab.quasistatic_shear.",
        default=None,
        unset="none",
    ),
    Argument(
        "quasistatic_shear",
        "Quasi-static shear of every state, with the arguments of jamlab.quasistatic_shear.",
        default=None,
        unset="none",
    ),
)
