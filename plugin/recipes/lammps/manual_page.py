"""Pages of docs/reference/lammps in the form of LAMMPS' manual: reStructuredText, in ASCII letters and American."""

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.dollarmath import dollarmath_plugin
from mdit_py_plugins.myst_role import myst_role_plugin

DOCS = Path(__file__).parents[3] / "docs"
PAGES = DOCS / "reference" / "lammps"
MANUAL = "lammps:"  # links to pages of LAMMPS' own manual begin so; docs/conf.py makes them addresses
COLUMNS = 80
VALUES = "values"  # what the arguments of a command are, below it
MARKS = {"em": "*", "strong": "**"}
RULES = {"h1": "=", "h2": '"', "h3": "^"}
RESTART = {  # what LAMMPS calls the section between Description and Restrictions
    "bond_style": "Restart info",
    "fix": "Restart, fix_modify, output, run start/stop, minimize info",
    "compute": "Output info",
    "pair_style": "Mixing, shift, table, tail correction, restart, rRESPA info",
}
SECTIONS = ("Syntax", "Examples", "Description", "Restrictions", "Related commands", "Default")
OF_ALL = "The [restrictions of all styles](index.md#restrictions) apply."
PLUGIN = "is part of the jamlab plugin"
PACKAGE = (  # with what that page says of all styles
    "is part of the POLYGON package, with which LAMMPS must be built: see :doc:`Build package <Build_package>`. "
    "It needs two dimensions and an atom style with bonds and molecule IDs"
)
PACKED = (  # pages of it
    "bond_line_tension|compute_polygon|compute_polygon_contact|fix_polygon_area|fix_polygon_bending|"
    "fix_polygon_perimeter|pair_circuloline"
)
OTHERS = (r"`?jamlab\b", rf"(?:(?!\n\n)[^.])*\]\((?!lammps:|(?:{PACKED})\.md)")  # sentences about other parts of jamlab
ASCII = dict(
    zip(
        "δεηγφατπ²⁴₀−–×’éµ≥≤·",
        "delta epsilon eta gamma phi alpha tau pi ^2 ^4 _0 - - x ' e mu >= <= *".split(),
        strict=True,
    )
)
AMERICAN = {"neighbour": "neighbor", "colour": "color", "minimis": "minimiz", "centre": "center", "analyse": "analyze",
            "behaviour": "behavior", "artefact": "artifact", "grey": "gray", "modelling": "modeling"}  # fmt: skip
COMMANDS = "fix|compute|dump|region|group|molecule"
MYST = MarkdownIt("commonmark").enable("table").use(dollarmath_plugin, double_inline=True).use(myst_role_plugin)


def american(text: str) -> str:
    """In ASCII letters and American spelling, with the dashes of `atom-ID`, as LAMMPS' checks ask."""
    for old, new in (ASCII | AMERICAN).items():
        text = text.replace(old, new)
    text = re.sub(rf"^(\s+)({COMMANDS}) ID\b", r"\1\2 \2-ID", text, flags=re.MULTILINE)
    text = re.sub(rf"(?i)\b({COMMANDS}|atom|chunk|grid) (IDs?)\b(?!\[)", r"\1-\2", text)
    text.encode("ascii")
    return text


def page(name: str) -> str:
    """The manual page of a style."""
    text = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    title = text.partition("\n")[0].removeprefix("# ")
    text = text.replace(OF_ALL, f"This {title.split()[0].replace('_', ' ')} {PLUGIN}.")
    text = re.sub(r"(## Syntax\n\n```text\n(?:(?!```).+\n)+)\n", rf"\1```\n\n```{VALUES}\n", text)
    for start in OTHERS:
        text = re.sub(rf"(?<=[.:\n])\s{start}.*?\.(?=\s)", "", text, flags=re.DOTALL)
    writer = Writer(name, title)
    lines = [f".. index:: {title}", "", *writer.blocks(MYST.parse(text)), *writer.references()]
    return american("\n".join(line.rstrip() for line in lines).rstrip() + "\n")


