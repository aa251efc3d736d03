"""What a user of LAMMPS sees who starts a deck in a wrong way: the value, and what to do instead."""

import os
import subprocess

import deck_runs
import pytest
from commands import call
from deck_runs import run

from jamlab.engine.deck_files import copy_decks
from jamlab.engine.installation import lammps_program, program_environment


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return copy_decks(tmp_path_factory.mktemp("decks") / "copy")


def lammps(folder, *words, before=(), **options):
    """Exit code and screen of plain LAMMPS in a folder."""
    environment = os.environ | program_environment()
    line = [*before, str(lammps_program()), *map(str, words), "-log", "none"]
    done = subprocess.run(
        line, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True, timeout=100, check=False, **options
    )
    return done.returncode, done.stdout


def test_a_deck_through_a_pipe_takes_any_variable(copy):
    """Its text cannot be read again. So it is with commands that Python gives, one after the other."""
    with (copy / "in.sp.jam").open() as deck, subprocess.Popen("cat", stdin=deck, stdout=subprocess.PIPE) as pipe:
        code, out = lammps(copy, "-var", "n", 4, "-var", "to", 0.87, stdin=pipe.stdout)
    assert code == 0 and "NOT CHECKED: the deck comes through a pipe" in out


def test_a_law_is_of_disks_or_droplets(lmp):
    with pytest.raises(Exception, match="jamlab/law: model xx must be sp or dp"):
        lmp.command("jamlab/law xx packing.data")


@pytest.mark.parametrize("second", [8, 16])
def test_a_variable_given_twice_is_refused(tmp_path, second):
    out = run("in.sp.jam", tmp_path, code=1, n=8, words=("-var", "n", str(second)))
    assert f"REFUSED: -var n is given twice, as 8 and as {second}: give one" in out


@pytest.mark.parametrize("deck", ["in.sp.jam", "in.dp.shear"])
def test_a_deck_in_another_folder_asks_for_its_own(copy, tmp_path, deck):
    code, out = lammps(tmp_path, "-in", copy / deck)
    assert code == 1 and "REFUSED: no parts/start in this folder" in out and "-var dir FOLDER" in out


@pytest.mark.parametrize(("deck", "needs"), [("in.dp.jam", "droplets"), ("in.sp.startup", "flows")])
def test_without_the_plugin_a_deck_says_that_it_needs_it(tmp_path, monkeypatch, deck, needs):
    environment = program_environment() | {"LAMMPS_PLUGIN_PATH": ""}
    monkeypatch.setattr(deck_runs, "program_environment", lambda: environment)
    out = run(deck, tmp_path, code=1)
    assert f"REFUSED: this LAMMPS has no plugin of jamlab, which {needs} need" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("in.attraction", "dept", 0), "-var dept: no such variable; give depth"),
        (("in.attraction", "depth", -1), "depth = -1: must be a number in [0, 1e9]"),
        (("in.growth", "steps", 2.5), "steps = 2.5: must be a whole number in [1, 1e9]"),
        (("in.gravity", "n", 30), "n = 30: must be a whole number in [1, 10]"),
        (("in.growth", "rest", 2), "-var rest: the deck sets it itself; it has droplet, first"),
        (("in.funnel", "file", "absent.data"), "file = absent.data: must be a file that exists: start in the folder"),
    ],
)
def test_an_example_refuses(copy, words, said):
    deck, *variable = words
    code, out = lammps(copy / "examples", "-in", deck, "-var", *variable)
    assert code == 1 and f"REFUSED: {said}" in out and out.count("REFUSED") == 1


def test_examples_start_in_their_folder_alone(copy):
    code, out = lammps(copy, "-in", "examples/in.growth")
    assert code == 1 and "REFUSED: droplet = ../parts/polygon12.mol: must be a file that exists" in out
    done = call(copy, "deck", "examples/in.growth", "--steps", 10)
    assert done.exit_code == 1 and "run `lmp -in in.growth`" in done.stderr


@pytest.mark.parametrize(("between", "code"), [("", 1), ("clear\n", 0)])
def test_a_second_deck_of_an_input_needs_clear(copy, tmp_path, between, code):
    """Variables of other styles that the input or the first deck has are not computed before there are particles."""
    (tmp_path / "in.two").write_text(
        f'variable dir index "{copy}"\nvariable n index 4\nvariable to index 0.9\nvariable step index 0.1\n'
        f"variable p equal press\nvariable shown format p %g\ninclude {copy}/in.sp.jam\n{between}"
        f"include {copy}/in.sp.shear\n"
    )
    found, out = lammps(tmp_path, "-in", "in.two")
    assert found == code and ("use the command clear" in out) == bool(code)
    assert ("relaxed shear modulus" in out) == (not code)


def test_long_tables_have_some_rows_on_the_screen_and_all_in_the_file(tmp_path):
    out = run("in.sp.jam", tmp_path, n=2, to=0.9, step=5e-4, phi_start=0.7, words=("-var", "seed", "3"))
    assert len(out.splitlines()) <= 60 < len((tmp_path / "sp.txt").read_text().splitlines())


def test_stiff_areas_have_a_shorter_time_step(tmp_path):
    """At ten times the default ka FIRE with the usual step tears droplets apart in the first minimum."""
    short = {"n": 2, "ka": 3000, "phi_start": 0.1, "search_step": 0.1, "increment_least": 0.09, "steps": 500}
    assert "NO ONSET" in run("in.dp.jam", tmp_path, code=2, **short)
