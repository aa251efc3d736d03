"""Forces do not depend on what output is asked for, nor on who else calls the styles: each has one path."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import outlines
import pytest
from disk_flows import Flow, commands
from droplet_flows import CONTACT, STOKES, DropletFlow
from engine.test_per_atom_tallies import DUMP, SHOW, TALLIES, area_parts, bond_parts, close, contact_parts, parts
from engine.test_plugin_on_ranks import columns, run

import jamlab

NUMDIFF = "fix d all numdiff 2 1e-6\nfix v all numdiff/virial 3 1e-6\n"
ASKED = {  # what is asked for -> lines before all other fixes, lines after them
    "nothing": ("", "thermo 1000"),
    "energy": ("", "thermo_style custom step pe\nthermo_modify norm no\nthermo 1"),
    "pressure": ("", "thermo 1"),
    "differences": ("", f"{NUMDIFF}thermo 1"),
    "differences first": (NUMDIFF, "thermo 1"),
    "tallies": (
        "",
        "compute e all pe/atom\ncompute s all stress/atom NULL\ndump t all custom 1 /dev/null id c_e c_s[1]",
    ),
}
MOVE = """
reset_timestep 0
velocity all create 0.02 99 loop all
velocity all set NULL NULL 0
timestep 0.004
fix m all nve
"""


def vectors(lmp, name):
    """Of all atoms, by ID, in the plane."""
    return np.array(lmp.gather_atoms(name, 1, 3)).reshape(-1, 3)[:, :2]


def check(lmp, deck, first_fix):
    """Positions and forces after eight steps are equal up to rounding, for all that may be asked for."""
    found = {}
    for asked, (before, after) in ASKED.items():
        text = deck.replace(first_fix, before + first_fix)
        outlines.commands(lmp, f"clear\n{text}{MOVE}{after}\nrun 8 post no")
        found[asked] = vectors(lmp, "x"), vectors(lmp, "f")
    assert np.abs(found["nothing"][1]).max() > 0.01
    for asked, pair in found.items():
        assert np.abs(np.subtract(pair, found["nothing"])).max() < 1e-13, asked


def area_forces(state):
    """On all atoms."""
    return np.concatenate([outlines.area_force(o.points, outlines.KA, o.a0)[1] for o in state.outlines])


def few_droplets(seed):
    """Four jagged polygons whose rims overlap, in a periodic box."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(4):
        one = outlines.regular(6 + k, (1.3 * (k % 2) + 0.6, 1.3 * (k // 2) + 0.6), 0.62)
        one.points += rng.uniform(-0.02, 0.02, one.points.shape)
        found.append(replace(one, a0=one.area * rng.uniform(0.9, 1.1)))
    return outlines.Scene(found, np.array([2.6, 2.6]))


def with_bonds(text, *bonds):
    """A data file with bonds more."""
    head, _, rest = text.partition("\nBonds\n\n")
    count = rest.partition("\n\n")[0].count("\n") + 1
    lines = "".join(f"{count + k} 1 {a} {b}\n" for k, (a, b) in enumerate(bonds, start=1))
    return f"{head}\nBonds\n\n{lines}{rest}".replace(f"{count} bonds", f"{count + len(bonds)} bonds")


HYBRID = "bond_style hybrid line/tension\nbond_coeff * line/tension 0.13\n"
BONDS = {  # bonds that are no edge of a ring, and lines of the deck
    "none": ([], ""),
    "foreign": ([(3, 9), (1, 20)], ""),
    "twice": ([(1, 2)], ""),
    "hybrid": ([(3, 9)], HYBRID),
}


def bonds_more(state, bonds):
    """Force, energy and virial of atoms that these bonds add, by loops."""
    force, rows = np.zeros_like(state.points), np.zeros((len(state.points), 4))
    for pair in np.array(bonds, dtype=int).reshape(-1, 2) - 1:
        r = np.subtract(*state.points[pair[::-1]])
        r -= np.round(r / state.box) * state.box
        pull = outlines.GAMMA * r / np.hypot(*r)
        force[pair] += np.array([pull, -pull])
        rows[pair] += np.array([outlines.GAMMA * np.hypot(*r), *(-parts(r, pull))]) / 2
    return force, rows


@pytest.mark.parametrize("newton", ["on", "off"])
@pytest.mark.parametrize("more", BONDS)
def test_bonds_of_droplets(lmp, tmp_path, more, newton):
    """The same steps, whatever is asked for."""
    (tmp_path / "data").write_text(with_bonds(outlines.data(few_droplets(6)), *BONDS[more][0]))
    check(lmp, outlines.deck("data", newton) + BONDS[more][1], "fix area")


HELD = "unfix area\nfix held all setforce 0.0 NULL NULL\nfix area rings polygon/area 20.0 d_a0\n"
STATES = {"walls": (outlines.scene(6), [], ""), "held": (few_droplets(7), [], HELD)}
STATES |= {name: (few_droplets(6), *BONDS[name]) for name in BONDS}


@pytest.mark.parametrize("ranks", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 4))])
def test_forces_energies_and_virials(tmp_path, ranks):
    """Of atoms, by loops; every bond pulls, be it an edge or not, and one that stands twice pulls twice."""
    deck = ""
    dump = "write_dump all custom {0}-{1}.dump id fx fy modify sort id format float %.17g\n"
    for name, (state, bonds, lines) in STATES.items():
        (tmp_path / name).write_text(with_bonds(outlines.data(state), *bonds))
        for newton in ("on", "off", "on off", "off on"):
            full = f"{name}-{newton.replace(' ', '-')}"
            deck += outlines.deck(name, newton) + lines + TALLIES + "run 0\n" + SHOW.format(full) + DUMP.format(full)
            deck += dump.format(full, "asked") + "jamlab/forces\n" + dump.format(full, "plain")
    found = run(tmp_path, deck, ranks)
    assert len(found) == 4 * len(STATES)
    for full, row in found.items():
        name = full.split("-")[1]
        state, bonds, _ = STATES[name]
        force, rows = bonds_more(state, bonds)
        force += outlines.forces(state, "outline")
        rows += area_parts(state) + contact_parts(state) + bond_parts(state)
        if name == "held":  # fix setforce acts before fix polygon/area
            force[:, 0] = area_forces(state)[:, 0]
        for asked in ("asked", "plain"):
            file = tmp_path / f"{full.removeprefix('state-')}-{asked}.dump"
            assert columns(file, 9) == pytest.approx(force, abs=1e-13)
        close(columns(tmp_path / f"{full.removeprefix('state-')}.dump", 9), rows * [1, -1, -1, -1])
        close(row[:4], row[4:])
        close(row[0], rows[:, 0].sum())


