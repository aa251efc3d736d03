"""What the line after Ctrl-C says of a campaign: how many tasks are finished, and which command goes on."""

import json
import shlex

import pytest
from campaigns import names
from commands import call

import jamlab
from jamlab.cli import interruption
from jamlab.cli.campaign import _show_tasks

CAMPAIGN = 'name = "c"\n[[sweep]]\nname = "disks"\nmodel = "sp"\nn = 16\nseeds = 12\nonset = true\n'


@pytest.fixture
def said(monkeypatch):
    """What would be printed by now."""
    monkeypatch.setattr(interruption, "_describe", lambda: "not told")
    return lambda: interruption._describe()


@pytest.mark.parametrize("out", [None, "elsewhere"])
def test_the_line_counts_tasks_and_its_command_finds_them(tmp_path, monkeypatch, said, out):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    campaign = jamlab.open_campaign("c.toml", out)
    campaign.folder.prepare()
    with _show_tasks(campaign, None):
        for name in ("0" * 32, *names("c.toml")[:3]):  # one of another campaign
            campaign.folder.task_file(name).touch()
        line = said()
    assert f"3 of 12 tasks are finished in {out or 'c'}; " in line and line.endswith(" goes on")
    words = shlex.split(line.split("`")[1])
    assert words[:3] == ["jamlab", "campaign", "resume"]
    assert json.loads(call(tmp_path, "campaign", "status", *words[3:], "--json").stdout)["finished"] == 3


def test_seeds_that_are_not_asked_for_yet_count_as_the_most(tmp_path, said):
    (tmp_path / "c.toml").write_text(CAMPAIGN + "until = { rho = 0.01 }\n")
    with _show_tasks(jamlab.open_campaign(tmp_path / "c.toml"), None):
        assert said().startswith("0 of at most 12 tasks are finished")


def test_tables_that_were_written_are_named(tmp_path, monkeypatch, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    assert call(tmp_path, "campaign", "export", "c.toml", "--to", "tables").exit_code == 0
    assert said() == "nothing was written"
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "onset.csv").write_text("n\n")
    assert said() == "kept 1 file in tables, each complete"
