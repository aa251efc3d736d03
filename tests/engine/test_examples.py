"""The example decks: their logs, and the physics that they show."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from deck_runs import SETTINGS
from scipy.optimize import minimize_scalar

from jamlab.engine.deck_defaults import copy_decks
from jamlab.kernels.installed_files import installed

from .test_plugin_on_ranks import launch, run

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
    assert all(len((EXAMPLES / f"in.{deck}").read_text().splitlines()) < 60 for deck in DECKS)


@pytest.mark.parametrize("deck", DECKS)
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
    assert last["c_up[2]"] > 1.0
    assert last["c_up[2]"] + last["c_low[2]"] == pytest.approx(0.0, abs=1e-9)
    assert last["c_up[2]"] == pytest.approx(last["Pyy"] * box / height * length, rel=1e-9)


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


def test_sheared_droplets_stay_droplets_through_flips_of_the_box(result):
    """Strain goes beyond two flips; every droplet stays nearly round."""
    rows = result("langevin_shear")
    assert np.any(np.diff(rows["Xy"]) < 0)
    assert rows["Xy"].max() <= 2.81
    assert np.all((rows["v_shape"] > 1.0) & (rows["v_shape"] < 1.1))
    assert rows["c_heat"][10:].mean() == pytest.approx(0.001, rel=0.2)  # shear heats, too
    assert rows["E_vdwl"].max() > 0.003


DUMP = """
dump states all custom 100 states id xu yu vx vy
dump_modify states sort id format float %.17g
run """


def states(folder, ranks, **variables):
    """Positions and velocities at each dump of the funnel, with more words for the atoms of each."""
    text = (EXAMPLES / "in.funnel").read_text().replace("\nrun ", DUMP)
    paths = {"droplet": EXAMPLES.parent / "parts" / "polygon12.mol", "walls": EXAMPLES / "funnel.data"} | variables
    deck = "".join(f"variable {name} index {value}\n" for name, value in paths.items()) + text
    folder.mkdir()
    code, output = launch(folder, deck, ranks, timeout=600)
    assert code == 0, output[-2000:]
    frames = (folder / "states").read_text().split("ITEM: TIMESTEP\n")[1:]
    return [np.array([line.split() for line in frame.splitlines()[8:]], dtype=float) for frame in frames]


FEW = {"n": 8, "every": 50}
ALL = {"n": 50, "every": 16}


@pytest.mark.parametrize(
    ("settings", "steps"),
    [
        pytest.param(FEW, {1: 1000, 2: 1000}, marks=pytest.mark.slow),
        pytest.param(ALL, {1: 1000, 2: 1000, 4: 1000}, marks=pytest.mark.slow),
    ],
    ids=["few", "all"],
)
def test_a_funnel_fills_alike_on_any_number_of_ranks(tmp_path, settings, steps):
    """Also where droplets come during the run; more ranks than cores are slow."""
    found = {ranks: states(tmp_path / f"{ranks}", ranks, steps=number, **settings) for ranks, number in steps.items()}
    assert len(found[1][-1]) == 50 + 12 * settings["n"]
    for ranks, number in steps.items():
        assert len(found[ranks]) == 1 + number // 100
        for frame, wanted in zip(found[ranks], found[1], strict=False):
            assert np.array_equal(frame[:, 0], wanted[:, 0])
            assert np.abs(frame - wanted).max() < 1e-9, ranks


def test_a_funnel_lets_droplets_through(result):
    """The walls bear their weight at last; none is lost."""
    rows = result("funnel")
    assert rows["Atoms"][-1] == 50 + 12 * 20
    assert rows["c_push[2]"][-1] < -10


SEAM = """
clear
{settings}
atom_style molecular
region box block 0 6 0 4 -0.5 0.5
create_box 2 box bond/types 1 extra/bond/per/atom 2 extra/special/per/atom 6
mass * 1.0
molecule wall {examples}/wall.mol toff 1 scale 1.2
create_atoms 0 single 3 1 0 mol wall 1 rotate 0 0 0 1
create_atoms 1 single {x:.17g} 1.15 0
bond_style zero
bond_coeff *
special_bonds lj/coul 1.0 1.0 1.0
pair_style circuloline 0.2 1.5 contact {form} walls 2 disks 1
pair_coeff 1 1 1.0 0.5
pair_coeff 2 2 0.0
pair_coeff 1 2 1.0
compute push all polygon/group/group all
thermo_style custom step pe fmax
thermo_modify norm no
run 0
print "state-{x:.3f} $(pe:%.17g)"
"""


@pytest.mark.parametrize(("form", "seamless"), [("segment/smooth", True), ("segment", True), ("outline", False)])
def test_the_seam_of_a_periodic_wall(tmp_path, form, seamless):
    """A disk slides along: its energy has the period of the points of the wall, or doubles where its ends meet."""
    places = np.linspace(0.0, 1.2, 13)[:-1]
    fields = {"settings": SETTINGS, "examples": EXAMPLES, "form": form}
    deck = "".join(SEAM.format(x=(x + k) % 6, **fields) for k in (0.0, 2.4) for x in places)
    energy = np.array([value[0] for value in run(tmp_path, deck, 1).values()])
    at_seam, inside = energy.reshape(2, -1)
    flat = 0.5 * (1 - 0.15 / 0.35) ** 2
    assert inside[6] == pytest.approx(flat, rel=1e-12)
    assert at_seam[0] == pytest.approx(2 * flat, rel=1e-12)
    if seamless:
        assert at_seam == pytest.approx(inside, rel=1e-12)
    else:
        assert inside == pytest.approx(np.full(12, flat), rel=1e-12)
