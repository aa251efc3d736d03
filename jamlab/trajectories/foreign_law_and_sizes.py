"""Complete the force law and the sizes of particles of foreign files: by the file, the user, or the decks' defaults."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jamlab.arrays import Array
from jamlab.checks import check_choice, finite_array, is_number
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.packing.law_parameters import FORCE_LAW, OPTIONAL, UNITS

Radii = ArrayLike | Mapping[Any, float] | None


def complete_force_law(
    model: str, found: Mapping[str, Any], units: str | None, params: Mapping[str, Any] | None
) -> tuple[str, dict[str, Any], list[str]]:
    """Complete the force law of a file, rest areas apart, with what the user gives; units are "eps" if neither says.
    Returns units, parameters, and the names of those found in neither, which have the defaults of the decks."""
    chosen = str(found.get("units", units or "eps"))
    check_choice("units", chosen, UNITS)
    if (model, chosen) not in FORCE_LAW:
        raise InputError(f"model {model} has no units {chosen!r}")
    names = [name for name in (*FORCE_LAW[model, chosen], *OPTIONAL[model]) if name != "a0"]
    given = {name: value for name, value in (params or {}).items() if name != "a0"}
    for name in given:
        if name not in names:
            raise InputError(f"model {model} in units {chosen} has no parameter {name!r}: use {', '.join(names)}")
    for name, value in {**given, **({} if units is None else {"units": units})}.items():
        if name in found and found[name] != value:
            raise InputError(f"{name} = {value!r} was given, but the source has {found[name]!r}")
    known = {name: given.get(name, found.get(name)) for name in names}
    law = {name: value for name, value in known.items() if value is not None}
    assumed = [name for name in names if name not in law and name not in OPTIONAL[model]]
    return chosen, law | {name: defaults(model)[name] for name in assumed}, assumed


def deck_diameters(types: NDArray[np.str_]) -> Array | None:
    """(n,) diameters of disks of type 1 (small) and 2 (large) of the decks; None if there are other types."""
    small = 2 / (1 + float(defaults("sp")["ratio"]))
    sizes = {"1": small, "2": float(defaults("sp")["ratio"]) * small}
    if not set(types.tolist()) <= set(sizes):
        return None
    return np.array([sizes[name] for name in types.tolist()])


def deck_rest_areas(vertices: NDArray[np.int64]) -> Array | None:
    """(n,) rest areas of the decks' droplets by their number of vertices; None if the decks have no such droplets."""
    law = defaults("dp")
    sizes = np.array([float(law["nv_small"]), float(law["nv_large"])])
    if not np.isin(vertices, sizes).all():
        return None
    return np.asarray((2 * vertices / sizes.sum()) ** 2)


def given_radii(radii: Radii, types: NDArray[np.str_]) -> Array | None:
    """(n,) radii of disks: one number, one for each disk, or one for each type."""
    if radii is None:
        return None
    if isinstance(radii, Mapping):
        by_type = {str(name): value for name, value in radii.items()}
        missing = sorted(set(types.tolist()) - set(by_type))
        if missing:
            raise InputError(
                f"radii has no type {missing[0]!r}: give a radius for each of {sorted(set(types.tolist()))}"
            )
        radii = [by_type[name] for name in types.tolist()]
    elif is_number(radii):
        radii = np.full(len(types), radii)
    return finite_array("radii", radii, (len(types),))
