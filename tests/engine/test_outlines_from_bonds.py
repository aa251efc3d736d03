"""Outlines are the bonds within a molecule: whatever the IDs, and whoever comes or goes."""

import re
from dataclasses import replace

import numpy as np
import outlines
import pytest
from engine.test_plugin_on_ranks import launch, run
from outlines import DISK, RING, WALL

RANKS = pytest.mark.parametrize("ranks", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 4))])


def numberings(state, rng):
    """Data files of one state that differ in IDs, molecule IDs, order of rows and orientation."""
    n, m = len(state.points), len(state.outlines)
    return {
        "plain": outlines.data(state),
        "clockwise": outlines.data(state, clockwise=True),
        "shuffled": outlines.data(state, ids=rng.permutation(n) + 1, rows=rng.permutation(n)),
        "gaps": outlines.data(state, rng.permutation(5 * n)[:n] + 1, 7 * rng.permutation(m) + 4, clockwise=True),
    }


@RANKS
def test_ids_and_orientation_mean_nothing(tmp_path, ranks):
    """Also after `reset_atoms id sort yes`, which orders IDs by place."""
    state = outlines.scene(1)
    wanted = outlines.energy(state)
    assert {(RING, RING), (RING, WALL), (WALL, RING), (DISK, RING), (DISK, DISK)} <= kinds_of_contacts(state)
    deck = ""
    for name, text in numberings(state, np.random.default_rng(ranks)).items():
        (tmp_path / name).write_text(text)
        for again in ("read", "sorted"):
            deck += outlines.deck(name) + ("reset_atoms id sort yes\n" if again == "sorted" else "")
            deck += f'run 0\nprint "state-{name}-{again} $(pe:%.17g)"\n'
    found = run(tmp_path, deck, ranks)
    assert len(found) == 8
    for name, (pe,) in found.items():
        assert pe == pytest.approx(wanted, rel=1e-12), name


def kinds_of_contacts(state):
    """Types of the vertex and the edge."""
    types = np.repeat([o.type for o in state.outlines], np.diff(state.starts))
    return {(types[c.vertex], types[c.tail]) for c in outlines.contacts(state)}


FRESH = 'print "state-{0}-ran $(pe:%.17g) $(atoms)"\nwrite_data {0}.data\n'
DRIFT = """
fix move all nve
timestep 0.002
velocity all create 0.05 {seed} loop geom dist gaussian
velocity all set NULL NULL 0.0
"""
REST = "variable rest atom 0.9+0.01*mol\ngroup rings type 1\nfix area rings polygon/area 20.0 v_rest\n"
# a polygon of six vertices; the upper half of a box twice as high as the packing is free
SIX = "six\n\n6 atoms\n6 bonds\n\nCoords\n\n{}\n\nTypes\n\n{}\n\nBonds\n\n{}\n"
DEPOSIT = """
molecule six six.mol
region free block 0.7 4.5 7.2 9.2 0 0
group new empty
fix rain rings deposit 3 0 20 4711 region free mol six near 0.4 id max attempt 100
run 100
"""
EVAPORATE = """
region all block INF INF INF INF -0.5 0.5
fix drain rings evaporate 10 1 all 99 molecule yes
run 35
unfix drain
"""
CREATE = """
create_atoms 0 single 2.0 9.0 0.0 mol six 123
group rings type 1
run 20
"""
DELETE = """
group gone molecule 2 3 20
delete_atoms group gone bond yes
run 20
"""


def six():
    """Molecule file of a hexagon, clockwise."""
    corners = outlines.regular(6, (0, 0), 0.6).points[::-1]
    coords = "\n".join(f"{k} {x} {y} 0" for k, (x, y) in enumerate(corners, start=1))
    types = "\n".join(f"{k} 1" for k in range(1, 7))
    return SIX.format(coords, types, "\n".join(f"{k} 1 {k} {k % 6 + 1}" for k in range(1, 7)))


