"""Campaigns: observables added later are measured on stored states; observables of the user's own."""

import csv
import time

import pytest
from campaigns import assert_same, run_here, written

import jamlab
from jamlab.campaign import states as making
from jamlab.campaign import workers
from jamlab.campaign.task_file import TaskContent, read_task_file, write_task_file
from jamlab.campaign.tasks import batches, states_name
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.packing.quantities import COLUMNS

OWN = """
import sys

CALLS = []

def twice_phi(packing):
    return 2 * packing.phi

def largest(packing):
    return {"widest": packing.diameters.max(), "nothing": float("nan")}

def text(packing):
    return "dense"

def clash(packing):
    return {"rho": 1.0}

def uneven(packing):
    CALLS.append(packing)
    return {f"call_{len(CALLS)}": 1.0}

def breaks(packing):
    return packing.no_such_thing

def leaves(packing):
    sys.exit("own_numbers has enough")

class Odd(BaseException):
    pass

def odd(packing):
    raise Odd

def stops(packing):
    raise KeyboardInterrupt

def surrogate(packing):
    return {"\\ud800": 1.0}

def null(packing):
    return {"a\\0b": 1.0}
"""
MORE = {
    "observables": ["voids", "spectra", "quasistatic", "correlation", "own_numbers:twice_phi", "own_numbers:largest"],
    "omega": [1e-2, 1.0],
    "correlation_omega": [1e-1],
    "prestress": [True, False],
}
ONSET = {"n": 8, "compress": None, "onset": True}
LOOSE = {"n": 8, "compress": None, "phi": [0.7]}  # takes no time
SHORT = {"n": 8, "compress": {"to": 0.88, "step": 0.02}}


@pytest.fixture
def forbid_minimization(monkeypatch):
    """Function after which nothing can be made or minimised any more."""

    def forbid():
        def fail(*_, **__):
            raise AssertionError("a packing was made or minimised")

        for name in ("make", "compress"):
            monkeypatch.setattr(making, name, fail)
        monkeypatch.setattr(Session, "minimize", fail)

    return forbid


def run(path):
    """The campaign of a file, run by the driver's own steps in this process."""
    (path.parent / "own_numbers.py").write_text(OWN)
    campaign = jamlab.open_campaign(path)
    assert {outcome.state for outcome in run_here(campaign)} <= {"finished"}
    return campaign


def seconds(campaign):
    """What the tasks of a campaign took, by their files."""
    return sum(read_task_file(campaign.folder.task_file(name)).seconds for name in campaign.finished())


PRESSED = {"n": 16, "compress": None, "pressures": [1e-2, 1e-3], "ensemble": "shear-stabilized", "seeds": 1}


@pytest.mark.parametrize("protocol", [pytest.param(SHORT, marks=pytest.mark.slow), PRESSED])
def test_observables_added_later_need_no_minimization(tmp_path, forbid_minimization, protocol):
    (tmp_path / "at_once").mkdir()
    began = time.perf_counter()
    at_once = run(written(tmp_path / "at_once" / "c.toml", **protocol, **MORE))
    path = tmp_path / "c.toml"
    before = run(written(path, **protocol))
    assert 0 < seconds(at_once) + seconds(before) < time.perf_counter() - began  # one after another
    forbid_minimization()
    run(written(path, **protocol, observables=["voids"]))
    later = run(written(path, **protocol, **MORE))
    assert later.status().foreign == 2 * len(at_once.finished())
    assert seconds(later) > seconds(before)
    assert_same(at_once, later)
    assert len(later.table("states")) and len(later.table("voids"))


def test_state_keys_depend_on_what_states_depend_on(tmp_path):
    def key(**changes):
        content = jamlab.open_campaign(written(tmp_path / "c.toml", **changes)).content
        return states_name(next(batches(content)[0].names()))

    same = key()
    assert key(**MORE) == same
    others = [{"seeds": [2]}, {"n": 18}, {"compress": {"to": 0.9, "step": 0.01}}, {"ensemble": "shear-stabilized"}]
    steps = {"to": 0.9, "step": 0.02}  # as of `same`
    others += [
        {"force_tolerance": 1e-10},
        {"compress": steps | {"pressure_tolerance": 1e-2}},
        {"search": "incremental"},
    ]
    others += [{"step": 0.02}, {"size_ratio": 1.3}, {"fraction_large": 0.25}]
    assert len({same, *(key(**changes) for changes in others)}) == 11


