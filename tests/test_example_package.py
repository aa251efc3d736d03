"""The example package of docs/extending: installed beside jamlab, its own tests, and what its tutorial says of it."""

import os
import re
import subprocess
import sys

import pytest
from example_package import SOURCE, install

PAGE = (SOURCE / "index.md").read_text(encoding="utf-8")
CODE = SOURCE / "jamlab_example"
OWN = {"OMP_NUM_THREADS": "1", "MPLBACKEND": "agg", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # it needs none of ours


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return install(tmp_path_factory.mktemp("site"))


def run_tests(place, *chosen):
    """Its tests, in a process that finds the package by its metadata alone."""
    words = ["-q", "-p", "no:cacheprovider", "-c", str(SOURCE / "pyproject.toml"), str(SOURCE / "tests"), *chosen]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words],
        cwd=place,
        env=os.environ | OWN | {"PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_its_tests_pass(place):
    run_tests(place, "-k", "not campaign and not page and not oscillation")


@pytest.mark.slow
def test_all_of_its_tests_pass(place):
    run_tests(place)


def test_the_tutorial_names_all_files_and_has_few_words():
    files = {path.name for path in CODE.iterdir() if path.is_file() and path.name != "__init__.py"}
    assert set(re.findall(r"^\| \[`([\w.]+)`\]", PAGE, re.MULTILINE)) == files
    assert len(PAGE.split()) <= 900


def test_the_tutorial_shows_lines_of_the_files():
    """What stands in its blocks marked by a file is in that file, line by line."""
    blocks = re.findall(r"```\w+\n# (\w+\.py|pyproject\.toml)\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) >= 4
    for name, block in blocks:
        path = SOURCE / name if name == "pyproject.toml" else CODE / name
        lines = path.read_text(encoding="utf-8").splitlines()
        assert [line for line in block.splitlines() if line not in lines] == [], name
