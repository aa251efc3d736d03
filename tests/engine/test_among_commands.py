"""Styles of the plugin among commands of LAMMPS: restart files, styles given twice, computes asked at any point, image
flags that begin anew, runs that skip their setup, fixes and lists that would make numbers wrong."""

from pathlib import Path

import numpy as np
import outlines
import pytest
from disk_flows import Flow
from droplet_flows import DropletFlow
from engine.test_plugin_on_ranks import run

import jamlab

DISKS = """
clear
units lj
dimension 2
atom_style molecular
atom_modify map array
region box prism 0 6 0 6 -0.5 0.5 0 0 0
create_box 2 box
mass * 1
create_atoms 1 single 2.0 3.0 0
create_atoms 2 single 2.5 3.0 0
special_bonds lj/coul 1 1 1
"""
LAWS = "pair_coeff 1 1 {circuloline} 1.0 0.8\npair_coeff 2 2 {circuloline} 4.0 0.6\n"
RULES = {  # of eps = 1 and 4, widths 0.8 and 0.6
    "geometric": 2.0,
    "arithmetic": 2.0,
    "sixthpower": 2 * 2.0 * (0.8 * 0.6) ** 3 / (0.8**6 + 0.6**6),
}


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("style", ["circuloline", "hybrid circuloline"])
def test_restart_files_keep_rules_and_roles(lmp, style, rule):
    """Two disks whose law is mixed, by hand; of hybrid, LAMMPS writes no coefficients."""
    hybrid = style.startswith("hybrid")
    laws = LAWS.format(circuloline="circuloline" if hybrid else "")
    outlines.commands(lmp, DISKS + f"pair_style {style} 0.5 1.0 disks 1*2\npair_modify mix {rule}\n{laws}")
    wanted = RULES[rule] / 2 * (1 - 0.5 / 0.7) ** 2
    again = "write_restart again.restart\nclear\nread_restart again.restart\n" + (laws if hybrid else "")
    for text in ("", again):
        outlines.commands(lmp, text + "thermo_modify norm no\nrun 0")
        assert lmp.get_thermo("pe") == pytest.approx(wanted, rel=1e-13)


SIZES = """
clear
units lj
dimension 2
atom_style atomic
region box prism 0 5 0 5 -0.5 0.5 0 0 0
create_box 1 box
mass * 1
fix d all property/atom d_diameter {ghost}
create_atoms 1 single 0.4 2.0 0
create_atoms 1 single 4.6 2.0 0
set group all d_diameter 1.0
pair_style disk/drag 0 0 exponent 2.5 sizes d_diameter power 0.5
pair_coeff 1 1 0.5 {s}
neighbor 0.05 bin
thermo_modify norm no
"""


def test_diameters_of_single_disks(lmp):
    """Through the boundary, whether or not the property has ghosts; after a restart; never beyond the lists."""
    wanted = 0.5 * 0.2**2.5
    for ghost in ("", "ghost yes"):
        outlines.commands(lmp, SIZES.format(ghost=ghost, s=1.0) + "run 0\n")
        assert lmp.get_thermo("pe") == pytest.approx(wanted, rel=1e-12)
    again = "write_restart sizes.restart\nclear\nread_restart sizes.restart\nfix d all property/atom d_diameter\n"
    outlines.commands(lmp, again + "thermo_modify norm no\nrun 0\n")
    assert lmp.get_thermo("pe") == pytest.approx(wanted, rel=1e-12)
    with pytest.raises(Exception, match=r"0\.9"):
        outlines.commands(lmp, SIZES.format(ghost="", s=0.9) + "run 0\n")


@pytest.fixture(scope="module")
def disks():
    return jamlab.pack(n=16, pressure=2e-2, seed=2)


@pytest.fixture(scope="module")
def droplets():
    return jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")


@pytest.mark.parametrize(
    ("kind", "fix", "steps"),
    [
        (Flow, "rate 0.1 tolerance 1e-2 background 1e-2 stop 0.5", 1000),
        (DropletFlow, "rate 0.1 tolerance 1e-2 drag 1 1 1 background 0.1 stop 0.5", 1000),
    ],
)
def test_a_flow_that_skips_its_setup(tmp_path, disks, droplets, kind, fix, steps):
    """Each interval ends where it should, with the numbers of a flow that does not skip it, to its tolerance."""
    ends = {}
    for pre in ("yes", "no"):
        with kind(tmp_path, disks if kind is Flow else droplets, fix, "1 1" if kind is Flow else "") as flow:
            flow.lmp.command("thermo_style custom step")  # no energy is known where an interval has ended a run
            flow.run(3)
            for n in (1, 2, 3):
                flow.lmp.command(f"run {steps} pre {pre} post no")
                assert flow.lmp.extract_fix("flow", 0, 1, 0, 0) == pytest.approx(0.5 * n, rel=1e-12)
            ends[pre] = [flow.lmp.extract_fix("flow", 0, 1, k, 0) for k in (1, 3, 9, 10, 11)]
    assert ends["no"] == pytest.approx(ends["yes"], rel=1e-2)


