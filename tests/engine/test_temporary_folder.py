"""LAMMPS reads packings from the folder that the user's system names, whatever letters its name has."""

import os
import subprocess
import sys

import pytest

RUN = "import jamlab; p = jamlab.pack(n=16, pressure=1e-2, seed=1); print(jamlab.evaluate(p).max_force < 1e-11)"
DROPLETS = "; d = jamlab.jam('dp', 6, 1); print(jamlab.evaluate(d).max_force < 1e-9)"


@pytest.mark.parametrize("name", ["plain", "é", "a b", 'say "so"', "$HOME & more", "数"])
def test_a_temporary_folder_of_any_name(tmp_path, name):
    folder = tmp_path / name
    folder.mkdir()
    line = [sys.executable, "-c", RUN + DROPLETS]
    done = subprocess.run(line, env=os.environ | {"TMPDIR": str(folder)}, capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("True\nTrue\n", 0), done.stderr
    assert not list(folder.iterdir())
