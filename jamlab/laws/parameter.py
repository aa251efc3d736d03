"""Parameters of force laws: each is declared once, with its range, unit and default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jamlab.checks import as_plain, check_choice, is_number
from jamlab.errors import InputError

LARGEST = 1e50  # of a parameter in any units: energies and stiffnesses then stay far from the ends of float64
WIDEST = 1e12  # of one in natural units: float64 keeps no digits of what is smaller


@dataclass(frozen=True)
class Parameter:
    """A parameter of a force law, declared once: what it may be, and what it is measured in.

    `jam`, `pack`, campaigns and the command line take those with a default by name; a packing that does not say one has
    the default. Their checks, those of LAMMPS decks, and the columns of files and tables follow from the declaration.
    """

    energy: int = 0  # power of energy that it is measured in
    length: int = 0  # power of length
    default: Any = None  # None: every packing says it
    least: float = 1 / LARGEST
    largest: float = LARGEST
    may_vanish: bool = False
    choices: tuple[str, ...] = ()  # of a parameter that is a name; dumps hold its place here: append only
    each: bool = False  # one number for each particle
    over_size: bool = False  # a length over the mean size of the particles
    beyond: str = ""  # what happens beyond the largest value, in words
    # where packings are made: limits in units of the strength of contacts and the mean size of particles
    made: tuple[float, float] | None = None
    meaning: str = ""  # in words

    @property
    def limits(self) -> tuple[float, float]:
        """Least and largest value of a packing that is made in natural units."""
        least, largest = self.made or (self.least, self.largest)
        return (0.0 if self.may_vanish else least), largest

    def check(self, name: str, value: Any, *, made: bool = False) -> None:
        """Refuse a value that is no number in range, or no name among the choices. `made`: in natural units."""
        if self.choices:
            check_choice(name, value, self.choices)
        elif not self.each and not (self.may_vanish and is_number(value) and value == 0):
            least, largest = (self.made if made else None) or (self.least, self.largest)
            if not (is_number(value) and least <= as_plain(value) <= largest):
                units = "choose other units where it is beyond" if (self.energy or self.length) and not made else ""
                more = "; ".join(filter(None, [f"beyond, {self.beyond}" if self.beyond else "", units]))
                raise InputError(
                    f"params[{name!r}] is {value!r}: must be a number from {least:g} to {largest:g}"
                    + (f"; {more}" if more else "")
                )


# names of the strength of contacts: the units in which it is 1, and the parameter that holds it. Steps of minimisers in
# decks are those of a strength near 1
STRENGTHS: Mapping[str, Parameter] = {
    "eps": Parameter(energy=1, made=(1e-3, 100.0), meaning="energy of contacts"),
    "k": Parameter(energy=1, length=-2, made=(1e-3, 100.0), meaning="stiffness of contacts"),
}
UNITS = tuple(STRENGTHS)


def check_params(model: str, units: str, declared: Mapping[str, Parameter], params: Mapping[str, Any]) -> None:
    """Refuse force-law parameters that are missing, unknown by name, no positive numbers or out of range."""
    whose = f"law {params['law']!r} of model {model}" if "law" in params else f"the force law of model {model}"
    if units not in declared:
        raise InputError(f"{whose} has no units {units!r}")
    if unknown := params.keys() - declared.keys():
        raise InputError(
            f"params[{min(unknown)!r}]: {whose} in units {units} has no such parameter: use {', '.join(declared)}"
        )
    for name, parameter in declared.items():
        if name in params:
            parameter.check(name, params[name])
        elif parameter.default is None:
            raise InputError(f"params of {whose} in units {units} lack {name!r}")
