"""An argument: of functions, options, keys of campaign files, columns and variables of decks, by one name."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final, Literal

Kind = Literal["integer", "number", "text", "choice", "flag", "path", "array", "object"]
Limits = tuple[float | None, float | None]


@dataclass(frozen=True)
class Required:
    """The default of an argument that has none."""

    def __repr__(self) -> str:
        return "required"


REQUIRED: Final = Required()


@dataclass(frozen=True)
class FromDeck:
    """A default that stands in a deck of LAMMPS: None in Python stands for it."""

    section: str
    name: str


@dataclass(frozen=True)
class InWords:
    """A default that the table cannot hold, such as a function or names that are listed elsewhere."""

    text: str


@dataclass(frozen=True)
class Argument:
    """One argument, wherever it stands.

    A place is a function or method ("jam", "Campaign.run"), a command ("jamlab jam"), a table of a campaign file
    ("sweep", "sweep.flow") or a deck ("in.sp.jam"; "deck" for all). Where a place differs, it stands in `otherwise`.
    """

    name: str
    text: str  # one sentence, for the page, --help and errors
    kind: Kind = "object"
    symbol: str = ""
    unit: str = ""
    least: float | None = None
    highest: float | None = None
    above: bool = False  # whether the least value is itself excluded
    choices: tuple[str, ...] | Callable[[], tuple[str, ...]] = ()
    choices_otherwise: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # place -> its choices
    default: Any = REQUIRED  # in Python; None: see `unset`
    unset: str = ""  # what a default of None stands for, in words
    unset_otherwise: Mapping[str, str] = field(default_factory=dict)  # place -> these words
    otherwise: Mapping[str, Any] = field(default_factory=dict)  # place -> its default
    text_otherwise: Mapping[str, str] = field(default_factory=dict)  # place -> the sentence, where it means less
    limits_otherwise: Mapping[str, Limits] = field(default_factory=dict)  # place -> its least and highest value
    habits: str = ""  # words that users of other programs type for it
    each: str = ""  # name of one of several, as in an option that is repeated
    short: str = ""  # letter of the option
    metavar: str = ""  # of the option

    def __post_init__(self) -> None:
        for name in ("otherwise", "limits_otherwise", "unset_otherwise", "choices_otherwise", "text_otherwise"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def option(self) -> str:
        """The option of the shell."""
        return f"--{self.name.replace('_', '-')}"

    @property
    def known(self) -> tuple[str, ...]:
        """The choices there are."""
        return self.choices() if callable(self.choices) else self.choices

    def text_at(self, *places: str) -> str:
        """The sentence at the first of the places that has its own, or else the usual one."""
        return next((self.text_otherwise[place] for place in places if place in self.text_otherwise), self.text)

    def choices_at(self, *places: str) -> tuple[str, ...]:
        """The choices at the first of the places that differs, or else the usual ones."""
        return next((self.choices_otherwise[place] for place in places if place in self.choices_otherwise), self.known)

    def unset_at(self, *places: str) -> str:
        """What None stands for at the first of the places that differs, or else usually."""
        return next((self.unset_otherwise[place] for place in places if place in self.unset_otherwise), self.unset)

    def default_at(self, *places: str) -> Any:
        """The default at the first of the places that differs, or else the usual one."""
        return next((self.otherwise[place] for place in places if place in self.otherwise), self.default)

    def limits_at(self, *places: str) -> Limits:
        """Least and highest value at the first of the places that differs, or else the usual ones."""
        usual = (self.least, self.highest)
        return next((self.limits_otherwise[place] for place in places if place in self.limits_otherwise), usual)

    def ends(self, *places: str) -> tuple[float, float]:
        """The limits as numbers, infinite where there is none."""
        least, highest = self.limits_at(*places)
        return -math.inf if least is None else least, math.inf if highest is None else highest

    def allowed(self, *places: str) -> str:
        """What a value may be, in words."""
        if known := self.choices_at(*places):
            return f"one of {', '.join(known)}"
        what, (least, highest) = "a whole number" if self.kind == "integer" else "a number", self.limits_at(*places)
        beyond = "" if least is None else f"above {least:g}" if self.above else f"from {least:g}"
        if least is not None and highest is not None:
            limits = f"{beyond} and at most {highest:g}" if self.above else f"{beyond} to {highest:g}"
            return f"{what} {limits}"
        finite = what if self.kind == "integer" else "a finite number"
        if least is not None:
            return f"{finite} {beyond}" if self.above else f"{finite}, {least:g} or more"
        return finite if highest is None else f"{what}, at most {highest:g}"

    def admits(self, value: float, *places: str) -> bool:
        """Whether a number is finite and within the limits."""
        least, highest = self.limits_at(*places)
        if not abs(value) <= sys.float_info.max or (highest is not None and value > highest):
            return False
        return least is None or value > least or (value == least and not self.above)
