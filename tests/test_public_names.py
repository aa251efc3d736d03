"""Public names of jamlab are what they claim, whatever was imported before."""

import ast
import inspect
import pydoc
import subprocess
import sys
from pathlib import Path

import pytest

import jamlab

STUB = Path(jamlab.__file__).with_suffix(".pyi")
EVERYTHING = """
import importlib, pkgutil, sys, types, jamlab
for module in pkgutil.walk_packages(jamlab.__path__, "jamlab."):
    if not module.name.endswith(("__main__", "_peer")):  # the first would run, the others need codes of other people
        importlib.import_module(module.name)
hidden = [name for name in jamlab.__all__ if not callable(getattr(jamlab, name))]
assert not hidden, hidden
p = jamlab.Packing("sp", [[2.0, 0.0], [0.0, 2.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
assert "z" in jamlab.measure(p)
assert jamlab.packing_fraction(p) == jamlab.measure(p)["rho"]
"""


def names():
    """Name -> (module, name there), as the stub re-exports them."""
    found = {}
    for line in ast.parse(STUB.read_text()).body:
        if isinstance(line, ast.ImportFrom):
            found |= {alias.asname: (f"jamlab.{line.module}", alias.name) for alias in line.names}
    return found


def test_every_name_is_the_class_or_function_of_its_module():
    assert set(names()) == set(jamlab.__all__) and len(names()) > 70
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
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", EVERYTHING], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
