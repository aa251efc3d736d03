"""Constants of jamlab's modules: their list, and jamlab imported with one of them scaled.

A module constant is a name in capitals that a statement at the level of a module gives a value. A field is a number in
a frozen class all of whose fields have defaults, such as the settings of a minimiser.
"""

from __future__ import annotations

import ast
import importlib.abc
import importlib.machinery
import importlib.util
import re
import sys
from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

NAME = re.compile(r"_*[A-Z][A-Z0-9_]*")
FIELD = re.compile(r"int|float|tuple\[[\w, .]*\]")
CHECKS = re.compile(r"(\w+\.)*(check_\w+|Field|Parameter|Limits?|Bound\w*|Between|Range)$")
DEFINED = re.compile(  # codes of others, units, directions, colours: what they are is not ours to choose
    r"packing\.quantities\.|packing\.strain_map\.(?!_ROUNDING)|packing\.deformation\.|_TURN$|METRES|LOSSY_TIFF|_NO_LOCKS|_NO_SPACE"
    r"|_SIGNALS|_PR_SET|_MODE$|_NO_MEMORY|_TOO_MANY_IMAGES|_OUTLINES_CROSS|decimal_point\.|WHOLE|_TOO_SMALL|_NOT_FINITE"
    r"|labels\.LAST|illumination\.MAD|PLATEAU_BORDER|\._IMAGES|_TOO_MANY_IMAGES|_FLOAT32|SIZE_NAMES|_EPS|seed|SEED$"
)
VERSION = re.compile(r"(DEFINITION|PROTOCOL|VERSION)$")


@dataclass(frozen=True)
class Constant:
    """A name of a module, or a field of a class of settings.

    Attributes:
        module: dotted name.
        name: NAME, or Class.field.
        line: where it gets its value.
        text: its value, as written.
        plain: a statement for it alone; else one of several names that share a statement.
    """

    module: str
    name: str
    line: int
    text: str
    plain: bool

    @property
    def label(self) -> str:
        return f"{self.module.removeprefix('jamlab.')}.{self.name}"


def _targets(statement: ast.stmt) -> list[tuple[ast.expr, ast.expr | None, bool]]:
    """Name, value and whether it stands alone, of every name that a statement gives a value."""
    if isinstance(statement, ast.AnnAssign):
        return [(statement.target, statement.value, True)]
    if not isinstance(statement, ast.Assign):
        return []
    found: list[tuple[ast.expr, ast.expr | None, bool]] = []
    for target in statement.targets:
        if isinstance(target, ast.Tuple):
            given = isinstance(statement.value, ast.Tuple) and len(statement.value.elts) == len(target.elts)
            values = statement.value.elts if given else [statement.value] * len(target.elts)
            found += [(name, value, False) for name, value in zip(target.elts, values, strict=True)]
        else:
            found.append((target, statement.value, True))
    return found


def _is_settings(statement: ast.stmt) -> bool:
    if not isinstance(statement, ast.ClassDef) or not statement.decorator_list:
        return False
    if "frozen=True" not in ast.unparse(statement.decorator_list[0]):
        return False
    fields = [each for each in statement.body if isinstance(each, ast.AnnAssign)]
    return statement.name not in ("Parameter", "Scales") and len(fields) > 1 and all(each.value for each in fields)


def constants_of(module: str, source: str) -> list[Constant]:
    """All constants of a module, in the order of its lines."""
    found = []
    for statement in ast.parse(source).body:
        for target, value, plain in _targets(statement):
            if isinstance(target, ast.Name) and NAME.fullmatch(target.id) and value is not None:
                found.append(Constant(module, target.id, statement.lineno, ast.unparse(value), plain))
        if _is_settings(statement):
            for each in statement.body:
                if isinstance(each, ast.AnnAssign) and FIELD.fullmatch(ast.unparse(each.annotation)):
                    name = f"{statement.name}.{ast.unparse(each.target)}"
                    found.append(Constant(module, name, each.lineno, ast.unparse(each.value), True))
    return found


