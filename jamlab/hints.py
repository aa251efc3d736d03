"""Names typed from habit: what each means, and what here gives it; never a name that only looks alike.

A word of a habit belongs to concepts. A concept says by which names classes and functions of jamlab have it, and what
gives it where none of those names exists. A hint is given only if its target exists on that very class, function or
module: names are looked up there, and `tests/test_hints.py` evaluates all others on real objects.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, lru_cache
from itertools import takewhile
from typing import TYPE_CHECKING, Any, ClassVar

from jamlab.argument_habits import INSTEAD, OF_ONE_FUNCTION
from jamlab.arguments.table import ARGUMENTS
from jamlab.errors import ArgumentError
from jamlab.face import also_called
from jamlab.field_habits import FIELD
from jamlab.habits import CONCEPTS, LIMITS, MODULE, PACKING, Concept


@dataclass(frozen=True)
class Likeness:
    """Which names are similar to another, and how many a message lists."""

    misspelt: float = 0.85  # likeness of two spellings of one name
    remembered: int = 10_000  # names
    at_a_glance: int = 25  # names listed at most
    most_listed: int = 60  # names in a message
    short: int = 3  # letters of names whose words are in one order only
    parts: int = 2  # of a name in a message


LIKENESS = Likeness()

# parts that say little of what is meant
_VAGUE = {
    *("elastic", "viscous", "complex", "plastic", "local", "mean", "total", "average", "real", "relative", "error")
}
_VAGUE |= {
    *("data", "from", "with", "write", "read", "load", "save", "make", "find", "plot", "show", "number", "count")
}
_VAGUE |= {*("index", "size", "values", "list", "array", "table", "scale", "time", "area", "step", "rate", "file")}
_VAGUE |= {*("value", "displacement", "difference", "histogram", "matrix", "sweep", "network", "state", "full")}
# words beside a known part that leave its meaning as it is
_NEUTRAL = {*("mean", "average", "avg", "data", "value", "values", "list", "array", "table", "of", "the", "all", "per")}
_ENDING = re.compile(r"(?:i[sz](?:e|ed|ing|ation)|s)$")
_WHOLE = {"frac": "fraction", "mod": "modulus", "moduli": "modulus", "freq": "frequency", "dist": "distribution"}
_WHOLE |= {"frequencies": "frequency", "viscosities": "viscosity", "visc": "viscosity", "coord": "coordination"}
_BEFORE = ("get_", "compute_", "calc_", "calculate_", "find_", "n_", "num_", "mean_", "avg_", "average_", "total_")
_AFTER = ("_matrix", "_list", "_array", "_values", "_table")


def meant(name: str, kinds: list[str], known: Iterable[str], argument: bool = False) -> str:
    """What a name means that does not exist, as code between backticks; "" where nothing is known.

    Args:
        name: as typed.
        kinds: names of the class and its bases, of the function, the command or "jamlab".
        known: names that are there.
        argument: whether it is one of a function or an option of a command: what gives it elsewhere is no help.
    """
    there, concepts = set(known), _concepts(name, argument)
    place = "jamlab." * (kinds[0] == MODULE)
    if not concepts or name not in _words(argument):
        for own in _forms(name):
            if own in there:
                return f"`{place}{own}`"
    for concept in concepts:
        for kind in kinds:
            if kind in concept.of and (not argument or _targets(concept.of[kind]) <= there):
                return _filled(concept.of[kind], kinds)
        for own in concept.has.split():
            if own in there:
                return f"`{place}{own}`"
    uses = [] if argument else [concept.use for concept in concepts if concept.use]
    return _filled(uses[0], kinds) if uses else ""


def _targets(use: str) -> set[str]:
    """The argument that a hint begins with; none where it begins with other code or with words."""
    return {found[1]} if (found := re.match(r"`(\w+)`", use)) else set()


@lru_cache(LIKENESS.remembered)
def _concepts(name: str, argument: bool) -> list[Concept]:
    words = _words(argument)
    if name.endswith("Error") and not argument:
        name = "exception"
    return next((words[form] for form in (name, *_forms(name)) if form in words), [])


@lru_cache(LIKENESS.remembered)
def _forms(name: str) -> tuple[str, ...]:
    """Other forms of a name with its meaning: in small letters, unless it is one letter, one or several, without a verb
    or "number of", without what says that it is an array, and with its words in any order or without a gap."""
    small = name.lower() if len(name) > 1 else name
    whole = "_".join(_WHOLE.get(part, part) for part in small.split("_"))
    stems = [small, whole, *(small.removeprefix(before) for before in _BEFORE if small.startswith(before))]
    stems += [stem.removesuffix(after) for stem in stems for after in _AFTER if stem.endswith(after)]
    return (*(form for stem in stems for form in (stem, f"{stem}s", stem.removesuffix("s"))), *_alike(name))


def _alike(name: str) -> tuple[str, str]:
    """What names of one meaning share: their words in any order and form, or all their letters; none is a name."""
    parts = name.lower().split("_")
    return " ".join(["", *sorted(_ENDING.sub("", part) for part in parts)]), f"={''.join(parts)}"


def hint(
    name: str, kinds: Iterable[str], known: Iterable[str], measured: Iterable[str] = (), functions: Iterable[str] = ()
) -> str:
    """What to use for an attribute that does not exist, as the end of a message; else what there is.

    Args:
        name: as typed.
        kinds: names of the class and its bases, or "jamlab".
        known: names that are there.
        measured: quantities of `jamlab.measure`.
        functions: of jamlab, which take such an object.
    """
    kinds, known = list(kinds), list(known)
    if use := meant(name, kinds, known):
        return f"; {use}" if use == LIMITS else f": use {use}"
    if name in measured:
        return _filled(f": use `jamlab.measure({{p}}, {name!r})`", kinds)
    if name in functions:
        return f": use `jamlab.{name}`"
    if not _concepts(name, False) and (near := misspelt(name, known)):
        return f": did you mean `{near}`?"
    if use := _by_parts(name, kinds, known):
        return f"; {use}"
    if len(known) > LIKENESS.most_listed:
        shared = [each for each in known if _parts(each) & _parts(name)]
        if shared:
            return f"; names with a word of it: {', '.join(shared)}; help(jamlab) lists all"
        return f"; help(jamlab{'' if kinds[0] == MODULE else '.' + kinds[0]}) lists what there is"
    return f"; it has {_listed(name, known)}"


def _listed(name: str, known: list[str]) -> str:
    """The names that there are, the most like one first if there are many."""
    if len(known) <= LIKENESS.at_a_glance:
        return ", ".join(known)
    parts = _parts(name)
    near = sorted(known, key=lambda each: (-len(_parts(each) & parts), -_begun_alike(each, name)))
    return f"{', '.join(near[: LIKENESS.at_a_glance])}, and {len(known) - LIKENESS.at_a_glance} more, which dir() lists"


def _begun_alike(one: str, other: str) -> int:
    """Letters from the first on that two names share."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))


