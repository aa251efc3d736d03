"""Stored tasks are found by their names: one of every sweep that ships, as it was named in version 0.2.0."""

import json
from importlib.resources import files
from pathlib import Path

import pytest
from campaigns import read_campaign_file

from jamlab.campaign.file import check_campaign
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import Parameters, batches
from jamlab.errors import InputError

NAMES = json.loads(Path(__file__).with_suffix(".json").with_stem("task_names").read_text())  # of file, sweep, n, seed


@pytest.mark.parametrize("name", NAMES)
def test_names_of_stored_tasks_stay(name):
    campaign = read_campaign_file(Path(str(files("jamlab.campaign"))) / f"{name}.toml")
    found = {(b.sweep, b.parameters.model, b.parameters.n): b for b in batches(campaign)}
    named = [[*key, seed, found[tuple(key)].name_of(seed)] for *key, seed, _ in NAMES[name]]
    assert named == NAMES[name]


def test_sizes_enter_the_names_of_tasks_only_where_they_are_given():
    text = 'name = "s"\n[[sweep]]\nname = "d"\nmodel = "sp"\nn = 4\nseeds = 1\nonset = true\n'

    def first(extra):
        batch = batches(check_campaign(text + extra, "s.toml"))[0]
        assert Parameters.from_record(batch.parameters.record()) == batch.parameters
        return batch

    plain, named = first(""), first('sizes = "lognormal:0.3"\n')
    given = first("sizes = [1.0, 1.5, 0.5, 1.0]\n")
    assert "sizes" not in plain.parameters.record()
    assert len({batch.name_of(1) for batch in (plain, named, given)}) == 3
    states = make_states(given.parameters)
    assert states.packings[0].diameters.tolist() == [1.0, 1.5, 0.5, 1.0]


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ('sizes = "wide"', r"sizes = 'wide': use one of"),
        ("sizes = [1.0, 2.0]", r"sizes hold 2 diameters for n = 4 disks: give n = 2"),
        ('sizes = "from-file:d.txt"', r"write the diameters as a list, since files may change"),
    ],
)
def test_sizes_that_no_campaign_can_have_are_named(extra, message):
    text = 'name = "s"\n[[sweep]]\nname = "d"\nmodel = "sp"\nn = 4\nseeds = 1\nonset = true\n'
    with pytest.raises(InputError, match=message):
        check_campaign(text + extra, "s.toml")
