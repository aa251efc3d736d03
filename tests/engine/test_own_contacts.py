"""Keyword `self` of pair style circuloline: outlines touch themselves, and cannot fold through themselves."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import outlines
import pytest
from droplet_flows import DropletFlow
from folded_outlines import NEAR, folded

import jamlab
from jamlab.installed_files import installed

from .test_plugin_errors import refusal
from .test_plugin_on_ranks import columns, launch, run

ASK = """
compute contacts all polygon/contact
dump contacts all local 1 {name}.contacts c_contacts[*]
dump_modify contacts format float %.17g
compute e all pe/atom
compute s all stress/atom NULL virial
compute sum all reduce sum c_e c_s[1] c_s[2] c_s[4]
compute virial all pressure NULL virial
thermo_style custom step pe press pxx pyy pxy c_sum[*]
thermo_modify norm no press virial
dump forces all custom 1 {name}.dump id fx fy
dump_modify forces sort id format float %.17g
run 0
print "state-{name} $(pe:%.17g) $(evdwl:%.17g) $(pxx:%.17g) $(pyy:%.17g) $(pxy:%.17g)&
 $(c_sum[1]:%.17g) $(-c_sum[2]/vol:%.17g) $(-c_sum[3]/vol:%.17g) $(-c_sum[4]/vol:%.17g)"
"""


def deck(form="outline", newton="on", near=NEAR):
    words = f"1.2 contact {form} self {near}" if near else f"1.2 contact {form}"
    plain = outlines.deck("data", newton).replace(f"1.2 walls {outlines.WALL} disks {outlines.DISK}", words)
    return plain + ASK.replace("{name}", "{0}").format(f"{form[:3]}-{newton}")


@pytest.mark.parametrize("ranks", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 3, 4))])
def test_energy_forces_and_virial_are_those_of_the_law(tmp_path, ranks):
    """Against plain loops; per atom they add up to the whole."""
    state = folded()
    (tmp_path / "data").write_text(outlines.data(state))
    printed = run(tmp_path, "".join(deck(form, newton) for form in outlines.FORMS for newton in ("on", "off")), ranks)
    assert len(printed) == 4
    owner = np.repeat(np.arange(len(state.outlines)), np.diff(state.starts))
    for form in outlines.FORMS:
        contacts, forces = outlines.contacts(state, form=form), outlines.forces(state, form)
        energy, scale = sum(c.energy for c in contacts), np.abs(forces).max()
        plain = replace(state, outlines=[], near=0.0)
        whole = energy + sum(outlines.energy(replace(plain, outlines=[one])) for one in state.outlines)
        for newton in ("on", "off"):
            name = f"{form[:3]}-{newton}"
            pe, evdwl, *rest = printed[f"state-{name}"]
            assert [pe, evdwl] == pytest.approx([whole, energy], rel=1e-12), name
            assert rest[3:] == pytest.approx([pe, *rest[:3]], rel=1e-10), name
            assert np.abs(columns(tmp_path / f"{name}.dump", 9) - forces).max() < 1e-12 * scale, name
            listed = np.loadtxt(tmp_path / f"{name}.contacts", skiprows=9)
            assert len(listed) == len(contacts), name
            own = sum(owner[c.vertex] == owner[c.tail] for c in contacts)
            assert np.sum(listed[:, 0] == listed[:, 1]) == own > 5, name


SLOPES = """
compute virial all pressure NULL virial
fix slope all numdiff 1 1e-5
fix strain all numdiff/virial 1 1e-5
dump slope all custom 1 {0}.slope id fx fy f_slope[1] f_slope[2]
dump_modify slope sort id format float %.17g
thermo_style custom step pe press pxx pyy pxy f_strain[*]
thermo_modify norm no press virial
run 0
print "state-{0} $(pxx:%.17g) $(pyy:%.17g) $(pxy:%.17g)&
 $(f_strain[1]:%.17g) $(f_strain[2]:%.17g) $(f_strain[6]:%.17g)"
