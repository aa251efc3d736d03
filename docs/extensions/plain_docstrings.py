"""Docstrings are plain text first: |x| is a modulus there, and no substitution of reStructuredText. Paths of pages in
them are links."""

import re
from typing import Any

from sphinx.application import Sphinx

CODE = (">>>", "...")
_PAGE = re.compile(r"(?<![`\w/])docs/([\w/]+)\.md\b")


def plain_text(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Escape bars and link pages, outside of examples."""
    in_example = False
    for k, line in enumerate(lines):
        in_example = line.lstrip().startswith(CODE) or (in_example and bool(line.strip()))
        if not in_example:
            lines[k] = _PAGE.sub(r":doc:`/\1`", line.replace("|", r"\|"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Look at every docstring before napoleon does."""
    app.connect("autodoc-process-docstring", plain_text, priority=100)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
