"""What readers of pages see as prose: without code, equations, addresses and comments."""

import re
from collections.abc import Iterator
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.dollarmath import dollarmath_plugin
from mdit_py_plugins.myst_role import myst_role_plugin

_MARKDOWN = MarkdownIt("commonmark").enable("table").use(dollarmath_plugin).use(myst_role_plugin)
_MARKS = {f"{kind}_{end}": "*" for kind in ("em", "strong") for end in ("open", "close")} | {"softbreak": "\n"}
_FRONT_MATTER = re.compile(r"\A---\n.*?\n---\n", re.DOTALL)
_FILLED_IN = re.compile(r"\{\{.*?\}\}")  # when pages are built
_NAMES = re.compile(
    r"""
    "[^"]*"                         # of columns and tables
    | [\w/.-]+\.(?:md|py|toml|h5)   # of files
    | \b(?:pair|bond|angle)_style\b # of LAMMPS
    """,
    re.VERBOSE,
)
_WORDS = re.compile(r"\b[a-z]{3,}(?:_[a-z]{2,})+\b")  # arguments, which LAMMPS' manual has in italics
_RAW = re.compile(r"\w\*?[_^]\S|[_^]\*?\w")


def prose(page: Path) -> Iterator[tuple[int, str]]:
    """Number and text of every line of prose, emphasis as `*`; lines of a paragraph that a code span breaks apart may
    have the number of its first one."""
    text = page.read_text(encoding="utf-8")
    front = _FRONT_MATTER.match(text)
    skipped = front[0].count("\n") if front else 0
    for token in _MARKDOWN.parse(text[front.end() if front else 0 :]):
        if token.type == "inline" and token.children and token.map:
            for k, line in enumerate(_shown(token.children).split("\n")):
                yield skipped + token.map[0] + k + 1, line


def _shown(tokens: list[Token]) -> str:
    parts = []
    for token in tokens:
        if token.type == "text" and not token.content.startswith((":::", ":link")):
            parts.append(_FILLED_IN.sub("", token.content))
        elif token.type == "image" and token.children:
            parts.append(_shown(token.children))
        else:
            parts.append(_MARKS.get(token.type, " " + "\n" * token.content.count("\n")))
    return "".join(parts)


def raw_marks(page: Path) -> list[str]:
    """Lines with an underscore or a caret that readers see as typed, such as z_J or *t*^0.02."""
    of_lammps = page.parent.name == "lammps"
    found = []
    for number, line in prose(page):
        left = _NAMES.sub("", line)
        if _RAW.search(_WORDS.sub("", left) if of_lammps else left):
            found.append(f"{page}:{number}: {line.strip()}")
    return found


def long_code(page: Path, most: int) -> list[str]:
    """Lines of code blocks that are wider than a page."""
    found = []
    for token in _MARKDOWN.parse(page.read_text(encoding="utf-8")):
        if token.type == "fence" and token.map and not token.info.startswith("{"):
            for k, line in enumerate(token.content.splitlines()):
                if len(line) > most:
                    found.append(f"{page}:{token.map[0] + 2 + k}: {len(line)} columns")
    return found
