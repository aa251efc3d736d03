"""The Python code of the documentation as modules that a type checker reads, each line at the number that it has there:
blocks of each page, cells of notebooks, scripts, and examples of docstrings."""

import ast
import doctest
import json
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
_BLOCK = re.compile(r"^( *)```\{?(?:code-block\} )?python\}? *\n(.*?)^\1```", re.MULTILINE | re.DOTALL)
_GIVEN = "import numpy as np; import jamlab"  # names that the examples of docstrings have


def written(folder: Path) -> dict[str, str]:
    """Write the modules into a folder; name of each file -> where its code comes from."""
    origins = {}
    for source, name, code in (*_pages(), *_notebooks(), *_scripts(), *_docstrings()):
        (folder / f"{name}.py").write_text(code, encoding="utf-8")
        origins[f"{name}.py"] = str(source.relative_to(ROOT))
    return origins


def _named(path: Path) -> str:
    return re.sub(r"\W", "_", str(path.relative_to(ROOT).with_suffix("")))


def _pages() -> Iterator[tuple[Path, str, str]]:
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        if {"build", "gallery"} & set(page.parts):
            continue
        text = page.read_text(encoding="utf-8")
        lines = [""] * (text.count("\n") + 1)
        for block in _BLOCK.finditer(text):
            first = text.count("\n", 0, block.start(2))
            for k, line in enumerate(block[2].splitlines()):
                lines[first + k] = line.removeprefix(block[1])
        if any(lines):
            yield page, f"page_{_named(page)}", "\n".join(lines)


def _notebooks() -> Iterator[tuple[Path, str, str]]:
    for path in sorted((ROOT / "docs").rglob("*.ipynb")):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        yield path, f"notebook_{_named(path)}", re.sub(r"^%", "# %", code, flags=re.MULTILINE)


def _scripts() -> Iterator[tuple[Path, str, str]]:
    for folder in ("gallery_scripts", "examples"):
        for path in sorted((ROOT / "docs" / folder).rglob("*.py")):
            yield path, f"script_{_named(path)}", path.read_text(encoding="utf-8")


def _docstrings() -> Iterator[tuple[Path, str, str]]:
    for path in sorted((ROOT / "jamlab").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if ">>>" not in text:
            continue
        for name, first, words in _documented(ast.parse(text)):
            lines = [_GIVEN, *[""] * (first + words.count("\n") + 1)]
            for example in doctest.DocTestParser().get_examples(words):
                for k, line in enumerate(example.source.splitlines()):
                    lines[first - 1 + example.lineno + k] = line
            if any(lines[1:]):
                yield path, f"docstring_{_named(path)}_{name.replace('.', '_')}", "\n".join(lines)


def _documented(tree: ast.Module | ast.ClassDef, prefix: str = "") -> Iterator[tuple[str, int, str]]:
    """Name, first line of the docstring and the docstring of every class and function, methods as `Class.method`."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            if words := ast.get_docstring(node, clean=False):
                yield f"{prefix}{node.name}", node.body[0].lineno, words
            if isinstance(node, ast.ClassDef):
                yield from _documented(node, f"{prefix}{node.name}.")