@pytest.mark.parametrize("keyword", ["contact segment/smooth", "self 0.1"])
def test_contacts(lmp, tmp_path, keyword):
    """With disks, a wall, and a droplet whose sides are near each other."""
    state = outlines.scene(6)
    state.outlines[0].points[:, 1] *= 0.15
    (tmp_path / "data").write_text(outlines.data(state))
    check(lmp, outlines.deck("data").replace("1.2 walls", f"1.2 {keyword} walls"), "fix area")


def test_disks(lmp, tmp_path):
    packing = jamlab.pack(n=16, pressure=2e-2, seed=2)
    jamlab.write(tmp_path / "disks.data", packing)
    check(lmp, "\n".join([*commands(packing, "disks.data"), "fix area all property/atom d_none", ""]), "fix area")


def test_bonds_that_form_in_a_run(lmp, tmp_path):
    """Fix bond/create ties droplets together: the same steps with the pressure and without."""
    (tmp_path / "data").write_text(outlines.data(few_droplets(6)))
    form = "fix form all bond/create 4 1 1 0.4 1 prob 0.5 77\n"
    found = []
    for asked in ("thermo 1", "thermo 1000"):
        deck = outlines.deck("data").replace("special/per/atom 8", "special/per/atom 40")
        outlines.commands(lmp, deck + form + MOVE + asked + "\nrun 20 post no")
        found.append((vectors(lmp, "x"), vectors(lmp, "f")))
        assert lmp.extract_fix("form", 0, 1, 1) > 0
    assert np.subtract(*found) == pytest.approx(0.0, abs=1e-13)


