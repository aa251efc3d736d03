"""LAMMPS reads packings from the folder that the user's system names, whatever letters its name has."""

import os
import subprocess
import sys
import tempfile

import pytest

import jamlab

RUN = "import jamlab; p = jamlab.pack(n=16, pressure=1e-2, seed=1); print(jamlab.evaluate(p).max_force < 1e-11)"


@pytest.mark.parametrize("name", ["plain", "a b", 'say "so"', "$HOME & more", "数"])
def test_a_temporary_folder_of_any_name(tmp_path, monkeypatch, dp_onset, name):
    folder = tmp_path / name
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    assert jamlab.evaluate(jamlab.pack(n=16, pressure=1e-2, seed=1)).max_force < 1e-11
    assert jamlab.evaluate(dp_onset).max_force < 1e-9
    assert not list(folder.iterdir())


def test_a_temporary_folder_of_the_environment(tmp_path):
    (tmp_path / "é").mkdir()
    environment = os.environ | {"TMPDIR": str(tmp_path / "é")}
    done = subprocess.run([sys.executable, "-c", RUN], env=environment, capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("True\n", 0), done.stderr
    assert not list((tmp_path / "é").iterdir())
