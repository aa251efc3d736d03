"""Campaigns: command line, workers that cannot be had, what is packed with jamlab."""

import io
import json

import pandas as pd
import pytest
from campaigns import written
from commands import call

from jamlab.campaign import workers
from jamlab.campaign.open_campaign import open_campaign
from jamlab.campaign.tasks import batches
from jamlab.errors import ConvergenceError, JamlabWarning

pytestmark = pytest.mark.usefixtures("here")


def test_command_line(full, tmp_path):
    def said(*words):
        done = call(tmp_path, "campaign", *words)
        assert done.exit_code == 0, done.stderr
        return done.stdout

    status = json.loads(said("status", full.folder.path, "--verify", "--json"))
    assert (status["tasks"], status["finished"], status["damaged"]) == (6, 6, {})
    assert "total" in said("status", full.file)
    assert json.loads(said("plan", full.file, "--only", "up", "--json"))["tasks"] == 0
    assert "0 tasks left" in said("plan", full.file)
    line = said("resume", full.file)
    assert "6 of 6 tasks are finished" in line
    exported = said("export", full.file, "--out", tmp_path / "t", "--table", "onset").strip()
    assert exported == str(tmp_path / "t/onset.csv")
    words = ("--out", tmp_path / "t", "--table", "onset", "--format", "h5")
    assert said("export", full.file, *words).strip() == str(tmp_path / "t/onset.h5")


def test_means_are_those_of_python(full, tmp_path):
    words = ("rho_J", "--table", "onset", "--by", "n", "--by", "model", "--confidence", "0.5", "--csv", "means.csv")
    done = call(tmp_path, "campaign", "aggregate", full.file, *words)
    assert done.exit_code == 0, done.stderr
    wanted = full.aggregate(["rho_J"], ["n", "model"], table="onset", confidence=0.5)
    assert pd.read_csv(tmp_path / "means.csv").equals(pd.read_csv(io.StringIO(wanted.to_csv(index=False))))
    assert f"{wanted['rho_J'].iloc[0]:.5g}" in done.stdout
    done = call(tmp_path, "campaign", "aggregate", full.file, "z", "--along", "rho", "--bins", "0.8,x")
    assert "--bins 0.8,x: 'x' is no number" in done.stderr


def test_tables_are_not_replaced_and_tasks_are_in_the_folder_named(tmp_path):
    """The folder of the tasks is that of Python, `open_campaign(path, folder)`; one without tasks is named."""
    written(tmp_path / "c.toml", n=8, seeds=1, compress=None, onset=True)
    assert call(tmp_path, "campaign", "run", "c.toml", "--workers", "1", "--folder", "elsewhere").exit_code == 0
    tables = ("export", "c.toml", "--out", "tables", "--folder", "elsewhere", "--table", "onset")
    assert call(tmp_path, "campaign", *tables).exit_code == 0
    (there := next(tmp_path.rglob("onset.csv"))).write_text("work of a week")
    again = call(tmp_path, "campaign", *tables)
    assert again.exit_code == 1 and "onset.csv exists: choose another name, or give --overwrite" in again.stderr
    assert there.read_text() == "work of a week"
    assert call(tmp_path, "campaign", *tables, "--overwrite").exit_code == 0
    assert (tmp_path / "tables" / "onset.csv").read_text() != "work of a week"


def test_a_damaged_file_gives_an_exit_code_and_the_command_that_repairs_it(tmp_path):
    written(tmp_path / "c.toml", n=8, seeds=2, compress=None, onset=True)
    where = ("c.toml", "--folder", "elsewhere")
    assert call(tmp_path, "campaign", "run", *where, "--workers", "1").exit_code == 0
    assert call(tmp_path, "campaign", "status", *where, "--verify").exit_code == 0
    path = next((tmp_path / "elsewhere" / "tasks").iterdir())
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    done = call(tmp_path, "campaign", "status", *where, "--verify")
    assert done.exit_code == 1 and path.name in done.stdout
    assert "`jamlab campaign resume c.toml --folder elsewhere` runs damaged tasks again" in done.stdout
    assert call(tmp_path, "campaign", "status", *where, "--verify", "--json").exit_code == 1
    assert call(tmp_path, "campaign", "resume", *where, "--workers", "1").exit_code == 0
    assert call(tmp_path, "campaign", "status", *where, "--verify").exit_code == 0


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    campaign = open_campaign(written(tmp_path / "c.toml"), tmp_path / "mistyped")
    for read in (campaign.table, lambda: campaign.aggregate(["z"])):
        with pytest.warns(JamlabWarning, match="no task is finished in .*mistyped, which does not exist"):
            assert len(read()) == 0


