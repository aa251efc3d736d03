"""Names of version 0.2, which work for one more release with a warning."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from typing import Any, ParamSpec, TypeVar

from jamlab.errors import ArgumentError, InputError, warn
from jamlab.hints import argument_hint

P = ParamSpec("P")
R = TypeVar("R")

# old public name -> new one, in `jamlab`
FUNCTIONS = {
    "relaxed": "relax",
    "to_polygons": "droplets_from_disks",
    "held_motions": "maxwell_count",
    "slow_shear": "nonaffine_response",
    "mode_motion": "mode_character",
    "oscillating_displacements": "displacement_response",
    "collapse": "scaling_collapse",
    "equivalent_time": "effective_relaxation_time",
    "orientational_order": "hexatic_order",
    "without_rattlers": "remove_rattlers",
    "area_ratios": "relative_areas",
    "zero_modes": "count_zero_modes",
    "follow": "track_droplets",
    "measure_all": "measure",
    "write_data": "write",
    "write_dump": "write",
    "Border": "BoxStrains",
}
# old class -> new one, in `jamlab.results`; the other classes there have kept their names
CLASSES = {
    "HeldMotions": "MaxwellCount",
    "SlowShear": "NonaffineResponse",
    "ModeMotion": "ModeCharacter",
    "OrientationalOrder": "HexaticOrder",
}
_FLOW = {"out": "path", "background": "background_drag"}
# function -> old argument -> new one
ARGUMENTS = {
    "jam": {"large": "fraction_large", "ratio": "size_ratio"},
    "pack": {"large": "fraction_large", "ratio": "size_ratio"},
    "compress": {"nearest": "first_step", "error": "pressure_tolerance"},
    "contacts": {"min_force": "threshold"},
    "ContactDamping": {"arms": "lever_arms"},
    "shear": {"rows": "n_rows", "frames": "snapshot_every", **_FLOW},
    "quasistatic_shear": {"out": "path"},
    "flow_cost": {"background": "background_drag"},
    **dict.fromkeys(("flow_curve", "oscillate", "creep", "relax_stress", "stop_flow"), _FLOW),
}
# argument -> old value -> new one
VALUES = {"search": {"paper": "incremental"}, "start": {"carried": "from-disks", "scratch": "direct"}}

MODEL_NAMES = {"disks": "sp", "disk": "sp", "droplets": "dp", "polygons": "dp", "sp": "sp", "dp": "dp"}


def find(name: str, public: Iterable[str], classes: Iterable[str]) -> str:
    """Where a public name of 0.2 is today, as "results.NAME" or NAME, with a warning; "" for any other name.

    Args:
        name: as typed.
        public: names of the package.
        classes: names of `jamlab.results`.
    """
    new, class_name = FUNCTIONS.get(name, ""), CLASSES.get(name, name)
    where = new if new in public else f"results.{class_name}" * (class_name in classes)
    if where:
        _warn(f"jamlab.{name}", f"jamlab.{where}")
    return where


def today(function: str, given: dict[str, Any], known: Iterable[str], others: bool = False) -> dict[str, Any]:
    """Arguments under their current names; each old one with a warning, an unknown one by an error, unless a
    function takes `others` too and checks them itself."""
    names, old = dict.fromkeys(known), ARGUMENTS.get(function, {})
    found: dict[str, Any] = {}
    for name, value in given.items():
        new = old[name] if name in old and name not in names else name
        if new in found or (new != name and new in given):
            raise InputError(
                f"{function}: {name} = {value!r} is the old name of {new}, which is given as well; give one of them"
            )
        if new != name:
            _warn(f"{function}({name}=...)", f"{function}({new}=...)")
        elif name not in names and not others:
            raise unknown_argument(function, name, names)
        found[new] = value
    return found


def unknown_argument(function: str, name: str, known: Iterable[str]) -> ArgumentError:
    """The error of an argument that a function does not have."""
    return ArgumentError(f"{function} has no argument {name!r}{argument_hint(name, function, known)}")


def n_first(function: Callable[P, R]) -> Callable[P, R]:
    """Take the model before n too, the order of 0.2, with a warning."""

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if not (args and isinstance(args[0], str)):
            return function(*args, **kwargs)
        name = function.__name__
        _warn(f"{name}(model, n, seed)", f"{name}(n, model, seed)")
        swapped: Any = dict(zip(("model", "n", "seed"), args, strict=False)) | kwargs
        return function(**swapped)  # type: ignore[call-arg]  # P names none

    return call


def value_today(argument: str, value: str) -> str:
    """The current value of a choice; an old one with a warning."""
    new = VALUES[argument].get(value, value)
    if new != value:
        _warn(f"{argument}={value!r}", f"{argument}={new!r}")
    return new


def _warn(old: str, new: str) -> None:
    warn(f"{old} is now {new}", FutureWarning)
