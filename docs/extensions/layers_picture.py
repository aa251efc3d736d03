"""The directive `layers`: the layers of the package as a picture, drawn from the import contract in `pyproject.toml`.

Its content is the caption.
"""

import ast
import tomllib
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]
WIDTH, ROW, BOX, GAP = 640, 27, 20, 10  # pixels: of the picture, a layer, a box, and between boxes
LETTER, MARGIN = 7.0, 9  # pixels: of a character, and beside a name
COLOURS = {"analysis": "#0072B2", "LAMMPS": "#D55E00", "": "currentColor"}


class Contract(NamedTuple):
    """Layers, highest first, and packages on both sides of the rule that analysis never runs LAMMPS."""

    layers: list[list[str]]
    analysis: set[str]
    lammps: set[str]


def contract(root: Path = ROOT) -> Contract:
    """Read what `lint-imports` checks."""
    settings = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    (layers,) = (each["layers"] for each in settings["contracts"] if each["type"] == "layers")
    (rule,) = (each for each in settings["contracts"] if each["name"] == "analysis never runs LAMMPS")
    sides = [{name.removeprefix("jamlab.") for name in rule[side]} for side in ("source_modules", "forbidden_modules")]
    return Contract([[name.strip() for name in layer.split("|")] for layer in layers], *sides)


def purpose(name: str, root: Path = ROOT) -> str:
    """First line of the docstring of a package or module."""
    path = root / "jamlab" / name
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").split("\n\n")[0].replace("\n", " ")


def box(name: str, x: float, y: float, colour: str) -> str:
    """One package with its purpose, which shows under the pointer."""
    width = len(name) * LETTER + 2 * MARGIN
    return (
        f'<g><title>{escape(purpose(name))}</title><rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{BOX}" '
        f'rx="4" stroke="{colour}" fill="{colour}" fill-opacity="0.12"/><text x="{x + width / 2:.1f}" '
        f'y="{y + 14:.1f}" text-anchor="middle" fill="currentColor">{escape(name)}</text></g>'
    )


def row(names: Sequence[str], y: float, found: Contract) -> str:
    """One layer, in the middle."""
    widths = [len(name) * LETTER + 2 * MARGIN for name in names]
    x = (WIDTH - sum(widths) - GAP * (len(names) - 1)) / 2
    parts = []
    for name, width in zip(names, widths, strict=True):
        side = "analysis" if name in found.analysis else "LAMMPS" if name in found.lammps else ""
        parts.append(box(name, x, y, COLOURS[side]))
        x += width + GAP
    return "".join(parts)


def picture(found: Contract) -> str:
    """All layers as SVG."""
    height = ROW * len(found.layers)
    rows = "".join(row(names, k * ROW + (ROW - BOX) / 2, found) for k, names in enumerate(found.layers))
    arrow = (
        f'<path d="M18 6V{height - 8}m-5 -8l5 8l5 -8" fill="none" stroke="currentColor" stroke-width="1.4"/>'
        f'<text x="30" y="{height / 2}" fill="currentColor">imports</text>'
    )
    return (
        f'<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="layers of the package, each imports those below" '
        f'style="width: 100%; max-width: {WIDTH}px; font: 12px monospace">{arrow}{rows}</svg>'
    )


class Layers(SphinxDirective):
    """Place the picture."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """The picture, and a caption."""
        self.env.note_dependency(str(ROOT / "pyproject.toml"))
        return [nodes.raw("", picture(contract()), format="html"), *self.parse_content_to_nodes()]


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the directive."""
    app.add_directive("layers", Layers)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
