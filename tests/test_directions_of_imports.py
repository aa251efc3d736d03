"""No import runs against the layers of `pyproject.toml`, by whatever way: in a function, by a string, or by the face.

import-linter reads import statements alone, and takes no notice of the package itself, which names what lies high.
"""

import ast
import graphlib
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONTRACTS = SETTINGS["tool"]["importlinter"]["contracts"]
LAYERS = [line.replace(" ", "").split("|") for each in CONTRACTS for line in each.get("layers", ())]
LEVEL = {name: level for level, names in enumerate(reversed(LAYERS)) for name in names}
FORBIDDEN = [each for each in CONTRACTS if each["type"] == "forbidden"]
# some are named as the module that has them; of observables jamlab itself declares none
GROUPS = {*SETTINGS["project"]["entry-points"], "jamlab.observables"}
FACE = "jamlab"
NAMED = re.compile(r"jamlab(\.\w+)*(:[\w.]+)?")


def module_of(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {module_of(path): path for path in sorted((ROOT / "jamlab").rglob("*.py"))}


class Imports(ast.NodeVisitor):
    """Modules of jamlab that a module names: by statements anywhere, for types alone as well, and by strings."""

    def __init__(self, module, package):
        self.found, self._module, self._package = set(), module, package

    def visit_Import(self, node):
        self.found |= {part for alias in node.names if (part := existing(alias.name))}

    def visit_ImportFrom(self, node):
        base = self._package.split(".")[: 1 - node.level or None] if node.level else []
        start = ".".join([*base, *([node.module] if node.module else [])])
        self.found |= {part for alias in node.names if (part := existing(f"{start}.{alias.name}"))}

    def visit_Expr(self, node):
        if not isinstance(node.value, ast.Constant):  # a docstring
            self.generic_visit(node)

    def visit_Call(self, node):
        if ast.unparse(node.func).rpartition(".")[2] in ("import_module", "__import__") and node.args:
            name = node.args[0]
            text = name.values[0] if isinstance(name, ast.JoinedStr) else name
            if isinstance(text, ast.Constant) and text.value.startswith((".", "jamlab")):
                whole = isinstance(name, ast.Constant) and text.value[0] != "."
                assert whole, f"{self._module}: {ast.unparse(node)} hides what it imports"
                self.found.add(existing(text.value))
        self.generic_visit(node)

    def visit_Constant(self, node):
        text = node.value
        if isinstance(text, str) and text not in {FACE, *GROUPS} and NAMED.fullmatch(text):
            self.found.add(existing(text.partition(":")[0]))


def existing(name):
    """The module that a dotted name leads to; None if it is not one of jamlab."""
    parts = name.split(".")
    return next((part for n in range(len(parts), 0, -1) if (part := ".".join(parts[:n])) in SOURCES), None)


def imports(source, module, package=None):
    reader = Imports(module, package or module.rpartition(".")[0])
    reader.visit(ast.parse(source))
    return reader.found - {module, None}


@cache
def graph():
    edges = {
        module: imports(path.read_text(encoding="utf-8"), module, module if path.stem == "__init__" else None)
        for module, path in SOURCES.items()
    }
    edges[FACE] |= imports((ROOT / "jamlab" / "__init__.pyi").read_text(encoding="utf-8"), FACE, FACE)
    return edges


def level(module):
    """Its layer, counted from the ground; the face lies over all that it names."""
    if module == FACE:
        return max(map(level, graph()[FACE])) + 0.5
    return LEVEL[module.split(".")[1]]


def runs_up(module, other):
    """Whether a module may not import another."""
    own, its = module.split(".")[1:2], other.split(".")[1:2]
    if any(begins(module, each["source_modules"]) and begins(other, each["forbidden_modules"]) for each in FORBIDDEN):
        return True
    return own != its and module != FACE and level(module) <= level(other)


def begins(module, names):
    return any(f"{module}.".startswith(f"{name}.") for name in names)


def test_no_module_names_one_above_it():
    assert len(LEVEL) > 20 and len(SOURCES) > 200 and len(FORBIDDEN) > 2
    assert not {(module, other) for module in graph() for other in graph()[module] if runs_up(module, other)}


def test_imports_form_no_circle():
    """Those in functions, for types and by strings as well."""
    graphlib.TopologicalSorter(graph()).prepare()
    with pytest.raises(graphlib.CycleError):
        graphlib.TopologicalSorter(graph() | {"jamlab.errors": {"jamlab.cli.main"}}).prepare()


def test_units_of_the_plugin_form_no_circle():
    """A header and the source file of its name are one unit, which includes others."""
    files = [path for path in (ROOT / "plugin").rglob("*") if path.suffix in (".cpp", ".h")]
    unit = {path.name: path.stem for path in files}
    assert len(unit) == len(files) > 80
    included = {stem: set() for stem in unit.values()}
    for path in files:
        names = re.findall(r'#include "(?:.*/)?([^"/]+)"', path.read_text(encoding="utf-8"))
        included[path.stem] |= {unit[name] for name in names if name in unit} - {path.stem}
    assert sum(map(len, included.values())) > 80
    graphlib.TopologicalSorter(included).prepare()


@pytest.mark.parametrize(
    "text",
    [
        "from jamlab.models.disks import DISKS",
        "from jamlab.models import disks",
        "from ..models import disks",
        "def f():\n    from jamlab.models.disks import DISKS",
        "def f():\n    import jamlab.models.disks as m",
        "import_module('jamlab.models.disks')",
        "PLACE = 'jamlab.models.disks:DISKS'",
        "if TYPE_CHECKING:\n    import os\nelse:\n    import jamlab.models.disks",
        "if TYPE_CHECKING:\n    from jamlab.models.disks import DISKS",
        "sys.modules['jamlab.models.disks'].DISKS",
    ],
)
def test_every_way_to_import_is_seen(text):
    assert imports(text, "jamlab.packing.packing") == {"jamlab.models.disks"}
    assert runs_up("jamlab.packing.packing", "jamlab.models.disks")


def test_what_imports_nothing_is_none():
    text = '"""jamlab.models.disks"""\nimport numpy'
    assert not imports(text, "jamlab.packing.packing")
    assert imports("def f():\n    import jamlab", "jamlab.packing.packing") == {FACE}
    assert runs_up("jamlab.figures.save_picture", FACE) and not runs_up("jamlab.cli.jam", FACE)
    assert runs_up("jamlab.rheology.damping", "jamlab.engine.session")  # by a contract of its own
    for hidden in ("import_module(f'jamlab.{name}')", "import_module('.disks', 'jamlab.models')"):
        with pytest.raises(AssertionError, match="hides"):
            imports(hidden, "jamlab.packing.packing")
