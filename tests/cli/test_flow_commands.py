"""The commands of flow in time: tables, files, pictures, and a run that goes on."""

import json

import numpy as np
import pandas as pd
import pytest
from commands import call

import jamlab
from jamlab.flow.flow_curve import Trials

RUNS = {  # words after the file -> columns of the table, and a note
    ("shear", "--rate", "0.1", "--strain", "0.2", "--snapshot-every", "0.1"): ("N₁", "start-up"),
    ("quasistatic-shear", "--strain", "0.02", "--strain-step", "2e-3"): ("N₁", "plastic events seen"),
    ("oscillate", "--omega", "1", "--amplitude", "1e-3", "--cycles", "2"): ("viscous stress", "|G*_3|/|G*_1|"),
    ("creep", "--stress", "1e-4", "--duration", "5", "--damping", "alpha=0.667"): ("compliance", "CREEPS"),
    ("relax-stress", "--strain", "1e-4", "--duration", "5", "--damping", "stokes"): (
        "modulus",
        "elastic stress before",
    ),
    ("flow-curve", "--rate", "0.3", "--strain", "1", "--discard", "0.2"): ("stress stderr", "no Herschel-Bulkley fit"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flow")
    jamlab.write(folder / "p.h5", jamlab.pack(n=16, pressure=2e-2, seed=2))
    return folder


@pytest.mark.parametrize("words", RUNS, ids=lambda words: words[0])
def test_command(folder, words):
    """The second call finds the run done, in the file of the first."""
    name, *options = words
    column, note = RUNS[words]
    picture = ["--plot", f"{name}.png"] if name in ("shear", "flow-curve") else []
    done = call(folder, name, "p.h5", *options, "--out", f"{name}.h5", "--csv", f"{name}.csv", *picture)
    assert done.exit_code == 0, done.stderr
    assert all(text in done.stdout for text in (column, note, "energy balance to", f"wrote {name}.h5"))
    assert not picture or (folder / f"{name}.png").stat().st_size > 5000
    found = jamlab.read_flow(folder / f"{name}.h5")
    again = call(folder, name, "p.h5", *options, "--out", f"{name}.h5", "--json")
    printed = json.loads(again.stdout)
    assert printed["stress"] == pytest.approx(found.stress.tolist()) and printed["conclusion"] == found.conclusion
    assert np.max(printed["energy_error"]) == np.max(found.energy_error) < 0.02
    assert printed.keys() - {"out"} == found.to_dict().keys()
    table = pd.read_csv(folder / f"{name}.csv")
    assert np.allclose(table["stress"], found.stress) and len(table) == len(found.stress)


def test_the_error_of_the_path_is_stated(folder):
    """As of Python: a column and a note, of a run that is done already too; a curve of means has another way."""
    words = ("creep", "p.h5", "--stress", "1e-4", "--duration", "1", "--out", "e.h5")
    assert "error of the trajectory" not in call(folder, *words).stdout
    done = call(folder, *words, "--trajectory-error", "--csv", "e.csv")
    assert "error of the trajectory" in done.stdout and "trajectory error" in done.stdout, done.stderr
    found = jamlab.creep(jamlab.read(folder / "p.h5"), 1e-4, 1.0, trajectory_error=True)
    assert found.trajectory_error[-1] > 0
    assert np.array_equal(pd.read_csv(folder / "e.csv")["trajectory_error"], found.trajectory_error)
    refused = call(folder, "flow-curve", "p.h5", "--rate", "1", "--trajectory-error")
    assert refused.exit_code == 2 and "--tolerance" in refused.stderr


def test_a_flow_is_stopped(folder):
    """There is no modulus without a step of strain: the table does without its column."""
    done = call(folder, "stop-flow", "p.h5", "--duration", "5", "--out", "s.h5", "--csv", "s.csv")
    assert done.exit_code == 0 and "viscous stress" in done.stdout, done.stderr
    table, found = pd.read_csv(folder / "s.csv"), jamlab.read_flow(folder / "s.h5")
    assert np.allclose(table["stress"], found.stress) and "modulus" not in table
    again = call(folder, "stop-flow", "p.h5", "--duration", "5", "--out", "s.h5", "--json")
    assert json.loads(again.stdout)["stress"] == pytest.approx(found.stress.tolist())


def test_refusals(folder, monkeypatch):
    monkeypatch.setattr("jamlab.flow.flow_curve.TRIALS", Trials(seconds=0.0))
    for words, message in {
        ("shear", "p.h5", "--rate", "0.1", "--plot", "p.txt"): "p.txt",
        ("shear", "p.h5", "--rate", "0.1", "--out", "p.h5"): "p.h5",
        ("shear", "p.h5", "--rate", "1e9", "--out", "fast.h5"): "--rate 1000000000.0",
        ("shear", "p.h5", "--rate", "0"): "use `jamlab quasistatic-shear`",
        ("flow-curve", "p.h5", "--rate", "0.0"): "use `jamlab quasistatic-shear`",
        ("relax-stress", "p.h5", "--strain", "0", "--duration", "1"): "use `jamlab stop-flow`",
        ("flow-curve", "p.h5", "--rate", "1e-6", "--within", "1", "--out", "slow.h5"): "1 s",
    }.items():
        done = call(folder, *words)
        assert done.exit_code == 1 and message in " ".join(done.stderr.split()), done.stderr
    assert not (folder / "slow.h5").exists()


def test_a_name_of_another_format_is_refused(folder):
    for words in (["creep", "p.h5", "--stress", "1e-4", "--duration", "5"], ["pack", "--n", "8"]):
        done = call(folder, *words, "--out", "x.csv")
        assert done.exit_code == 1 and "x.csv" in done.stderr and ".h5" in done.stderr
        assert not (folder / "x.csv").exists()


def test_a_run_of_another_packing_stays_unless_forced(folder):
    jamlab.write(folder / "other.h5", jamlab.pack(n=16, pressure=2e-2, seed=3))
    words = ["--rate", "0.1", "--strain", "0.02", "--rows", "2", "--out", "kept.h5"]
    assert call(folder, "shear", "p.h5", *words).exit_code == 0
    before = (folder / "kept.h5").read_bytes()
    done = call(folder, "shear", "other.h5", *words)
    assert done.exit_code == 1 and "kept.h5" in done.stderr and "--overwrite" in done.stderr
    assert (folder / "kept.h5").read_bytes() == before
    assert call(folder, "shear", "other.h5", *words, "--overwrite").exit_code == 0
    assert (folder / "kept.h5").read_bytes() != before
