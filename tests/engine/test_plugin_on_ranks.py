"""Plain `lmp` under MPI: the same energy, forces and virial on any number of ranks, newton on or off."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.engine.installation import lammps_program, program_environment
from jamlab.installed_files import installed
from jamlab.packing.deformation import sheared

THERMO = ("pe", "evdwl", "pxx", "pyy", "pxy")

PRINT = " ".join(f"$({key}:%.17g)" for key in THERMO)
DECK = """
clear
newton {newton}
{variables}
include {decks}/parts/{model}
{more}
run 0
write_dump all custom {name}.dump id fx fy modify sort id format float %.17g
print "{name} {printed}"
"""
SHAPES = """
compute shape all polygon
fix shape all ave/time 1 1 1 c_shape[1] c_shape[2] mode vector file {name}.shape format " %.17g"
"""


def law(packing, data):
    """Variables that the parts of decks need."""
    values = {key: value for key, value in packing.params.items() if key != "a0"}
    values |= {"units": packing.units, "skin": 0.1, "longest_edge": 1.5, "out": "x", "of_python": "yes", "data": data}
    values["second"] = 0  # of parts/start
    values["dir"] = installed("lammps_inputs")
    if packing.model == "sp":
        values |= {"exponent": 2} | {f"d{k}": size for k, size in enumerate(np.unique(packing.diameters), start=1)}
    texts = {key: f"{value:.17g}" if isinstance(value, float) else value for key, value in values.items()}
    return "\n".join(f"variable {key} delete\nvariable {key} index {text}" for key, text in texts.items())


def launch(folder, deck, ranks, timeout=1200, words=""):
    """Run a deck in `folder`, with more words of the command line: return code and all that LAMMPS wrote."""
    (folder / "in.test").write_text(deck)
    several = [str(Path(sys.executable).parent / "mpiexec"), "-n", str(ranks)] if ranks > 1 else []
    line = [*several, str(lammps_program()), "-in", "in.test", "-log", "none", "-nocite", *words.split()]
    done = subprocess.run(
        line, cwd=folder, env=os.environ | program_environment(), capture_output=True, text=True, timeout=timeout
    )
    return done.returncode, done.stdout + done.stderr


def run(folder, deck, ranks):
    """Names and numbers that `print` left behind."""
    code, output = launch(folder, deck, ranks)
    assert code == 0, output[-2000:]
    rows = [row.split() for row in output.splitlines() if row.startswith("state-")]
    return {row[0]: np.array(row[1:], dtype=float) for row in rows}


def columns(path, header):
    """Numbers of a LAMMPS text file, without the first column."""
    return np.loadtxt(path, skiprows=header, ndmin=2)[:, 1:]


def deck_for(packing, name, *, data, newton="on", more=""):
    """Evaluate one state of a data file."""
    fields = {"decks": installed("lammps_inputs"), "newton": newton, "model": packing.model, "name": name}
    return DECK.format(more=more.format(name=name), printed=PRINT, variables=law(packing, data), **fields)


@pytest.fixture(scope="module")
def states(random_disks, random_polygons, spanning, sp_jammed, dp_dense):
    """Random states of every kind; jammed ones a little sheared, so that forces are not rounding; wide polygons."""
    dense = sheared(dp_dense, 0.01)
    return {
        "eps": random_disks(0.3, "eps", 1, n=40),
        "k": random_disks(0.7, "k", 2),
        "jammed-sp": sheared(sp_jammed, 0.01),
        "outline": random_polygons(0.3, "outline", 1),
        "jammed-outline": dense,
        "jammed-smooth": dense.with_state(params=dense.params | {"contact": "segment/smooth"}),
        "spanning-outline": spanning("outline", -0.9),  # meet their own images; larger than a subdomain
        "spanning-smooth": spanning("segment/smooth", 0.0),
    }


@pytest.mark.parametrize("ranks", [1, 2, pytest.param(4, marks=pytest.mark.slow)])
@pytest.mark.slow
def test_ranks_and_newton_change_nothing(states, tmp_path, ranks):
    """Energy, virial and forces against jamlab's own session, which has one rank; areas and perimeters too."""
    printed = {}
    if ranks == 4:  # slow where there are fewer cores
        states = {kind: states[kind] for kind in ("k", "jammed-smooth", "spanning-outline")}
    for kind, p in states.items():
        jamlab.write(tmp_path / f"{kind}.data", p)
        more = SHAPES if p.model == "dp" else ""
        for newton in ("on", "off"):  # each by itself: a deck leaves the defaults of its law behind
            deck = deck_for(p, f"state-{kind}-{newton}", newton=newton, data=f"{kind}.data", more=more)
            printed |= run(tmp_path, deck, ranks)
    assert len(printed) == 2 * len(states)
    for name, values in printed.items():
        p = states[name.removeprefix("state-").rpartition("-")[0]]
        e = jamlab.evaluate(p)
        assert values[:2] == pytest.approx([e.energy, e.contact_energy], rel=1e-10), name
        assert np.abs(values[2:] - e.stress[[0, 1, 0], [0, 1, 1]]).max() < 1e-10 * e.pressure, name
        forces = columns(tmp_path / f"{name}.dump", 9)
        assert np.abs(forces - e.forces).max() < 1e-10 * e.max_force, name
        if p.model == "dp":
            areas, perimeters = columns(tmp_path / f"{name}.shape", 4).T
            assert areas == pytest.approx(p.polygons.areas, rel=1e-12), name
            assert perimeters == pytest.approx(p.polygons.perimeters, rel=1e-12), name


