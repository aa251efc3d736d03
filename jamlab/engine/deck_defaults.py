"""The defaults in decks of LAMMPS, which decks and Python share.

A line `# [NAME]` of a deck or part opens a section; the lines `variable NAME index VALUE` below it are defaults, which
this module reads, so each is written once.
"""

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

from jamlab.errors import EngineError
from jamlab.installed_files import installed
from jamlab.packing.kinds import MODELS

_INDEX = re.compile(r"^variable\s+(\w+)\s+index\s+(\S+)", re.MULTILINE)
# what a variable may be, where a deck says it behind the default: an interval, "whole" or "even" numbers, or words
LIMITS = re.compile(
    r"^variable\s+(\w+)\s+index\s+\S+\s+# ([\[(]\S+, \S+\](?: even| whole)?|[\w/]+(?: \| [\w/]+)+)", re.MULTILINE
)
NOTES = re.compile(r"^variable\s+(\w+)\s+index\s+\S+\s+# (.+)", re.MULTILINE)  # all that stands behind a default
_INCLUDED = re.compile(r"include \"\$\{dir\}/([\w./${}]+)\"")


def deck_text(folder: Path, name: str, model: str = "") -> str:
    """Text of a deck, then that of each part that it includes."""
    text = (folder / name).read_text()
    model = model or dict(_INDEX.findall(text)).get("model", "")
    return "".join(
        [text, *(deck_text(folder, part.replace("${model}", model), model) for part in _INCLUDED.findall(text))]
    )


def settings(folder: Path, name: str, model: str = "", what: re.Pattern[str] = _INDEX) -> dict[str, str]:
    """Variables that `lmp -var` may set in a deck, each with its default: its own, then those of what it includes.
    `what`: LIMITS for what they may be."""
    text = (folder / name).read_text()
    found = dict(reversed(what.findall(text)))  # of two lines for one name the first counts
    model = model or dict(_INDEX.findall(text)).get("model", "")
    for part in _INCLUDED.findall(text):
        found = settings(folder, part.replace("${model}", model), model, what) | found
    return found


def defaults(name: str) -> dict[str, float | str]:
    """Values of the section `# [name]` of the decks: numbers as float, the rest as str."""
    model = name.partition(".")[0]
    return dict(_values(MODELS.get(model).part, model, name) if model in MODELS.names() else _values(None, "", name))


@cache
def _values(part: Path | None, model: str, name: str) -> dict[str, float | str]:
    sections = _sections(part, model)
    if name not in sections:
        raise EngineError(f"no deck has the section {name}: reinstall jamlab with `pip install --force-reinstall .`")
    # beside those of decks: `jam` and moduli of droplets have steps that decks do without
    of_python: dict[str, dict[str, float | str]] = {
        "onset": {
            "phi_near": 0.70,  # from here on the first increment is step_near
            "step_near": 2e-3,
            "step_paper": 1e-4,  # search="incremental": first increment of Boromand et al.
            "step_fine": 2.5e-4,  # where jammed, this close above unjammed: go down to onset
            "phi_carried": 0.80,  # droplets: up to here, or until they jam, disks carry them
        },
        "strain": {"strain_step_dp": 3e-7},  # their contacts are less linear: 1e-6 costs 1e-4 of G
    }
    return {key: _parsed(value) for key, value in _INDEX.findall(sections[name])} | of_python.get(name, {})


@cache
def numbers(name: str) -> Mapping[str, float]:
    """Values of a section that holds numbers alone."""
    return MappingProxyType({key: float(value) for key, value in defaults(name).items()})


@cache
def _sections(part: Path | None, model: str) -> dict[str, str]:
    """Sections of the decks, or of the part of a model; those of a part that models share begin with `${model}`."""
    folder = installed("lammps_inputs")
    files = [*folder.glob("parts/*"), *folder.glob("in.*")] if part is None else [part]
    section = re.compile(r"^# \[(\S+)\].*\n((?:variable .*\n)+)", re.MULTILINE)
    found = [each for path in files for each in section.findall(path.read_text())]
    return {name.replace("${model}", model): lines for name, lines in found}


def _parsed(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