class Writer:
    """The parts of a page, as lines of reStructuredText; `cited`: keys of papers in their order."""

    def __init__(self, name: str, title: str) -> None:
        self.name, self.kind, self.cited = name, title.split()[0], list[str]()

    def blocks(self, tokens: Sequence[Token]) -> list[str]:
        """Paragraphs, lists, tables and code, each with an empty line below."""
        lines: list[str] = []
        k = 0
        while k < len(tokens):
            token, end = tokens[k], closing(tokens, k)
            body = tokens[k + 1 : end]
            if token.type == "heading_open":
                lines += self.heading(token.tag, self.inline(body[0]))
            elif token.type == "paragraph_open":
                lines += [*filled(self.inline(body[0])), ""]
            elif token.type == "bullet_list_open":
                lines += self.bullets(body)
            elif token.type == "table_open":
                lines += self.table(body)
            elif token.type == "hr":
                lines += ["-" * 10, ""]
            elif token.type == "math_block":
                lines += [".. math::", "", f"   {' '.join(token.content.split())}", ""]
            elif token.type == "fence":
                lines += code(token)
            else:
                raise NotImplementedError(f"{self.name}.md: {token.type}")
            k = end + 1
        return lines

    def heading(self, tag: str, title: str) -> list[str]:
        """A title with its rule below; a section beside those of every page gets the name that LAMMPS gives it."""
        if tag == "h1":
            title += " command"
        elif tag == "h2" and title not in SECTIONS:
            title = RESTART[self.kind]
        added = [".. versionadded:: TBD", ""] if title == "Description" else []
        return [title, RULES[tag] * len(title), "", *added]

    def bullets(self, tokens: Sequence[Token]) -> list[str]:
        """Items of a list, close together where each is one paragraph."""
        items, k = [], 0
        while k < len(tokens):
            end = closing(tokens, k)
            body = self.blocks(tokens[k + 1 : end])
            items.append([f"{'  ' if i else '* '}{line}" for i, line in enumerate(body)])
            k = end + 1
        return [line for item in items for line in (item[:-1] if "" not in map(str.strip, item[:-1]) else item)] + [""]

    def table(self, tokens: Sequence[Token]) -> list[str]:
        lines = [".. list-table::", "   :header-rows: 1", ""]
        for k, token in enumerate(tokens):
            if token.type == "tr_open":
                first = True
            elif token.type in ("th_open", "td_open"):
                lines.append(f"   {'*' if first else ' '} - {self.inline(tokens[k + 1])}")
                first = False
        return [*lines, ""]

    def inline(self, token: Token) -> str:
        """Marks within a line."""
        text, before, link = "", "", ""
        for part in token.children or ():
            kind = part.type.partition("_")[0]
            if part.type in ("link_open", "em_open", "strong_open"):
                before, text, link = text, "", str(part.attrs.get("href", ""))
            elif part.type in ("link_close", "em_close", "strong_close"):
                mark = MARKS.get(kind, "")
                text, link = joined(before, self.linked(text, link) if link else f"{mark}{text}{mark}"), ""
            elif part.type == "code_inline":
                text = joined(text, part.content if link else f"``{part.content}``")
            elif part.type in ("math_inline", "math_inline_double"):
                text = joined(text, f":math:`{part.content}`")
            elif part.type == "myst_role":
                text = joined(text, self.citation(part.content))
            elif part.type in ("text", "text_special", "softbreak"):
                text = joined(text, re.sub(r"[*|`]|_(?=\W|$)", r"\\\g<0>", part.content) or " ")
            else:
                raise NotImplementedError(f"{self.name}.md: {part.type}")
        return text.replace(PLUGIN, PACKAGE)

    def linked(self, words: str, link: str) -> str:
        """The name of a page of LAMMPS' manual or of the package; of another page, its words alone."""
        page = link.removeprefix(MANUAL).partition("#")[0].removesuffix(".md")
        return f":doc:`{words} <{page}>`" if link.startswith(MANUAL) or re.fullmatch(PACKED, page) else words

    def citation(self, key: str) -> str:
        if key not in self.cited:
            self.cited.append(key)
        return f":ref:`({author(key)}) <{self.label(key)}>`"

    def label(self, key: str) -> str:
        """Of a paper on this page: labels of LAMMPS' manual are unique among all pages."""
        return f"{self.name.replace('_', '-')}-{author(key)}"

    def references(self) -> list[str]:
        """The papers, below all."""
        lines = ["-" * 10, ""] if self.cited else []
        for key in self.cited:
            lines += [f".. _{self.label(key)}:", "", *filled(f"**({author(key)})** {paper(key)}"), ""]
        return lines


def closing(tokens: Sequence[Token], k: int) -> int:
    """Where what opens at k ends."""
    if tokens[k].nesting == 0:
        return k
    return next(i for i in range(k + 1, len(tokens)) if tokens[i].nesting < 0 and tokens[i].level == tokens[k].level)


def joined(text: str, part: str) -> str:
    """Marks end at a letter only behind an escaped space."""
    ends = text.endswith(("`", "*")) and not text.endswith("\\*")
    begins = part.startswith(("`", "*", ":"))
    apart = (ends and part[:1].isalnum()) or (begins and len(part) > 1 and text[-1:].isalnum())
    return text + ("\\ " if apart else "") + part


def filled(text: str) -> list[str]:
    """A paragraph in lines that break nowhere inside of marks."""
    whole = re.sub(r"``.+?``|:\w+:`.+?`|\*+\w.*?\*+", lambda m: m[0].replace(" ", "\0"), american(text))
    lines = textwrap.wrap(whole, COLUMNS, break_long_words=False, break_on_hyphens=False)
    return [line.replace("\0", " ") for line in lines]


def code(token: Token) -> list[str]:
    """Commands, or what their arguments are."""
    text = token.content.rstrip().splitlines()
    if token.info == VALUES:
        head, text = ".. parsed-literal::", [line.replace("*", "\\*") for line in text]
    else:
        head = f".. code-block:: {'LAMMPS' if token.info == 'text' else token.info}"
    return [head, "", *(f"   {line}" for line in text), ""]


def fields(key: str) -> dict[str, str]:
    """Of a paper, from the bibliography of the docs."""
    entry = (DOCS / "references.bib").read_text(encoding="utf-8").partition(f"{{{key},")[2].partition("\n}")[0]
    plain = re.sub(r"\{\\\W(\w)\}", r"\1", entry).replace("--", "-")  # letters with accents
    return dict(re.findall(r"(\w+)\s+= \{([^}]*)\}", plain))


def author(key: str) -> str:
    return fields(key)["author"].partition(",")[0]


def paper(key: str) -> str:
    """As LAMMPS' manual names it: names of the authors, journal, volume, page and year."""
    of = fields(key)
    names = [name.partition(",")[0] for name in of["author"].split(" and ")]
    listed = ", ".join([*names[:-1], f"and {names[-1]}"]) if len(names) > 2 else " and ".join(names)
    return f"{listed}, {of['journal']}, {of['volume']}, {of['pages']} ({of['year']})."
