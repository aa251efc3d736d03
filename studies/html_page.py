"""Write one self-contained HTML page of sections, a picture with its tables each."""

import base64
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, select_autoescape
from markupsafe import Markup, escape

from jamlab.storage.atomic_file import atomic_file

_NAMES = "alpha beta gamma delta eps zeta eta theta kappa lambda mu rho sigma tau phi omega Delta"
_GREEK = dict(zip(_NAMES.split(), "αβγδεζηθκλμρστφωΔ", strict=True))
_LETTER = rf"(?<![\w.-])(?:(d?)({_NAMES.replace(' ', '|')})|([A-Za-zα-ωΔ]))"
_SYMBOL = re.compile(_LETTER + r"(?:_(\w+))?(?![\w=-])|\^(-?)([\w.]*\w)|(?<= )~(?= )")


def typeset(text: str) -> Markup:
    """Set symbols that words write in plain letters as mathematics.

    >>> from studies.html_page import typeset
    >>> print(typeset("z_J, p N^2 <a> ~ drho^alpha_0 N^-theta, --rho 0.9, a dot"))
    z<sub>J</sub>, p N<sup>2</sup> &lt;a&gt; ∝ Δρ<sup>α<sub>0</sub></sup> N<sup>−θ</sup>, --rho 0.9, a dot
    """

    def written(found: re.Match[str]) -> str:
        change, greek, latin, index, minus, power = found.groups()
        if power is not None:
            return f"<sup>{minus.replace('-', '−')}{_SYMBOL.sub(written, power)}</sup>"
        if not (greek or latin):
            return "∝"
        return ("Δ" if change else "") + (latin or _GREEK[greek]) + (f"<sub>{index}</sub>" if index else "")

    return Markup(_SYMBOL.sub(written, str(escape(text))))


_NOTHING = Markup("")
_WIDE = 1.7  # width over height of a picture: a phone lets it slide instead of making it illegible


@dataclass(frozen=True)
class TextTable:
    """A table as the reader sees it."""

    columns: Sequence[str]  # their names, with units
    rows: Sequence[Sequence[str]]  # cells
    heading: str = ""  # above the table; none by default
    # a word for each row, such as its verdict, by which the reader can filter; none by default
    marks: Sequence[str] = ()
    words: bool = False  # columns of text: they are set left, and wrap
    folded: str = ""  # what stands in place of the table until the reader opens it; "" shows it at once


@dataclass(frozen=True)
class Section:
    """One part of a page: picture first, then what was measured."""

    heading: str  # also in the table of contents
    picture: bytes = b""  # PNG, held inside the page; none by default
    caption: str = ""  # of the picture
    tables: Sequence[TextTable] = ()  # in their order
    fragment: Markup = _NOTHING  # HTML above all of them, such as an explorer

    @property
    def anchor(self) -> str:
        """Name of the section in links."""
        return re.sub(r"[^a-z0-9]+", "-", self.heading.lower()).strip("-")

    @property
    def image(self) -> str:
        """Picture as base64."""
        return base64.b64encode(self.picture).decode("ascii")

    @property
    def wide(self) -> bool:
        """Whether the picture holds panels side by side."""
        width, height = (int.from_bytes(self.picture[k : k + 4], "big") for k in (16, 20))  # where a PNG has them
        return width > _WIDE * height

    @property
    def marks(self) -> Counter[str]:
        """How often each mark stands in the tables of the section."""
        return Counter(mark for table in self.tables for mark in table.marks)


def write_report(path: Path, sections: Sequence[Section], **words: Any) -> None:
    """Write the page: contents, sections, a choice of rows by their marks, dark where the browser asks for it. Words:
    title, lead, facts at the end, assets (styles and scripts), and columns: pictures in columns fit on a screen,
    without columns they are as wide as the page."""
    environment = Environment(loader=PackageLoader("studies", ""), autoescape=select_autoescape())
    environment.filters["typeset"] = typeset
    marks: Counter[str] = sum((section.marks for section in sections), Counter())
    page = environment.get_template("page.html").render(sections=sections, marks=marks, **words)
    with atomic_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
