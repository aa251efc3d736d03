"""A public function with its result and its table of campaigns takes the files of `near_gaps` and no other of jamlab:
in a copy of the code that has them, what holds names together passes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import near_gaps
import pytest

import jamlab
from jamlab import face

ROOT = Path(__file__).parents[1]
TESTS = (
    *("test_public_names.py", "test_one_name.py", "test_hints.py", "test_shape_of_the_code.py", "cli/test_options.py"),
    *("test_directions_of_imports.py", "campaign/test_file.py", "campaign/test_folder.py"),
    *("test_docstring_examples.py", "test_argument_types.py"),
)
OF_IT = "near or every or choices or map or said or name_means or habits or help or option or forms"
# editable installs look into the checkout before anything else
AS_COPIED = (
    "import sys\nsys.meta_path[:] = [each for each in sys.meta_path if 'Redirecting' not in type(each).__name__]\n"
)
USED = """
import argument_page
import jamlab
assert argument_page.page().count("| `gap_width`<br>") == 1
p = jamlab.pack(n=16, pressure=1e-2, seed=1)
assert "Structure    near_gaps" in jamlab.__doc__
for name, told in {"small_gaps": "jamlab.near_gaps`", "piv": "jamlab.near_gaps`", "NearGaps": "results.Near"}.items():
    try:
        getattr(jamlab, name)
    except AttributeError as error:
        assert told in str(error), error
try:
    jamlab.near_gaps(p, gap_size=1.0)
except jamlab.ArgumentError as error:
    assert "use `gap_width`" in str(error), error
open("c.toml", "w").write('''name = "c"
[[sweep]]
name = "s"
model = "sp"
n = 8
seeds = 1
pressures = [1e-2]
observables = ["near_gaps"]
gap_width = 1.0
''')
campaign = jamlab.open_campaign("c.toml")
campaign.run(1)
table = campaign.table("near_gaps")
assert len(table) > 8 and list(table.columns)[-1] == "gap"
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The checkout with the new function."""
    place = tmp_path_factory.mktemp("copy")
    for folder in ("jamlab", "tests", "docs", "lammps_inputs"):
        shutil.copytree(ROOT / folder, place / folder, ignore=shutil.ignore_patterns("build", "__pycache__", "*.png"))
    for file in ("pyproject.toml", "README.md", "CONTRIBUTING.md", "CHANGELOG.md"):
        shutil.copy(ROOT / file, place)
    for name, text in near_gaps.NEW.items():
        (place / "jamlab" / name).write_text(text)
    for name, (before, line) in near_gaps.LINES.items():
        text = (place / "jamlab" / name).read_text()
        assert text.count(before) == 1, name
        (place / "jamlab" / name).write_text(text.replace(before, line + before))
    (place / "sitecustomize.py").write_text(AS_COPIED)
    return place


def run(place, *words):
    path = os.pathsep.join(map(str, (place, place / "docs" / "extensions", place / "tests" / "support")))
    env = os.environ | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1", "MPLBACKEND": "agg"}
    done = subprocess.run([sys.executable, *words], cwd=place, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]
    return done.stdout


@pytest.mark.slow
def test_a_new_function_is_found_by_all_that_lists_functions(copy):
    run(copy, "-c", USED)


@pytest.mark.slow
def test_what_holds_names_together_passes(copy):
    files = [f"tests/{name}" for name in TESTS]
    said = run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", OF_IT, *files)
    assert " passed" in said


def test_a_function_is_found_by_what_it_is_also_called():
    called = face.also_called()
    assert len(called) >= 3
    for name, words in called.items():
        for word in words:
            with pytest.raises(AttributeError, match=f"use `jamlab.{name}`"):
                getattr(jamlab, word)


def test_the_map_names_functions_that_it_does_not_know_yet(monkeypatch):
    monkeypatch.setattr(face, "modules", lambda: {"jam": "protocols.onset", "one": "motion.one", "two": "motion.two"})
    text = "map\n\nStates  jam: onset\nErrors  E\n\n    example\n"
    assert face.completed(text) == "map\n\nStates  jam: onset\nErrors  E\nMotion       one, two\n\n    example\n"
