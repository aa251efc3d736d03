"""Write a figure as a picture file; the ending of its name says which kind."""

from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from jamlab.figures.html_page import save_png
from jamlab.storage.atomic_file import atomic_file

# pictures made of lines, without the date: the same figure gives the same file
_DATELESS: dict[str, dict[str, Any]] = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
PICTURES = (".png", *_DATELESS)


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure as .png, .pdf or .svg, all or nothing.

    Raises:
        StorageError: see `jamlab.storage.atomic_file.atomic_file`.
    """
    kind = path.suffix.lower()
    if kind == ".png":
        save_png(figure, path)
        return
    buffer = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "jamlab"}):  # else names inside an svg are random
        figure.savefig(buffer, format=kind[1:], metadata=_DATELESS[kind])
    with atomic_file(path) as temporary:
        temporary.write_bytes(buffer.getvalue())
