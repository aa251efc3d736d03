"""Budgets of lines: who adds must remove. Lower a number whenever its folder has shrunk."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ENDINGS = {".py", ".pyi", ".cpp", ".h", ".cmake", ".js", ".txt", ".yaml"}
BUDGETS = {"jamlab": 32_517, "studies": 8_000, "tests": 22_777, "plugin": 11_800}
DECKS = 800  # decks and their parts, without molecule files and the examples


def lines(folder, endings):
    """Of the files of a folder, without what a build leaves there."""
    files = [path for path in (ROOT / folder).rglob("*") if path.suffix in endings and "build" not in path.parts]
    return sum(len(path.read_bytes().splitlines()) for path in files)


@pytest.mark.parametrize(("folder", "most"), BUDGETS.items())
def test_lines_of_a_folder(folder, most):
    assert lines(folder, ENDINGS if folder == "plugin" else {".py"}) <= most


def test_lines_of_decks():
    decks = [path for path in (ROOT / "lammps_inputs").glob("*") if path.is_file()]
    parts = [path for path in (ROOT / "lammps_inputs" / "parts").iterdir() if path.suffix != ".mol"]
    assert sum(len(path.read_bytes().splitlines()) for path in [*decks, *parts]) <= DECKS