@RANKS
def test_polygons_that_come_and_go(tmp_path, ranks):
    """The energy that goes on is that of the same state read afresh; the run has no time to look away."""
    state = outlines.scene(2)
    high = replace(state, box=state.box * [1, 2])
    (tmp_path / "high").write_text(outlines.data(high))
    (tmp_path / "six.mol").write_text(six())
    deck = outlines.HEAD.format(newton="on") + outlines.READ.format(data="high")
    deck += outlines.FORCE + REST + outlines.THERMO + DRIFT.format(seed=1 + ranks)
    stages = {"deposit": DEPOSIT, "evaporate": EVAPORATE, "create": CREATE, "delete": DELETE}
    for name, commands in stages.items():
        deck += commands + FRESH.format(name)
    for name in stages:
        deck += outlines.HEAD.format(newton="on") + f"read_data {name}.data nocoeff fix d_a0 NULL d_a0\n"
        deck += outlines.FORCE + REST + outlines.THERMO
        deck += f'run 0\nprint "state-{name}-read $(pe:%.17g) $(atoms)"\n'
    found = run(tmp_path, deck, ranks)
    assert len(found) == 8
    assert found["state-deposit-ran"][1] == len(state.points) + 18
    assert found["state-evaporate-ran"][1] < found["state-deposit-ran"][1]
    assert found["state-create-ran"][1] == found["state-evaporate-ran"][1] + 6
    assert found["state-delete-ran"][1] < found["state-create-ran"][1]
    for name in stages:
        assert found[f"state-{name}-ran"] == pytest.approx(found[f"state-{name}-read"], rel=1e-12), name


OPEN = "group one id 12 13\ndelete_bonds one bond 1\n"
NOT_AN_OUTLINE = {
    "vertex": "group one id 3\ndelete_atoms group one bond yes\n",
    "edge": "group one id 3 4\ndelete_bonds one bond 1 remove special\n",
    "edge switched off": "group one id 3 4\ndelete_bonds one bond 1\n",
    "branch": "create_bonds single/bond 1 1 4\n",
    "two rings": "group one molecule 1 2\nset group one mol 1\n",
    "ring and chain": f"{OPEN}group two molecule 1 2\nset group two mol 1\n",
}


@pytest.mark.parametrize("style", ["pair", "fix"])
@pytest.mark.parametrize("change", NOT_AN_OUTLINE.values(), ids=NOT_AN_OUTLINE.keys())
def test_bonds_that_are_no_outline_are_refused(lmp, tmp_path, change, style):
    """By the pair style and by the fix, each alone, before anything moves."""
    (tmp_path / "data").write_text(outlines.data(outlines.scene(4)))
    deck = outlines.deck("data") + "run 0\n"
    outlines.commands(lmp, deck.replace(outlines.AREA, "") if style == "pair" else deck + "pair_style none\n")
    outlines.commands(lmp, "special_bonds lj 1 1 1 coul 1 1 1\n" + change)
    with pytest.raises(Exception, match=r"molecule 1 \(atom \d+\)") as refused:
        lmp.command("run 0")
    assert ("Pair style circuloline: " if style == "pair" else "Fix polygon/area: ") in str(refused.value)


def test_all_ranks_refuse_with_one_line(tmp_path):
    """Printed before any of them stops: the message of one that calls MPI_Abort is lost now and then."""
    (tmp_path / "data").write_text(outlines.data(outlines.scene(4)))
    change = "pair_style none\nspecial_bonds lj 1 1 1 coul 1 1 1\n" + NOT_AN_OUTLINE["vertex"]
    code, output = launch(tmp_path, outlines.deck("data") + change + "run 0\n", 2)
    told = re.findall(r"^ERROR: Fix polygon/area: .*molecule 1", output, re.MULTILINE)
    assert code != 0 and "MPI_Abort" not in output and len(told) == 1


