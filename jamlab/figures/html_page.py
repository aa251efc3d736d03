"""Write one self-contained HTML page of tables, pictures and facts, and the PNG and CSV files beside it."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, select_autoescape
from matplotlib.figure import Figure

from jamlab.packing.atomic_file import atomic_file

if TYPE_CHECKING:
    import pandas as pd

_DPI = 130  # figures of two or more panels are wider than the page, and stay sharp when it scales them down


@dataclass(frozen=True)
class TextTable:
    """A table as the reader sees it.

    Attributes:
        heading: above the table.
        columns: their names.
        rows: cells.
        red: whether to mark each row; by default none.
    """

    heading: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    red: Sequence[bool] = ()


def save_png(figure: Figure, path: Path) -> bytes:
    """Write a figure as PNG and return its bytes."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI)
    with atomic_file(path) as temporary:
        temporary.write_bytes(buffer.getvalue())
    return buffer.getvalue()


def write_csv(path: Path, table: "pd.DataFrame") -> None:
    """Write a table as CSV with 8 significant digits; missing values are empty."""
    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.8g")


def write_page(
    path: Path,
    title: str,
    lead: str,
    tables: Sequence[TextTable],
    pictures: Mapping[str, bytes],
    facts: Mapping[str, str],
) -> None:
    """Write the page.

    Args:
        path: HTML file to create or replace.
        title, lead: heading and first paragraph.
        tables: in their order.
        pictures: caption -> PNG, held inside the page.
        facts: name -> value, listed at the end as "How it was made".

    Raises:
        StorageError: the file cannot be written.
    """
    environment = Environment(loader=PackageLoader("jamlab.figures", ""), autoescape=select_autoescape())
    images = {caption: base64.b64encode(png).decode("ascii") for caption, png in pictures.items()}
    page = environment.get_template("page.html").render(
        title=title, lead=lead, tables=tables, images=images, facts=facts
    )
    with atomic_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
