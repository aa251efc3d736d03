"""Campaigns: the folder of tasks; status, damage, failures, export, plan."""

import errno
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from campaigns import FULL, run_here, written

import jamlab
from jamlab.campaign import states as sweep_states
from jamlab.campaign import workers
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.observables import TABLES
from jamlab.campaign.plan import plan, share_names, total_time
from jamlab.campaign.task_file import damage, read_task_file
from jamlab.campaign.tasks import batches, task_names
from jamlab.campaign.workers import run_tasks
from jamlab.errors import InputError, StorageError
from jamlab.packing.hdf5 import read_all_hdf5
from jamlab.protocols.decompression import decompress

pytestmark = pytest.mark.usefixtures("here")


def test_status_counts_and_more_seeds_leave_what_is_there(full, tmp_path):
    status = full.status(verify=True)
    assert (status.tasks, status.finished, status.failed, status.left) == (6, 6, 0, 0)
    assert (status.damaged, status.gaps, status.foreign) == ({}, {}, 0)
    assert jamlab.open_campaign(full.folder.path / "campaign.toml").finished() == full.finished()
    shutil.copytree(full.folder.path, tmp_path / "full")
    path = tmp_path / "full.toml"
    path.write_text(FULL.replace("seeds = [3, 4]", "seeds = [4, 5]"))
    status = jamlab.open_campaign(path).status()
    assert [(s.n, s.finished, s.left) for s in status.sweeps] == [(8, 1, 1), (10, 1, 1), (32, 1, 0), (8, 1, 0)]
    assert status.foreign == 2


@pytest.mark.parametrize("harm", ["cut", "flip", "empty", "other", "foreign", "folder"])
def test_damaged_files_are_found(full, harm, tmp_path):
    name, other = full.finished()[:2]
    content = full.folder.task_file(name).read_bytes()
    middle, file = len(content) // 2, tmp_path / "harmed.h5"
    harmed = {
        "cut": content[:middle],
        "flip": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :],
        "empty": b"",
        "other": full.folder.task_file(other).read_bytes(),
        "foreign": b"hello" * 1000,
    }
    file.write_bytes(harmed[harm]) if harm in harmed else file.mkdir()
    assert damage(file, f"task {name}")
    assert damage(full.folder.task_file(name), f"task {name}") is None


@pytest.mark.slow
def test_a_damaged_file_is_moved_aside_and_done_again(full, tmp_path):
    shutil.copytree(full.folder.path, tmp_path / "c")
    campaign = jamlab.open_campaign(tmp_path / "c")
    name = next(n for n in campaign.finished() if campaign.packings(n)[0].n == 8)
    whole = read_task_file(campaign.folder.task_file(name))
    campaign.folder.task_file(name).write_bytes(b"\x89HDF\r\n\x1a\n" + b"\0" * 500)
    with pytest.raises(StorageError) as caught:
        campaign.table("states")
    assert name in str(caught.value)
    done = campaign.run(1)
    assert (done.finished, done.failed, list(done.repaired)) == (1, 0, [name])
    assert (tmp_path / "c" / "damaged" / f"{name}.1.h5").exists()
    again = read_task_file(campaign.folder.task_file(name))
    for column, values in whole.observables.items():
        np.testing.assert_array_equal(again.observables[column], values)


@pytest.mark.slow
def test_a_task_that_cannot_be_done_is_recorded_and_not_tried_again(tmp_path):
    path = written(tmp_path / "c.toml", n=8, seeds=1, compress={"to": 0.5})
    campaign = jamlab.open_campaign(path)
    (outcome,) = run_here(campaign)
    assert outcome[0] == "failed" and "onset lies at rho" in outcome[1]
    status = campaign.status()
    assert (status.failed, status.left) == (1, 0)
    (record,) = status.failures.values()
    assert (record["label"], record["error"]) == ("sp n=8 seed=1", "ConvergenceError")
    assert campaign.run(1) == type(campaign.run(1))(0, 0, {}, 0)  # nothing is left: no worker starts
    kept = campaign.folder.failure_file(*task_names(batches(campaign.content)))
    first = kept.stat().st_mtime_ns
    done = campaign.run(1, retry_failed=True)
    assert (done.finished, done.failed) == (0, 1)
    assert kept.stat().st_mtime_ns > first


