"""A contact sheet: many pictures on few pages, each with its name, to look at all of them in one go."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from PIL import Image, ImageDraw

from jamlab.errors import InputError
from jamlab.storage.atomic_file import atomic_file

COLUMNS, ROWS, WIDTH = 3, 4, 600  # of a sheet; pixels of a picture
_TITLE = 18  # pixels above a picture


def pictures_in(places: Sequence[Path]) -> list[Path]:
    """Pictures in folders and below, without thumbnails, and files as they are."""
    found = [path for place in places for path in (sorted(place.rglob("*.png")) if place.is_dir() else [place])]
    shown = [path for path in found if path.parent.name != "thumb" and path.is_file()]
    if not shown:
        raise InputError(f"{', '.join(map(str, places))}: no .png there: name folders of pictures, or pictures")
    return shown


def write_sheets(pictures: Sequence[Path], folder: Path) -> Iterator[Path]:
    """Write sheets of twelve pictures, sheet-1.png, sheet-2.png, ..."""
    page = COLUMNS * ROWS
    for k in range(0, len(pictures), page):
        path = folder / f"sheet-{k // page + 1}.png"
        with atomic_file(path) as temporary:
            _sheet(pictures[k : k + page]).save(temporary, format="png")
        yield path


def _sheet(pictures: Sequence[Path]) -> Image.Image:
    """Pictures of one width, row by row."""
    shown = [_reduced(path) for path in pictures]
    rows = [range(k, min(k + COLUMNS, len(shown))) for k in range(0, len(shown), COLUMNS)]
    heights = [max(shown[k].height for k in row) + _TITLE for row in rows]
    sheet = Image.new("RGB", (COLUMNS * WIDTH, sum(heights)), "white")
    pen = ImageDraw.Draw(sheet)
    for row, top in zip(rows, (sum(heights[:k]) for k in range(len(rows))), strict=True):
        for column, k in enumerate(row):
            pen.text((column * WIDTH + 4, top + 3), pictures[k].stem, fill="black")
            sheet.paste(shown[k], (column * WIDTH, top + _TITLE))
    return sheet


def _reduced(path: Path) -> Image.Image:
    with Image.open(path) as picture:
        size = (WIDTH, max(1, round(picture.height * WIDTH / picture.width)))
        return picture.convert("RGB").resize(size, Image.Resampling.LANCZOS)
