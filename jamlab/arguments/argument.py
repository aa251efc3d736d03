"""An argument: of functions, options, keys of campaign files, columns and variables of decks, by one name."""

from __future__ import annotations

import math
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
    signed: bool = False  # whether the limits are those of the magnitude
    choices: tuple[str, ...] | Callable[[], tuple[str, ...]] = ()
    default: Any = REQUIRED  # in Python; None: see `unset`
    unset: str = ""  # what a default of None stands for, in words
    otherwise: Mapping[str, Any] = field(default_factory=dict)  # place -> its default
    limits_otherwise: Mapping[str, Limits] = field(default_factory=dict)  # place -> its least and highest value
    habits: str = ""  # words that users of other programs type for it
    each: str = ""  # name of one of several, as in an option that is repeated
    short: str = ""  # letter of the option
    metavar: str = ""  # of the option

    def __post_init__(self) -> None:
        for name in ("otherwise", "limits_otherwise"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def option(self) -> str:
        """The option of the shell."""
        return f"--{self.name.replace('_', '-')}"

    @property
    def known(self) -> tuple[str, ...]:
        """The choices there are."""
        return self.choices() if callable(self.choices) else self.choices

    def default_at(self, *places: str) -> Any:
        """The default at the first of the places that differs, or else the usual one."""
        return next((self.otherwise[place] for place in places if place in self.otherwise), self.default)

    def limits_at(self, *places: str) -> Limits:
        """Least and highest value at the first of the places that differs, or else the usual ones."""
        usual = (self.least, self.highest)
        return next((self.limits_otherwise[place] for place in places if place in self.limits_otherwise), usual)

    def allowed(self, *places: str) -> str:
        """What a value may be, in words; "" where there is no limit."""
        least, highest = self.limits_at(*places)
        if known := self.known:
            return f"one of {', '.join(known)}"
        what = "a whole number" if self.kind == "integer" else "a number"
        if self.signed and least is not None and highest is not None:
            return f"{what} from {least:g} to {highest:g} in magnitude"
        if least is not None and highest is not None:
            if self.above:
                return f"{what} above {least:g} and at most {highest:g}"
            return f"{what} from {least:g} to {highest:g}"
        if least is not None:
            return f"{what} above {least:g}" if self.above else f"{what}, {least:g} or more"
        return f"{what}, at most {highest:g}" if highest is not None else ""

    def admits(self, value: float, *places: str) -> bool:
        """Whether a number is within the limits."""
        least, highest = self.limits_at(*places)
        value = abs(value) if self.signed else value
        if not math.isfinite(value) or (highest is not None and value > highest):
            return False
        return least is None or value > least or (value == least and not self.above)
