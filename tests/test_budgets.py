"""Budgets of lines: who adds must remove. Lower a number whenever its folder has shrunk."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BUDGETS = {"jamlab": 28_000, "studies": 8_000, "tests": 22_000, "plugin": 11_000}  # of Python, and of C++
DECKS = 800  # decks and their parts, without molecule files and the examples


def lines(folder, endings):
    """Of the files of a folder, without what a build leaves there."""
    files = [path for path in (ROOT / folder).rglob("*") if path.suffix in endings and "build" not in path.parts]
    return sum(len(path.read_bytes().splitlines()) for path in files)


@pytest.mark.parametrize(("folder", "most"), BUDGETS.items())
def test_lines_of_a_folder(folder, most):
    assert lines(folder, {".cpp", ".h"} if folder == "plugin" else {".py"}) <= most


def test_lines_of_decks():
    decks = [path for path in (ROOT / "lammps_inputs").glob("*") if path.is_file()]
    parts = [path for path in (ROOT / "lammps_inputs" / "parts").iterdir() if path.suffix != ".mol"]
    assert sum(len(path.read_bytes().splitlines()) for path in [*decks, *parts]) <= DECKS
