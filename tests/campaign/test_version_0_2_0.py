"""A task file that jamlab 0.2.0 wrote, beside the tables that it exported: read bit for bit, and served from."""

import csv
import shutil
from pathlib import Path

import pytest
from campaigns import run_here

import jamlab

STORED = Path(__file__).parent / "version_0.2.0"


@pytest.fixture
def campaign(tmp_path):
    shutil.copytree(STORED, tmp_path / "c")
    return jamlab.open_campaign(tmp_path / "c")


def test_every_table_is_read_bit_for_bit(campaign):
    assert (campaign.status(verify=True).finished, campaign.status().left) == (1, 0)
    files = sorted((STORED / "tables").iterdir())
    for file in files:
        with file.open(newline="") as lines:  # numbers are parsed by Python, digit by digit
            stored = list(csv.DictReader(lines))
        found = campaign.table(file.stem)
        younger = found.columns.difference(stored[0].keys())
        later = {"unsettled", "sheared", "mean_approach", "mean_sliding", "mean_nonaffine", "mean_sheared"}
        assert set(younger) <= later and found[younger].isna().all(axis=None)
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
    assert len(changed.table("spectra")) == len(campaign.table("spectra")) / 2