def test_sweeps_of_one_run_share_packings(tmp_path, monkeypatch, here):
    """Two sweeps of the same three packings: each is made once, for the first that comes to it."""
    path = written(tmp_path / "c.toml", **PRESSED | {"n": 8, "pressures": [1e-2], "seeds": 3})
    more = written(tmp_path / "d.toml", **PRESSED | {"n": 8, "pressures": [1e-2], "seeds": 3}, observables=["voids"])
    text = more.read_text()
    path.write_text(path.read_text() + text[text.index("[[sweep]]") :].replace('"disks"', '"again"'))
    monkeypatch.setattr(making, "make", counted := Counted(making.make))
    assert jamlab.open_campaign(path).run(1).finished == 6
    assert sorted(recipe.seed for (recipe,) in counted.calls) == [1, 2, 3]


def test_a_new_column_of_states_makes_new_tasks_of_the_same_packings(tmp_path, monkeypatch):
    content = jamlab.open_campaign(written(tmp_path / "c.toml", **ONSET, seeds=1)).content
    (before,) = batches(content)[0].names()
    monkeypatch.setattr("jamlab.campaign.tasks.COLUMNS", (*COLUMNS, "charge"))
    (after,) = batches(content)[0].names()
    assert after != before and states_name(after) == states_name(before)


def test_own_observables_are_columns_of_states(tmp_path):
    campaign = run(written(tmp_path / "c.toml", **SHORT, observables=["own_numbers:twice_phi", "own_numbers:largest"]))
    states = campaign.table("states")
    assert states["twice_phi"].tolist() == (2 * states["phi"]).tolist()
    for task, part in states.groupby("task"):
        assert part["widest"].tolist() == [p.diameters.max() for p in campaign.packings(task)]
    assert states["nothing"].isna().all()
    (file,) = campaign.export(tmp_path / "tables", ["states"])
    with open(file, newline="") as lines:  # parsed by Python: older pandas miss the last digit
        assert [float(row["twice_phi"]) for row in csv.DictReader(lines)] == states["twice_phi"].tolist()
    mean = campaign.aggregate(["twice_phi"], by=["n"])
    assert mean["twice_phi_packings"].tolist() == [2]


REFUSED = ["text", "clash", "uneven", "breaks", "leaves", "odd", "surrogate", "null"]


@pytest.mark.parametrize("function", REFUSED)
def test_what_own_observables_may_not_return(tmp_path, function):
    """No number, a column that is taken or cannot be stored, other columns for other states, an error of its own, the
    end of the process by `sys.exit`: named, others go on."""
    (tmp_path / "own_numbers.py").write_text(OWN)
    campaign = jamlab.open_campaign(
        written(tmp_path / "c.toml", **LOOSE, seeds=1, observables=[f"own_numbers:{function}"])
        if function != "uneven"  # needs two states
        else written(tmp_path / "c.toml", **SHORT, seeds=1, observables=[f"own_numbers:{function}"])
    )
    (outcome,) = run_here(campaign)
    (record,) = campaign.status().failures.values()
    assert (outcome.state, record["label"], record["error"]) == ("failed", "sp n=8 seed=1", "InputError")
    assert f"own_numbers:{function}" in record["reason"]


