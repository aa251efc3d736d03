"""Decks: random starts that find no room, and replicas of `lmp -partition` beside each other."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from jamlab.engine.deck_defaults import copy_decks
from jamlab.kernels.installed_files import installed

BIN = Path(sys.executable).parent
DECKS = installed("lammps_inputs")


def lmp(folder: Path, deck: Path, *words: str, ranks: int = 1, decks: Path = DECKS) -> subprocess.CompletedProcess[str]:
    """LAMMPS in `folder`, which leaves no hidden file there."""
    start = [str(BIN / "mpiexec"), "-n", str(ranks)] if ranks > 1 else []
    line = [*start, str(BIN / "lmp"), "-in", str(deck), "-var", "dir", str(decks), *words]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    assert not [path.name for path in folder.iterdir() if path.suffix in {".parts", ".given", ".settings"}]
    return done


def refusals(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("REFUSED: ")]


def test_droplets_that_find_no_room_are_refused(tmp_path):
    """LAMMPS itself warns and goes on."""
    done = lmp(tmp_path, DECKS / "in.dp.jam", "-log", "none", "-var", "phi_start", "0.5", "-var", "n", "8")
    assert done.returncode == 1
    (line,) = refusals(done.stdout)
    found = re.fullmatch(r"REFUSED: phi_start = 0.5: only (\d+) of 8 particles found room: lower phi_start, .*", line)
    assert found and 0 < int(found[1]) < 8
    inserted = [int(n) for n in re.findall(r"Only inserted (\d+) particles out of 4", done.stdout)]
    assert int(found[1]) == sum(inserted) + 4 * (2 - len(inserted))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("deck", ["in.sp.jam", "in.sp.pressure"])
def test_disks_that_find_no_room_are_refused(tmp_path, deck):
    """By parts that someone changed to keep disks apart: as installed, every disk finds a place."""
    folder = copy_decks(tmp_path / "decks")
    part = folder / "sp.start"
    part.write_text(part.read_text().replace("random ${half} ${other} NULL", "random ${half} ${other} NULL overlap 50"))
    (tmp_path / "run").mkdir()
    done = lmp(tmp_path / "run", folder / deck, "-log", "none", "-var", "n", "20", decks=folder)
    assert done.returncode == 1
    (line,) = refusals(done.stdout)
    assert ": only 10 of 20 particles found room: " in line


def test_replicas_write_their_own_files(tmp_path):
    """Two partitions of one deck, whose seeds and last packing fraction differ."""
    deck = tmp_path / "in.replicas"
    deck.write_text(f"variable seed world 5 6\nvariable to world 0.86 0.87\ninclude {DECKS / 'in.sp.jam'}\n")
    done = lmp(tmp_path, deck, "-partition", "2x1", "-var", "n", "16", "-var", "out", "mine", ranks=2)
    assert done.returncode == 0, done.stdout
    names = {path.name for path in tmp_path.glob("mine*")}
    assert names == {f"mine.{k}.{end}" for k in (0, 1) for end in ("onset.data", "dump")}
    seen = [(tmp_path / f"screen.{k}").read_text() for k in (0, 1)]
    for text, last in zip(seen, ("0.86", "0.87"), strict=True):
        assert f"\n {last}00000000 " in text  # the last row of the table
        assert "Minimization stats" not in text  # quiet on the screen of a partition as well
    onsets = [re.search(r"onset=(\S+)", (tmp_path / f"mine.{k}.onset.data").read_text())[1] for k in (0, 1)]
    assert onsets[0] != onsets[1]


def test_a_value_of_one_replica_is_refused_there(tmp_path):
    """By name and value, in the output of its own partition; the other goes on, and LAMMPS does not wait for ever."""
    deck = tmp_path / "in.replicas"
    deck.write_text(f"variable n world 16 15\ninclude {DECKS / 'in.sp.jam'}\n")
    done = lmp(tmp_path, deck, "-partition", "2x1", "-var", "to", "0.86", ranks=2)
    assert done.returncode == 1 and (tmp_path / "sp.0.onset.data").exists()
    assert refusals((tmp_path / "screen.1").read_text()) == ["REFUSED: n = 15: must be even, >= 2, <= 1e8"]
    assert refusals((tmp_path / "screen.0").read_text()) == []