def test_what_comes_after_a_flow_has_its_own_time_step(tmp_path, disks):
    with Flow(tmp_path, disks, "rate 0.1 background 1e-2") as flow:
        flow.lmp.command("unfix flow")
        flow.lmp.commands_list(["timestep 0.003", "fix flow all overdamped rate 0.1 background 1e-2"])
        flow.run(5)
        assert flow.lmp.extract_global("dt") != 0.003
        flow.lmp.command("unfix flow")
        assert flow.lmp.extract_global("dt") == 0.003


def test_contacts_of_a_flow_are_complete_whatever_neigh_modify_says(tmp_path, droplets):
    rows = []
    for setting in ("every 1 delay 0 check yes", "every 200 delay 200 check no"):
        fix = "rate 0.1 tolerance 1e-2 drag 1 1 1 background 1e-2 stop 3"
        with DropletFlow(tmp_path, droplets, fix, "") as flow:
            flow.lmp.command(f"neigh_modify {setting}")
            rows.append(flow.run())
    assert rows[1]["contacts"] == rows[0]["contacts"]
    assert rows[1]["energy"] == pytest.approx(rows[0]["energy"], rel=1e-5)


MOVING = """
fix move all nve
timestep 0.002
velocity all create 0.05 7 loop geom
velocity all set NULL NULL 0.0
neigh_modify every 1 delay 0 check no
compute c all polygon/contact
compute g all reduce sum c_c[5] inputs local
compute shape rings polygon
variable eps equal 1.7+0.1*c_g
variable ka equal 20+c_shape[1][1]
fix change all adapt 1 pair circuloline eps 1 1 v_eps
run 40
print "state-{name} $(pe:%.17g) $(ke:%.17g)"
"""


@pytest.mark.parametrize(
    ("boundary", "ranks", "newton"),  # with ghosts, whose number changes, and without
    [("p p p", 1, "on"), ("f f p", 1, "on"), pytest.param("p p p", 3, "off", marks=pytest.mark.slow)],
)
def test_computes_are_asked_at_any_point_of_a_step(tmp_path, boundary, ranks, newton):
    """fix adapt asks between the neighbor build, which sorts atoms, and the forces: sorting changes nothing."""
    state = outlines.scene(31)
    if boundary[0] == "f":
        state = outlines.Scene([outlines.Outline(o.points - state.points.min(axis=0) + 1.0, o.type, o.a0)
                                for o in state.outlines], state.box + 3)  # fmt: skip
    (tmp_path / "data").write_text(outlines.data(state))
    deck = ""
    for sort in (0, 3):
        here = outlines.deck("data", newton).replace("sort 0 0.0", f"sort {sort} 0.2").replace("p p p", boundary)
        deck += here + MOVING.format(name=sort)
    found = run(tmp_path, deck, ranks)
    assert found["state-3"] == pytest.approx(found["state-0"], rel=1e-10)


RERUN = """
fix move all nve
timestep 0.002
velocity all create 0.05 7 loop geom
velocity all set NULL NULL 0.0
dump moved all custom 20 moved.dump id mol type x y ix iy
dump_modify moved format float %.17g
run 40
print "state-run $(pe:%.17g) $(pxy:%.17g)"
undump moved
unfix move
rerun moved.dump dump x y ix iy box yes
print "state-rerun $(pe:%.17g) $(pxy:%.17g)"
"""
RANKS = [
    (1, "on"),
    (2, "off"),
    *(pytest.param(n, newton, marks=pytest.mark.slow) for n, newton in ((3, "on"), (4, "off"))),
]


def with_far_images(state, first):
    """Data file of a state whose image flags along x begin at `first`, and begin anew beyond 511."""
    text = outlines.data(state.shifted(np.array([first, 0]) * state.box)).splitlines()
    for k, line in enumerate(text):
        words = line.split()
        if len(words) == 9:  # an atom
            words[6] = str((int(words[6]) + 512) % 1024 - 512)
            text[k] = " ".join(words)
    return "\n".join(text) + "\n"