def test_a_sweep_that_breaks_off_keeps_its_states_and_says_so(tmp_path, monkeypatch):
    def breaks_off(packing, to, **_):
        yield packing
        raise jamlab.EngineError("LAMMPS stopped")

    monkeypatch.setattr(sweep_states, "compress", breaks_off)
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=8, seeds=1))
    ran = campaign.run(1)
    assert (ran.finished, ran.gaps) == (1, ["sp n=8 seed=1 lacks states after 1: LAMMPS stopped"])
    assert len(campaign.table("states")) == 2
    (line,) = campaign.status(verify=True).gaps.values()
    assert line == "sp n=8 seed=1 lacks states after 1: LAMMPS stopped"


def test_pressures_one_from_the_other(tmp_path, monkeypatch):
    """The highest starts at random; one that is not met is left out, and the next comes down from the one before it."""

    began = []

    def fussy(packing, pressure, **how):
        began.append((packing.provenance["pressure"], how))
        if pressure == 1e-3:
            raise jamlab.ConvergenceError("not met")
        return decompress(packing, pressure, **how)

    monkeypatch.setattr(sweep_states, "decompress", fussy)
    keys = {"n": 16, "seeds": 1, "compress": None, "pressures": [1e-5, 1e-4, 1e-3, 1e-2]}
    keys |= {"force_tolerance": 1e-13}
    path = written(tmp_path / "c.toml", decompress=True, **keys)
    campaign = jamlab.open_campaign(path)
    assert run_here(campaign)[0][0] == "finished"
    assert campaign.table("states")["target_pressure"].tolist() == [1e-2, 1e-4, 1e-5]
    assert list(campaign.status(verify=True).gaps.values()) == ["sp n=16 seed=1 lacks pressure 0.001: not met"]
    assert [p for p, _ in began] == pytest.approx([1e-2, 1e-2, 1e-4], rel=1e-6)
    assert all(how == {"force_tolerance": 1e-13, "ranks": 1} for _, how in began)
    (name,) = campaign.finished()
    first, _, last = read_all_hdf5(campaign.folder.task_file(name))
    assert first.provenance["protocol"] == "pressure"
    assert last.provenance["from_pressure"] == pytest.approx(1e-4, rel=1e-6)
    assert jamlab.open_campaign(written(path, **keys)).status().foreign == 1  # the key enters names


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_folder_that_cannot_be_written_is_no_fault_of_the_task(tmp_path, monkeypatch, number):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=8, seeds=1, compress=None, onset=True))
    campaign.folder.prepare()
    (batch,) = batches(campaign.content)

    def no_space(self, content):
        with open(self, "wb") as file:
            file.write(content[:100])
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "write_bytes", no_space)
    (outcome,) = run_tasks(campaign.folder, batch, {})
    assert outcome[0] == "full"
    assert os.strerror(number) in outcome[1]
    assert not list((campaign.folder.path / "tasks").iterdir())  # nothing half-written
    monkeypatch.undo()

    def no_room(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(workers, "make_states", no_room)  # for a temporary file, such as of LAMMPS
    (outcome,) = run_tasks(campaign.folder, batch, {})
    assert outcome.state == "full" and os.strerror(number) in outcome.line and "make room" in outcome.line
    assert not campaign.folder.failed()
    monkeypatch.undo()
    assert run_tasks(campaign.folder, batch, {})[0].state == "finished"


def test_a_file_that_is_edited_after_it_was_opened_does_not_change_the_run(tmp_path):
    """The copy in the folder is the text whose tasks are there."""
    path = written(tmp_path / "c.toml", n=8, seeds=1, compress=None, onset=True)
    before = path.read_text()
    campaign = jamlab.open_campaign(path)
    path.write_text(before.replace("n = 8", "n = 10"))
    assert campaign.run(1).finished == 1
    assert (campaign.folder.path / "campaign.toml").read_text() == before
    assert jamlab.open_campaign(campaign.folder.path).status().finished == 1


def test_two_campaign_files_of_one_folder_are_both_kept_or_the_second_is_refused(tmp_path):
    """The first campaign of the folder stays; files of one name, such as one edited twice, are kept side by side."""
    keys = {"n": 8, "compress": None, "onset": True}
    one, two, three = (
        jamlab.open_campaign(written(tmp_path / f"{k}.toml", seeds=k, **keys), tmp_path / "out") for k in (1, 2, 3)
    )
    other = jamlab.open_campaign(written(tmp_path / "o.toml", name="other", seeds=1, **keys), tmp_path / "out")
    copy = tmp_path / "out" / "campaign.toml"
    for campaign in (one, one):
        assert campaign.run(1).left == 0 and sorted(p.name for p in copy.parent.glob("*.toml")) == ["campaign.toml"]
    with pytest.raises(InputError) as caught:
        other.run(1)
    assert "'c'" in str(caught.value) and "'other'" in str(caught.value) and copy.read_text() == one.text
    for campaign in (two, three, one, two):
        campaign.run(1)
        assert copy.read_text() == campaign.text
    kept = [(copy.parent / f"campaign.{k}.toml").read_text() for k in (1, 2, 3)]
    assert kept == [one.text, two.text, three.text] and not (copy.parent / "campaign.4.toml").exists()
    copy.write_text("no TOML [")  # is kept too
    one.run(1)
    assert (copy.parent / "campaign.4.toml").read_text() == "no TOML [" and copy.read_text() == one.text


def test_the_file_of_another_task_is_no_row_of_a_table(full, tmp_path):
    """Its checksum is right, its task is not; nor are its packings taken for those of the task."""
    shutil.copytree(full.folder.path, tmp_path / "c")
    campaign = jamlab.open_campaign(tmp_path / "c")
    one, other = campaign.finished()[:2]
    shutil.copy(campaign.folder.task_file(other), campaign.folder.task_file(one))
    for look in (campaign.table, lambda: campaign.packings(one)):
        with pytest.raises(StorageError) as caught:
            look()
        assert f"{one}.h5 holds task {other}" in str(caught.value)
    parameters = read_task_file(campaign.folder.task_file(other)).parameters
    assert sweep_states.read_stored(campaign.folder, [one], parameters) is None
    assert sweep_states.read_stored(campaign.folder, [other], parameters)


def test_a_share_forgets_its_own_failures_only(tmp_path):
    """Others may be at work on theirs."""
    path = written(tmp_path / "c.toml", n=8, seeds=4, compress={"to": 0.5})
    campaign = jamlab.open_campaign(path)
    campaign.folder.prepare()
    tasks = list(batches(campaign.content)[0].tasks())
    for task in tasks:
        campaign.folder.record_failure(task, jamlab.JamlabError("before"))
    ran = campaign.run(1, share=(2, 2), retry_failed=True)
    assert (ran.finished, ran.failed) == (0, 2)
    reasons = {name: record["reason"] for name, record in campaign.folder.failures().items()}
    mine = {name for name, reason in reasons.items() if reason != "before"}
    assert len(reasons) == 4 and mine == share_names(batches(campaign.content), (2, 2))
    shutil.copy(path, campaign.folder.task_file(tasks[0].name))  # finished by another process after all
    status = campaign.status()
    assert (status.finished, status.failed, len(status.failures), status.left) == (1, 3, 3, 0)


def test_two_drivers_do_not_share_a_folder(tmp_path):
    folder, campaign = CampaignFolder(tmp_path), jamlab.open_campaign(written(tmp_path / "c.toml"), tmp_path)
    folder.prepare()
    with folder.lock():
        with pytest.raises(StorageError) as caught:
            campaign.run(1)
        assert "lock.1-of-1: stop it, or wait" in str(caught.value) and str(tmp_path) in str(caught.value)
    with folder.lock((2, 3)):  # free again
        for share, remedy in (((2, 3), "run another share, or wait"), ((1, 2), "stop it, or wait")):
            with pytest.raises(StorageError, match=remedy):
                campaign.run(1, share=share)
    code = "import sys, os, pathlib; from jamlab.campaign.folder import CampaignFolder\n"
    code += "CampaignFolder(pathlib.Path(sys.argv[1])).lock().__enter__(); os.kill(os.getpid(), 9)"
    assert subprocess.run([sys.executable, "-c", code, tmp_path], check=False).returncode == -9
    with folder.lock():  # the lock of a dead driver is none
        pass


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOTSUP])
def test_a_campaign_runs_where_there_are_no_locks(tmp_path, monkeypatch, number):
    def fail(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("jamlab.campaign.folder.fcntl.flock", fail)
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=8, seeds=1, compress=None, pressures=[1e-2]))
    with pytest.warns(UserWarning):
        assert campaign.run(1).finished == 1
    number = errno.EIO
    with pytest.raises(StorageError) as caught:
        campaign.run(1)
    assert os.strerror(errno.EIO) in str(caught.value)