def test_rest_areas_changed_between_runs_that_continue(lmp, tmp_path):
    """They count from the next evaluation on, and differ between the vertices of no polygon."""
    state = few_droplets(6)
    outlines.start(lmp, tmp_path, state, "run 0 post no\nset group all d_a0 1.3\nrun 1 pre no post no\n")
    area = sum(outlines.area_force(o.points, outlines.KA, 1.3)[0] for o in state.outlines)
    assert lmp.extract_fix("area", 0, 0) == pytest.approx(area, rel=1e-12)
    lmp.command("set atom 9 d_a0 1.4")
    with pytest.raises(Exception, match="differs between the vertices of polygon 2"):
        lmp.command("run 1 pre no post no")


@pytest.mark.parametrize("level", [1, 2])
def test_levels_of_respa(lmp, tmp_path, level):
    """Levels of one step are those of Verlet; at any level the energy error falls as the square of the step."""
    deck = outlines.deck("data").replace("thermo_modify norm no", "")
    (tmp_path / "data").write_text(outlines.data(few_droplets(6)))
    styles = "thermo_style custom step etotal\nthermo_modify norm no\n"
    found = []
    for style in ("verlet", "respa 2 1 bond 1 pair 2\nfix_modify area respa 1"):
        outlines.commands(lmp, deck + styles + f"run_style {style}\n{MOVE}run 20 post no")
        found.append(vectors(lmp, "x"))
    assert np.subtract(*found) == pytest.approx(0.0, abs=1e-13)
    style = f"run_style respa 2 2 bond 1 pair 2\nfix_modify area respa {level}\n"
    spread = []
    for step, steps in ((0.02, 50), (0.01, 100)):
        mean = "variable e equal etotal\nfix e all ave/time 1 1 1 v_e file e.txt format ' %.17g'\n"
        outlines.commands(lmp, deck + styles + style + MOVE + f"timestep {step}\n{mean}run {steps} post no")
        spread.append(np.ptp(np.loadtxt("e.txt")[:, 1]))
    assert 3 < spread[0] / spread[1] < 5


DROPLETS = Path(__file__).parents[1] / "states" / "stable_droplets.h5"
FLOWS = [
    *((Flow, drive, drag) for drag in ("1 1", "1 0.4 alpha 0.5") for drive in ("rate 0.1", "oscillate 0.01 1")),
    *((Flow, "stress 0.01 background 0.1", "1 1"), (Flow, "rate 0.1 background 0.1", "0 0")),
    *((DropletFlow, "rate 0.1", drag) for drag in (CONTACT, STOKES, "drag 1 0.3 0.7 background 0.1")),
    *((DropletFlow, drive, STOKES) for drive in ("oscillate 0.01 1", "stress 0.01")),
]


@pytest.fixture(scope="module")
def packings():
    return {Flow: jamlab.pack(n=16, pressure=2e-2, seed=2), DropletFlow: jamlab.read(DROPLETS)}


@pytest.mark.parametrize(("kind", "fix", "drag"), FLOWS)
def test_flows(tmp_path, packings, kind, fix, drag):
    """Twelve steps, with the pressure and tallies of every step and without."""
    found = []
    for asked in ("thermo 1000", "thermo 1", "compute s all stress/atom NULL\ndump t all custom 1 /dev/null id c_s[1]"):
        with kind(tmp_path, packings[kind], fix, drag) as flow:
            outlines.commands(flow.lmp, asked)
            numbers = flow.run(12)
            found.append(np.concatenate([[numbers["time"], numbers["stress"]], vectors(flow.lmp, "x").ravel()]))
    assert np.ptp(found, axis=0) == pytest.approx(0.0, abs=1e-13)
