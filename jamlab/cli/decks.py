"""`jamlab doctor`: check the installation; `decks`, `deck`: list, show or copy LAMMPS decks, and run one, checked."""

import math
import warnings
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from jamlab.cli.console import out_console, print_json
from jamlab.cli.options import Json
from jamlab.errors import EngineError, InputError


def doctor(as_json: Json = False) -> None:
    """Check the installation, and say how to repair it."""
    from jamlab.engine.installation import examine

    findings = examine()
    if as_json:
        print_json({f.subject: {"ok": f.right, "detail": f.detail} for f in findings})
    else:
        for f in findings:
            mark = Text("ok  ", style="green") if f.right else Text("FAIL", style="red")
            out_console.print(mark, f"{f.subject:12s} {f.detail}", soft_wrap=True)
    if not all(f.right for f in findings):
        raise typer.Exit(1)


def decks(
    name: Annotated[str | None, typer.Argument(help="Deck to show, such as in.sp.jam (default: list all).")] = None,
    copy: Annotated[Path | None, typer.Option(help="Folder to which all decks and parts are copied.")] = None,
    as_json: Json = False,
) -> None:
    """List, show or copy the LAMMPS decks."""
    from jamlab.engine.deck_defaults import copy_decks, summaries
    from jamlab.kernels.library import installed

    folder = installed("lammps_inputs") if copy is None else copy_decks(copy)
    if name is not None:
        typer.echo(_path_of(name).read_text(), nl=False)
        return
    found, examples = summaries(folder), summaries(folder / "examples")
    if as_json:
        print_json({"folder": str(folder), "decks": found, "examples": examples})
        return
    for deck_name, summary in (found | {f"examples/{example}": text for example, text in examples.items()}).items():
        out_console.print(f"{deck_name:32s} {summary}", soft_wrap=True, highlight=False)
    out_console.print("\nRun one: jamlab deck NAME; without checks, in a copy of their folder: lmp -in NAME")
    out_console.print(f"They are in {folder}", soft_wrap=True, highlight=False)


def deck(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="Deck of this folder or, if there is none, of jamlab: in.sp.jam.")],
    ranks: Annotated[int, typer.Option(help="MPI ranks.")] = 1,
) -> None:
    """Run a LAMMPS deck; its variables are checked options.

    Example of variables: --n 64 --to 0.9. With --data FILE, the file defines force law and sizes. The table goes to the
    screen, other output of LAMMPS to log.lammps. Exit code 2: a state is not converged, or differs from the request.
    `jamlab deck NAME --help` lists the variables of a deck with defaults and ranges.
    """
    import subprocess

    from jamlab.engine.deck_defaults import check_ranks, lammps_line, settings
    from jamlab.processes.child import child_environment

    if name == "--help":
        typer.echo(context.get_help())
        return
    path = _path_of(name)
    known = settings(path.parent, path.name)
    if "--help" in context.args:
        typer.echo(path.read_text().partition("\n\n")[0] + "\n")
        for setting in _own(known):
            text = "of others" if "$(" in known[setting] else known[setting].replace("${", "").replace("}", "")
            typer.echo(f"--{setting:16s} {text:12s} {values_of(name, setting, known[setting])}")
        return
    given = dict(_options(context.args))
    check_ranks(ranks)
    for setting, text in given.items():
        check_setting(name, setting, text, known)
    line = lammps_line(
        *(path, {**_law_of_data(known | given, given), **given, "table": "/dev/stdout"}, ranks),
        *("-screen", "none", "-log", "log.lammps"),
    )
    with subprocess.Popen(line, env=child_environment(), stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        for row in program.stdout:
            typer.echo(row, nl=False)
    if program.returncode == 1 and (errors := [x for x in Path("log.lammps").read_text().splitlines() if "ERROR" in x]):
        raise EngineError(f"LAMMPS stopped at its own error, see log.lammps: {errors[-1]}")
    if program.returncode:
        raise typer.Exit(program.returncode)


def _path_of(name: str) -> Path:
    """A deck of this folder, or else of jamlab."""
    from jamlab.kernels.library import installed

    for folder in (Path.cwd(), installed("lammps_inputs")):
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"{name}: no such deck in this folder or in the list of `jamlab decks`")