def test_a_bond_that_breaks_during_a_run_is_seen(lmp, tmp_path):
    """The longest edge breaks: refused in that step, not at the start of the next run."""
    state = outlines.scene(4)
    outlines.start(lmp, tmp_path, state, "run 0\nfix move all nve\ntimestep 1e-6\n")
    longest = sorted(length for o in state.outlines if o.type == RING for length in outlines.lengths(o))
    lmp.command(f"fix change rings bond/break 1 1 {(longest[-1] + longest[-2]) / 2}")
    with pytest.raises(Exception, match="molecule"):
        lmp.command("run 2")


def test_bonds_between_molecules_are_no_edges(lmp, tmp_path):
    """They pull like others, and are neither outlines nor in the way of them."""
    state = outlines.scene(5)
    outlines.start(lmp, tmp_path, state)
    a, b = state.starts[0] + 1, state.starts[1] + 3
    bond = np.hypot(*(state.points[a] - state.points[b]))
    assert bond < state.box.min() / 2
    outlines.commands(lmp, f"comm_modify cutoff 2.6\ncreate_bonds single/bond 1 {a + 1} {b + 1}\nrun 0")
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state) + outlines.GAMMA * bond, rel=1e-12)


OTHERS = """
special_bonds lj/coul 1.0 1.0 1.0
neighbor 0.1 bin
bond_style line/tension
bond_coeff * {gamma}
pair_style {hybrid} circuloline {width} 1.2 harmonic/cut
pair_coeff 1 1 circuloline {eps} {width}
pair_coeff 1*3 2*3 harmonic/cut 3.0 0.9
group rings type 1
fix area rings polygon/area {ka} d_a0
thermo_modify norm no
run 0
"""


@pytest.mark.parametrize("hybrid", ["hybrid", "hybrid/overlay"])
def test_other_molecules_are_left_to_other_styles(lmp, tmp_path, hybrid):
    """A polymer and single atoms, all with molecule IDs, that repel each other and the polygons as points."""
    state = outlines.scene(7)
    (tmp_path / "data").write_text(outlines.data(state, clockwise=True))
    law = {"gamma": outlines.GAMMA, "width": outlines.WIDTH[RING], "eps": outlines.EPS[RING], "ka": outlines.KA}
    outlines.commands(lmp, outlines.HEAD.format(newton="on") + outlines.READ.format(data="data"))
    outlines.commands(lmp, OTHERS.format(hybrid=hybrid, **law))
    rings = replace(state, outlines=[o for o in state.outlines if o.type == RING])
    wall = [o for o in state.outlines if o.type == WALL]
    types = np.repeat([o.type for o in state.outlines], np.diff(state.starts))
    i, j = np.triu_indices(len(types), 1)
    r = state.points[i] - state.points[j]
    d = np.hypot(*(r - np.round(r / state.box) * state.box).T)
    touch = (d < 0.9) & ((types[i] != RING) | (types[j] != RING))
    points = 3.0 * np.sum((0.9 - d[touch]) ** 2)
    tension = outlines.GAMMA * sum(np.sum(outlines.lengths(o)) for o in wall)
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(rings) + tension + points, rel=1e-12)


@RANKS
def test_areas_are_those_of_the_deformed_box(tmp_path, ranks):
    """A tenth in one step, with all ghosts: nothing of the step before is left."""
    state = outlines.scene(9)
    (tmp_path / "data").write_text(outlines.data(state))
    deck = outlines.deck("data") + "compute shape rings polygon\nfix wider all deform 1 x scale 1.1 remap x\n"
    rings = [o for o in state.outlines if o.type == RING]
    deck += "run 1\n" + "".join(
        f'print "state-{m} $(c_shape[{m}][1]:%.17g) $(c_shape[{m}][2]:%.17g)"\n' for m in range(1, len(rings) + 1)
    )
    found = run(tmp_path, deck, ranks)
    for m, ring in enumerate(rings, start=1):
        wide = replace(ring, points=ring.points * [1.1, 1])
        assert found[f"state-{m}"] == pytest.approx([wide.area, np.sum(outlines.lengths(wide))], rel=1e-12)