"""


def test_forces_and_virial_are_slopes_of_the_energy(tmp_path):
    """By fix numdiff and fix numdiff/virial of LAMMPS, without tension and areas."""
    (tmp_path / "data").write_text(outlines.data(folded(2)))
    text = ""
    for form in outlines.FORMS:
        plain = deck(form).partition("\ncompute")[0].replace(outlines.AREA, "")
        text += plain.replace(f"bond_coeff * {outlines.GAMMA}", "bond_coeff * 0.0") + SLOPES.format(form[:3])
    for name, values in run(tmp_path, text, 1).items():
        forces, slopes = np.split(columns(tmp_path / f"{name.removeprefix('state-')}.slope", 9), 2, axis=1)
        assert np.abs(slopes - forces).max() < 1e-6 * np.abs(forces).max(), name
        assert np.abs(values[3:] - values[:3]).max() < 1e-6 * np.abs(values[:3]).max(), name


MOVE = """
fix move all nve
timestep 0.002
velocity all create 0.01 7 loop geom
velocity all set NULL NULL 0.0
run 50
print "state-{0} $(pe:%.17g) $(evdwl:%.17g) $(ke:%.17g)"
"""


def test_outlines_that_bend_little_feel_nothing(tmp_path):
    """The same bits with the keyword and without: droplets that touch each other, with 7 to 40 vertices."""
    state = outlines.scene(5, foreign=False)
    for k in (0, 6):
        place = state.outlines[k].points.mean(axis=0)
        state.outlines[k] = outlines.regular(40 - k, place, 0.62, a0=1.1)
    (tmp_path / "data").write_text(outlines.data(state))
    text = ""
    for k, near in enumerate((0, 0.04)):
        text += deck("outline", near=near).partition("\ncompute")[0] + MOVE.format(k)
    found = run(tmp_path, text, 1)
    assert found["state-0"][1] > 0.01
    assert found["state-0"].tolist() == found["state-1"].tolist()


@pytest.mark.parametrize("kept", ["restart", "data"])
def test_files_and_styles_given_again(lmp, tmp_path, kept):
    """A restart file keeps the range; a data file goes with pair_style, which may change it."""
    state = folded(3)
    (tmp_path / "data").write_text(outlines.data(state))
    outlines.commands(lmp, deck().partition("\ncompute")[0] + "\nrun 0\n")
    wanted = lmp.get_thermo("evdwl")
    if kept == "restart":
        outlines.commands(lmp, "write_restart whole\nclear\nread_restart whole\nfix d_a0 all property/atom d_a0\n")
        outlines.commands(lmp, outlines.FORCE.partition("bond_style")[0] + "thermo_modify norm no\nrun 0\n")
        assert lmp.get_thermo("evdwl") == wanted
    for near in (0.05, 0.0):
        outlines.commands(lmp, f"pair_style circuloline 0.25 1.2 self {near}\nrun 0\n")
        here = replace(state, near=near)
        assert lmp.get_thermo("evdwl") == pytest.approx(sum(c.energy for c in outlines.contacts(here)), rel=1e-12)


@pytest.mark.parametrize("form", outlines.FORMS)
def test_a_width_that_fix_adapt_lessens_is_that_of_a_new_run(lmp, tmp_path, form):
    """From the present width follows which edges are near, and each count, and of which the closest point alone."""
    (tmp_path / "data").write_text(outlines.data(folded(3)))
    plain, found = deck(form, near=0.03).partition("\ncompute")[0], []
    coefficient = f"pair_coeff {outlines.RING} {outlines.RING} {outlines.EPS[outlines.RING]}"
    adapt = f"fix less all adapt 1 pair circuloline delta {outlines.RING} {outlines.RING} v_width\n"
    for more in (f"{coefficient} 0.2\n", f"variable width equal 0.2\n{adapt}"):
        outlines.commands(lmp, f"{plain}\n{more}run 0\n")
        found.append((lmp.get_thermo("evdwl"), *lmp.gather_atoms("f", 1, 3)))
    assert found[0][0] > 0.1
    assert found[0] == pytest.approx(found[1], rel=1e-13, abs=1e-13)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("pair_style circuloline 0.25 1.2 self -0.1", "self -0.1 must not be negative"),
        ("pair_style circuloline 0.25 1.2 self much", "much"),
        ("pair_style circuloline 0.25 1.2 self 0.001\nrun 0", "self 0.001 is less than 1/100"),
        ("special_bonds lj/coul 0 0 0\nrun 0", "use special_bonds lj/coul 1 1 1, or remove self 0.1"),
        (
            "neigh_modify exclude molecule/intra all\nrun 0",
            "exclude molecule/intra hides the contacts of a polygon with",
        ),
    ],
)
def test_what_hides_these_contacts_is_refused(lmp, tmp_path, lines, said):
    (tmp_path / "data").write_text(outlines.data(folded()))
    outlines.commands(lmp, deck().partition("\ncompute")[0])
    assert said in refusal(lmp, lines)


def test_edges_shorter_than_the_range_are_told(tmp_path):
    """Once a run; their ends repel each other."""
    (tmp_path / "data").write_text(outlines.data(folded()))
    _, output = launch(tmp_path, deck(near=0.2).replace("run 0", "run 0\nrun 0 post no"), 1)
    assert len(re.findall(r"WARNING: .*: \d+ edges are shorter than self 0.2, so that their ends repel", output)) == 2


def test_a_descent_ends_between_own_edges(lmp, tmp_path):
    """jamlab/descend has these contacts in its Hessian: droplets shrink until their short edges hold them."""
    state = folded()
    state = replace(state, outlines=[replace(one, a0=0.05) for one in state.outlines])
    (tmp_path / "data").write_text(outlines.data(state))
    outlines.commands(lmp, deck("segment/smooth").partition("\ncompute")[0] + "\nrun 0\n")
    lmp.command("jamlab/descend 1e-10 5000 0 0 20 0.05 2 0.3 8 1e-13 1e-4 1e-10 2 3e-4 3e-4 4")
    steps, *_, force, _, crossed = map(float, lmp.extract_variable("descent").split())
    assert force < 1e-10
    assert steps < 400
    assert crossed == 0
    assert lmp.get_thermo("evdwl") > 1e-4


class OwnFlow(DropletFlow):
    """Droplets whose shortest edges are shorter than the range."""

    def lines(self, data, drag, newton):
        return [
            line + " self 0.2" if line.startswith("pair_style") else line for line in super().lines(data, drag, newton)
        ]


@pytest.mark.parametrize("drag", ["background 1", "drag 1 1 1 background 0.3"])
def test_flows_balance_their_energy(tmp_path, drag):
    """fix overdamped: work less dissipation is the change of the energy, that of these contacts included."""
    packing = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    with OwnFlow(tmp_path, packing, "rate 0.05 tolerance 1e-3 stop 0.05", drag) as flow:
        first, last = flow.run(0), flow.run()
    assert first["contacts"] > 80
    change = last["energy"] - first["energy"]
    assert change < -1e-3
    assert last["work"] - last["dissipated"] == pytest.approx(change, rel=1e-3)


HEAT = """
units lj
dimension 2
atom_style molecular
atom_modify map array
region box block 0 8 0 8 -0.5 0.5
create_box 1 box bond/types 1 extra/bond/per/atom 2 extra/special/per/atom 6
mass * 0.1
molecule drop {decks}/parts/polygon12.mol scale 0.9
create_atoms 0 random 8 {seed} NULL mol drop {seed} overlap 0.75 maxtry 10000
special_bonds lj/coul 1 1 1
{bonds}
pair_style circuloline 0.2 2.5 contact {form} {words}
pair_coeff 1 1 3.0
fix area all polygon/area 50 0.3
neighbor 0.2 bin
neigh_modify every 1 delay 0 check yes
compute shape all polygon
variable crossings equal sum(c_shape[4])
fix bath all langevin {heat} {heat} 1.0 {seed}
fix move all nve
fix plane all enforce2d
fix seen all ave/time 50 1 50 v_crossings mode scalar file crossings
timestep 0.005
run {steps}
print "state-heat $(temp:%.17g)"
"""
SPRINGS = "bond_style harmonic\nbond_coeff 1 50.0 0.28"


def crossings(folder, words, steps, bonds=SPRINGS, form="outline", heat=0.01, seed=4711):
    """Number of crossings of all outlines, every 50 steps of eight floppy droplets in a heat bath."""
    fields = {"decks": installed("lammps_inputs"), "bonds": bonds, "form": form, "words": words, "steps": steps}
    code, output = launch(folder, HEAT.format(heat=heat, seed=seed, **fields), 1)
    assert code == 0, output[-2000:]
    return np.loadtxt(folder / "crossings", skiprows=2)[:, 1]


def test_droplets_in_a_heat_bath_do_not_fold_through_themselves(tmp_path):
    assert crossings(tmp_path, "", 2500).max() > 1
    assert crossings(tmp_path, "self 0.1", 2500).max() == 0


@pytest.mark.parametrize("form", outlines.FORMS)
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.slow
def test_nor_do_they_in_long_runs(tmp_path, form, seed):
    """Half a million steps, at three times the temperature with springs, at length with line tension alone."""
    assert crossings(tmp_path, "self 0.1", 500000, form=form, seed=seed, heat=0.03).max() == 0
    tension = "bond_style line/tension\nbond_coeff 1 0.02 0.05"
    assert crossings(tmp_path, "self 0.1", 200000, tension, form=form, seed=seed).max() == 0
