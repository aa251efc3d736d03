"""Campaigns: the file and its errors, task names, tables, aggregation, merge, export, status, plan."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from importlib import resources
from pathlib import Path

import MDAnalysis
import numpy as np
import pandas as pd
import pytest

import jamlab
from jamlab.campaign import sweep_states
from jamlab.campaign.bootstrap import aggregate, interval
from jamlab.campaign.campaign_file import CampaignTable, read_campaign_file
from jamlab.campaign.driver import to_do
from jamlab.campaign.exchange import export, merge
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.tables import TABLE_COLUMNS, TABLES
from jamlab.campaign.task_file import damage, read_task_file
from jamlab.campaign.tasks import batches, task_name
from jamlab.campaign.walkthrough import walk
from jamlab.campaign.worker import run_task
from jamlab.campaign.workers import Workers
from jamlab.errors import InputError, StorageError
from jamlab.lammps_files import write_dump
from jamlab.measure import COLUMNS, measure
from jamlab.parameters import defaults

SWEEP = {"name": "disks", "model": "sp", "n": 16, "seeds": 2, "compress": {"to": 0.9, "step": 0.02}}
FULL = """
name = "full"

[[sweep]]
name = "up"
model = "sp"
n = [8, 10]
seeds = [3, 4]
compress = { to = 0.9, step = 0.02, nearest = 1e-3 }
observables = ["voids"]

[[sweep]]
name = "sheared"
model = "sp"
n = 32
seeds = [3]
ensemble = "shear-stabilized"
pressures = [1e-3, 1e-2]
observables = ["spectra", "quasistatic", "correlation"]
damping = { contact = [1.0], stokes = [2.0] }
prestress = [true, false]
omega = [1e-3, 1.0]
correlation_omega = [1e-2]

