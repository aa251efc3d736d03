"""The example decks: their logs, and the physics that they show."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from jamlab.engine.deck_files import copy_decks
from jamlab.engine.installation import lammps_program, program_environment
from jamlab.installed_files import installed

EXAMPLES = Path(__file__).parents[2] / "lammps_inputs" / "examples"
LINES = {  # before chaos has grown to 1e-8
    "attraction": 2,
    "channel": 4,
    "droplets_and_disks": 4,
    "evaporation": 3,
    "funnel": 3,
    "gravity": 3,
    "growth": 4,
    "hopper_droplets": 2,
    "hopper_overdamped": 2,
    "langevin_shear": 2,
    "self_propulsion": 2,
    "sinking_disks": 2,
}
DECKS = sorted(LINES)


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
            command = [str(lammps_program()), "-in", f"in.{deck}", *words, "-log", "log"]
            environment = os.environ | program_environment()
            done = subprocess.run(
                command, cwd=folder, env=environment, capture_output=True, text=True, timeout=100, check=False
            )
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


def test_droplets_that_grow_become_polygons_under_pressure(result):
    grown = result("growth")
    assert grown["v_area"][[0, -1]] == pytest.approx([0.49, 4.5], rel=0.01)
    free, packed = grown["v_shape"][[0, -1]]
    assert free == pytest.approx(3 / np.pi * 2 * np.tan(np.pi / 12) * 2, rel=1e-9)  # 12 corners, P^2/(4 pi A)
    assert packed > 1.05 and grown["Pxx"][-1] > 5 * grown["Pxx"][5]


def test_the_floor_bears_the_weight_of_a_pile(result):
    last = {name: values[-1] for name, values in result("gravity").items()}
    assert last["f_floor[1]"] == pytest.approx(-10 * 12 * 0.05, rel=1e-7)
    assert last["f_sides[1]"] == pytest.approx(-last["f_sides[2]"], rel=1e-7) and last["f_sides[2]"] > 1.0
    assert last["KinEng"] < 1e-12


def test_droplets_that_attract_each_other_stay_together(result):
    together, apart = result("attraction"), result("attraction", depth=0)
    assert together["E_vdwl"][5:].max() < -1.0 < apart["E_vdwl"].min()
    assert together["c_radius"][-1] < 0.9 * apart["c_radius"][-1]


def test_whole_droplets_evaporate_until_none_is_left(result):
    atoms = result("evaporation")["Atoms"]
    assert not (atoms % 12).any()
    assert atoms.max() == 60 and atoms[2:8].min() >= 48 and atoms[-1] == 0


def test_swimming_droplets_are_in_each_others_way(result):
    assert result("self_propulsion", n=1)["c_along"][-1] == pytest.approx(1.0, abs=0.01)
    assert 0.2 < result("self_propulsion")["c_along"][3:].mean() < 0.7


def test_heavy_disks_sink_below_droplets(result):
    heights = result("sinking_disks")
    above = heights["v_disks"] - heights["v_drops"]
    assert above[0] > 5 and above[-1] < -1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("deck", "weight"), [("hopper_overdamped", 182 * 0.02), ("hopper_droplets", 20 * 12 * 0.1 * 0.1)]
)
def test_a_hopper_without_inertia_bears_the_weight_and_loses_no_energy(result, deck, weight):
    found = result(deck)
    assert found["v_bears"][1:] == pytest.approx(-weight, rel=1e-5)
    assert np.ptp(found["v_lost"]) < 1e-2 * found["f_flow[11]"][-1]
