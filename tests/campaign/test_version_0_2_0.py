"""What version 0.2.0 stored is found and read: names of tasks, a task file bit for bit, packings serving more."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from campaigns import read_campaign_file, run_here

import jamlab
from jamlab.campaign.file import check_campaign
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import Parameters, batches
from jamlab.errors import InputError

STORED = Path(__file__).parent / "version_0.2.0"


@pytest.fixture
def campaign(tmp_path):
    shutil.copytree(STORED, tmp_path / "c")
    return jamlab.open_campaign(tmp_path / "c")


def test_every_table_is_read_bit_for_bit(campaign):
    assert (campaign.status().finished, len(campaign.earlier())) == (0, 1)  # of other versions: shown if asked for
    with pytest.warns(UserWarning):
        assert not len(campaign.table("states"))
    files = sorted((STORED / "tables").iterdir())
    for file in files:
        with file.open(newline="") as lines:  # numbers are parsed by Python, digit by digit
            stored = list(csv.DictReader(lines))
        found = campaign.table(file.stem, earlier=True)
        younger = found.columns.difference(stored[0].keys())
        later = {"unsettled", "sheared", "mean_approach", "mean_sliding", "mean_nonaffine", "mean_sheared"}
        later |= {"z_all", "z_all_error"}
        assert set(younger) <= later | {"protocol", "definitions"}
        assert found[younger.intersection(list(later))].isna().all(axis=None)
        assert set(found["protocol"]) <= {"pressure=1"} and "=2" not in "".join(set(found["definitions"]))
        found = found.drop(columns=younger)
        assert len(found) == len(stored) and list(found.columns) == list(stored[0])
        for column in found:
            kind = float if found[column].dtype.kind == "f" else str
            for value, text in zip(found[column], (row[column] for row in stored), strict=True):
                assert value != value if text == "" and kind is float else kind(value) == kind(text), column
    assert len(files) == 8


def test_its_packings_serve_a_task_that_measures_more(campaign, monkeypatch):
    monkeypatch.setattr("jamlab.campaign.states.pack", lambda *_, **__: pytest.fail("a packing was made"))
    path = campaign.file
    path.write_text(path.read_text().replace("omega = [1.0, 1e-3]", "omega = [1.0]"))
    changed = jamlab.open_campaign(campaign.folder.path)
    assert [(line.left, line.stored) for line in changed.plan()] == [(1, 1)]
    assert [outcome.state for outcome in run_here(changed)] == ["finished"]
    assert len(changed.table("spectra")) == len(campaign.table("spectra", earlier=True)) / 2


CAMPAIGNS = Path(__file__).parents[2] / "studies" / "campaigns"
NAMES = json.loads(Path(__file__).with_name("task_names.json").read_text())  # of file, sweep, n, seed


@pytest.mark.parametrize("name", NAMES)
def test_names_of_stored_tasks_stay(name):
    campaign = read_campaign_file(CAMPAIGNS / f"{name}.toml")
    before = [replace(b, parameters=replace(b.parameters, protocol={}, definitions={})) for b in batches(campaign)]
    found = {(b.sweep, b.parameters.model, b.parameters.n): b for b in before}
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
    assert make_states(given.parameters).packings[0].diameters.tolist() == [1.0, 1.5, 0.5, 1.0]
    for extra, message in {
        'sizes = "wide"': r"sizes = 'wide': use one of",
        "sizes = [1.0, 2.0]": r"sizes hold 2 diameters for n = 4 disks: give n = 2",
        'sizes = "from-file:d.txt"': r"write the diameters as a list, since files may change",
    }.items():
        with pytest.raises(InputError, match=message):
            check_campaign(text + extra, "s.toml")
