"""Contacts of outlines and disks under settings of LAMMPS: edges that grow, moving boxes, exclude, special_bonds."""

import numpy as np
import outlines
import pytest

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


EXCLUDE = "group one molecule 1\ngroup two molecule 2\nneigh_modify exclude {}\n"


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("form", "excluded"),
    [
        pytest.param(form, excluded, marks=[pytest.mark.slow] * bool(excluded and form != outlines.FORMS[0]))
        for form in outlines.FORMS
        for excluded in ("", "group one two", "molecule/inter all")
    ],
)
def test_contacts_of_edges_that_grew(tmp_path, form, ranks, excluded):
    """0.4 long at the start, 2.3 at the end of the run: energy and forces as in a run that starts there. `neigh_modify
    exclude` holds where the neighbor lists no longer find the contacts."""
    (tmp_path / "growing.data").write_text(growing())
    start = START.format(form=form, eps=1.0) + (EXCLUDE.format(excluded) if excluded else "")
    last = "run 0 pre no" if ranks == 1 else ""
    deck = start + GROW + END.format(name="grown").replace("run 0", last, 1)
    deck += start.replace("growing.data", "grown.data") + END.format(name="fresh")
    values = run(tmp_path, deck, ranks)
    assert (values["state-fresh"][0] > 0.001) == (excluded != "molecule/inter all")
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


@pytest.mark.parametrize("factor", [1.0, 0.5, 0.0])
def test_special_bonds_weaken_contacts_of_disks(lmp, factor):
    """Four overlaps of 0.1, all between bonded disks: each has the factor of bonded pairs."""
    chain(lmp, f"lj {factor} 1 1", "disks 1")
    assert lmp.get_thermo("pe") * 5 == pytest.approx(factor * 4 * 0.5 * 0.1**2, abs=1e-14)
    assert lmp.numpy.extract_atom("f")[0, 0] == pytest.approx(-0.1 * factor, abs=1e-14)


def test_special_bonds_between_a_disk_and_an_outline_are_refused(lmp):
    """An edge has two ends with a factor each."""
    with pytest.raises(Exception, match="outline"):
        chain(lmp, "lj 0.5 1 1", "disks 1 walls 2", ["set atom 1*2 type 2 mol 1", "set atom 3*5 mol 2"])
