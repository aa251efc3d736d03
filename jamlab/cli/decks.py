"""`jamlab doctor`: check the installation; `decks`, `deck`: list, show or copy LAMMPS decks, and run one, checked."""

import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from jamlab.cli.console import out_console, print_json
from jamlab.cli.given import check_apart
from jamlab.cli.options import command, option
from jamlab.errors import EngineError, InputError
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing


@command()
def doctor(*, json: bool) -> None:
    """Check the installation, and say how to repair it."""
    from jamlab.engine.doctor import examine

    findings = examine()
    if json:
        print_json({f.subject: {"ok": f.right, "detail": f.detail} for f in findings})
    else:
        for f in findings:
            mark = Text("ok  ", style="green") if f.right else Text("FAIL", style="red")
            out_console.print(mark, f"{f.subject:12s} {f.detail}", soft_wrap=True)
    if not all(f.right for f in findings):
        raise typer.Exit(1)


@command()
def decks(name: str | None, *, copy: Path | None, json: bool) -> None:
    """List, show or copy the LAMMPS decks."""
    from jamlab.engine.deck_files import copy_decks, summaries
    from jamlab.installed_files import installed

    folder = installed("lammps_inputs") if copy is None else copy_decks(copy)
    if name is not None:
        typer.echo(_path_of(name).read_text(), nl=False)
        return
    found, examples = summaries(folder), summaries(folder / "examples")
    if json:
        print_json({"folder": str(folder), "decks": found, "examples": examples})
        return
    for deck_name, summary in (found | {f"examples/{example}": text for example, text in examples.items()}).items():
        out_console.print(f"{deck_name:32s} {summary}", soft_wrap=True, highlight=False)
    out_console.print("\nRun one: jamlab deck NAME, or lmp -in NAME in a copy of its folder. Examples: by lmp alone")
    out_console.print(f"They are in {folder}", soft_wrap=True, highlight=False)


def deck(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="Deck of this folder or, if there is none, of jamlab: in.sp.jam.")],
    ranks: Annotated[int, option("ranks", "jamlab deck")] = 1,
) -> None:
    """Run a LAMMPS deck; its variables are checked options.

    Example of variables: --n 64 --to 0.9. With --data FILE, the file defines force law and sizes. The table goes to the
    screen, other output of LAMMPS to log.lammps. Exit code 2: a state is not converged, or differs from the request.
    `jamlab deck NAME --help` lists the variables of a deck with defaults and ranges.
    """
    from jamlab.engine.command_line import lammps_line
    from jamlab.engine.deck_defaults import settings
    from jamlab.engine.ranks import check_ranks

    if name == "--help":
        typer.echo(context.get_help())
        return
    path = _path_of(name)
    known = settings(path.parent, path.name)
    if "table" not in known:
        raise InputError(
            f"{name}: it has no parts and no table of its own; run `lmp -in {path.name}` in its folder, of which "
            "`jamlab decks --copy FOLDER` makes a copy"
        )
    if "--help" in context.args:
        typer.echo(path.read_text().partition("\n\n")[0] + "\n")
        typer.echo("\n".join(_lines_of_help(path, known)))
        return
    given = dict(_options(context.args))
    if given.get("damping") == "stokes" and (idle := sorted(given.keys() & {"alpha", "beta"})):
        raise InputError(f"--{idle[0]}: only contact damping has it; leave it out, or --damping stokes")
    check_ranks(ranks)
    for setting, text in given.items():
        check_setting(path, setting, text)
    law = _law_of_data(known | given, given)
    data = [Path(value) for name, value in (known | given).items() if name == "data"]
    for file in (_LOG, *sorted(written(path, known | given))):
        check_apart(file, [*data, path], "it is also the input")
        check_target(file)
    line = lammps_line(path, {**law, **given, "table": "/dev/stdout"}, ranks, *f"-screen none -log {_LOG}".split())
    code = _run(line)
    if code < 0:
        raise EngineError(f"signal {-code} ended LAMMPS; its last words are in {_LOG}")
    if code == 1 and (errors := [x for x in _LOG.read_text().splitlines() if "ERROR" in x]):
        raise EngineError(f"LAMMPS stopped at its own error, see {_LOG}: {errors[-1]}")
    if code:
        raise typer.Exit(code)