def _options(words: list[str]) -> Iterator[tuple[str, str]]:
    rest = iter(words)
    for word in rest:
        name, equals, text = word.removeprefix("--").partition("=")
        value = text if equals else next(rest, None)
        if not word.startswith("--") or value is None:
            raise InputError(f"{word}: give a variable of the deck as --NAME VALUE")
        yield name.replace("-", "_"), value


def _law_of_data(settings: Mapping[str, str], given: Mapping[str, str]) -> dict[str, Any]:
    """Law and sizes of the packing that a deck reads; none without such a file."""
    if "data" not in settings:
        return {}
    import numpy as np

    import jamlab
    from jamlab.engine.deck_defaults import law_settings

    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        packing = jamlab.read(settings["data"])
    with open(settings["data"], "rb") as file:
        if not any(line.rstrip().endswith(b" atoms") for line in islice(file, 100)):
            raise InputError(f"data = {settings['data']}: LAMMPS reads a file of jamlab.write or of another deck")
    for note in notes:
        typer.echo(str(note.message))
    if packing.model != (taken := settings.get("model", "sp")):
        raise InputError(f"data = {settings['data']}: contains {packing.model}, but this deck needs {taken}")
    if packing.fixed is not None:
        raise InputError(
            f"data = {settings['data']}: {packing.fixed.sum()} particles are fixed, but decks move all: use "
            "jamlab in Python, or release them by packing.with_state(fixed=None, walls=False)"
        )
    if packing.converged is False:
        typer.echo(f"{settings['data']} says converged=0: it is no minimum")
    if packing.model == "dp" and float(given.get("phi_target", 0)):  # free areas are those of two numbers of vertices
        vertices = np.array([float(settings[name]) for name in ("nv_small", "nv_large")])
        wanted = (2 * vertices / vertices.sum()) ** 2
        if np.abs(np.asarray(packing.params["a0"])[:, None] - wanted).min(axis=1).max() > 1e-9:
            raise InputError(
                f"phi_target = {given['phi_target']}: the file does not have the default rest areas; use phi_target = 0"
            )
    law = law_settings(packing)
    for name, value in law.items():
        text = given.get(name, str(value))
        same = text == value if isinstance(value, str) else math.isclose(float(text), float(str(value)), rel_tol=1e-9)
        if not same:
            raise InputError(f"{name} = {text}: {settings['data']} was made with {name} = {value}")
    if "ratio" in given:
        raise InputError(f"ratio = {given['ratio']}: the diameters come from {settings['data']}; leave it out")
    return law


def check_setting(deck_name: str, name: str, text: str, known: Mapping[str, str]) -> None:
    """Refuse a variable that a deck does not have and a value that Python would refuse, too."""
    from jamlab.checks import is_number, name_meant

    own = _own(known)
    if name not in own:
        raise InputError(f"--{name}: {deck_name} has no such variable; {name_meant(name.lower(), own, ', '.join(own))}")
    if name in (choices := _choices()):
        good = text in choices[name]
    elif name in _NAMES:
        good = bool(text) and not set(text) & set(" \t\"'$&#")
    else:
        least, most = limits_of(deck_name, name, known[name])
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        good = is_number(value) and least <= value <= most and (name not in _WHOLE or value == int(value))
        good = good and (name != "n" or value % 2 == 0)
    if not good:
        raise InputError(f"{name} = {text}: must be {values_of(deck_name, name, known[name])}")


def values_of(deck_name: str, name: str, default: str) -> str:
    """What a variable of a deck may be, in words."""
    if name in (choices := _choices()):
        return f"one of {', '.join(choices[name])}"
    if name in _NAMES:
        return "a name without spaces and quotes, which LAMMPS takes"
    least, most = limits_of(deck_name, name, default)
    kind = "an even" if name == "n" else "a whole" if name in _WHOLE else "a"
    return f"{kind} number {'above 0' if least == _ABOVE_ZERO else f'from {least:g}'} to {most:g}"


