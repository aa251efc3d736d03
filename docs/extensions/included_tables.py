"""Tables that pages of the reference include: decks by their first lines; keys of campaign files, columns of tables and
facts of files by the code that checks and makes them; licences by metadata. They are written when the documentation is
built, as `*.inc` beside the pages."""

from collections.abc import Iterator, Mapping

from argument_page import default_of, range_at, table, written
from argument_places import Stand, of_keys
from licence_table import licence_table

from jamlab.arguments.table import ARGUMENTS
from jamlab.campaign.tables import TABLE_COLUMNS
from jamlab.engine.deck_files import summaries
from jamlab.installed_files import installed
from jamlab.packing.facts import facts_table
from jamlab.rheology.damping import ContactDamping

MADE = "name model n seeds compress pressures decompress phi onset changes law size_ratio fraction_large sizes units"
HOW = "search step start ensemble force_tolerance ranks chunk"
SHOWN_ONCE = ("sweep.seeds", "sweep.omega", "sweep.damping")  # their own keys stand in sentences of the page
OF_EVERY_TABLE = ("task", "model", "n", "seed", "ensemble", "protocol", "definitions")


def included() -> dict[str, str]:
    """Name of each file, and its text."""
    folder = installed("lammps_inputs")
    return {
        "decks.inc": _of_decks(summaries(folder)),
        "deck_examples.inc": _of_decks(summaries(folder / "examples")),
        **{f"campaign_keys_{topic}.inc": _of_keys(stands) for topic, stands in keys().items()},
        "campaign_columns.inc": _of_columns(),
        "facts.inc": facts_table() + "\n",
        "licences.inc": licence_table(),
    }


def _of_decks(found: Mapping[str, str]) -> str:
    return table(("deck", "what it does"), [(f"`{name}`", text) for name, text in found.items()])


def keys() -> dict[str, list[Stand]]:
    """Keys of a sweep by topic; those of observables are the rest."""
    found: dict[str, list[Stand]] = {"made": [], "how": [], "measured": []}
    for each in dict.fromkeys((stand.place, stand.name) for stand in of_keys()):
        place, name = each
        if place.startswith("sweep") and place not in SHOWN_ONCE:
            first = (*place.split("."), name)[1]
            topic = "made" if first in MADE.split() else "how" if first in HOW.split() else "measured"
            found[topic].append(Stand(name, "key", place))
    return found


def _of_keys(stands: list[Stand]) -> str:
    rows = [(f"`{_key(each)}`", *_said(each)) for each in stands]
    return written(table(("key", "meaning", "values"), rows))


def _key(each: Stand) -> str:
    """A key of a table within a sweep as TOML writes it: `compress.to`."""
    return f"{each.place}.{each.name}".removeprefix("sweep.")


def _said(each: Stand) -> Iterator[str]:
    """What a key means, and its range and default."""
    if each.name not in ARGUMENTS:
        law = ContactDamping.parameters()[each.name]
        yield f"{law.meaning[0].upper()}{law.meaning[1:]}."
        yield f"{law.least:g} to {law.largest:g}, default {getattr(ContactDamping(), each.name):g}"
        return
    line = ARGUMENTS[each.name]
    places = (each.place, each.place.rpartition(".")[2], "sweep")
    yield line.text_at(*places) + (f" Unit: {line.unit}." if line.unit else "")
    yield ", ".join(
        filter(None, [range_at(line, *places), default_of(line.default_at(*places), line.unset_at(*places))])
    )


def _of_columns() -> str:
    rows = []
    for name, columns in TABLE_COLUMNS.items():
        own = [f"`{column}`" for column in columns if column not in OF_EVERY_TABLE]
        rows.append((f"`{name}`", ", ".join(own)))
    return table(("table", "columns"), rows)
