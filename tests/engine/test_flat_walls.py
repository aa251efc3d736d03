"""Flat walls of pair_style circuloline: lines that vertices alone meet, on any number of ranks, against plain numpy."""

from dataclasses import replace

import numpy as np
import outlines
import pytest
from outlines import DISK, RING, WALL

from .test_plugin_on_ranks import columns, launch, run

LINES = 3
ASK = """
compute energies all pe/atom
compute energy all reduce sum c_energies
compute stresses all stress/atom NULL pair
compute stress all reduce sum c_stresses[1] c_stresses[2] c_stresses[4]
compute virial all pressure NULL pair
compute contacts all polygon/contact
dump contacts all local 1 {name}.contacts c_contacts[*]
dump_modify contacts format float %.17g
dump forces all custom 1 {name}.dump id fx fy
dump_modify forces sort id format float %.17g
thermo_style custom step temp pe ke press c_energy c_stress[*] c_virial
thermo_modify norm no
run 0
variable volume equal vol
print "state-{name} $(pe:%.17g) $(c_energy:%.17g) $(-c_stress[1]/v_volume:%.17g) $(c_virial[1]:%.17g)&
 $(-c_stress[2]/v_volume:%.17g) $(c_virial[2]:%.17g) $(-c_stress[3]/v_volume:%.17g) $(c_virial[4]:%.17g)"
undump forces
undump contacts
fix move all nve
velocity all create 0.01 7 dist gaussian loop all
timestep 0.002
run 20
print "state-{name}-later $(pe:%.17g) $(ke:%.17g)"
"""


@pytest.fixture(scope="module")
def state():
    """Droplets and two disks; of the atoms of three lines, one lies close to a disk, one where ranks meet, and one
    at the edge of the box, beyond which its image meets vertices."""
    scene = outlines.scene(3)
    disk = next(o.points[0] for o in scene.outlines if o.type == DISK)
    atoms = np.mod([np.add(disk, (0.1, 0.3)), 0.49 * scene.box, (0.7, 0.05)], scene.box)
    lines = [outlines.Outline(atom[None], WALL) for atom in atoms]
    return replace(scene, outlines=[*scene.outlines[:-1], *lines])


def law(state):
    """Energy, forces and number of contacts."""
    others = replace(state, outlines=state.outlines[:-LINES])
    energy, forces, count = outlines.energy(others), outlines.forces(others, "outline"), len(outlines.contacts(others))
    forces = np.vstack([forces, np.zeros((LINES, 2))])
    eps, width = outlines.mixed(RING, WALL)
    rings = np.repeat([o.type == RING for o in state.outlines], np.diff(state.starts))
    y = np.mod(state.points[:, 1], state.box[1])
    for k in range(-LINES, 0):
        r = y - y[k]
        r -= state.box[1] * np.round(r / state.box[1])
        near = np.flatnonzero(rings & (np.abs(r) < width))
        overlap = 1 - np.abs(r[near]) / width
        push = eps / width * overlap * np.sign(r[near])
        energy += np.sum(eps / 2 * overlap**2)
        forces[near, 1] += push
        forces[k, 1] -= np.sum(push)
        count += len(near)
        assert k < -1 or ((r[near] > 0).any() and (y[near] > y[k] + width).any())
    return energy, forces, count


def deck(newton, more=ASK):
    """Type 2 is of lines."""
    return outlines.deck("data", newton).replace(f"walls {WALL}", f"flat {WALL}") + more.format(name=newton)


@pytest.mark.parametrize("ranks", [1, 2, pytest.param(4, marks=pytest.mark.slow)])
def test_energy_forces_and_virial_of_lines_on_ranks(tmp_path, state, ranks):
    (tmp_path / "data").write_text(outlines.data(state))
    printed = run(tmp_path, deck("on") + deck("off"), ranks)
    energy, forces, count = law(state)
    for newton in ("on", "off"):
        pe, of_atoms, *stress = printed[f"state-{newton}"]
        assert pe == pytest.approx(energy, rel=1e-13)
        assert of_atoms == pytest.approx(energy, rel=1e-13)
        assert stress[::2] == pytest.approx(stress[1::2], rel=1e-13)
        found = columns(tmp_path / f"{newton}.dump", 9)
        assert np.abs(found - forces).max() < 1e-13 * np.abs(forces).max()
        listed = np.loadtxt(tmp_path / f"{newton}.contacts", skiprows=9)
        lines = listed[listed[:, 3] > len(forces) - LINES]
        assert len(listed) == count
        assert len(lines) and not lines[:, [6, 8]].any()
    if ranks > 1:
        one = run(tmp_path, deck("on") + deck("off"), 1)
        for name, values in one.items():
            assert printed[name] == pytest.approx(values, rel=1e-12), name


def test_flows_of_droplets_between_lines_take_one_rank(tmp_path, state):
    state = replace(state, outlines=[o for o in state.outlines if o.type != DISK])
    (tmp_path / "data").write_text(outlines.data(state))
    more = "change_box all triclinic\nfix flow all overdamped rate 0.01 background 0.1\nrun 1\n"
    code, output = launch(tmp_path, deck("on", more).replace("area rings", "area all"), 2)
    assert code and "need one rank" in output, output[-2000:]