[[sweep]]
name = "droplets"
model = "dp"
n = 8
seeds = [1]
onset = true
force_law = { gamma = 0.12 }
"""


def written(path, **changes):
    """A campaign file of one sweep; None takes a key out."""
    sweep = {key: value for key, value in (SWEEP | changes).items() if value is not None}
    path.write_text('name = "c"\n[[sweep]]\n' + "".join(f"{key} = {toml(value)}\n" for key, value in sweep.items()))
    return path


def toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + " }"
    return json.dumps(value)


def names(path, only=None):
    return [task.name for batch in batches(read_campaign_file(path), only) for task in batch.tasks()]


def run_here(campaign):
    """All tasks in this process, without Dask."""
    campaign.folder.prepare()
    campaign.folder.keep_copy(campaign.file)
    return [
        run_task(str(campaign.folder.path), task.name, task.parameters)
        for task in to_do(batches(campaign.content), campaign.folder.finished() | campaign.folder.failed())
    ]


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    path = tmp_path_factory.mktemp("full") / "full.toml"
    path.write_text(FULL)
    campaign = jamlab.open_campaign(path)
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"] * 6
    return campaign


# the file ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": "spx"}, r"sweep\[1\] \(disks\)\.model\[1\] = 'spx': use one of 'sp' or 'dp'"),
        ({"n": 15}, r"n\[1\] = 15: .* even"),
        ({"n": 0}, r"n\[1\] = 0: must be 2 or more"),
        ({"n": "x"}, r"n\[1\] = 'x': must be a whole number"),
        ({"n": []}, r"n = \[\]: the list is empty"),
        ({"seeds": 0}, r"seeds = 0: give how many"),
        ({"seeds": True}, r"seeds = True: give how many"),
        ({"seeds": [1, 2, 1]}, r"seeds = \[1, 2, 1\]: 1 is listed twice"),
        ({"seeds": [-1]}, r"seeds\[1\] = -1: must be 0 or more"),
        ({"seed": 3}, r"seed = 3: unknown key, did you mean seeds\?"),
        ({"name": "a b"}, r"name = 'a b': use letters"),
        ({"ensemble": "npt"}, r"ensemble = 'npt': use one of 'fixed-box' or 'shear-stabilized'"),
        ({"compress": None}, r"none of them: give exactly one of compress, pressures and onset"),
        ({"pressures": [0.01]}, r"compress and pressures: give exactly one"),
        ({"compress": {"to": 1.2}}, r"to = 1.2 is above 1, .*: lower it or by = 'phi'"),
        ({"compress": {"to": 0.9, "nearest": 0.1}}, r"nearest = 0.1 is above step = 0.01: lower it"),
        ({"compress": {"to": 0.9, "steps": 0.1}}, r"compress\.steps = 0.1: unknown key, did you mean step\?"),
        ({"compress": {"step": 0.1}}, r"compress\.to is missing: add it"),
        ({"compress": 0.9}, r"compress = 0.9: must be a table"),
        ({"compress": None, "pressures": [0.5]}, r"pressures\[1\] = 0.5: must be 0.3 or less"),
        ({"compress": None, "pressures": [0.01], "model": ["sp", "dp"]}, r"pressures are of model sp"),
        ({"model": "dp", "prestress": False}, r"prestress = false is of model sp"),
        ({"model": "dp", "observables": ["quasistatic"]}, r"'quasistatic' is of model sp"),
        ({"model": "dp", "force_law": {"gama": 1.0}}, r"force_law: model dp has no parameter 'gama': use .*gamma"),
        ({"model": "dp", "force_law": {"ka": -1.0}}, r"force_law: .*'ka'\] is -1.0"),
        ({"force_law": {"gamma": 0.1}}, r"force_law is of model dp"),
        ({"observables": ["void"]}, r"observables\[1\] = 'void': use one of"),
        ({"observables": ["spectra"]}, r"'spectra' needs omega"),
        ({"omega": [1.0]}, r"omega is there, but observable 'spectra' is not"),
        ({"observables": ["spectra"], "omega": [1.0], "damping": {}}, r"'spectra' needs a damping law"),
        ({"observables": ["spectra"], "omega": [-1.0]}, r"omega\[1\] = -1.0: must be above 0"),
        (
            {"observables": ["spectra"], "omega": {"lowest": 2.0, "highest": 1.0, "points": 3}},
            r"lowest = 2 is not below",
        ),
        ({"tolerances": {"max_force": 0}}, r"tolerances\.max_force = 0: must be above 0"),
    ],
)
def test_what_no_campaign_can_do_is_named_with_file_key_value_and_remedy(tmp_path, changes, message):
    path = written(tmp_path / "wrong.toml", **changes)
    with pytest.raises(InputError, match=message) as caught:
        read_campaign_file(path)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())


def test_files_that_are_no_campaign_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        jamlab.open_campaign(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("name = ")
    with pytest.raises(InputError, match="is not TOML"):
        jamlab.open_campaign(tmp_path / "bad.toml")
    with pytest.raises(InputError, match="no campaign has run in the folder"):
        jamlab.open_campaign(tmp_path)
    path = written(tmp_path / "c.toml")
    path.write_text(path.read_text() + path.read_text().split("\n", 1)[1])
    with pytest.raises(InputError, match="two sweeps have the name 'disks': rename one"):
        jamlab.open_campaign(path)
    with pytest.raises(InputError, match="has no sweep 'x': use one of disks"):
        jamlab.open_campaign(written(tmp_path / "c.toml")).plan(only=["x"])


# tasks --------------------------------------------------------------------------------------------------------------


def test_task_names_depend_on_what_results_depend_on(tmp_path):
    path = tmp_path / "c.toml"
    one = names(written(path))
    assert len(set(one)) == 2
    assert names(written(path, name="other", seeds=[2, 1])) == one[::-1]
    assert set(names(written(path, seeds=3))) > set(one)  # more seeds keep what is there
    assert set(names(written(path, n=[16, 18]))) > set(one)
    assert names(written(path, observables=["states"])) == one
    for changes in (
        {"ensemble": "shear-stabilized"},
        {"compress": {"to": 0.91, "step": 0.02}},
        {"observables": ["voids"]},
        {"tolerances": {"max_force": 1e-9}},
    ):
        assert not set(names(written(path, **changes))) & set(one)
    lists = {"compress": None, "pressures": [1e-3, 1e-2], "observables": ["spectra"], "omega": [1.0, 2.0]}
    turned = lists | {"pressures": [1e-2, 1e-3], "omega": [2.0, 1.0], "prestress": [True]}
    assert names(written(path, **lists)) == names(written(path, **turned))


def test_task_names_are_the_same_in_another_process_and_for_other_droplets_not(tmp_path):
    path = written(tmp_path / "c.toml", model="dp", force_law={"gamma": 0.1})
    code = "import sys; from jamlab.campaign.campaign_file import *; from jamlab.campaign.tasks import *\n"
    code += "print(*[t.name for b in batches(read_campaign_file(sys.argv[1])) for t in b.tasks()])"
    environment = os.environ | {"PYTHONHASHSEED": "7"}
    done = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, check=True, env=environment
    )
    assert done.stdout.split() == names(path)
    task = next(batches(read_campaign_file(path))[0].tasks())
    assert task_name(dict(reversed(task.parameters.items()))) == task.name
    # the defaults of the decks are part of the name: new ones make new tasks
    assert task.parameters["force_law"]["ka"] == defaults("dp")["ka"]
    assert not set(names(written(path, model="dp", force_law={"gamma": 0.11}))) & set(names(path)) - set(names(path))


def test_a_task_of_two_sweeps_is_done_once():
    content = CampaignTable.model_validate({"name": "c", "sweep": [SWEEP, SWEEP | {"name": "again", "seeds": 3}]})
    tasks = list(to_do(batches(content), set()))
    assert sorted(task.parameters["seed"] for task in tasks) == [1, 2, 3]
    assert [t.parameters["seed"] for t in to_do(batches(content), {tasks[0].name})] == [2, 3]


# results --------------------------------------------------------------------------------------------------------------


def test_tables_have_their_columns_and_one_row_for_each(full):
    for name in TABLES:
        assert tuple(full.table(name).columns) == TABLE_COLUMNS[name]
    onset, states = full.table("onset"), full.table("states")
    assert list(onset["model"]) == ["dp", "sp", "sp", "sp", "sp"]
    assert len(states) == sum(len(full.packings(task)) for task in full.finished())
    assert len(full.table("spectra")) == 2 * 2 * 2 * 2  # pressures, laws, pre-stress, frequencies
    assert len(full.table("quasistatic")) == 4
    assert set(full.table("states", sweep="sheared")["n"]) == {32}
    with pytest.raises(InputError, match="no table 'state': use one of states"):
        full.table("state")


def test_tables_hold_what_jamlab_measures(full):
    states = full.table("states", sweep="up")
    row = states[(states.n == 10) & (states.seed == 4)].iloc[-1]
    p = full.packings(row.task)[-1]
    assert {name: row[name] for name in COLUMNS} == pytest.approx(measure(p), nan_ok=True)
    assert (row.units, row.ensemble, row.contact) == ("eps", "fixed-box", "")
    onset = jamlab.jam(n=10, seed=4)
    assert (row.onset, row.onset_phi) == (jamlab.packing_fraction(onset), onset.phi)
    first = full.table("onset", sweep="up").query("n == 10 and seed == 4").iloc[0]
    network = jamlab.contacts(onset)
    assert (first.phi_J, first.z_J, first.n_contacts) == (onset.phi, network.z, network.count)
    assert first.rattlers == network.rattlers.sum()
    voids = full.table("voids", sweep="up").query("n == 10 and seed == 4")
    v = jamlab.voids(p)
    last = voids[voids.state == row.state]
    assert last.sides.tolist() == v.sides[v.percolating == 0].tolist()
    assert last["area"].sum() == v.area[v.percolating == 0].sum()
    assert last.particle_area.iloc[0] == pytest.approx(row.rho * p.area / p.n)
    droplet = full.table("states", sweep="droplets").iloc[0]
    assert (droplet.gamma, droplet.ka, droplet.contact) == (0.12, defaults("dp")["ka"], "outline")


def test_spectra_hold_what_jamlab_computes(full):
    frame = full.table("spectra")
    row = frame[(frame.law == "stokes") & ~frame.prestress & (frame.target_pressure == 1e-3) & (frame.omega == 1.0)]
    p = next(p for p in full.packings(row.task.iloc[0]) if abs(p.provenance["pressure"] / 1e-3 - 1) < 1e-5)
    s = jamlab.complex_modulus(p, [1e-3, 1.0], jamlab.StokesDrag(eta_f=2.0), False)
    assert (row.storage.item(), row.loss.item()) == (s.storage[1], s.loss[1])
    assert (row.g0.item(), row.eta0.item(), row.eta_inf.item()) == (s.g0, s.eta0, s.eta_inf)
    assert (row.eta_f.item(), np.isnan(row.beta.item()), row.converged.item()) == (2.0, True, True)
    slow = full.table("quasistatic").query("prestress and target_pressure == 1e-3").iloc[0]
    u = jamlab.slow_shear(p)
    assert slow.approach == pytest.approx(u.median_normal, rel=1e-9)
    assert slow.sliding == pytest.approx(u.median_tangential, rel=1e-9)
    c = jamlab.displacement_correlation(p, 1e-2, jamlab.ContactDamping(), True)
    curve = full.table("correlation").query("law == 'contact' and prestress and target_pressure == 1e-3")
    assert (curve.delta.tolist(), curve.box.iloc[0]) == (c.delta.tolist(), p.box[0, 0])
    np.testing.assert_allclose(curve.c, c.correlation, atol=1e-9)


def test_what_is_not_converged_is_marked(tmp_path):
    limits = {"tolerances": {"max_force": 1e-30}, "seeds": 1, "n": 8, "compress": None, "onset": True}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **limits))
    assert run_here(campaign)[0][0] == "finished"
    assert campaign.table("states")["converged"].tolist() == [False]
    assert campaign.table("onset")["converged"].tolist() == [False]
    assert campaign.aggregate(["rho"]).empty


@pytest.mark.filterwarnings("ignore:Guessed all Masses to 1.0:UserWarning")
def test_mdanalysis_iterates_the_frames_of_a_task_file(full, tmp_path):
    for task in full.finished():
        frames, file = full.packings(task), str(full.folder.task_file(task))
        write_dump(tmp_path / "run.dump", frames)
        universe = MDAnalysis.Universe(
            str(tmp_path / "run.dump"), file, topology_format="LAMMPSDUMP", format="H5MD", convert_units=False
        )
        assert len(universe.trajectory) == len(frames)
        for packing, step in zip(frames, universe.trajectory, strict=True):
            np.testing.assert_allclose(step.positions[:, :2], packing.positions, atol=1e-5)
            np.testing.assert_allclose(step.triclinic_dimensions[:2, :2], packing.box, atol=1e-5)


# aggregation ----------------------------------------------------------------------------------------------------------


def test_bootstrap_interval_of_a_mean_is_that_of_the_normal_law():
    values = np.random.default_rng(3).normal(5.0, 2.0, 400)
    low, high = interval(values, resamples=4000)
    half = 1.96 * values.std(ddof=1) / 20
    assert (low, high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.1 * half)
    assert np.isnan(interval(values[:1])).all()
    assert interval(np.ones(5)) == (1.0, 1.0)


def test_packings_are_drawn_not_rows():
    """Ten equal rows of a packing tell no more than one."""
    frame = pd.DataFrame(
        {"model": "sp", "n": 8, "seed": np.repeat([1, 2, 3], [10, 1, 1]), "z": [4.0] * 10 + [5.0, 6.0]}
    )
    row = aggregate(frame, ["z"], ["n"]).iloc[0]
    once = aggregate(frame.drop_duplicates(), ["z"], ["n"]).iloc[0]
    assert (row.z, row.z_packings) == (5.0, 3)
    assert (row.z_low, row.z_high) == (once.z_low, once.z_high)


def test_groups_bins_and_what_is_left_out():
    frame = pd.DataFrame(
        {
            "model": "sp",
            "n": 8,
            "seed": [1, 2, 1, 2, 1],
            "p": [1e-3, 1.0000002e-3, 1e-2, 1e-2, 1e-2],
            "x": [0.1, 0.3, 1.5, 1.7, 9.0],
            "g": [1.0, 3.0, 5.0, np.nan, 100.0],
        }
    )
    assert aggregate(frame, ["g"], ["p"])["g_packings"].tolist() == [2, 1]
    binned = aggregate(frame, ["g"], ["n"], along="x", bins=[0, 1, 2])
    assert (binned.g.tolist(), binned.x.tolist()) == ([2.0, 5.0], [0.2, 1.6])
    with pytest.raises(InputError, match="no column 'h': use one of model"):
        aggregate(frame, ["h"], ["p"])
    for wrong in ({"along": "x"}, {"along": "x", "bins": [2, 1]}, {"confidence": 1.0}, {"statistic": "mode"}):
        with pytest.raises(InputError, match="|".join(wrong)):
            aggregate(frame, ["g"], ["p"], **wrong)


# folders --------------------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("harm", ["cut", "flip", "empty", "other", "foreign"])
def test_damaged_files_are_found(full, harm, tmp_path):
    name, other = full.finished()[:2]
    content = full.folder.task_file(name).read_bytes()
    middle = len(content) // 2
    harmed = {
        "cut": content[:middle],
        "flip": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :],
        "empty": b"",
        "other": full.folder.task_file(other).read_bytes(),
        "foreign": b"hello" * 1000,
    }[harm]
    (tmp_path / "harmed.h5").write_bytes(harmed)
    assert damage(tmp_path / "harmed.h5", name)
    assert damage(full.folder.task_file(name), name) is None


def test_a_damaged_file_is_moved_aside_and_done_again(full, tmp_path):
    shutil.copytree(full.folder.path, tmp_path / "c")
    campaign = jamlab.open_campaign(tmp_path / "c")
    name = next(n for n in campaign.finished() if campaign.packings(n)[0].n == 8)
    whole = read_task_file(campaign.folder.task_file(name))
    campaign.folder.task_file(name).write_bytes(b"\x89HDF\r\n\x1a\n" + b"\0" * 500)
    with pytest.raises(StorageError, match=name):
        campaign.table("states")
    done = campaign.run(1)
    assert (done.finished, done.failed, list(done.repaired)) == (1, 0, [name])
    assert (tmp_path / "c" / "damaged" / f"{name}.1.h5").exists()
    again = read_task_file(campaign.folder.task_file(name))
    for column, values in whole.observables.items():
        np.testing.assert_array_equal(again.observables[column], values)


def test_a_task_that_cannot_be_done_is_recorded_and_not_tried_again(tmp_path):
    path = written(tmp_path / "c.toml", n=8, seeds=1, compress={"to": 0.5})
    campaign = jamlab.open_campaign(path)
    (outcome,) = run_here(campaign)
    assert outcome[0] == "failed"
    assert "onset lies at rho" in outcome[1]
    status = campaign.status()
    assert (status.failed, status.left) == (1, 0)
    (record,) = status.failures.values()
    assert (record["label"], record["error"]) == ("sp n=8 seed=1", "ConvergenceError")
    assert campaign.run(1) == type(campaign.run(1))(0, 0, {})  # nothing is left: no worker starts
    first = campaign.folder.failure_file(task_name(record["parameters"])).stat().st_mtime_ns
    done = campaign.run(1, retry_failed=True)
    assert (done.finished, done.failed) == (0, 1)
    assert campaign.folder.failure_file(task_name(record["parameters"])).stat().st_mtime_ns > first


def test_a_sweep_that_breaks_off_keeps_its_states_and_says_so(tmp_path, monkeypatch):
    def breaks_off(packing, to, **_):
        yield packing
        raise jamlab.EngineError("LAMMPS stopped")

    monkeypatch.setattr(sweep_states, "compress", breaks_off)
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=8, seeds=1))
    assert run_here(campaign)[0][0] == "finished"
    assert len(campaign.table("states")) == 2
    (line,) = campaign.status(verify=True).gaps.values()
    assert line == "sp n=8 seed=1 lacks states after 1: LAMMPS stopped"


def test_pressures_that_are_not_met(tmp_path, monkeypatch):
    def fussy(n, pressure, seed, **how):
        if pressure < 1e-2:
            raise jamlab.ConvergenceError("not met")
        return jamlab.pack(n, pressure, seed, **how)

    monkeypatch.setattr(sweep_states, "pack", fussy)
    path = written(tmp_path / "c.toml", n=8, seeds=1, compress=None, pressures=[1e-2, 1e-3])
    campaign = jamlab.open_campaign(path)
    assert run_here(campaign)[0][0] == "finished"
    assert campaign.table("states")["target_pressure"].tolist() == [1e-2]
    assert list(campaign.status(verify=True).gaps.values()) == ["sp n=8 seed=1 lacks pressure 0.001: not met"]
    alone = jamlab.open_campaign(written(tmp_path / "c.toml", n=8, seeds=1, compress=None, pressures=[1e-3]))
    assert run_here(alone)[0][0] == "failed"


def test_a_folder_that_cannot_be_written_is_no_fault_of_the_task(full, tmp_path, monkeypatch):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=8, seeds=1, compress=None, onset=True))
    campaign.folder.prepare()
    task = next(batches(campaign.content)[0].tasks())
    place = str(campaign.folder.path)

    def no_space(self, content):
        with open(self, "wb") as file:
            file.write(content[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", no_space)
    outcome = run_task(place, task.name, task.parameters)
    assert outcome[0] == "full"
    assert "No space left" in outcome[1]
    assert not list((campaign.folder.path / "tasks").iterdir())  # nothing half-written
    assert not campaign.folder.failed()
    monkeypatch.undo()
    assert run_task(place, task.name, task.parameters)[0] == "finished"


def test_two_drivers_do_not_share_a_folder(tmp_path):
    folder = CampaignFolder(tmp_path)
    folder.prepare()
    with folder.lock():
        with pytest.raises(StorageError, match=f"process {os.getpid()} on .* works in {tmp_path}: wait"):
            jamlab.open_campaign(written(tmp_path / "c.toml"), tmp_path).run(1)
    with folder.lock():  # free again
        pass
    code = "import sys, os, pathlib; from jamlab.campaign.folder import CampaignFolder\n"
    code += "lock = CampaignFolder(pathlib.Path(sys.argv[1])).lock(); lock.__enter__(); os.kill(os.getpid(), 9)"
    assert subprocess.run([sys.executable, "-c", code, tmp_path], check=False).returncode == -9
    with folder.lock():  # the lock of a dead driver is none
        pass


def test_merge_takes_what_is_whole_and_missing(full, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(full.folder.path, other)
    a, b = full.finished()[:2]
    (other / "tasks" / f"{a}.h5").write_bytes(b"no")
    target = jamlab.open_campaign(full.file, tmp_path / "merged")
    assert merge(target, [other]) == {"copied": 5, "present": 0, "damaged": 1}
    assert merge(target, [other, full.folder.path]) == {"copied": 1, "present": 10, "damaged": 1}
    assert target.finished() == full.finished()
    assert target.folder.task_file(b).read_bytes() == full.folder.task_file(b).read_bytes()
    with pytest.raises(InputError, match="no campaign has run"):
        merge(target, [tmp_path / "nowhere"])


def test_export(full, tmp_path):
    files = export(full, tmp_path / "csv")
    assert sorted(file.stem for file in files) == sorted(TABLES)
    back = pd.read_csv(tmp_path / "csv" / "states.csv", dtype=str)
    np.testing.assert_array_equal(back["g"].astype(float), full.table("states")["g"])
    pytest.importorskip("pyarrow")
    export(full, tmp_path / "parquet", "parquet", ["spectra"])
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "parquet" / "spectra.parquet"), full.table("spectra"))
    dumps = export(full, tmp_path / "dump", "dump", sweep="droplets")
    assert dumps[0].read_text().startswith("ITEM: TIMESTEP")
    with pytest.raises(InputError, match="unknown format 'xls': use one of csv"):
        export(full, tmp_path, "xls")


def test_parquet_without_pyarrow_says_what_to_install(full, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install 'jamlab\[parquet\]', or export csv"):
        export(full, tmp_path / "out", "parquet")


def test_plan_counts_states_and_learns_from_finished_tasks(full, tmp_path):
    lines = {(line.sweep, line.n): line for line in full.plan()}
    assert all(line.left == 0 and line.seconds == 0 and line.measured for line in lines.values())
    path = tmp_path / "full.toml"
    path.write_text(FULL)
    fresh = jamlab.open_campaign(path).plan()
    assert [(line.tasks, line.left, line.measured) for line in fresh[:2]] == [(2, 2, False)] * 2
    states = full.table("states", sweep="up").groupby(["n", "seed"]).size()
    assert abs(fresh[0].states - states[8].mean()) < 8  # the onset of so few disks lies lower than the typical one
    sizes = [full.folder.task_file(task).stat().st_size for task in full.finished("up")]
    assert 0.3 < sum(line.bytes for line in fresh[:2]) / sum(sizes) < 3


# command line, workers, examples --------------------------------------------------------------------------------------


def test_command_line(full, tmp_path, capsys):
    from jamlab.cli import app

    def said(*words):
        app(args=["campaign", *map(str, words)], standalone_mode=False)
        return capsys.readouterr().out

    status = json.loads(said("status", full.folder.path, "--verify", "--json"))
    assert (status["tasks"], status["finished"], status["damaged"]) == (6, 6, {})
    assert "total" in said("status", full.file)
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
    with pytest.raises(InputError, match="leave workers and slurm out"):
        Workers(count=2, scheduler="tcp://127.0.0.1:1")


def test_reference_campaign_is_packed_and_valid():
    text = resources.files("jamlab.campaign").joinpath("reference.toml").read_text()
    content = CampaignTable.model_validate(tomllib.loads(text))
    assert content.name == "reference"
    assert {"sp", "dp"} == {model for sweep in content.sweep for model in sweep.model}


def test_walkthrough(tmp_path, capsys):
    walk(tmp_path, workers=2, seeds=2)
    out = capsys.readouterr().out
    assert "6 tasks now, 6 in all" in out
