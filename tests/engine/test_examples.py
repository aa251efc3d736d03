"""The example decks: their logs, and the physics that they show."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from jamlab.engine.deck_files import copy_decks
from jamlab.installed_files import installed

EXAMPLES = Path(__file__).parents[2] / "lammps_inputs" / "examples"
DECKS = ("channel", "droplets_and_disks", "funnel", "langevin_shear")
LINES = {"channel": 4, "droplets_and_disks": 4, "funnel": 3, "langevin_shear": 2}  # before chaos has grown to 1e-8
LMP = Path(sys.executable).parent / "lmp"


def thermo(text):
    """Columns of the thermo lines of a log, each run after the other."""
    tables = re.findall(r"^ +(Step .*)\n((?: +[-+.\de ]+\n)+)", text, re.MULTILINE)
    assert tables
    tables = [(head, lines) for head, lines in tables if head == tables[-1][0]]  # not of a minimum before a run
    lines = np.array([line.split() for _, table in tables for line in table.splitlines()], dtype=float)
    return dict(zip(tables[0][0].split(), lines.T, strict=True))


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """Function that runs an example in its folder of a copy of the decks, as a user does: its thermo columns."""
    folder = copy_decks(tmp_path_factory.mktemp("decks") / "copy") / "examples"
    made = {}

    def of(deck, **variables):
        if (key := (deck, *variables.items())) not in made:
            words = [word for name, value in variables.items() for word in ("-var", name, str(value))]
            command = [str(LMP), "-in", f"in.{deck}", *words, "-log", "log"]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=100, check=False)
            assert done.returncode == 0, done.stdout[-2000:]
            assert re.findall("WARNING.*", done.stdout) == []
            made[key] = thermo((folder / "log").read_text())
        return made[key]

    return of


def test_examples_are_installed():
    names = {path.name for path in EXAMPLES.iterdir()}
    assert names == {path.name for path in (installed("lammps_inputs") / "examples").iterdir()}
    assert {f"{kind}.{deck}" for deck in DECKS for kind in ("in", "log")} <= names


@pytest.mark.parametrize("deck", DECKS)
@pytest.mark.slow
def test_an_example_repeats_the_log_beside_it(result, deck):
    """Its first lines; later ones depend on the last digits of all that went before."""
    wanted, found = thermo((EXAMPLES / f"log.{deck}").read_text()), result(deck)
    assert wanted.keys() == found.keys()
    for name, values in wanted.items():
        first = values[: LINES[deck]]
        rounding = 1e-8 * max(1.0, np.abs(first).max())
        assert found[name][: len(first)] == pytest.approx(first, rel=1e-8, abs=rounding), name


def test_walls_of_a_channel_bear_its_normal_stress(result):
    """At the minimum, forces on both walls balance: normal stress, from the virial, times their length."""
    length, box, height = 6.0, 10.0, 7.0 - 13 * 0.3
    last = {name: values[-1] for name, values in result("channel").items()}
    assert last["Fmax"] <= 1e-10
    assert last["f_up[2]"] > 1.0
    assert last["f_up[2]"] + last["f_low[2]"] == pytest.approx(0.0, abs=1e-9)
    assert last["f_up[2]"] == pytest.approx(last["Pyy"] * box / height * length, rel=1e-9)


def free_droplet(gamma, ka, a0=1.0, corners=12):
    """Energy of a regular polygon at rest, without contacts."""
    c = 4 * corners * np.tan(np.pi / corners)
    energy = minimize_scalar(lambda a: gamma * np.sqrt(c * a) + ka / 2 * (a - a0) ** 2, bracket=(0.9, 1.0), tol=1e-12)
    return energy.fun


def test_droplets_among_disks_jam_and_unjam(result):
    jammed = {name: values[-1] for name, values in result("droplets_and_disks").items()}
    assert jammed["Fmax"] <= 1e-10
    assert jammed["Press"] > 0.01
    assert jammed["E_vdwl"] > 1e-3
    assert jammed["v_shape"] > 1.001 * result("droplets_and_disks")["v_shape"][1]

    loose = {name: values[-1] for name, values in result("droplets_and_disks", steps=1).items()}
    assert loose["Fmax"] <= 1e-10
    assert loose["E_vdwl"] < 1e-18
    assert abs(loose["Press"]) < 1e-9
    assert loose["PotEng"] == pytest.approx(8 * free_droplet(0.2, 50.0), rel=1e-11)