def _by_parts(name: str, kinds: list[str], known: list[str]) -> str:
    """What the longest parts of a name mean, each with the part, at most two; "" where a word is left that may change
    what is meant."""
    words = name.lower().split("_")
    spans = [(start, stop) for start in range(len(words)) for stop in range(start + 1, len(words) + 1)]
    found: dict[tuple[int, int], str] = {}
    for start, stop in sorted(spans, key=lambda span: (span[0] - span[1], -span[1])):
        part = "_".join(words[start:stop])
        if len(part) <= LIKENESS.short or part in _VAGUE or part == name:
            continue
        if any(start < end and begin < stop for begin, end in found):
            continue
        place = "jamlab." * (kinds[0] == MODULE)
        use = f"`{place}{part}`" if part in known else meant(part, kinds, known)
        if use and use != LIMITS and len(found) < LIKENESS.parts:
            found[start, stop] = f"for {part!r} use {use}"
    told = {at for start, stop in found for at in range(start, stop)}
    if any(at not in told and word not in _NEUTRAL for at, word in enumerate(words)):
        return ""
    return "; ".join(found[span] for span in sorted(found))


@lru_cache(LIKENESS.remembered)
def _parts(name: str) -> frozenset[str]:
    """Words of a name, in small letters and the singular."""
    return frozenset(part.removesuffix("s") for part in name.lower().split("_")) - {""}


