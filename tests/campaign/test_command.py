"""Campaigns: command line, workers that cannot be had, what is packed with jamlab."""

import json
import runpy
import tomllib
from importlib import resources
from pathlib import Path

import pytest
from commands import call

from jamlab.campaign.file import CampaignTable
from jamlab.campaign.workers import Workers
from jamlab.errors import InputError

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


def test_command_line(full, tmp_path):
    def said(*words):
        done = call(tmp_path, "campaign", *words)
        assert done.exit_code == 0, done.stderr
        return done.stdout

    status = json.loads(said("status", full.folder.path, "--verify", "--json"))
    assert (status["tasks"], status["finished"], status["damaged"]) == (6, 6, {})
    assert status["sweeps"][0]["cpu_seconds"] > 0
    assert "total" in (counted := said("status", full.file))
    assert "CPU time" not in counted
    assert "CPU time" in said("status", full.file, "--verify")
    assert json.loads(said("plan", full.file, "--only", "up", "--json"))["tasks"] == 0
    assert "0 tasks left" in said("plan", full.file)
    assert "0 tasks finished, 0 failed" in said("resume", full.file)
    assert said("export", full.file, "--to", tmp_path / "t", "--table", "onset").strip() == str(
        tmp_path / "t/onset.csv"
    )
    assert said("merge", full.file, full.folder.path, "--out", tmp_path / "m").startswith("6 copied")


def test_workers_that_cannot_be_had(tmp_path):
    with pytest.raises(InputError, match="workers = 0: must be 1 or more"):
        Workers(count=0)
    with pytest.raises(InputError, match="leave out workers and slurm"):
        Workers(count=2, scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize("name", ["reference", "beyond_the_papers"])
def test_campaigns_of_the_figures_are_packed_and_valid(name):
    text = resources.files("jamlab.campaign").joinpath(f"{name}.toml").read_text()
    content = CampaignTable.model_validate(tomllib.loads(text))
    assert content.name == name
    assert {"sp", "dp"} == {model for sweep in content.sweep for model in sweep.model}


@pytest.mark.slow
def test_example_of_a_campaign(tmp_path, capsys):
    example = runpy.run_path(str(EXAMPLES / "campaign.py"))
    example["walk"](tmp_path, workers=2, seeds=2)
    out = capsys.readouterr().out
    assert "6 tasks now, 6 in all" in out
