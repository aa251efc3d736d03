"""Every example in a docstring runs and prints what it says; every public name has one."""

import ast
import doctest
import functools
import inspect
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot

import jamlab

ROOT = Path(jamlab.__file__).parent
PICTURES = {"Micrograph", "track_droplets", "Micrograph.packing", "micrograph", "synthetic_micrograph"}
SLOW = PICTURES | {"FlowCurve.plot", "Running", "estimate", "write_movie"}  # a second and more


def documented(tree, prefix=""):
    """Name and docstring of every class and function of a file, methods as `Class.method`."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            name = prefix + node.name
            yield name, ast.get_docstring(node) or ""
            if isinstance(node, ast.ClassDef):
                yield from documented(node, f"{name}.")


def examples():
    """(name, doctest) of every docstring with an example; found in the files, so that nothing is imported for it."""
    for path in sorted(ROOT.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if ">>>" not in text:
            continue
        for name, words in documented(ast.parse(text)):
            if ">>>" in words:
                yield name, doctest.DocTestParser().get_doctest(words, {}, name, str(path), 0)


FOUND = list(examples())


def once(function):
    """The function, called once for the same arguments, unless it writes a file; packings are the same where they are
    one object, which lives as long as this does."""
    made, kept, signature = {}, [], inspect.signature(function)

    @functools.wraps(function)
    def call(*args, **kwargs):
        if "path" in kwargs or not kwargs.keys() <= signature.parameters.keys():
            return function(*args, **kwargs)
        given = signature.bind(*args, **kwargs).arguments
        kept.extend(each for each in given.values() if isinstance(each, jamlab.Packing))
        key = repr({name: id(each) if isinstance(each, jamlab.Packing) else each for name, each in given.items()})
        return made[key] if key in made else made.setdefault(key, function(*args, **kwargs))

    return call


@pytest.fixture(scope="module")
def made_once():
    """Names that examples use; the packings that most of them start from, and runs of these, are made once."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("jam", "pack", "flow_curve", "quasistatic_shear", "shear", "complex_modulus"):
            patch.setattr(jamlab, name, once(getattr(jamlab, name)))
        yield {"jamlab": jamlab, "np": np}


@pytest.mark.parametrize(
    "example",
    [pytest.param(test, id=name, marks=[pytest.mark.slow] * (name in SLOW)) for name, test in FOUND],
)
def test_example(example, made_once, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    example.globs.update(made_once)
    with matplotlib.rc_context({"backend": "agg"}):
        failures = doctest.DocTestRunner().run(example).failed
    pyplot.close("all")
    assert failures == 0, capsys.readouterr().out


def test_every_public_name_has_an_example():
    assert set(jamlab.__all__) - {"results"} - {name for name, _ in FOUND} == set()