def test_export(full, tmp_path):
    files = full.export(tmp_path / "csv")
    others = {
        "flow",
        "quasistatic_shear",
        "plastic_events",
        "oscillation",
        "creep",
        "order",
        "modes",
        "cyclic_shear",
    }  # which it does not measure
    assert sorted(file.stem for file in files) == sorted(set(TABLES) - others)
    back = pd.read_csv(tmp_path / "csv" / "states.csv", dtype=str)
    np.testing.assert_array_equal(back["g"].astype(float), full.table("states")["g"])
    (one,) = full.export(tmp_path / "json", ["onset"], "up", format="json")
    rows, onset = json.loads(one.read_text()), full.table("onset", "up")
    assert [row["rho_J"] for row in rows] == onset["rho_J"].tolist() and list(rows[0]) == list(onset)
    with pytest.raises(InputError, match="xlsx"):
        full.export(tmp_path / "xlsx", format="xlsx")
    assert not (tmp_path / "xlsx").exists()


def test_plan_takes_times_and_sizes_from_finished_tasks(full, tmp_path):
    """Of the same sweep, model and n; `pilot` makes one of each of which there is none."""
    assert all((line.left, line.seconds, line.bytes) == (0, 0.0, 0) for line in full.plan())
    keys = {"compress": None, "pressures": [1e-2], "seeds": 3}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=[8, 10], **keys))
    assert [(line.left, line.estimated, line.bytes) for line in campaign.plan()] == [(3, True, None)] * 2
    assert campaign.run(1, pilot=True).finished == 2 and campaign.run(1, pilot=True).finished == 0
    for line, (name,) in zip(
        campaign.plan(), (set(b.names()) & campaign.folder.finished() for b in batches(campaign.content)), strict=True
    ):
        file = campaign.folder.task_file(name)
        assert (line.left, line.bytes) == (2, 2 * file.stat().st_size)
        assert line.seconds == pytest.approx(2 * read_task_file(file).seconds)
    wall, work, cores = total_time(campaign.plan(), 2)
    assert (work, cores) == (pytest.approx(sum(line.seconds for line in campaign.plan())), 2) and wall == work / 2
    more = jamlab.open_campaign(written(tmp_path / "c.toml", n=[8, 10], **keys, observables=["voids"]))
    assert [(line.stored, line.estimated) for line in more.plan()] == [(1, True)] * 2
    assert {outcome.state for outcome in run_here(more)} == {"finished"}
    four = jamlab.open_campaign(
        written(tmp_path / "c.toml", n=[8, 10], **keys | {"seeds": 4}, observables=["voids"], ranks=4)
    )
    one = jamlab.open_campaign(
        written(tmp_path / "d.toml", n=[8, 10], **keys | {"seeds": 4}, observables=["voids"]), four.folder.path
    )
    for line, alone in zip(four.plan(), one.plan(), strict=True):  # a task holds the cores of all its ranks
        assert line.seconds == 4 * alone.seconds > 0 and (line.ranks, line.left) == (4, alone.left)
    wall, work, cores = total_time(four.plan(), 1)
    assert cores == 4 and (wall, work) == pytest.approx((total_time(one.plan(), 1)[0], 4 * wall))


