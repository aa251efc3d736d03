"""One self-contained HTML page from tables and pictures."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from jinja2 import Environment, PackageLoader, select_autoescape
from matplotlib.figure import Figure

from jamlab.packing.atomic_file import atomic_file

_DPI = 130


@dataclass(frozen=True)
class Table:
    """A table of text: heading, column names, rows of cells, and which rows are red (by default none)."""

    heading: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    red: Sequence[bool] = ()


def save(figure: Figure, path: Path) -> bytes:
    """Write a figure as PNG and return its bytes."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI)
    with atomic_file(path) as temporary:
        temporary.write_bytes(buffer.getvalue())
    return buffer.getvalue()


def write_page(
    path: Path, title: str, lead: str, tables: Sequence[Table], pictures: Mapping[str, bytes], facts: Mapping[str, str]
) -> None:
    """Write the page; pictures (caption -> PNG) are held inside it."""
    environment = Environment(loader=PackageLoader("jamlab.figures", ""), autoescape=select_autoescape())
    images = {caption: base64.b64encode(png).decode("ascii") for caption, png in pictures.items()}
    page = environment.get_template("page.html").render(
        title=title, lead=lead, tables=tables, images=images, facts=facts
    )
    with atomic_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