def test_ctrl_c_in_an_own_observable_is_ctrl_c(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run(written(tmp_path / "c.toml", **ONSET, seeds=1, observables=["own_numbers:stops"]))


@pytest.mark.parametrize("observable", ["nowhere_to_be:f", "own_numbers:f", "broken:f", "leaving:f"])
def test_own_observables_that_cannot_be_imported_stop_a_run_before_it_begins(tmp_path, observable):
    """Planning imports nothing: no code beside the file runs."""
    (tmp_path / "own_numbers.py").write_text(OWN)
    (tmp_path / "broken.py").write_text(f"from pathlib import Path\nPath({str(tmp_path / 'ran')!r}).touch()\n1 / 0\n")
    (tmp_path / "leaving.py").write_text("raise SystemExit(4)\n")
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SHORT, observables=[observable]))
    assert campaign.plan()[0].left == 2 and not (tmp_path / "ran").exists()
    with pytest.raises(InputError) as caught:
        campaign.run(1)
    assert observable in str(caught.value)
    assert campaign.status().left == 2


def test_two_own_observables_of_one_column_are_not_mixed(tmp_path):
    (tmp_path / "more_numbers.py").write_text("def twice_phi(packing):\n    return 0.0\n")
    path = written(tmp_path / "c.toml", **SHORT, observables=["own_numbers:twice_phi"], seeds=1)
    other = written(tmp_path / "d.toml", **SHORT, observables=["more_numbers:twice_phi"], seeds=1).read_text()
    path.write_text(path.read_text() + other[other.index("[[sweep]]") :].replace("disks", "again"))
    campaign = run(path)
    with pytest.raises(InputError) as caught:
        campaign.table("states")
    assert "'twice_phi'" in str(caught.value)
    assert (campaign.table("states", sweep="again")["twice_phi"] == 0).all()


RAISED = [("geometry.contact_network", "CONTACTS_DEFINITION"), ("protocols.decompression", "PRESSURE_PROTOCOL")]


@pytest.mark.parametrize(("module", "constant"), RAISED)
def test_rows_of_two_versions_stand_apart(tmp_path, monkeypatch, module, constant):
    """After a raise, and with one more seed: definitions are measured again on stored packings, protocols run again;
    no table holds the old rows."""
    before = run(written(tmp_path / "c.toml", **PRESSED))
    old = set(before.finished())
    monkeypatch.setattr(f"jamlab.{module}.{constant}", 7)
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **(PRESSED | {"seeds": 2})))
    assert [line.stored for line in campaign.plan()] == [int("DEFINITION" in constant)]
    assert not len(campaign.table("states"))
    monkeypatch.setattr(making, "make", counted := Counted(making.make))
    monkeypatch.setattr(workers, "numbers_of", measured := Counted(workers.numbers_of))
    assert [outcome.state for outcome in run_here(campaign)] == ["finished"] * 2
    assert [recipe.seed for (recipe,) in counted.calls] == ([2, 2] if "DEFINITION" in constant else [1, 1, 2, 2])
    assert len(measured.calls) == 2  # of the old packings too
    states = campaign.table("states")
    assert sorted(states["seed"]) == [1, 1, 2, 2] and old.isdisjoint(states["task"])
    assert all("=7" in text for text in states["definitions" if "DEFINITION" in constant else "protocol"])


def test_rows_that_lack_a_column_are_measured_again(tmp_path, monkeypatch):
    """Such as those of a jamlab that measured less under the same definitions."""
    before = run(written(tmp_path / "c.toml", **ONSET, seeds=1))
    (name,) = before.finished()
    path, parameters = before.folder.task_file(name), next(batches(before.content)[0].tasks()).parameters
    whole, _ = making.read_stored(before.folder, [name], parameters)
    assert whole.observables.keys() >= {*COLUMNS}
    task, states = next(batches(before.content)[0].tasks()), making.read_stored(before.folder, [name], parameters)[1]
    less = {column: values for column, values in whole.observables.items() if column != COLUMNS[-1]}
    write_task_file(path, TaskContent(task, states, less, {}, 1.0))
    found, _ = making.read_stored(before.folder, [name], parameters)
    assert found.observables == {}


class Counted:
    """A function that notes the arguments of each call."""

    def __init__(self, function):
        self.function, self.calls = function, []

    def __call__(self, *words, **how):
        self.calls.append(words)
        return self.function(*words, **how)
