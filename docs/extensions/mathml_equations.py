"""Equations as MathML, which browsers draw themselves: pages need no script and no network."""

from html import escape
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from mathml import mathml
from sphinx.application import Sphinx
from sphinx.util import logging

_LOGGER = logging.getLogger(__name__)


def _drawn(node: nodes.Node, as_block: bool = False) -> str:
    """MathML of an equation; of one that cannot be translated a warning, and its source on the page."""
    try:
        return mathml(node.astext(), as_block)
    except MathError as error:
        _LOGGER.warning("equation %s: %s", node.astext(), error, location=node, type="math", subtype="mathml")
        return f"<code>{escape(node.astext())}</code>"


def draw_inline(translator: Any, node: nodes.math) -> None:
    """Write an equation within a line."""
    translator.body.append(_drawn(node))
    raise nodes.SkipNode


def draw_display(translator: Any, node: nodes.math_block) -> None:
    """Write an equation of its own, with its number if it has one."""
    translator.body.append(translator.starttag(node, "div", CLASS="equation"))
    if node["number"]:
        translator.body.append(f'<span class="eqno">({node["number"]})</span>')
    translator.body.append(_drawn(node, as_block=True) + "</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the renderer and choose it."""
    app.add_html_math_renderer("mathml", (draw_inline, None), (draw_display, None))
    app.config.html_math_renderer = "mathml"  # type: ignore[attr-defined]
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
