"""One name for one thing: every argument of a function, option, key of a campaign file and variable of a deck is in the
table of arguments, or declared by a law, with the same default, range and choices."""

import re
from functools import cache
from pathlib import Path

import argument_places
from argument_page import page
from argument_places import DECK, FUNCTION, KEY, Stand, columns, declared, of_deck
from included_tables import SHOWN_ONCE, included

from jamlab.arguments.argument import REQUIRED, FromDeck, InWords
from jamlab.arguments.decks import DECKS
from jamlab.arguments.table import ARGUMENTS, SUBJECTS
from jamlab.packing.quantities import MEASURED

stands = cache(argument_places.stands)
OF_DECKS = {each.name for each in DECKS}  # numbers of method, whose defaults and ranges the decks say


def offences(each, parameters):
    """How one argument differs from the table in one place."""
    where = f"{each.form} {each.place}: {each.name}"
    if each.name not in ARGUMENTS:
        return [] if each.name in parameters else [f"{where} is not in the table"]
    if each.form == DECK and each.name in {*OF_DECKS, *parameters}:
        return []
    line, found = ARGUMENTS[each.name], []
    wanted = line.default_at(*each.places)
    if isinstance(wanted, FromDeck):
        wanted = of_deck(wanted) if each.form in (KEY, DECK) else None
    if not isinstance(wanted, InWords) and plain(each.default) != plain(wanted):
        found.append(f"{where} has the default {each.default!r}, the table {wanted!r}")
    if each.limits and each.limits != (limits := line.limits_at(*each.places)):
        found.append(f"{where} is limited to {each.limits}, in the table {limits}")
    if each.choices and (known := line.choices_at(*each.places)) and set(each.choices) != set(known):
        found.append(f"{where} is one of {each.choices}, in the table {known}")
    return found


def plain(value):
    """A default without what the shell and pydantic make of it: no value, an empty table, a tuple or a list."""
    if callable(value) and not isinstance(value, type):
        return getattr(value, "__name__", value)
    return [*value] if isinstance(value, tuple | list) else value


def test_every_argument_is_in_the_table_and_agrees():
    parameters = declared()
    found = [said for each in stands() for said in offences(each, parameters)]
    assert not found, "\n".join(found)


def test_an_argument_that_differs_is_found():
    """Else the test above would pass whatever stood there."""
    good = Stand("step", FUNCTION, "compress", ARGUMENTS["step"].default_at("compress"))
    assert not offences(good, {})
    assert offences(good._replace(name="increment_of_phi"), {})
    assert offences(good._replace(default=0.5), {})
    assert offences(good._replace(default=REQUIRED), {})
    assert offences(good._replace(form=DECK, place="in.sp.jam", default=0.01, limits=(0.0, 7.0)), {})
    assert offences(Stand("ensemble", FUNCTION, "jam", "fixed-box", None, ("fixed-box",)), {})


def test_the_page_has_every_argument_once():
    """With its sentence and its default, and the parameters of laws below; tables that Sphinx can read."""
    text = page()
    arguments, laws = text.split("## Parameters of force laws")
    rows = re.findall(r"^\| `(\w+)`[^|\n]*<br>", arguments, re.MULTILINE)
    assert sorted(rows) == sorted(ARGUMENTS)
    assert set(re.findall(r"^\| `(\w+)` \|", laws, re.MULTILINE)) <= declared().keys()
    assert all(f"| `{name}` |" in laws for name in ("gamma", "exponent", "beta", "eta_f"))
    assert "| `step` Δφ<br>Increment of packing fraction. | above 0 to 1<br>" in arguments
    columns_of = [len(re.findall(r"(?<!\\)\|", line)) for line in text.splitlines() if line.startswith("|")]
    assert set(columns_of) == {4, 5}


def test_pages_include_tables_that_hold_every_key_and_deck():
    tables = included()
    pages = (Path(__file__).parents[1] / "docs" / "reference").glob("*.md")
    names = [
        name for page in pages for name in re.findall(r"^```\{include\} (\w+\.inc)", page.read_text(), re.MULTILINE)
    ]
    assert sorted(names) == sorted(tables)
    keys = [
        row
        for name in names
        if "keys" in name
        for row in re.findall(r"^\| `([\w.]+)` \| \S", tables[name], re.MULTILINE)
    ]
    wanted = {f"{each.place}.{each.name}" for each in stands() if each.form == KEY and each.place not in SHOWN_ONCE}
    assert sorted(f"sweep.{key}" for key in keys) == sorted(name for name in wanted if name.startswith("sweep."))
    assert "`in.sp.jam`" in tables["decks.inc"] and "`g_x`" in tables["campaign_columns.inc"]


def test_every_line_of_the_table_stands_somewhere():
    used = {each.name for each in stands()}
    assert not ARGUMENTS.keys() - used
    assert len(ARGUMENTS) == sum(map(len, SUBJECTS.values()))


def test_exceptions_of_the_table_are_places():
    """A function that is renamed takes its exceptions with it."""
    places = {place for each in stands() for place in each.places}
    named = {place for line in ARGUMENTS.values() for place in (*line.otherwise, *line.limits_otherwise)}
    assert not named - places


def test_no_column_has_another_name():
    """A column that users may call by the word of an argument has the name of that argument."""
    words = {word: line.name for line in ARGUMENTS.values() for word in line.habits.split()}
    own = {*ARGUMENTS, *MEASURED, *declared(), "target_pressure"}  # it stands beside the pressure that was reached
    assert not {name: words[name] for name in columns() if name not in own and name in words}