def test_a_plan_is_never_negative(tmp_path):
    """Where the stored packings took longer than the task that stands for those left."""
    keys = {"n": 8, "seeds": 3, "compress": None, "onset": True}
    (before,) = batches(jamlab.open_campaign(written(tmp_path / "c.toml", **keys)).content)
    later = batches(jamlab.open_campaign(written(tmp_path / "c.toml", **keys, observables=["voids"])).content)

    class Slow(CampaignFolder):
        def finished(self):
            return {*before.names(), later[0].name_of(1)}

        def read(self, names):
            return {name: SimpleNamespace(seconds=1.0 if name in later[0].names() else 9.0) for name in names}

        def task_file(self, name):
            return tmp_path / "c.toml"

    (line,) = plan(later, Slow(tmp_path))
    assert (line.left, line.stored, line.seconds) == (2, 2, 0.0)


@pytest.mark.parametrize(
    "harm",
    [
        lambda folder: (folder / "lock.1-of-1").mkdir(),
        lambda folder: os.mkfifo(folder / "lock.1-of-2"),
        lambda folder: (folder / "campaign.toml").mkdir(),
        lambda folder: (folder / "tasks").write_text(""),
    ],
)
def test_a_folder_that_holds_something_else_is_one_line(tmp_path, harm):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=8, seeds=1, compress=None, onset=True))
    campaign.folder.path.mkdir()
    harm(campaign.folder.path)
    with pytest.raises(StorageError) as caught:
        campaign.run(1)
    assert "\n" not in str(caught.value) and str(campaign.folder.path) in str(caught.value)
