"""Contacts of outlines and disks under settings of LAMMPS: edges that grow, moving boxes, exclude, special_bonds."""

import numpy as np
import pytest
from deck_runs import SETTINGS
from mixtures import coefficients, mixture, write

from jamlab.packing.law_parameters import CONTACT_FORMS

from .test_plugin_on_ranks import columns, run

START = """
clear
units lj
dimension 2
atom_style molecular
atom_modify map array sort 0 0.0
read_data growing.data
special_bonds lj/coul 1.0 1.0 1.0
bond_style line/tension
bond_coeff * 0.0
pair_style circuloline 0.25 2.5 contact {form}
pair_coeff * * {eps}
neighbor 0.1 bin
neigh_modify delay 0 every 1 check yes
"""
GROW = """
fix move all nve
timestep 0.01
run 190
write_data grown.data nocoeff
"""
END = """
run 0
write_dump all custom {name}.dump id fx fy modify sort id format float %.17g
print "state-{name} $(pe:%.17g) $(pxx:%.17g) $(pyy:%.17g)"
"""


def moving_rings(x, v, size, side):
    """Data file of rings of `size` vertices each, with velocities, in a square box."""
    lines = ["rings", "", f"{len(x)} atoms", f"{len(x)} bonds", "1 atom types", "1 bond types", f"0 {side} xlo xhi"]
    lines += [f"0 {side} ylo yhi", "-0.5 0.5 zlo zhi", "", "Masses", "", "1 1e9", "", "Atoms", ""]
    lines += [f"{k + 1} {k // size + 1} 1 {a} {b} 0" for k, (a, b) in enumerate(x)]
    lines += ["", "Velocities", "", *(f"{k + 1} {a} {b} 0" for k, (a, b) in enumerate(v)), "", "Bonds", ""]
    lines += [f"{k + 1} 1 {k + 1} {k // size * size + (k + 1) % size + 1}" for k in range(len(x))]
    return "\n".join(lines) + "\n"


def growing():
    """A square whose right side runs away, and a small one beside the middle of the edge that is drawn out."""
    corners = np.array([[0, 0], [0.4, 0], [0.4, 0.4], [0, 0.4]])
    v = np.zeros((12, 2))
    v[[1, 2], 0] = 1.0
    return moving_rings(np.vstack([corners + 3.0, corners * 0.5 + [3.9, 3.6], corners * 0.5 + [3.9, 2.6]]), v, 4, 8)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("form", CONTACT_FORMS)
def test_contacts_of_edges_that_grew(tmp_path, form, ranks):
    """0.4 long at the start, 2.3 at the end of the run: energy and forces as in a run that starts there."""
    (tmp_path / "growing.data").write_text(growing())
    start = START.format(form=form, eps=1.0)
    last = "run 0 pre no" if ranks == 1 else ""
    deck = start + GROW + END.format(name="grown").replace("run 0", last, 1)
    deck += start.replace("growing.data", "grown.data") + END.format(name="fresh")
    values = run(tmp_path, deck, ranks)
    assert values["state-fresh"][0] > 0.005
    assert values["state-grown"] == pytest.approx(values["state-fresh"], rel=1e-12)
    forces = [columns(tmp_path / f"{name}.dump", 9) for name in ("grown", "fresh")]
    assert np.abs(forces[0] - forces[1]).max() < 1e-12


COLUMN = """
clear
newton {newton}
processors 2 1 1
units lj
dimension 2
atom_style molecular
atom_modify map array
lattice sq 1.0
region box block 0 12 0 {height} -0.5 0.5
create_box 1 box bond/types 1 extra/bond/per/atom 2
region crowd block 0 5.9 0 {height} -0.5 0.5
create_atoms 1 region crowd
mass * 1.0
displace_atoms all random 0.1 0.1 0 8321
pair_style {pair}
pair_coeff * * {style} 1.0 1.3
neighbor 0.3 bin
run 0
print "state-{style}-{newton} $(pe:%.17g) $(pxx:%.17g) $(pxy:%.17g)"
"""


@pytest.mark.parametrize("style, pair", [("", "{}"), ("circuloline", "hybrid/overlay {}")])
def test_a_rank_that_sends_more_than_it_receives(tmp_path, style, pair):
    """What comes back to a crowded rank, newton off, needs more room than what LAMMPS itself sends there."""
    deck = ""
    for newton in ("on", "off"):
        deck += COLUMN.format(height=3000, newton=newton, style=style, pair=pair.format("circuloline 1.0 1.0 disks 1"))
    on, off = run(tmp_path, deck, 2).values()
    assert on[0] > 0.01
    assert off == pytest.approx(on, rel=1e-10)


