"""Names of version 0.2, which work for one more release with a warning; names typed from habit, with a hint."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import Any, ParamSpec, TypeVar

from jamlab.errors import ArgumentError, InputError, warn

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

# what users of other programs look for, in `jamlab` or in a packing -> what jamlab has; what it measures besides, see
# `jamlab.packing.quantities`
HABITS = {
    **dict.fromkeys(("load", "open"), "jamlab.read(path)"),
    "save": "jamlab.write(path, packings)",
    **dict.fromkeys(("minimize", "relax", "fire"), "jamlab.relax(packing)"),
    "quench": "jamlab.jam, or jamlab.pack at a pressure",
    "compress": "jamlab.compress(packing, to=...)",
    **dict.fromkeys(("stress", "energy", "forces"), "jamlab.evaluate(packing)"),
    **dict.fromkeys(("contacts", "coordination", "coordination_number", "rattlers"), "jamlab.contacts(packing)"),
    **dict.fromkeys(("rdf", "structure_factor", "to_ase"), "jamlab.universe(packing), or jamlab.write(path, packing)"),
    "psi6": "jamlab.hexatic_order(packing)",
    "G": "jamlab.shear_modulus(packing)",
    "young_modulus": "jamlab.elastic_tensor(packing)",
    "Simulation": "jamlab.Session(packing)",
    "set_num_threads": "the argument ranks of jamlab.jam or jamlab.pack",
    "velocities": "jamlab.shear(packing, rate): packings are at rest",
    **dict.fromkeys(("neighbors", "voronoi"), "jamlab.tessellation(packing)"),
    "density": "packing.phi, or jamlab.packing_fraction(packing)",
    **dict.fromkeys(("plot", "draw", "show"), "packing.plot(), or .plot() of any result"),
    **dict.fromkeys(("modes", "dos"), "jamlab.lowest_modes(packing)"),
    **dict.fromkeys(("hessian", "dynamical_matrix"), "jamlab.hessian(packing)"),
    "modulus": "jamlab.shear_modulus(packing)",
    "gstar": "jamlab.complex_modulus(packing, omega)",
    "simulate": "jamlab.shear(packing, rate), or jamlab.quasistatic_shear",
    "measure": "jamlab.measure(packing)",
    **dict.fromkeys(("to_dataframe", "to_csv"), "jamlab.measure(packings), a table of observables"),
    **dict.fromkeys(("Disks", "Droplets"), "jamlab.Packing"),
    **dict.fromkeys(("radii", "radius"), "packing.diameters / 2"),
    "copy": "the packing itself: packings never change; packing.with_state(...) makes another",
    **dict.fromkeys(("cell", "volume", "lx", "Lx"), "packing.box, or packing.area"),
    "N": "packing.n",
    "types": "packing.diameters, since a particle has a size, no type",
    "masses": "jamlab.shear(packing, rate): motion is overdamped, without masses",
    "images": "jamlab.contacts(packing).shift, of every contact",
    "test": "the command `jamlab doctor`",
    **dict.fromkeys(("coords", "get_positions", "wrap"), "packing.positions"),
}
# what users look for in a result -> what it may have
OF_RESULTS = {
    **dict.fromkeys(("gprime", "G1"), "storage"),
    **dict.fromkeys(("gdoubleprime", "G2"), "loss"),
    **dict.fromkeys(("frequency", "frequencies", "freq"), "omega"),
    "tan_delta": "loss / storage",
    **dict.fromkeys(("to_csv", "save"), "to_dataframe().to_csv(path)"),
    "sigma": "stress",
    "viscosity": "stress over rate",
    "coordination": "z",
    **dict.fromkeys(("overlaps", "normal_forces"), "forces, with gap and size"),
}
# arguments typed from habit -> the argument meant, or what to do
MEANT = {
    **dict.fromkeys(("N", "num", "n_particles"), "n"),
    **dict.fromkeys(("random_state", "rng"), "seed"),
    "polydispersity": "sizes, such as sizes='lognormal:0.2'",
    "verbose": "progress, such as progress=True",
    **dict.fromkeys(("tol", "ftol", "force_tol"), "tolerance, the largest force at a minimum"),
    "n_jobs": "processes",
    **dict.fromkeys(("threads", "cores"), "ranks"),
    "dt": "tolerance: time steps follow from the error they may make",
    "filename": "path",
    **dict.fromkeys(("frequency", "freq", "frequencies"), "omega"),
    "sigma": "stress",
    "radii": "diameters",
    "p": "pressure",
    **dict.fromkeys(("dphi", "drho", "n_steps"), "step"),
    **dict.fromkeys(("potential", "alpha"), "exponent, such as exponent=2.5 for Hertzian disks"),
    **dict.fromkeys(("box_length", "box_size"), "n: the size of the box follows"),
    **dict.fromkeys(("dim", "friction", "gravity", "temperature"), "another code: docs/explanation/limits.md"),
    **dict.fromkeys(("gamma_dot", "shear_rate"), "rate"),
    "pressure": "jamlab.pack, which makes packings at a pressure",
    **dict.fromkeys(("phi", "rho", "packing_fraction", "density"), "jamlab.compress(packing, to=...), from onset"),
}


def find(name: str) -> Any:
    """A public name of 0.2, with a warning; an AttributeError that says what to use for any other name."""
    results = importlib.import_module("jamlab.results")
    package = importlib.import_module("jamlab")
    if name in FUNCTIONS:
        _warn(f"jamlab.{name}", f"jamlab.{FUNCTIONS[name]}")
        return getattr(package, FUNCTIONS[name])
    if (new := CLASSES.get(name, name)) in results.__all__:
        _warn(f"jamlab.{name}", f"jamlab.results.{new}")
        return getattr(results, new)
    raise AttributeError(f"module 'jamlab' has no attribute {name!r}{hint(name, package.__all__)}", name=name)


def hint(name: str, known: Iterable[str] = (), habits: Mapping[str, str] = HABITS) -> str:
    """What is meant by a name that does not exist, as the end of a message; "" where nothing is like it."""
    if name in habits:
        return f": use {habits[name]}"
    if name in importlib.import_module("jamlab.packing.quantities").MEASURED:
        return f": use jamlab.measure(packing, {name!r})"
    near = get_close_matches(name, list(known), 1, 0.6)
    return f": did you mean {near[0]!r}?" if near else ""


def today(function: str, given: dict[str, Any], known: Iterable[str], others: bool = False) -> dict[str, Any]:
    """Arguments under their current names; each old one with a warning, an unknown one by an error, unless a
    function takes `others` too and checks them itself."""
    names, old = set(known), ARGUMENTS.get(function, {})
    found: dict[str, Any] = {}
    for name, value in given.items():
        new = old[name] if name in old and name not in names else name
        if new in found or (new != name and new in given):
            raise InputError(
                f"{function}: {name} = {value!r} is the old name of {new}, which is given as well; give one of them"
            )
        if new != name:
            _warn(f"{function}({name}=...)", f"{function}({new}=...)")
        elif name not in names and (not others or name in MEANT):
            raise unknown_argument(function, name, names)
        found[new] = value
    return found


def unknown_argument(function: str, name: str, known: Iterable[str]) -> ArgumentError:
    """The error of an argument that a function does not have."""
    return ArgumentError(
        f"{function} has no argument {name!r}{hint(name, known, MEANT) or '; it takes ' + ', '.join(known)}"
    )


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
