"""The installation: what LAMMPS loads and cites, and what is said where parts are missing."""

import os
import subprocess
import sys
import tempfile
import types
from pathlib import Path

import pytest

import jamlab
from jamlab import installed_files
from jamlab.engine import installation

FORK = """
import os, signal, sys
import jamlab
p = jamlab.read(sys.argv[1])
jamlab.evaluate(p)
if child := os.fork():
    sys.exit(os.waitpid(child, 0)[1] or os.environ["OMP_NUM_THREADS"] != "2")
signal.alarm(20)
jamlab.evaluate(p)
os._exit(0)
"""


def test_lammps_runs_in_a_forked_child_whatever_threads_are_asked_for(sp_jammed, tmp_path):
    """As the pools of MDAnalysis and of multiprocessing fork; OpenMP's threads do not live on in the child."""
    jamlab.write(path := tmp_path / "p.h5", sp_jammed)
    line = [sys.executable, "-c", FORK, str(path)]
    assert subprocess.run(line, env=os.environ | {"OMP_NUM_THREADS": "2"}, timeout=60).returncode == 0


def test_another_lammps_version_is_refused(sp_jammed, monkeypatch):
    """The plugin registers nothing there; both versions and the remedies are named."""
    monkeypatch.setattr(installation, "PLUGIN_STYLES", (("pair", "not/there"),))
    monkeypatch.setattr(installation, "required_lammps", lambda: "2024.8.29.1.0")
    with pytest.raises(jamlab.EngineError, match=r"2024\.8\.29"):
        jamlab.evaluate(sp_jammed)


def test_a_missing_deck_is_named(tmp_path, monkeypatch, sp_jammed):
    """The installation lost an include file."""
    monkeypatch.setattr(installed_files, "installed", lambda folder: Path(tmp_path))
    with pytest.raises(jamlab.EngineError, match="parts/sp"):
        jamlab.evaluate(sp_jammed)


@pytest.mark.parametrize("name", ["plain", "a b", 'say "so"', "$HOME & more", "数"])
def test_a_temporary_folder_of_any_name(tmp_path, monkeypatch, dp_onset, name):
    folder = tmp_path / name
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    assert jamlab.evaluate(jamlab.pack(n=16, pressure=1e-2, seed=1)).max_force < 1e-11
    assert jamlab.evaluate(dp_onset).max_force < 1e-9
    assert not list(folder.iterdir())


def test_lammps_leaves_other_processes_of_mpi4py_alone(monkeypatch):
    """Those of its MPIPoolExecutor run calls of their own: a LAMMPS of all of them would wait for them."""
    given = []

    class World:
        def Get_size(self):  # noqa: N802  as MPI has it
            return 3

    mpi = types.SimpleNamespace(COMM_SELF="self", COMM_WORLD=World(), Is_initialized=lambda: True)
    monkeypatch.setattr(installation, "lammps_class", lambda: lambda cmdargs, comm: given.append(comm))
    for module in (mpi, None):
        monkeypatch.setitem(sys.modules, "mpi4py.MPI", module)
        installation._silent("")
    assert given == ["self", None]
