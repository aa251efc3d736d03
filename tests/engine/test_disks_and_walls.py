"""Droplets, disks and walls in one box: energy, forces and contacts in each form against plain loops over the law.

E = (eps/2) (1 - d/delta_ij)^2 of the distance d between a point and a segment; on 1, 2 and 4 ranks, newton on and off.
"""

import numpy as np
import outlines
import pytest
from outlines import DISK, RING, WALL

from .test_plugin_on_ranks import columns, run

ASK = """
compute contacts all polygon/contact
dump contacts all local 1 {name}.contacts c_contacts[*]
dump_modify contacts format float %.17g
dump forces all custom 1 {name}.dump id fx fy
dump_modify forces sort id format float %.17g
run 0
print "state-{name} $(pe:%.17g)"
"""


def by_place(rows):
    """Forces and separations of contacts, in an order of their own."""
    return rows[np.lexsort(np.rint(1e6 * rows).T)]


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(4, marks=pytest.mark.slow)])
def test_energy_forces_and_contacts_are_those_of_the_law(tmp_path, ranks):
    """Each kind meets each other; either of two disks is the vertex."""
    state, deck = outlines.scene(3), ""
    (tmp_path / "data").write_text(outlines.data(state))
    kinds = np.repeat([o.type for o in state.outlines], np.diff(state.starts))
    met = {tuple(sorted(kinds[[c.vertex, c.tail]])) for c in outlines.contacts(state)}
    assert met >= {(RING, RING), (RING, WALL), (RING, DISK), (DISK, DISK)}
    for k, form in enumerate(outlines.FORMS):
        for newton in ("on", "off"):
            here = outlines.deck("data", newton).replace("1.2 walls", f"1.2 contact {form} walls")
            deck += here + ASK.format(name=f"state-{k}-{newton}")
    printed = run(tmp_path, deck.replace("state-state", "state"), ranks)
    assert len(printed) == 2 * len(outlines.FORMS)
    wanted_of = {form: (outlines.contacts(state, form=form), outlines.forces(state, form)) for form in outlines.FORMS}
    for name, (pe,) in printed.items():
        form = outlines.FORMS[int(name.split("-")[1])]
        contacts, forces = wanted_of[form]
        scale = np.abs(forces).max()
        assert pe == pytest.approx(outlines.energy(state, form=form), rel=1e-12), name
        assert np.abs(columns(tmp_path / f"{name}.dump", 9) - forces).max() < 1e-12 * scale, name
        listed = np.loadtxt(tmp_path / f"{name}.contacts", skiprows=9)
        wanted = np.array([[c.vertex + 1, c.tail + 1, *c.force, *c.separation] for c in contacts])
        found = listed[:, [2, 3, 6, 7, 8, 9]]
        assert len(found) == len(wanted) > 20
        found, wanted = (by_place(np.delete(rows, 1, axis=1)[(kinds[rows[:, :2].astype(int) - 1] != DISK).any(1)])
                         for rows in (found, wanted))  # fmt: skip
        assert np.abs(found - wanted).max() < 1e-12 * max(scale, 1.0), name


NUMERICAL = """
compute virial all pressure NULL virial
fix slope all numdiff 1 1e-5
fix strain all numdiff/virial 1 1e-5
dump slope all custom 1 {name}.slope id fx fy f_slope[1] f_slope[2]
dump_modify slope sort id format float %.17g
thermo_style custom step pe press pxx pyy pxy fmax f_strain[*]
thermo_modify norm no press virial
run 0
print "state-{name} $(pxx:%.17g) $(pyy:%.17g) $(pxy:%.17g)&
 $(f_strain[1]:%.17g) $(f_strain[2]:%.17g) $(f_strain[6]:%.17g)"
"""


def test_forces_and_virial_are_slopes_of_the_energy(tmp_path):
    """fix numdiff and fix numdiff/virial of LAMMPS: two droplets, two disks and a wall in a small box."""
    ring = outlines.regular(6, (0.7, 0.7), 0.5, a0=0.6)
    other = outlines.regular(5, (1.75, 0.72), 0.5, a0=0.6)
    disks = [outlines.Outline(np.array([[x, 1.9]]), DISK) for x in (0.9, 1.7)]
    wall = outlines.Outline(np.array([[0.1, 1.37], [1.2, 1.35], [2.1, 1.37]]), WALL)
    state = outlines.Scene([ring, other, *disks, wall], np.array([2.6, 3.0]))
    (tmp_path / "data").write_text(outlines.data(state))
    deck = ""
    for k, form in enumerate(outlines.FORMS):
        here = outlines.deck("data").replace("1.2 walls", f"1.2 contact {form} walls").replace(outlines.AREA, "")
        deck += here.replace(f"bond_coeff * {outlines.GAMMA}", "bond_coeff * 0.0") + NUMERICAL.format(name=k)
    for name, values in run(tmp_path, deck, 1).items():
        forces, slopes = np.split(columns(tmp_path / f"{name.removeprefix('state-')}.slope", 9), 2, axis=1)
        assert np.abs(forces).max() > 0.1
        assert np.abs(slopes - forces).max() < 1e-6 * np.abs(forces).max(), name
        assert np.abs(values[3:] - values[:3]).max() < 1e-6 * np.abs(values[:3]).max(), name