class Tree:
    """Sources of jamlab, read once.

    Args:
        folder: the one that holds jamlab.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.paths = {self._module(path): path for path in sorted((folder / "jamlab").rglob("*.py"))}
        self.trees = {module: ast.parse(path.read_text()) for module, path in self.paths.items()}

    def _module(self, path: Path) -> str:
        parts = path.relative_to(self.folder).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    @cached_property
    def constants(self) -> list[Constant]:
        return [each for module, path in self.paths.items() for each in constants_of(module, path.read_text())]

    def value(self, constant: Constant) -> object:
        """What the name holds in this process; imports the module."""
        found = __import__(constant.module, fromlist=["_"])
        for part in constant.name.split("."):
            found = getattr(found, part, None)
        return found

    def kind(self, constant: Constant) -> str:
        """version, number, numbers (tuple, dictionary or array of numbers) or other."""
        if VERSION.search(constant.name):
            return "version"
        value = self.value(constant)
        if isinstance(value, bool) or value is None:
            return "other"
        if isinstance(value, int | float):
            return "number"
        inside = list(value.values()) if isinstance(value, dict) else value
        if isinstance(inside, tuple | list | np.ndarray) and len(inside):
            array = np.array(inside, dtype=object).ravel()
            if all(isinstance(each, int | float) and not isinstance(each, bool) for each in array):
                return "numbers"
        return "other"

    @cached_property
    def _uses(self) -> dict[tuple[str, str], set[tuple[str, str]]]:
        """(module, name) -> what names it: lines "=12" of functions, "12" of those with such a default, or names at the
        level of the module."""
        found: dict[tuple[str, str], set[tuple[str, str]]] = defaultdict(set)
        for module, tree in self.trees.items():
            known, modules = self._names(module, tree)
            for place, node in _places(tree):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                    origin = known.get(node.id, (module, node.id))
                elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules:
                    origin = (modules[node.value.id], node.attr)
                else:
                    continue
                found[origin] |= {(module, each) for each in place}
        return found

    def _names(self, module: str, tree: ast.AST) -> tuple[dict[str, tuple[str, str]], dict[str, str]]:
        known, modules = {}, {}
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                base = module.split(".") if self.paths[module].name == "__init__.py" else module.split(".")[:-1]
                base = base[: len(base) - node.level + 1] if node.level else []
                source = ".".join([*base, *([node.module] if node.module else [])])
                for each in node.names:
                    inner = f"{source}.{each.name}"
                    if inner in self.paths:
                        modules[each.asname or each.name] = inner
                    else:
                        known[each.asname or each.name] = (source, each.name)
        return known, modules

    def lines(self, constant: Constant) -> set[tuple[str, int]]:
        """(module, line) of the functions that read it, also through names, defaults and classes made of it."""
        found, seen = set(), set()
        todo = [(constant.module, constant.name.split(".")[0])]
        if "." in constant.name:
            return self._lines_of_field(constant)
        while todo:
            each = todo.pop()
            if each in seen:
                continue
            seen.add(each)
            for module, place in self._uses.get(each, ()):
                if place.strip("=").isdigit():
                    found.add((module, int(place.strip("="))))
                else:
                    todo.append((module, place))
        return found

    def _lines_of_field(self, constant: Constant) -> set[tuple[str, int]]:
        """Where it is read from an object of its module; else wherever an attribute has its name, or the
        object is named."""
        owner, field = constant.name.split(".")
        made = {
            (constant.module, target.id)
            for statement in self.trees[constant.module].body
            for target, value, _ in _targets(statement)
            if isinstance(target, ast.Name) and isinstance(value, ast.Call) and ast.unparse(value.func) == owner
        }
        exact, others, whole = set(), set(), set()
        for module, tree in self.trees.items():
            known, _ = self._names(module, tree)
            for node in ast.walk(tree):
                if isinstance(node, ast.Name) and known.get(node.id, (module, node.id)) in made:
                    whole.add((module, node.lineno))
                if isinstance(node, ast.Attribute) and node.attr == field:
                    others.add((module, node.lineno))
                    name = ast.unparse(node.value)
                    if known.get(name, (module, name)) in made:
                        exact.add((module, node.lineno))
        return exact or others or whole

    def is_plain(self, constant: Constant) -> bool:
        """Only functions name it: nothing at the level of a module, no default and no class is made of it."""
        places = self._uses.get((constant.module, constant.name), ()) if "." not in constant.name else ()
        return all(place.startswith("=") for _, place in places)

    def aliases(self, constant: Constant) -> list[tuple[str, str]]:
        """(module, name) that import it."""
        found = []
        for module, tree in self.trees.items():
            known, _ = self._names(module, tree)
            found += [(module, name) for name, origin in known.items() if origin == (constant.module, constant.name)]
        return found

    def sort(self, constant: Constant, kinds: dict[str, str]) -> str:
        """version, limit (only checks of arguments name it), tunable (numbers), or other (words, tables, types)."""
        kind = kinds.get(constant.label, "other")
        if kind not in ("number", "numbers"):
            return kind
        if DEFINED.search(constant.label):
            return "definition"
        checks = self._in_checks.get((constant.module, constant.name), [])
        return "limit" if checks and all(checks) else "tunable"

    @cached_property
    def _in_checks(self) -> dict[tuple[str, str], list[bool]]:
        """(module, name) -> for every place that names it, whether that is a check of an argument."""
        found: dict[tuple[str, str], list[bool]] = defaultdict(list)
        for module, tree in self.trees.items():
            known, modules = self._names(module, tree)

            def visit(node: ast.AST, inside: bool, known=known, modules=modules, module=module) -> None:
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                    found[known.get(node.id, (module, node.id))].append(inside)
                elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules:
                    found[modules[node.value.id], node.attr].append(inside)
                inner = inside or (isinstance(node, ast.Call) and bool(CHECKS.match(ast.unparse(node.func))))
                for child in ast.iter_child_nodes(node):
                    visit(child, inner)

            visit(tree, False)
        return found


def _places(tree: ast.Module) -> list[tuple[set[str], ast.AST]]:
    """Every node, with the lines where it is run, or the names at the level of the module that are made of it."""
    found: list[tuple[set[str], ast.AST]] = []
    _visit(tree, None, found)
    return found


def _visit(node: ast.AST, place: set[str] | None, found: list[tuple[set[str], ast.AST]]) -> None:
    """`place`: names or lines that stand for the node; "*" is its own line, None the level of the module."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        outer = (place or set()) | _body_lines(node)
        parts: list[tuple[ast.AST, set[str]]] = [(each, {"*"}) for each in node.body]
        parts += [(each, outer) for each in (*node.decorator_list, node.args, node.returns) if each]
    elif isinstance(node, ast.ClassDef):
        inner = {node.name}.union(*(_body_lines(each) for each in ast.walk(node) if isinstance(each, ast.FunctionDef)))
        parts = [(each, inner) for each in (*node.decorator_list, *node.bases, *node.keywords, *node.body)]
    elif isinstance(node, ast.Lambda):
        parts = [(node.args, place or set()), (node.body, {"*", *(place or set())})]
    else:
        place = _made_of(node) if place is None else place
        here = (place or set()) - {"*"}
        if "*" in (place or ()) and hasattr(node, "lineno"):
            here = here | {f"={node.lineno}"}
        found.append((here, node))
        for child in ast.iter_child_nodes(node):
            _visit(child, place, found)
        return
    for each, where in parts:
        _visit(each, where, found)


