"""Registry of the force laws of contacts, by the name that `params["law"]` of a packing has.

Laws are entry points of the group `jamlab.laws`, of jamlab or of another package, between disks or between the rims of
droplets. Without a name the law of disks is "sticky" where `stickiness` is above 0, else "power", and the packing may
have the parameters of both; the law of rims is "adhesive" where `adhesion` is above 0, else "rim".
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from jamlab.arguments.choices import Law
from jamlab.errors import InputError, typed
from jamlab.laws.pair_law import PairLaw, Surfaces
from jamlab.laws.parameter import UNITS, Parameter
from jamlab.registry import Registry

# laws of a packing that names none, by what is in contact: the first, or that whose parameter is above 0
UNNAMED: Mapping[Surfaces, Mapping[str, str]] = {
    "disks": {"": "power", "stickiness": "sticky"},
    "rims": {"": "rim", "adhesion": "adhesive"},
}
# names of laws that differ from another one in parameters alone
NAMED: Mapping[str, Mapping[str, Any]] = {"harmonic": {"exponent": 2.0}, "hertz": {"exponent": 2.5}}


def _check(name: str, law: type[PairLaw]) -> None:
    if not (isinstance(law, type) and issubclass(law, PairLaw)):
        raise InputError(f"force law {name!r} is {law!r}: register a class derived from jamlab.laws.pair_law.PairLaw")
    if not name.isidentifier():  # variables of LAMMPS and columns of dumps are called by it
        raise InputError(f"force law {name!r}: its name must be letters, digits and underscores")
    if not law.strengths or (foreign := law.strengths.keys() - set(UNITS)):
        raise InputError(f"force law {name!r}: its strengths must be among {', '.join(UNITS)}, not {sorted(foreign)}")
    if name in NAMED:
        raise InputError(f"force law {name!r}: the name stands for {dict(NAMED[name])}; choose another name")
    if taken := {*UNITS, "law"} & law.parameters.keys():
        raise InputError(f"force law {name!r}: no parameter of its own may be called {min(taken)!r}")
    if words := [
        word for each in law.parameters.values() for word in each.choices if not word or set(word) & set(" =\t")
    ]:
        raise InputError(f"force law {name!r}: {words[0]!r} is no word, as files hold one for a choice")


LAWS: Registry[type[PairLaw]] = Registry("jamlab.laws", "force law", _check)


def parameters_of(law: Law | None, fit: Collection[str] | None = None) -> dict[str, Any]:
    """Parameters of a force law that is given by its name, or by parameters.

    Args:
        law: its name, or parameters.
        fit: names that a message may give instead of an unknown one, default all.

    Raises:
        InputError: no such law is known, or a parameter is given that its name fixes.
    """
    if law is None:
        return {}
    given: dict[str, Any] = {"law": law} if isinstance(law, str) else dict(law)
    name = given.get("law")
    if isinstance(name, str) and name in NAMED:
        del given["law"]
        if twice := NAMED[name].keys() & given.keys():
            raise InputError(
                f"law = {law!r}: {name!r} has {min(twice)} = {NAMED[name][min(twice)]:g}; give one of both"
            )
        return {**NAMED[name], **given}
    if isinstance(name, str) and name not in LAWS.names():
        known = [each for each in (*NAMED, *LAWS.names()) if fit is None or each in fit]
        own, value = ("exponent", 2.5) if "power" in known else ("adhesion", 0.1)
        as_parameters = typed(f"law={{{own!r}: {value}}}", f"--law {own}={value}")
        near = [each for each in known if name.lower() in (each, f"{each}ian")]
        there = f"use {near[0]!r}" if near else f"known are {', '.join(known)}"
        raise InputError(
            f"unknown force law {name!r}: {there}; give parameters as {as_parameters}, and write "
            "another law as docs/how_to/own_force_law.md says; workers and commands need it in an installed package"
        )
    return given


def law_class(params: Mapping[str, Any], between: Surfaces = "disks") -> type[PairLaw]:
    """The law that the parameters of a packing name.

    Args:
        params: `Packing.params`.
        between: what is in contact.

    Raises:
        InputError: no such law is known, it acts between other surfaces, a parameter is given of a law that is not
            chosen, or stickiness goes with an exponent.
    """
    if (name := _named(params)) is not None:
        law = LAWS.get(name)
        if law.between != between:
            raise InputError(f"law {name!r} acts between {law.between}, not {between}: {_known(between)}")
        return law
    usual, *others = UNNAMED[between].items()
    name = next((other for own, other in others if params.get(own)), usual[1])
    for own, other in others:
        idle = LAWS.get(other).parameters.keys() - LAWS.get(name).parameters.keys()
        if given := sorted(each for each in idle if params.get(each)):
            raise InputError(f"{given[0]} = {params[given[0]]!r} without {own}: give {own} above 0, or leave it out")
    if name == "sticky" and (exponent := params.get("exponent", 2.0)) != 2:
        raise InputError(f"stickiness = {params['stickiness']!r} with exponent = {exponent!r}: sticky disks need 2")
    return LAWS.get(name)


def declared(
    params: Mapping[str, Any], units: str | None = None, between: Surfaces = "disks"
) -> Mapping[str, Parameter]:
    """Parameters of the law that the parameters of a packing name, by name: the strength that the units name, or those
    of all units, `law` where it is named, and the law's own. A law between other surfaces counts as none.

    Raises:
        InputError: no such law is known.
    """
    name = _named(params)
    return _declared(name if name is None or LAWS.get(name).between == between else None, units, between)


def _known(between: Surfaces) -> str:
    return f"use {', '.join(name for name, law in LAWS.each().items() if law.between == between)}"


def _named(params: Mapping[str, Any]) -> str | None:
    name = params.get("law")
    if name is not None and not isinstance(name, str):
        raise InputError(
            f"params['law'] is {name!r}: must be the name of a force law, one of {', '.join(LAWS.names())}"
        )
    return name


@cache
def _declared(name: str | None, units: str | None, between: Surfaces) -> Mapping[str, Parameter]:
    laws = [LAWS.get(each) for each in ([name] if name is not None else UNNAMED[between].values())]
    if units is not None and units not in laws[0].strengths:
        raise InputError(f"law {laws[0].name!r} has no units {units!r}: use {' or '.join(laws[0].strengths)}")
    found = {strength: each for strength, each in laws[0].strengths.items() if units in (None, strength)}
    if name is not None:
        found["law"] = Parameter(choices=(name,))
    for law in laws:
        found |= law.parameters
    return MappingProxyType(found)