def argument_hint(name: str, function: str, known: Iterable[str]) -> str:
    """What to use for an argument that a function does not have, as the end of a message."""
    names = list(known)
    if use := meant(name, [function], names, argument=True):
        return f"; {use}" if use == LIMITS else f": use {use}"
    if not _concepts(name, True) and (near := misspelt(name, names)):
        return f": did you mean `{near}`?"
    return f"; it takes {', '.join(names)}"


def unknown_argument(function: str, name: str, known: Iterable[str]) -> ArgumentError:
    """The error of an argument that a function does not have."""
    return ArgumentError(f"{function} has no argument {name!r}{argument_hint(name, function, known)}")


def misspelt(name: str, known: Iterable[str]) -> str:
    """The known name that one misspells, or whose words it has in another order; "" if none is as like. What begins
    with another letter, such as "unjammed" or "eta_star" beside "tau_star", has another meaning."""
    parts = sorted(name.split("_"))
    alike = [each for each in known if each[:1] == name[:1]]
    turned = [each for each in known if sorted(each.split("_")) == parts]
    return (turned or get_close_matches(name, alike, 1, LIKENESS.misspelt) or [""])[0]


def instead_of(function: str, wanted: Iterable[str], value: object) -> str:
    """What to give in place of an object, as the end of a message: `wanted` are the classes that are asked for."""
    given = [each.__name__ for each in type(value).__mro__]
    for what in (function, *wanted):
        for kind in given:
            if (what, kind) in INSTEAD:
                return f"; give {INSTEAD[what, kind]}"
    return ""


@cache
def attributes(cls: type) -> list[str]:
    """Public attributes of a class: fields in their order, properties and methods."""
    names = dict.fromkeys([*getattr(cls, "__dataclass_fields__", ()), *dir(cls)])
    return [name for name in names if name[0] != "_"]


class Hinted:
    """A class whose missing attributes are answered by what to use."""

    _measured: ClassVar[Iterable[str]] = ()  # quantities of `jamlab.measure` that are hinted at
    _functions: ClassVar[Iterable[str]] = ()  # functions of jamlab that are hinted at

    if not TYPE_CHECKING:  # else every name would be an attribute

        def __getattr__(self, name: str) -> Any:
            cls = type(self)
            if name.startswith("_"):
                raise AttributeError(f"{cls.__name__!r} object has no attribute {name!r}", name=name, obj=self)
            article = "an" if cls.__name__[0] in "AEIOU" else "a"
            use = hint(name, [each.__name__ for each in cls.__mro__], attributes(cls), self._measured, self._functions)
            raise AttributeError(f"{article} {cls.__name__} has no attribute {name!r}{use}", name=name, obj=self)


def _filled(text: str, kinds: Iterable[str]) -> str:
    """Put the expression for a packing into a hint of a class."""
    return text.replace("{p}", next((PACKING[kind] for kind in kinds if kind in PACKING), "packing"))


def _by_word(concepts: Iterable[Concept]) -> dict[str, list[Concept]]:
    found: dict[str, list[Concept]] = {}
    for concept in concepts:
        for word in concept.words.split():
            found.setdefault(word, []).append(concept)
    # not classes of other programs
    for word in [word for word in found if len(word) > LIKENESS.short and word.islower()]:
        for form in _alike(word):
            found.setdefault(form, found[word])
    return found


# words of arguments: what one function answers in its own way, then the words of the table
HABITS = (*OF_ONE_FUNCTION, *(Concept(line.habits, line.name) for line in ARGUMENTS.values() if line.habits))


@cache
def _words(argument: bool) -> dict[str, list[Concept]]:
    """What words of arguments mean, or those of attributes: what functions say that they are called comes first."""
    return _by_word((*(HABITS if argument else _of_functions()), *FIELD, *CONCEPTS))


def _of_functions() -> list[Concept]:
    """What public functions say in their docstrings that they are also called."""
    called = {f"`jamlab.{name}`": words for name, words in also_called().items()}
    return [
        Concept(" ".join(words), use=use, of=dict.fromkeys((MODULE, "Packing"), use)) for use, words in called.items()
    ]