def _lines_of_help(path: Path, known: Mapping[str, str]) -> Iterator[str]:
    """Variables of a deck as options, each with its default, its range and what the deck says of it."""
    from jamlab.engine.deck_defaults import LIMITS, NOTES, settings

    rules, limits, notes = _rules(path), *(settings(path.parent, path.name, what=what) for what in (LIMITS, NOTES))
    for name in offered(path):
        text = "of others" if "$(" in known[name] else known[name].replace("${", "").replace("}", "")
        note = notes.get(name, "").removeprefix(limits.get(name, "")).strip(": ")
        yield f"{_option(name):18s} {text:12s} {rules[name][0]}{'; ' if note else ''}{note}"


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


_LOG = Path("log.lammps")


def _run(line: list[str]) -> int:
    """Run LAMMPS, print its table and return its exit code; LAMMPS ends with this function, whatever ends that."""
    import subprocess

    from jamlab.engine.installation import program_environment
    from jamlab.processes.child import child_environment

    environment = child_environment() | program_environment()
    with subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        try:
            for row in program.stdout:
                typer.echo(row, nl=False)
            return program.wait()
        finally:
            if program.poll() is None:
                program.terminate()
                try:
                    program.wait(5.0)  # s that LAMMPS has to end in
                except subprocess.TimeoutExpired:
                    program.kill()


def written(path: Path, settings: Mapping[str, str]) -> set[Path]:
    """Files that a deck may write, but for the log: each is named after `out`, some after the state that is saved."""
    from jamlab.engine.deck_defaults import deck_text

    text = deck_text(path.parent, path.name)
    names = set(re.findall(r"\$\{out\}\.(\w[\w.]*)", text)) - {"txt"}
    names |= {f"{state}.data" for state in re.findall(r"^variable saved string (\w+)", text, re.MULTILINE)}
    if "data" in settings:  # a deck that reads a packing searches no onset
        names.discard("onset.data")
    return {Path(f"{settings['out']}.{name}") for name in names}


def _path_of(name: str) -> Path:
    """A deck of this folder, or else of jamlab."""
    from jamlab.checks import name_meant
    from jamlab.installed_files import installed

    for folder in (Path.cwd(), installed("lammps_inputs")):
        if (folder / name).is_file():
            return folder / name
    known = [path.name for path in installed("lammps_inputs").glob("in.*")]
    raise InputError(
        f"{name}: no such deck in this folder or of jamlab; {name_meant(name, known, 'see `jamlab decks`')}"
    )


def _options(words: list[str]) -> Iterator[tuple[str, str]]:
    rest, seen = iter(words), set()
    for word in rest:
        name, equals, text = word.removeprefix("--").partition("=")
        value = text if equals else next(rest, None)
        if not word.startswith("--") or value is None:
            raise InputError(f"{word}: give a variable of the deck as --NAME VALUE")
        if (variable := name.replace("-", "_")) in seen:
            raise InputError(f"{_option(name)} is given twice: give one value")
        seen.add(variable)
        yield variable, value


def _law_of_data(settings: Mapping[str, str], given: Mapping[str, str]) -> dict[str, Any]:
    """Law and sizes of the packing that a deck reads; none without such a file."""
    if "data" not in settings:
        return {}
    import numpy as np

    from jamlab.engine.command_line import law_settings
    from jamlab.models.disks import DISKS
    from jamlab.models.droplets import DROPLETS

    if "data" not in given and not Path(settings["data"]).exists():
        first = f"in.{settings.get('model', DISKS.name)}.jam"
        raise InputError(
            f"there is no {settings['data']} in this folder: give --data FILE, or run `jamlab deck {first}` first, "
            "which writes it"
        )
    packing = _data_of_lammps(settings["data"])
    needed, found = settings.get("model", DISKS.name), packing.model
    if found != needed:
        raise InputError(f"data = {settings['data']}: contains {found}, but this deck needs {needed}")
    if not packing.frame.all_free:
        raise InputError(
            f"data = {settings['data']}: {packing.frame.fixed.sum()} particles are fixed, but decks move all: use "
            "jamlab in Python, or release them by packing.with_state(fixed=None, walls=False)"
        )
    if packing.converged is False:
        typer.echo(f"{settings['data']} says converged=0: it is no minimum")
    if packing.model == DROPLETS.name and float(given.get("to", 0)):
        # free areas are those of two numbers of vertices
        vertices = np.array([float(settings[name]) for name in ("nv_small", "nv_large")])
        wanted = (2 * vertices / vertices.sum()) ** 2
        if np.abs(np.asarray(packing.params["a0"])[:, None] - wanted).min(axis=1).max() > 1e-9:
            raise InputError(f"to = {given['to']}: the file does not have the default rest areas; leave it out")
    law = law_settings(packing)
    if twice := next((name for name in given if name in {*law, "size_ratio"}), None):
        raise InputError(f"{twice} = {given[twice]}: law and sizes come from {settings['data']}; leave it out")
    return law