@pytest.mark.parametrize(("ranks", "newton"), RANKS)
def test_files_are_read_alike_on_any_number_of_ranks(tmp_path, ranks, newton):
    """A dump by rerun; image flags that begin anew, with ghosts by type; restart files of a mixed law and of single
    diameters. Their energies are known by hand."""
    split = outlines.scene(32).shifted(np.array([2.7, 0.4]))
    (tmp_path / "far").write_text(with_far_images(split, 511))
    laws = "pair_style circuloline 0.5 1.0 disks 1*2\npair_modify mix sixthpower\n" + LAWS.format(circuloline="")
    (tmp_path / "data").write_text(outlines.data(outlines.scene(31)))
    deck = outlines.deck("data", newton) + "compute v all pressure NULL virial\nthermo_modify press v\n" + RERUN
    for name, start, again in (
        ("mixed", DISKS + laws, ""),
        ("sizes", SIZES.format(ghost="", s=1.0), SIZES.splitlines()[8]),
    ):
        deck += start.replace("units lj", f"units lj\nnewton {newton}") + f"write_restart {name}\nclear\n"
        deck += f"read_restart {name}\n{again.format(ghost='')}\nthermo_modify norm no\nrun 0\n"
        deck += f'print "state-{name} $(pe:%.17g)"\n'
    by_type = "neighbor 0.1 multi\ncomm_modify mode multi\nthermo_modify norm no\nrun 0\n"
    deck += outlines.deck("far", newton) + by_type + 'print "state-far $(pe:%.17g)"\n'
    found = run(tmp_path, deck, ranks)
    assert found["state-far"] == pytest.approx([outlines.energy(split)], rel=1e-11)
    assert found["state-rerun"] == pytest.approx(found["state-run"], rel=1e-12)
    mixed = RULES["sixthpower"] / 2 * (1 - 0.5 / 0.7) ** 2
    assert [*found["state-mixed"], *found["state-sizes"]] == pytest.approx([mixed, 0.5 * 0.2**2.5], rel=1e-12)


@pytest.mark.parametrize("first", [511, -512, 260])
def test_image_flags_begin_anew(lmp, tmp_path, first):
    """A polygon over the boundary is whole where the flags of its vertices are not: energy and areas by numpy."""
    state = outlines.scene(32).shifted(np.array([2.7, 0.4]))
    wanted, areas = outlines.energy(state), [o.area for o in state.outlines if o.type == outlines.RING]
    (tmp_path / "data").write_text(with_far_images(state, first))
    shown = "compute shape rings polygon\nthermo_style custom pe c_shape[1][1]\nthermo_modify norm no\nrun 0\n"
    outlines.commands(lmp, outlines.deck("data") + shown)
    assert lmp.get_thermo("pe") == pytest.approx(wanted, rel=1e-11)
    assert lmp.numpy.extract_compute("shape", 0, 2)[:, 0] == pytest.approx(areas, rel=1e-11)


def test_commands_that_the_styles_survive(lmp, tmp_path):
    """An unfix of the internal fix; a style given again, with another form, or with fewer ghosts than before."""
    state = outlines.scene(33)
    outlines.start(lmp, tmp_path, state, "run 0\n")
    ghosts = lmp.extract_setting("nghost")
    for text in ("jamlab/forces", "run 0"):
        outlines.commands(lmp, f"unfix POLYGON_OUTLINE\n{text}")
        assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state), rel=1e-12)
    outlines.commands(lmp, "pair_style circuloline 0.25 3.0 walls 2 disks 3\nrun 0\nwrite_restart wide.restart\n")
    assert lmp.extract_setting("nghost") > ghosts
    outlines.commands(lmp, "pair_style circuloline 0.25 1.2 contact segment/smooth walls 2 disks 3\nrun 0\n")
    assert lmp.extract_setting("nghost") == ghosts
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, form="segment/smooth"), rel=1e-12)
    again = "clear\nread_restart wide.restart\nneighbor 0.1 bin\n"
    outlines.commands(lmp, again + "pair_style circuloline 0.25 1.2 walls 2 disks 3\nrun 0\n")
    assert lmp.extract_setting("nghost") == ghosts


@pytest.mark.parametrize("other", ["angle_style zero", "improper_style zero", "fix squeeze all deform 1 x erate 0.1"])
def test_forces_without_a_run_refuse_what_they_do_not_know(lmp, tmp_path, other):
    outlines.start(lmp, tmp_path, outlines.scene(34), "run 0\njamlab/forces\n" + other)
    if other.startswith("fix"):
        lmp.command("run 0")  # where LAMMPS learns that the box changes
    with pytest.raises(Exception, match="jamlab/forces"):
        lmp.command("jamlab/forces")


def test_bonds_that_change_within_a_run(lmp, tmp_path):
    """As many at each atom as before, while part of a ring comes to run the other way."""
    ring = outlines.Outline(np.array([[2, 2], [4, 1.2], [6, 2], [6, 4], [4, 4.8], [2, 4]]) / 4, a0=0.5)
    state = outlines.Scene([ring], np.array([6.0, 6.0]))
    outlines.start(lmp, tmp_path, state, "neigh_modify every 1 delay 0 check no\nfix move all nve\ntimestep 0\nrun 1\n")
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state), rel=1e-12)
    ids, counts, ends = (lmp.extract_atom(name) for name in ("id", "num_bond", "bond_atom"))
    order = [1, 2, 5, 4, 3, 6]
    for i in range(6):
        assert counts[i] == 1  # that to the next vertex
        ends[i][0] = order[(order.index(ids[i]) + 1) % 6]
    lmp.command("run 1 pre no")
    twisted = outlines.Scene([outlines.Outline(ring.points[[0, 1, 4, 3, 2, 5]], a0=0.5)], state.box)
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(twisted), rel=1e-12)