@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.slow), pytest.param(4, marks=pytest.mark.slow)])
def test_tiled_subdomains_change_nothing(random_polygons, random_disks, tmp_path, ranks):
    """With newton off, forces of ghosts return by the plugin's own communication."""
    states = {"outline": random_polygons(0.3, "outline", 1), "smooth": random_polygons(0.0, "segment/smooth", 2)}
    states["disks"] = random_disks(0.3, "eps", 1, n=40)
    deck = ""
    for kind, p in states.items():
        jamlab.write(tmp_path / f"{kind}.data", p)
        tiled = "comm_style tiled\nbalance 1.0 rcb\n"
        deck += deck_for(p, f"state-{kind}", newton="off", data=f"{kind}.data", more=tiled)
    printed = run(tmp_path, deck, ranks)
    assert len(printed) == len(states)
    for name, values in printed.items():
        e = jamlab.evaluate(states[name.removeprefix("state-")])
        assert values[:2] == pytest.approx([e.energy, e.contact_energy], rel=1e-12), name
        assert np.abs(values[2:] - e.stress[[0, 1, 0], [0, 1, 1]]).max() < 1e-12 * np.abs(e.stress).max(), name
        assert np.abs(columns(tmp_path / f"{name}.dump", 9) - e.forces).max() < 1e-12 * e.max_force, name


GROW = """
neigh_modify every 1 delay 0 check yes
unfix area
fix hold all setforce 0 0 0
fix move all nve
velocity all set 0 0 0
group one id 3
velocity one set {speed} {speed} 0
run 300
"""


@pytest.mark.parametrize(
    ("ranks", "speed"),
    [
        (1, 5.0),
        (2, 500.0),
        pytest.param(4, 5.0, marks=pytest.mark.slow),
        pytest.param(4, 500.0, marks=pytest.mark.slow),
    ],
)
def test_an_edge_that_outgrows_the_cutoff_stops_all_ranks(random_polygons, tmp_path, ranks, speed):
    """One vertex is drawn out slowly, or thrown beyond all that its neighbour's rank can see."""
    p = random_polygons(0.0, "outline", 1)
    p = p.with_state(box=3 * p.box)
    jamlab.write(tmp_path / "grow.data", p)
    code, output = launch(tmp_path, deck_for(p, "state", data="grow.data") + GROW.format(speed=speed), ranks)
    assert code != 0
    found = re.search(r"edge between atoms \d and \d is (\S+) long, more than the 1.5 .*: raise its second arg", output)
    assert found, output[-2000:]
    assert float(found[1]) < 1.5 + (0.1 if speed == 5.0 else np.inf)  # caught within one skin
    assert f"ghost cutoff, now {p.params['delta'] + 1.5 + 0.1:.6g}" in output
