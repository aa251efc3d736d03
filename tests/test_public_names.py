"""Public names of jamlab are what they claim, and enough to call every function; what prompts show of results."""

import ast
import inspect
import pydoc
import subprocess
import sys
import typing
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

import jamlab

STUB = Path(jamlab.__file__).with_suffix(".pyi")
EVERYTHING = """
import importlib, pkgutil, sys, types, jamlab
for module in pkgutil.walk_packages(jamlab.__path__, "jamlab."):
    if not module.name.endswith(("__main__", "_peer")):  # the first would run, the others need codes of other people
        importlib.import_module(module.name)
hidden = [name for name in jamlab.__all__ if name != "results" and not callable(getattr(jamlab, name))]
assert not hidden, hidden
p = jamlab.Packing("sp", [[2.0, 0.0], [0.0, 2.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
assert "z" in jamlab.measure(p)
assert jamlab.packing_fraction(p) == jamlab.measure(p)["rho"]
"""


def names():
    """Name -> (module, name there), as the stub re-exports them."""
    found = {}
    for line in ast.parse(STUB.read_text()).body:
        if isinstance(line, ast.ImportFrom) and line.module:
            found |= {alias.asname: (f"jamlab.{line.module}", alias.name) for alias in line.names}
    return found


def test_every_name_is_the_class_or_function_of_its_module():
    assert set(names()) == set(jamlab.__all__) - {"results"} and len(names()) > 70
    for name, (module, original) in names().items():
        thing = getattr(jamlab, name)
        assert inspect.isclass(thing) or inspect.isfunction(thing), name
        assert (thing.__module__, thing.__name__) == (module, original) and thing.__doc__


def test_help_opens_with_words():
    """numpy's array types fill ten lines where they are written out."""
    for name in jamlab.__all__:
        thing = getattr(jamlab, name)
        if inspect.isfunction(thing):
            signature = pydoc.render_doc(thing, renderer=pydoc.plaintext).splitlines()[2]
            assert "numpy" not in signature and len(signature) < 600, signature
    assert jamlab.__version__.count(".") == 2


@pytest.mark.slow
def test_functions_stay_functions_after_every_module_was_imported():
    """A module named as a function, such as `measure`, must not take its place."""
    line = [sys.executable, "-W", "error", "-c", EVERYTHING]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


# results of one function that spare another the same work; nobody makes them by hand
HANDED_ON = (
    "Campaign DataFrame FlowRun Run DiskCells ForceNetwork VertexContacts Pairs EnsembleWay WayRecord Outcome".split()
)


def public_functions():
    """Name and function of every public function and of every public method."""
    for name in jamlab.__all__:
        thing = getattr(jamlab, name)
        members = {name: thing} if inspect.isfunction(thing) else vars(thing) if inspect.isclass(thing) else {}
        for member, value in members.items():
            found = getattr(value, "__func__", value)
            if inspect.isfunction(found) and not member.startswith("_"):
                yield f"{name}.{member}", inspect.unwrap(found)


def classes_in(hint):
    """All classes that stand in an annotation."""
    if inspect.isclass(hint) and not typing.get_args(hint):
        yield hint
    for part in hint if isinstance(hint, list) else typing.get_args(hint):
        yield from classes_in(part)


def arguments_of(function):
    for name, hint in function.__annotations__.items():
        if name != "return":
            known = (
                vars(jamlab)
                | vars(jamlab.results)
                | vars(typing)
                | {"Axes": object, "pd": object, "sparse": sparse}
                | function.__globals__
            )
            yield name, eval(hint, known) if isinstance(hint, str) else hint


def test_no_argument_has_a_type_that_is_not_public():
    hidden = {
        (name, argument, kind.__name__)
        for name, function in public_functions()
        for argument, hint in arguments_of(function)
        for kind in classes_in(hint)
        if kind.__module__.startswith("jamlab")
        and getattr(jamlab if kind.__name__ in jamlab.__all__ else jamlab.results, kind.__name__, None) is not kind
        and kind.__name__ not in HANDED_ON
    }
    assert not hidden


@pytest.mark.parametrize("model", ["sp", "dp"])
def test_reprs_are_short_and_say_what_is_there(model, sp_jammed, dp_dense):
    packing = {"sp": sp_jammed, "dp": dp_dense}[model]
    assert f"n={packing.n}" in repr(packing) and "converged=True" in repr(packing)
    results = (jamlab.voids(packing), jamlab.contacts(packing), jamlab.elastic_tensor(packing))
    for thing in (packing, *results, jamlab.complex_modulus(packing, np.logspace(-3, 1, 5))):
        assert len(repr(thing)) < 250 and "\n" not in repr(thing), repr(thing)
    assert "omega=(5,) float64" in repr(thing) and f"g0={thing.g0:.6g}" in repr(thing)


def test_a_repr_shows_the_law_where_it_is_not_the_usual_one():
    """Of droplets without a recipe nothing tells which values are usual: all of the law are shown."""
    usual = [jamlab.pack(8, phi=0.9), jamlab.pack(8, phi=0.9, units="eps", law="harmonic"), jamlab.jam(4, "dp", seed=1)]
    assert not any("law=" in repr(packing) for packing in usual)
    hertz = jamlab.pack(8, phi=0.9, law="hertz")
    assert "law={'exponent': 2.5}" in repr(hertz) and "law={'exponent': 2.5}" in repr(
        hertz.with_state(positions=hertz.positions)
    )
    droplets = jamlab.jam(4, "dp", seed=1, law={"gamma": 0.3})
    assert "law={'gamma': 0.3}" in repr(droplets)
    params = {**droplets.params, "gamma": 0.2}
    other = jamlab.Packing("dp", droplets.box, droplets.positions, params, offsets=droplets.offsets)
    assert all(f"{name!r}: {other.params[name]!r}" in repr(other) for name in ("gamma", "ka", "delta"))
    strong = jamlab.Packing("sp", hertz.box, hertz.positions, {"k": 3.0}, diameters=hertz.diameters, units="k")
    assert "law={'k': 3.0}" in repr(strong)


def test_notebooks_show_a_picture(random_polygons):
    png = random_polygons(0.3)._repr_png_()
    assert png.startswith(b"\x89PNG") and 5_000 < len(png) < 200_000