def _body_lines(function: Any) -> set[str]:
    return {str(each.lineno) for part in function.body for each in ast.walk(part) if isinstance(each, ast.stmt)}


def _made_of(node: ast.AST) -> set[str] | None:
    """Names that a statement at the level of a module gives a value, or reads where it gives none."""
    if isinstance(node, ast.Assign | ast.AnnAssign):
        return {each.id for each, _, _ in _targets(node) if isinstance(each, ast.Name)}
    if isinstance(node, ast.For | ast.If | ast.Expr | ast.Assert | ast.With | ast.Try):
        return {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
    return None


def scaled(value, factor: float):
    """Numbers times a factor; whole ones are rounded and stay at least 1 where they were."""
    if isinstance(value, bool):
        return value
    if isinstance(value, int):
        return max(1, round(value * factor)) if value > 0 else round(value * factor)
    if isinstance(value, float):
        return value * factor
    if isinstance(value, tuple | list):
        return type(value)(scaled(each, factor) for each in value)
    if isinstance(value, dict):
        return {name: scaled(each, factor) for name, each in value.items()}
    return value * factor


class Importer(importlib.abc.MetaPathFinder):
    """Imports jamlab from a tree, with one constant scaled; put first into sys.meta_path before jamlab is imported."""

    def __init__(self, tree: Tree, constant: Constant | None = None, factor: float = 1.0) -> None:
        self.tree, self.constant, self.factor = tree, constant, factor

    def find_spec(self, name, path=None, target=None):
        if name not in self.tree.paths:
            return None
        file = self.tree.paths[name]
        here = self.constant is not None and self.constant.module == name
        loader = _Scaling(name, str(file)) if here else importlib.machinery.SourceFileLoader(name, str(file))
        loader.importer = self
        inside = [str(file.parent)] if file.name == "__init__.py" else None
        return importlib.util.spec_from_file_location(name, file, loader=loader, submodule_search_locations=inside)


class _Scaling(importlib.machinery.SourceFileLoader):
    """Compiles a module with one value scaled, past the kept bytecode."""

    def get_code(self, fullname):
        tree = ast.parse(self.get_data(self.path))
        constant, factor = self.importer.constant, self.importer.factor
        owner, _, name = constant.name.rpartition(".")
        body = tree.body
        if owner:
            body = next(each.body for each in tree.body if isinstance(each, ast.ClassDef) and each.name == owner)
        done = sum(_scale(statement, name, factor) for statement in body)
        if done != 1:
            raise ImportError(f"{constant.label} is given a value {done} times")
        sys.modules.setdefault("_scaled_constants", sys.modules[__name__])
        tree.body.insert(_after_future(tree), ast.parse("from _scaled_constants import scaled as _scaled").body[0])
        return compile(ast.fix_missing_locations(tree), self.path, "exec", dont_inherit=True)


def _after_future(tree: ast.Module) -> int:
    found = 0
    for place, each in enumerate(tree.body):
        text = isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant)
        if text or (isinstance(each, ast.ImportFrom) and each.module == "__future__"):
            found = place + 1
        else:
            break
    return found


def _scale(statement: ast.stmt, name: str, factor: float) -> int:
    """Scale the value of a name in a statement; returns how many were."""
    done = 0
    for target, value, plain in _targets(statement):
        if isinstance(target, ast.Name) and target.id == name and value is not None:
            new = ast.parse(f"_scaled(0, {factor!r})", mode="eval").body
            new.args[0] = value
            if plain:
                statement.value = new
            elif isinstance(statement.value, ast.Tuple):
                statement.value.elts[statement.value.elts.index(value)] = new
            else:
                return 0
            done += 1
    return done
