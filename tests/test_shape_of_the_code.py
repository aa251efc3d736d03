"""What is asked of the shape of the code, not of its length: functions that fit on a screen, files of one idea.

How many ways lead through a function is up to ruff, code that stands in two files up to pylint, directions of imports
up to import-linter: see `pyproject.toml`.
"""

import ast
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CODE = sorted(
    path
    for folder in ("jamlab", "studies", "plugin", "lammps_inputs", "docs", "tests")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".py", ".pyi", ".cpp", ".h", ".js", ".css") and "build" not in path.parts
)
MOST_OF_A_FUNCTION = 60  # lines, its docstring left out: arguments and an example are no steps
MOST_OF_A_FILE = 500  # lines


def lengths(tree):
    """(name, lines without its docstring) of every function; those within another are shorter than that."""
    todo = [*tree.body]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0]
            told = first.end_lineno - first.lineno + 1 if ast.get_docstring(node) is not None else 0
            yield node.name, node.end_lineno - node.lineno + 1 - told
        else:
            todo += [*getattr(node, "body", ()), *getattr(node, "orelse", ())]


def own_names(tree):
    """Classes and functions of a file. Commands have the names of functions that they call, parts of a model those of
    what they answer, and protocols that of the class above which they stand for."""
    for node in tree.body:
        bases = node.bases if isinstance(node, ast.ClassDef) else ()
        part = {"Part", "Protocol"} & {ast.unparse(base).partition("[")[0] for base in bases}
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_") and not part:
            yield node.name


@cache
def found_in_files():
    """Lengths of functions as `file: name`, and own names of files of the library; no tree is kept, since the garbage
    collector would look at all of them again and again."""
    functions, names = {}, {}
    for path in CODE:
        if path.suffix == ".py":
            tree, where = ast.parse(path.read_text(encoding="utf-8")), path.relative_to(ROOT)
            functions |= {f"{where}: {name}": lines for name, lines in lengths(tree)}
            if where.parts[0] == "jamlab" and "cli" not in where.parts:
                names[str(where)] = [*own_names(tree)]
    return functions, names


@pytest.mark.parametrize("said", ["", '        """One.\n\n    Two.\n    """\n'])
def test_a_docstring_is_no_part_of_a_length(said):
    text = f"class A:\n  if a:\n    def f(a):\n{said}        a += 1\n        return a\n"
    assert [*lengths(ast.parse(text))] == [("f", 3)]


def test_functions_fit_on_a_screen():
    found, _ = found_in_files()
    assert len(found) > 2000 and {name: n for name, n in found.items() if n >= MOST_OF_A_FUNCTION} == {}


def test_a_file_holds_one_idea():
    long = {str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines()) for path in CODE}
    assert len(long) > 500 and {name: n for name, n in long.items() if n > MOST_OF_A_FILE} == {}


def test_a_name_means_one_thing():
    found = {}
    for where, names in found_in_files()[1].items():
        for name in names:
            found.setdefault(name, set()).add(where)
    assert len(found) > 700 and {name: files for name, files in found.items() if len(files) > 1} == {}