def test_a_plan_adds_up_what_it_knows(tmp_path):
    path = written(tmp_path / "c.toml", seeds=5)
    other = written(tmp_path / "d.toml", model="dp", ensemble="shear-stabilized").read_text()
    path.write_text(path.read_text() + other[other.index("[[sweep]]") :].replace("disks", "droplets"))
    assert "tasks left: more than ~" in call(tmp_path, "campaign", "plan", "c.toml").stdout


def test_a_task_that_sweeps_share_is_planned_once(tmp_path):
    path = written(tmp_path / "c.toml", seeds=5)
    other = written(tmp_path / "d.toml", seeds=8).read_text()
    path.write_text(path.read_text() + other[other.index("[[sweep]]") :].replace("disks", "more"))
    found = json.loads(call(tmp_path, "campaign", "plan", "c.toml", "--json").stdout)
    assert found["tasks"] == 8 and found["bytes"] is None and [line["left"] for line in found["sweeps"]] == [5, 3]
    assert json.loads(call(tmp_path, "campaign", "status", "c.toml", "--json").stdout)["tasks"] == 8


def test_plan_counts_the_tasks_that_failed(tmp_path):
    campaign = open_campaign(written(tmp_path / "c.toml", seeds=3))
    campaign.folder.prepare()
    (first, *_) = batches(campaign.content)
    campaign.folder.record_failure(next(iter(first.tasks())), ConvergenceError("no luck"))
    said = " ".join(call(tmp_path, "campaign", "plan", "c.toml").stdout.split())
    assert "2 tasks left" in said and "1 tasks failed and are not among these; reasons: jamlab campaign status" in said


def test_a_failed_export_leaves_no_folder(tmp_path):
    written(tmp_path / "c.toml")
    for words in (("--table", "nonsense"), ("--sweep", "nowhere"), ("--format", "dump"), ("--format", "csv")):
        call(tmp_path, "campaign", "export", "c.toml", "--out", "tables", *words)
        assert not (tmp_path / "tables").exists()


def test_a_run_prints_few_of_many_failures(tmp_path, monkeypatch):
    def fail(*how):
        raise ConvergenceError("never")

    written(tmp_path / "c.toml", n=8, seeds=30, compress=None, onset=True)
    monkeypatch.setattr(workers, "make_states", fail)
    done = call(tmp_path, "campaign", "run", "c.toml", "--workers", "1")
    assert done.exit_code == 1 and "0 tasks finished, 30 failed" in done.stdout
    lines = [line for line in done.stderr.splitlines() if line.startswith("failed: ")]
    assert len(lines) == 21 and lines[0].endswith("seed=1: never") and "campaign status c.toml" in lines[-1]
    assert call(tmp_path, "campaign", "status", "c.toml").stdout.count(": never") == 30


def test_plan_says_when_chunks_are_too_large_for_the_workers(tmp_path, monkeypatch):
    monkeypatch.setattr("jamlab.campaign.plan.available_cores", lambda: 8)
    written(tmp_path / "c.toml", n=8, seeds=30, compress=None, onset=True, chunk=10)
    done = call(tmp_path, "campaign", "plan", "c.toml")
    assert "30 tasks left: ~" in done.stdout and "on 8 free cores, ? in 3 files" in done.stdout
    assert "sweep disks has work for 3 workers only: lower its chunk" in done.stdout
    assert json.loads(call(tmp_path, "campaign", "plan", "c.toml", "--json").stdout)["files"] == 3
    written(tmp_path / "c.toml", n=8, seeds=30, compress=None, onset=True)
    assert "only" not in call(tmp_path, "campaign", "plan", "c.toml").stdout