def _own(known: Mapping[str, str]) -> list[str]:
    """Variables that `jamlab deck` does not set itself."""
    return sorted(known.keys() - {"dir", "model", "table", "section", "strict"})


_ABOVE_ZERO = 5e-324
_NAMES = ("data", "out")
_WHOLE = {"n", "seed", "steps", "stretch", "steps_shear", "halvings", "tries", "rows", "cycles", "per_decade", "least"}
_WHOLE |= {"nv_small", "nv_large"}
_SHARES = {"above", "phi_start", "increment_least", "miss", "residual", "doubt", "loose", "fall", "dmax"}
_SHARES |= {"slope_least", "slope", "slope_most"}


def _choices() -> dict[str, tuple[str, ...]]:
    return {
        "law": ("eps", "k"),
        "minimizer": ("cg", "fire"),
        "contact": ("outline", "segment/smooth"),
        "arms": ("radius", "contact"),
        "viscous": ("contact", "stokes"),
    }


def limits_of(deck_name: str, name: str, default: str) -> tuple[float, float]:
    """Least and largest value of a number of a deck: of an argument of Python, where it is one."""
    from jamlab.checks import MOST_PARTICLES
    from jamlab.flow import creep, oscillate, overdamped_session, shear
    from jamlab.models.models import optional_parameters
    from jamlab.protocols.compression import LARGEST_TOLERANCE
    from jamlab.protocols.relaxation import LEAST_TOLERANCE
    from jamlab.protocols.size_distributions import LARGEST_RATIO
    from jamlab.rheology.damping import LEAST_ALPHA

    least_strain, law = overdamped_session.LEAST_STRAIN, optional_parameters("sp")
    found: dict[str, tuple[float, float]] = {
        **dict.fromkeys(("to", "phi_jammed"), (_ABOVE_ZERO, 2)),
        **dict.fromkeys(("nv_small", "nv_large"), (3, 1000)),
        # softer disks never seem to touch within absolute windows of energy, stiffer ones never rest
        "eps": (_ABOVE_ZERO if ".dp." in deck_name else 1e-3, 100),
        "k": (1e-3, 100),
        "phi_target": (0, 2),
        "nearest": (0, 1),
        "step": (_ABOVE_ZERO, 0.5),
        "per_decade": (1, 1000),
        "gamma": (0, 100),
        "ka": (_ABOVE_ZERO, 1e5),  # stiffer droplets fly apart under the time step of FIRE
        "delta": (_ABOVE_ZERO, 2),
        "exponent": (law["exponent"].least, law["exponent"].largest),
        "stickiness": (0, law["stickiness"].largest),
        "ratio": (1, LARGEST_RATIO),
        "n": (2, MOST_PARTICLES),
        "pressure": (_ABOVE_ZERO, 30),
        "force": (LEAST_TOLERANCE, LARGEST_TOLERANCE),
        "beta": (0, overdamped_session.LARGEST_BETA),
        "alpha": (LEAST_ALPHA, 1),
        "background": (0, overdamped_session.LARGEST_BACKGROUND),
        "accuracy": (overdamped_session.LEAST_TOLERANCE, overdamped_session.LARGEST_TOLERANCE),
        "solver": (1e-13, 0.1),
        "rows": (1, shear.MOST_ROWS),
        "rate": (shear.LEAST_RATE, shear.LARGEST_RATE),
        "strain": (least_strain, shear.LARGEST_STRAIN) if deck_name.endswith("startup") else (_ABOVE_ZERO, 0.1),
        "omega": (oscillate.SLOWEST, oscillate.FASTEST),
        "amplitude": (least_strain, oscillate.LARGEST_AMPLITUDE),
        "cycles": (1, oscillate.MOST_CYCLES),
        "stress": (least_strain, creep.LARGEST_STRESS),
        "duration": (overdamped_session.LEAST_TIME, creep.LONGEST),
    }
    if name in _SHARES:
        return _ABOVE_ZERO, 1
    whole = 0.0 if name in ("seed", "least") else 1.0  # the least of those that are whole
    usual = whole if name in _WHOLE else 0.0 if default.strip("0.") == "" else _ABOVE_ZERO
    return found.get(name, (usual, 1e9))
