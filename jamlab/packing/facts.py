"""What a packing is, fact by fact, and where each format keeps it.

Writers, readers, the table that the page `docs/reference/files.md` includes and the test of all round trips are made
from these lists: a field of `Packing` that is missing here fails the test. A format keeps a fact, or it is in `LOST`:
then `jamlab.write` returns its name, and so does `provenance["lost"]` of what is read.

Text formats hold facts of the whole packing as words `name=value`: numbers with 17 significant digits, which read back
as the same doubles; truth values as 0 or 1; the provenance as JSON, percent-encoded. Columns of dumps hold numbers
alone: of what is a word its place among the choices; a force law that is named has a column `law_NAME` of ones.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.laws.parameter import UNITS, Parameter
from jamlab.packing.ensembles import ENSEMBLES
from jamlab.packing.kinds import MODELS
from jamlab.packing.packing import KNOWN, Packing

FORMATS = {
    **{"packings": "HDF5", "data": "LAMMPS data", "dump": "LAMMPS dump"},
    **{"xyz": "extended xyz", "universe": "Universe of MDAnalysis"},
}
LOST, REFUSED = "lost", "refused"


class Fact(NamedTuple):
    """Something that a packing, or a file of packings, may say."""

    name: str  # attribute of `Packing`; or of a file
    of: str  # what has it: each "particle", each "site" (disk or vertex), each "frame", or the "file"
    places: tuple[str, ...]  # where it stands, or LOST, or REFUSED, in the order of `FORMATS`


_WORDS = ("comment", "column", "second line", "`descriptions`")


def _state(name: str) -> Fact:
    return Fact(name, "frame", ("`/parameters/state`", *_WORDS))


FACTS = (
    Fact("model", "file", ("`/parameters`", "comment, bonds", "columns of the law", *_WORDS[2:])),
    Fact("units", "file", ("`/parameters`", "comment", "columns of the law", *_WORDS[2:])),
    Fact("params", "file", ("`/parameters/force_law`", *_WORDS)),
    Fact("box", "frame", ("`box/edges`", "`xlo xhi`, `xy`", "`BOX BOUNDS`", "`Lattice`", "`dimensions`, float32")),
    Fact("positions", "site", ("`position`", "wrapped, with images", "`xu yu`", "`pos`", "`positions`, float32")),
    Fact("diameters", "particle", ("`/parameters`", "types, `d_diameter`", "`radius`", "`radius`", "`radii`")),
    Fact("offsets", "particle", ("`/parameters`", "bonds, molecules", "`mol`", "`mol`", "bonds, residues")),
    Fact("fixed", "particle", ("`/parameters/state`", "comment", "`fixed`", "`fixed`", "`fixed_flags`")),
    Fact("phi_J", "frame", ("`/parameters/phi_J`", *_WORDS)),
    *map(_state, (name for name in KNOWN if name != "fixed")),
    Fact("provenance", "frame", ("`/parameters/provenance`", "comment", LOST, *_WORDS[2:])),
    Fact("frames", "file", ("of one sweep", REFUSED, "of equal number of sites", "any", "of one sweep")),
    Fact("observables", "file", ("`/observables`", REFUSED, REFUSED, REFUSED, REFUSED)),
    Fact("record of a flow", "file", ("`/flow`, by the flow", LOST, LOST, LOST, LOST)),
)
STATE: dict[str, Any] = {"phi_J": None, **{name: usual for name, usual in KNOWN.items() if name != "fixed"}}
OF_DIGITS = ("max_force", "converged", "force_tolerance")  # of a minimum, which a rounded packing is not at
_LAW_COLUMN = "law_"
_EARLIER = {"onset", "tolerance"}  # words of earlier layouts, which have `rounding` as well


def lost_names(kind: str) -> tuple[str, ...]:
    """Names of the fields of packings that a format does not keep."""
    at = list(FORMATS).index(kind)
    return tuple(fact.name for fact in FACTS if fact.places[at] == LOST and fact.name in Packing.__dataclass_fields__)


def lost(kind: str, packings: Iterable[Packing]) -> tuple[str, ...]:
    """Names of what these packings have, and a format does not keep."""
    frames = list(packings)
    return tuple(name for name in lost_names(kind) if any(getattr(packing, name) for packing in frames))


def facts_table() -> str:
    """The table of facts and formats that `docs/reference/files.md` includes."""
    alike: dict[tuple[str, ...], list[str]] = {}  # names of facts by what is said of them
    for fact in FACTS:
        name = f"`{fact.name}`" if " " not in fact.name else fact.name
        alike.setdefault((fact.of, *fact.places), []).append(name)
    rows = [("fact", "of each", *FORMATS.values()), ("---",) * (2 + len(FORMATS))]
    rows += [(", ".join(names), *said) for said, names in alike.items()]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def rounding_of(kind: np.dtype[Any], values: Array) -> float:
    """How far numbers may be off that a file holds in a type of fewer digits than float64."""
    if kind.kind != "f" or kind.itemsize >= 8:
        return 0.0
    return float(0.5 * np.finfo(kind.newbyteorder("=")).eps * np.abs(values).max())


# words ----------------------------------------------------------------------------------------------------------------


def law_of(packing: Packing) -> dict[str, Any]:
    """Parameters of the force law that are the same for all particles."""
    return {name: value for name, value in packing.params.items() if not packing.parameters[name].each}


def facts_of(packing: Packing) -> dict[str, Any]:
    """What is true of the whole packing, by name; what is unknown is left out."""
    state = {name: value for name in STATE if (value := getattr(packing, name)) is not None}
    history = {"provenance": packing.provenance} if packing.provenance else {}
    return {"model": packing.model, "units": packing.units, **law_of(packing), **state, **history}


def words(facts: Mapping[str, Any]) -> str:
    """Facts as words `name=value`."""
    return " ".join(f"{name}={_word(value)}" for name, value in facts.items())


def _word(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        return quote(history_text(value, "provenance"))
    return f"{float(value):.17g}"


def facts_of_words(found: Mapping[str, str]) -> dict[str, Any]:
    """Values of facts from their words, by name.

    Raises:
        InputError: one should be a number, and is none, or the force law is unknown, or an earlier jamlab wrote them.
    """
    refuse_earlier(found)
    chosen = _choices(found.get("law"))
    return {name: _fact_of_word(name, text, chosen) for name, text in found.items()}


def refuse_earlier(names: Iterable[str]) -> None:
    """Refuse what an earlier jamlab wrote, by the names of its words or columns."""
    there = set(names)
    if "rounding" in there and (found := sorted(there & _EARLIER)):
        raise InputError(f"an earlier jamlab wrote it, with {' and '.join(found)}: make its packings again")


def _fact_of_word(name: str, text: str, chosen: Mapping[str, tuple[str, ...]]) -> Any:
    names = ("model", "units", "fixed", "law")  # facts that are words of any sort
    if name in chosen or name in names:
        return text
    if name == "provenance":
        history = json.loads(unquote(text))
        if not isinstance(history, dict):
            raise InputError(f"provenance is {text[:40]}, no table")
        return history
    try:
        number = float(text)
    except ValueError:
        raise InputError(f"{f'{name}={text}'!r} is no number: give it as name=number") from None
    return bool(number) if isinstance(STATE.get(name), bool) else number


def law_columns(packing: Packing) -> dict[str, float]:
    """Columns that say the force law, beside its strength."""
    law = {name: value for name, value in law_of(packing).items() if name not in UNITS}
    return {name: value for name, value in columns_of(law).items() if name not in STATE}


def columns_of(facts: Mapping[str, Any]) -> dict[str, float]:
    """Facts as numbers, for columns: of a word its place among the choices; what is unknown of a state is -1."""
    law = facts.get("law")
    numbers = {name: facts.get(name, -1.0) for name in STATE} | {**facts}
    chosen = {name: each.index(facts[name]) for name, each in _choices(law).items() if name in facts and name != "law"}
    plain = {name: value for name, value in (numbers | chosen).items() if not isinstance(value, str | Mapping)}
    return {name: float(value) for name, value in plain.items()} | ({_LAW_COLUMN + law: 1.0} if law else {})


def facts_of_columns(names: Iterable[str], number: Callable[[str], float]) -> dict[str, Any]:
    """Facts of the whole packing from the columns that hold them; what is unknown is left out.

    Args:
        names: of all columns.
        number: the value of a column that is the same for all atoms.

    Raises:
        InputError: the force law is unknown, or an earlier jamlab wrote them.
    """
    there = set(names)
    refuse_earlier(there)
    laws = sorted(name.removeprefix(_LAW_COLUMN) for name in there if name.startswith(_LAW_COLUMN))
    law = laws[0] if laws else None
    chosen, known = _choices(law), (*shared_parameters(law), *STATE)
    found = {name: _fact_of_column(name, number(name), chosen) for name in known if name in there}
    return {name: value for name, value in found.items() if value is not None} | ({"law": law} if law else {})


def _fact_of_column(name: str, number: float, chosen: Mapping[str, tuple[str, ...]]) -> Any:
    """The value of a fact from a column; None if it is unknown."""
    if choices := chosen.get(name):
        if number not in range(len(choices)):
            raise InputError(f"{name} is {number:g}: 0 to {len(choices) - 1} stand for {', '.join(choices)}")
        return choices[int(number)]
    if name in STATE and STATE[name] is None and number < 0:
        return None
    return bool(number) if isinstance(STATE.get(name), bool) else number


def law_parameters(law: str | None = None) -> Mapping[str, Parameter]:
    """Parameters of the force laws of all models, by name, where `params["law"]` is this one.

    Raises:
        InputError: no such law is known.
    """
    return _law_parameters(tuple(MODELS.each()), law)


@cache
def _law_parameters(models: tuple[str, ...], law: str | None) -> Mapping[str, Parameter]:
    params = {} if law is None else {"law": law}
    kinds = map(MODELS.get, reversed(models))  # of one name the parameter of the first counts
    return {name: each for kind in kinds for name, each in kind.parameters(None, params).items()}


def shared_parameters(law: str | None = None) -> list[str]:
    """Names of those that are the same for all particles."""
    return [name for name, each in law_parameters(law).items() if not each.each]


def _choices(law: str | None) -> Mapping[str, tuple[str, ...]]:
    # of facts that are words
    return {"ensemble": ENSEMBLES} | {name: each.choices for name, each in law_parameters(law).items() if each.choices}


def history_text(provenance: Mapping[str, Any], what: str) -> str:
    """A provenance as JSON; numpy numbers become plain numbers, arrays and tuples lists."""

    def plain(value: Any) -> Any:
        if isinstance(value, np.generic | np.ndarray):
            return value.tolist()
        raise TypeError(f"{value!r} is a {type(value).__name__}")

    try:
        return json.dumps(provenance, default=plain)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} cannot be stored: {error}; use numbers, text, None, lists and dicts") from error
