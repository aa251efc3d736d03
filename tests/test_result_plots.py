"""Every class with a method `plot` hands the style of its caller to matplotlib, as in `plot(axes, linewidth=2)`."""

import ast
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from one_of_each import objects

import jamlab


def classes_that_draw():
    """Names of the classes of the library that define `plot`; protocols only ask for one."""
    for path in Path(jamlab.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and "Protocol" not in map(ast.unparse, node.bases):
                if "plot" in (each.name for each in node.body if isinstance(each, ast.FunctionDef)):
                    yield node.name


def widths(thing, linewidth):
    """Line widths of all lines, collections and patches that a plot adds to axes."""
    axes = Figure().subplots()
    assert thing.plot(axes, linewidth=linewidth) is axes
    kinds = (axes.lines, axes.collections, axes.patches)
    return np.concatenate([np.ravel(each.get_linewidth()) for kind in kinds for each in kind])


def test_every_plot_takes_a_width_of_lines():
    """Twice the width is drawn twice as wide, by at least one artist; that of a force network is of the mean force."""
    drawn = {name: thing for name, thing in objects().items() if hasattr(thing, "plot")}
    known = {each.__name__ for thing in drawn.values() for each in type(thing).__mro__}
    defined = {*classes_that_draw()}
    assert len(defined) > 35 and defined <= known, f"{sorted(defined - known)}: add one to tests/support/one_of_each.py"
    kept = []
    for name, thing in drawn.items():
        thin, thick = widths(thing, 1.5), widths(thing, 3.0)
        if not (np.isclose(thick, 2 * thin) & (thin > 0)).any():
            kept.append(name)
    assert kept == [], "these drop the style"