MOVED = """
{settings}
atom_style molecular
bond_style zero nocoeff
special_bonds lj/coul 1.0 1.0 1.0
read_data mixture.data
bond_coeff *
mass * 1.0
pair_style circuloline 0.25 0.9 walls 3*4 disks 5,6
{coefficients}
neighbor 0.4 bin
group walls type 3 4
group droplets type 1 2
compute contacts all polygon/contact
compute forces all reduce sum c_contacts[5] c_contacts[6] inputs local
compute walls walls polygon/group/group droplets
thermo_style custom step pe c_forces[*] c_walls c_walls[*]
thermo_modify norm no
fix move all deform 1 xy erate 0.05 remap x
timestep 1.0
run 1
{printed}
unfix move
run 0
{printed}
"""
SUMS = ["c_forces[1]", "c_forces[2]", "c_walls", "c_walls[1]", "c_walls[2]"]


@pytest.mark.parametrize("ranks", [1, 2])
def test_contacts_after_the_box_was_sheared(tmp_path, ranks):
    """At the end of a step, fix deform moves atoms and leaves ghosts behind: computes look at present positions."""
    write(tmp_path / "mixture.data", *mixture(3, 0.1))
    printed = 'print "state-{}' + " ".join(f"$({name}:%.17g)" for name in SUMS) + '"'
    deck = MOVED.replace("{printed}", printed.format("sheared "), 1).replace("{printed}", printed.format("again "))
    deck = deck.format(settings=SETTINGS, coefficients=coefficients("outline"))
    values = run(tmp_path, deck, ranks)
    assert values["state-sheared"] == pytest.approx(values["state-again"], rel=1e-10)


EXCLUDE = """
group one molecule 1
group two molecule 2
neigh_modify exclude {pairs}
"""


@pytest.mark.parametrize("pairs", ["group one two", "molecule/inter all"])
@pytest.mark.parametrize("form", ["outline", "segment"])
def test_pairs_stay_excluded_when_an_edge_grows(tmp_path, form, pairs):
    """`neigh_modify exclude` holds when contacts are no longer found by the neighbor lists."""
    (tmp_path / "growing.data").write_text(growing())
    start = START.format(form=form, eps=1.0) + EXCLUDE.format(pairs=pairs)
    deck = start + GROW + END.format(name="grown").replace("run 0", "run 0 pre no", 1)
    deck += start.replace("growing.data", "grown.data") + END.format(name="fresh")
    values = run(tmp_path, deck, 1)
    assert (values["state-fresh"][0] > 0.001) == (pairs == "group one two")
    assert values["state-grown"] == pytest.approx(values["state-fresh"], rel=1e-12)
    forces = [columns(tmp_path / f"{name}.dump", 9) for name in ("grown", "fresh")]
    assert np.abs(forces[0] - forces[1]).max() < 1e-12


def chain(lmp, special, roles, more=()):
    """Five disks in a row, overlapping by 0.1, bonded to their neighbors."""
    for line in [
        *["units lj", "dimension 2", "atom_style molecular", "atom_modify map array"],
        "region box block -5 5 -2 2 -0.5 0.5",
        "create_box 2 box bond/types 1 extra/bond/per/atom 2 extra/special/per/atom 4",
        *(f"create_atoms 1 single {-2 + 0.9 * k} 0 0" for k in range(5)),
        *["mass * 1", "bond_style zero", "bond_coeff * 0.9", f"pair_style circuloline 1.0 1.5 {roles}"],
        *["pair_coeff * * 1.0", "neighbor 0.3 bin", "create_bonds many all all 1 0.85 0.95"],
        *[f"special_bonds {special}", *more, "run 0"],
    ]:
        lmp.command(line)


@pytest.mark.parametrize("form", ["outline", "segment"])
@pytest.mark.parametrize("factor", [1.0, 0.5, 0.0])
def test_special_bonds_weaken_contacts_of_disks(lmp, factor, form):
    """Four overlaps of 0.1, all between bonded disks: each has the factor of bonded pairs."""
    chain(lmp, f"lj {factor} 1 1", f"contact {form} disks 1")
    assert lmp.get_thermo("pe") * 5 == pytest.approx(factor * 4 * 0.5 * 0.1**2, abs=1e-14)
    assert lmp.numpy.extract_atom("f")[0, 0] == pytest.approx(-0.1 * factor, abs=1e-14)


def test_special_bonds_between_a_disk_and_an_outline_are_refused(lmp):
    """An edge has two ends with a factor each."""
    with pytest.raises(Exception, match="outline"):
        chain(lmp, "lj 0.5 1 1", "disks 1 walls 2", ["set atom 1*2 type 2 mol 1", "set atom 3*5 mol 2"])
