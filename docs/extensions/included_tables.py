"""Tables that pages of the reference include, from the sentences of the decks. They are made when the documentation is
built, into files `*.inc` beside the pages."""

from collections.abc import Iterable, Mapping

from jamlab.engine.deck_files import summaries
from jamlab.installed_files import installed


def included() -> dict[str, str]:
    """Name of each file, and its text."""
    folder = installed("lammps_inputs")
    return {
        "decks.inc": _of_decks(summaries(folder)),
        "deck_examples.inc": _of_decks(summaries(folder / "examples")),
    }


def table(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table of Markdown."""
    cells = [heading, ("---",) * len(heading), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |\n" for row in cells)


def _of_decks(found: Mapping[str, str]) -> str:
    return table(("deck", "what it does"), [(f"`{name}`", text) for name, text in found.items()])
