"""Commands and options typed from habit, and what to use: by meaning, by spelling only where names differ by a slip."""

from collections.abc import Sequence
from difflib import get_close_matches

_SLIP = 0.85  # likeness of names that differ by a letter

COMMANDS = {
    "minimize": "use `jamlab relax`",
    "decompress": "use `jamlab compress` with --to below the packing fraction of the file",
    "sweep": "use `jamlab compress`, or `jamlab campaign` for ensembles",
    **dict.fromkeys(("measure", "info", "analyse", "image"), "use `jamlab analyze`"),
    "export": "use `jamlab convert`",
    **dict.fromkeys(("view", "plot", "movie", "show"), "use `jamlab explore`"),
    **dict.fromkeys(("run", "lmp"), "use `jamlab deck`"),
    **dict.fromkeys(("check", "test"), "use `jamlab doctor`"),
    **dict.fromkeys(("list", "examples"), "use `jamlab decks`"),
    "init": "use `jamlab campaign new`",
    **dict.fromkeys(("resume", "restart", "continue"), "give the command again that was interrupted: it resumes"),
    "track": "use jamlab.track_droplets in Python",
    **dict.fromkeys(("modulus", "moduli", "elastic"), "use `jamlab analyze`, or `jamlab gstar` for G*"),
    "rheology": "use `jamlab gstar`, or `jamlab oscillate` for finite amplitude",
}

OPTIONS = {  # what to use: the first option that the command has, or else what is no option
    **dict.fromkeys(("num", "n-particles", "particles"), ("--n",)),
    **dict.fromkeys(("random-state", "rng"), ("--seed",)),
    "polydispersity": ("--sizes",),
    "size-ratio": ("--ratio",),
    "fraction-large": ("--large",),
    **dict.fromkeys(("tol", "ftol", "force-tol"), ("--tolerance",)),
    **dict.fromkeys(("n-jobs", "jobs", "threads", "cores", "np"), ("--workers", "--processes", "--ranks")),
    **dict.fromkeys(("frequency", "freq", "frequencies"), ("--omega", "--omega-min")),
    "sigma": ("--stress",),
    **dict.fromkeys(("dphi", "drho", "n-steps"), ("--step",)),
    **dict.fromkeys(("gamma-dot", "shear-rate"), ("--rate",)),
    **dict.fromkeys(("output", "outfile", "filename", "path"), ("--out", "--csv")),
    **dict.fromkeys(("overwrite", "replace"), ("--force",)),
    **dict.fromkeys(("background-drag",), ("--background",)),
    **dict.fromkeys(("snapshot-every",), ("--frames",)),
    "pixel-size": ("--pixel",),
    "verbose": ("--debug, before or behind the command",),
    "pressure": ("`jamlab pack`, which makes packings at a pressure",),
    **dict.fromkeys(
        ("phi", "rho", "packing-fraction", "density"),
        ("--phi", "--to", "`jamlab pack --phi`, or `jamlab compress --to`, from onset"),
    ),
    **dict.fromkeys(("box-length", "box-size"), ("--box", "--n: the size of the box follows")),
    **dict.fromkeys(("potential", "exponent"), ("--law, such as --law exponent=2.5 for Hertzian disks",)),
    **dict.fromkeys(("dim", "friction", "gravity", "temperature"), ("another program: docs/explanation/limits.md",)),
    **dict.fromkeys(("show", "view"), ("`jamlab explore`, which writes a page",)),
    "dt": ("--tolerance",),
}


def command_meant(name: str, known: Sequence[str]) -> str:
    """What to use instead of a command that does not exist."""
    return COMMANDS.get(name) or _by_spelling(name, known) or f"use one of {', '.join(known)}"


def option_meant(name: str, known: Sequence[str]) -> str:
    """What to use instead of an option that a command does not have; `known`: those that it has."""
    for use in OPTIONS.get(name.lstrip("-").replace("_", "-").lower(), ()):
        first = use.partition(" ")[0].rstrip(",:")
        if not first.startswith("--") or first in (*known, "--debug"):
            return f"use {use}"
    return _by_spelling(name, known) or f"it takes {', '.join(known)}"


def _by_spelling(name: str, known: Sequence[str]) -> str:
    near = get_close_matches(name, known, 1, _SLIP)
    return f"did you mean {near[0]}?" if near else ""