def _data_of_lammps(path: str) -> "Packing":
    """The packing of a data file that LAMMPS reads too; what jamlab assumes of it is printed."""
    import jamlab

    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        packing = jamlab.read(path)
    with open(path, "rb") as file:
        if not any(line.rstrip().endswith(b" atoms") for line in islice(file, 100)):
            raise InputError(f"data = {path}: LAMMPS reads a file of jamlab.write or of another deck")
    for note in notes:
        typer.echo(str(note.message))
    return packing


def check_setting(path: Path, name: str, text: str) -> None:
    """Refuse a variable that a deck does not use, and a value that the deck says it cannot have."""
    if name not in (own := offered(path)):
        raise InputError(f"{_option(name)}: {path.name} has no such variable; {_variable_meant(path.name, name, own)}")
    words, good = _rules(path)[name]
    if not good(text):
        raise InputError(f"{name} = {text}: must be {words}")


def _variable_meant(deck: str, name: str, own: list[str]) -> str:
    """What to give for a variable that a deck does not have."""
    from jamlab.checks import name_meant
    from jamlab.hints import meant

    use = meant(name, [deck, "jamlab deck"], own, argument=True).strip("`")
    return f"use {_option(use)}" if use in own else name_meant(name.lower(), own, f"it has {', '.join(own)}")


def offered(path: Path) -> list[str]:
    """Variables that a deck uses, and that `jamlab deck` does not set itself. What stands behind their defaults says
    whether they are for one model, or for a random start."""
    from jamlab.engine.deck_defaults import NOTES, settings

    known, notes = settings(path.parent, path.name), settings(path.parent, path.name, what=NOTES)
    idle = ["; sp only"] if known.get("model") == "dp" else ["; dp only"]
    idle += ["; random start only"] if "data" in known else []
    unused = {name for name, note in notes.items() if note.endswith(tuple(idle))}
    return sorted(known.keys() - unused - {"dir", "model", "quote", "quiet", "table", "strict"})


def _rules(path: Path) -> dict[str, tuple[str, Callable[[str], bool]]]:
    """What each variable of a deck may be, in words, and whether a text is that."""
    from jamlab.engine.deck_defaults import LIMITS, settings

    known, limits = settings(path.parent, path.name), settings(path.parent, path.name, what=LIMITS)
    limits |= _limits_of_law(path, known)
    rules = {name: _rule(limits.get(name) or _usual(default)) for name, default in known.items()}
    words = "a name without spaces and quotes, which LAMMPS takes"
    return rules | dict.fromkeys(("data", "out"), (words, lambda text: bool(text) and not set(text) & set(" \t\"'$&#")))


def _limits_of_law(path: Path, known: Mapping[str, str]) -> dict[str, str]:
    """Limits of the parameters of the force law of a deck that are numbers, as the law declares them."""
    from jamlab.packing.kinds import MODELS

    text = path.read_text()
    parts = (name for name in MODELS.names() if name == known.get("model") or f'/parts/{name}"' in text)
    declared = {name: each for part in parts for name, each in MODELS.get(part).parameters(None, {}).items()}
    numbers = {name: each.limits for name, each in declared.items() if not (each.choices or each.each)}
    return {name: f"[{least:g}, {largest:g}]" for name, (least, largest) in numbers.items()}


def _usual(default: str) -> str:
    return "[0, 1e9]" if default.strip("0.") == "" else "(0, 1e9]"


def _rule(limits: str) -> tuple[str, Callable[[str], bool]]:
    """A number in an interval, or one of several words."""
    interval = re.match(r"([\[(])(\S+), (\S+)\] ?(even|whole)?", limits)
    if interval is None:
        return f"one of {limits}", limits.split(" | ").__contains__
    bracket, least, most, kind = interval.groups()

    def good(text: str) -> bool:
        try:
            value = float(text)
        except ValueError:
            return False
        inside = float(least) <= value <= float(most) and (bracket == "[" or value > float(least))
        # LAMMPS counts by numbers without an exponent
        return inside and (
            kind is None or (text.lstrip("+-").isdecimal() and value % (2 if kind == "even" else 1) == 0)
        )

    words = {None: "a number", "whole": "a whole number", "even": "an even number"}[kind]
    return f"{words} in {bracket}{least}, {most}]{'' if kind is None else ', in digits'}", good
