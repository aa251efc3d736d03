"""Write a figure as a picture: the same figure gives the same bytes."""

from io import BytesIO
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.formats import check_ending

_DPI = 130


def save_picture(figure: Figure, path: Path) -> bytes:
    """Write a figure as .png, .pdf or .svg, all or nothing, and return the bytes."""
    check_ending(path, "picture")
    drawn = picture(figure, path.suffix.lower() or ".png")
    with atomic_file(path) as temporary:
        temporary.write_bytes(drawn)
    return drawn


def picture(figure: Figure, kind: str = ".png") -> bytes:
    """Draw a figure as .png, .pdf or .svg. It is laid out once, here: matplotlib would draw it twice."""
    buffer = BytesIO()
    if (engine := figure.get_layout_engine()) is not None:
        figure.set_dpi(_DPI)
        engine.execute(figure)
        figure.set_layout_engine(None)
    with matplotlib.rc_context({"svg.hashsalt": "jamlab"}):  # else names inside an svg are random
        without_date = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
        figure.savefig(buffer, format=kind[1:], dpi=_DPI, metadata=without_date.get(kind))
    return buffer.getvalue()
