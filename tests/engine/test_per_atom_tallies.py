"""Energy and virial of single atoms: they add up to those of the whole, and each is the one of plain numpy."""

import numpy as np
import outlines
import plain_outline_laws as plain
import pytest
from engine.test_plugin_on_ranks import columns, run
from outlines import DISK, RING

TALLIES = """
compute e all pe/atom
compute s all stress/atom NULL virial
compute of_fix all stress/atom NULL fix
compute of_pair all stress/atom NULL pair
compute sum all reduce sum c_e c_s[1] c_s[2] c_s[4]
compute p all pressure NULL virial
thermo_style custom pe c_p[1] c_p[2] c_p[4] c_sum[*]
thermo_modify norm no
"""
SHOW = """
variable v equal -vol
print "state-{0} $(pe:%.17g) $(c_p[1]*v_v:%.17g) $(c_p[2]*v_v:%.17g) $(c_p[4]*v_v:%.17g)&
 $(c_sum[1]:%.17g) $(c_sum[2]:%.17g) $(c_sum[3]:%.17g) $(c_sum[4]:%.17g)"
"""
DUMP = "write_dump all custom {0}.dump id c_e c_s[1] c_s[2] c_s[4] modify sort id format float %.17g\n"
RANKS = pytest.mark.parametrize("ranks", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 4))])


def parts(vectors, forces):
    """Virial of single contacts, bonds or vertices: xx, yy, xy."""
    return vectors[..., [0, 1, 0]] * forces[..., [0, 1, 1]]


def area_parts(state):
    """Energy and virial of the vertices of each ring, from the mean of its vertices."""
    rows = np.zeros((len(state.points), 4))
    for start, o in zip(state.starts, state.outlines, strict=False):
        if o.type != RING:
            continue
        energy, force = outlines.area_force(o.points, outlines.KA, o.a0)
        own = rows[start : start + len(o.points)]
        own[:, 0] = energy / len(o.points)
        own[:, 1:] = parts(o.points - o.points.mean(axis=0), force)
    return rows


def contact_parts(state):
    """Half of a contact at its vertex; the ends of the edge share the other half as they share the force."""
    rows = np.zeros((len(state.points), 4))
    for c in outlines.contacts(state):
        whole = np.array([c.energy, *parts(c.separation, c.force)])
        rows[c.vertex] += whole / 2
        rows[c.tail] += (1 - c.t) * whole / 2
        rows[c.head] += c.t * whole / 2
    return rows


def bond_parts(state):
    """Half at each end."""
    rows = np.zeros((len(state.points), 4))
    for start, o in zip(state.starts, state.outlines, strict=False):
        if o.type == DISK:
            continue
        for a, b in o.bonds:
            r = o.points[b] - o.points[a]
            whole = outlines.GAMMA * np.array([np.hypot(*r), *(-parts(r, r) / np.hypot(*r))])
            rows[[start + a, start + b]] += whole / 2
    return rows


def close(found, wanted):
    """To twelve digits of the largest."""
    assert np.abs(wanted).max() > 0.01
    assert np.abs(np.subtract(found, wanted)).max() < 1e-12 * np.abs(wanted).max()


@RANKS
def test_atoms_have_their_shares(tmp_path, ranks):
    """Polygons, walls and disks, newton on and off, for pairs and bonds apart."""
    state = outlines.scene(11)
    (tmp_path / "data").write_text(outlines.data(state))
    deck = ""
    for newton in ("on", "off", "on off", "off on"):
        name = newton.replace(" ", "-")
        deck += outlines.deck("data", newton) + TALLIES + "run 0\n" + SHOW.format(name) + DUMP.format(name)
    found = run(tmp_path, deck, ranks)
    wanted = area_parts(state) + contact_parts(state) + bond_parts(state)
    assert wanted[:, 0].sum() == pytest.approx(outlines.energy(state), rel=1e-12)
    assert len(found) == 4
    for name, row in found.items():
        close(columns(tmp_path / f"{name.removeprefix('state-')}.dump", 9), wanted * [1, -1, -1, -1])
        close(row[4:], row[:4])
        close(row[0], wanted[:, 0].sum())


INTEGRATE = """
fix move all nve
timestep 0.002
run 25
"""


@RANKS
def test_shares_add_up_in_all_forms_and_runs(tmp_path, ranks):
    """Both contact forms; during a run, in a minimization; virial per atom asked or not."""
    state = outlines.scene(12)
    (tmp_path / "data").write_text(outlines.data(state))
    deck = ""
    ends = {form: "run 0\n" for form in outlines.FORMS}
    ends |= {"verlet": INTEGRATE, "minimize": "minimize 0 1e-9 20 20\n"}
    for name, end in ends.items():
        for newton in ("on", "off"):
            form = name if name in outlines.FORMS else "outline"
            here = outlines.deck("data", newton).replace("1.2 walls", f"1.2 contact {form} walls")
            deck += here + TALLIES + "thermo 5\n" + end + SHOW.format(f"{name}-{newton}")
    found = run(tmp_path, deck, ranks)
    assert len(found) == 2 * len(ends)
    for row in found.values():
        close(row[4:], row[:4])


KAPPA, THETA0, KP, KL, P0 = 0.02, 0.6, 0.3, 0.2, 3.7
OUTLINE_LAWS = f"""
fix bend rings polygon/bending {KAPPA} {THETA0}
fix perimeter rings polygon/perimeter {KP} {KL} {P0} d_a0
"""


def strained(energy, points):
    """Energy of points and its derivatives by strain xx, yy, xy: minus the virial."""
    found = [energy(points)]
    for a, b in ((0, 0), (1, 1), (0, 1)):
        moved = points.astype(complex)
        moved[:, a] += 1e-30j * points[:, b]
        found.append(energy(moved).imag / 1e-30)
    return found


def outline_parts(state):
    """Of bending the vertex where an outline turns has all; of a perimeter all have the same, and the edge ahead."""
    rows = np.zeros((len(state.points), 4))
    for start, o in zip(state.starts, state.outlines, strict=False):
        if o.type != RING:
            continue
        n, rest = len(o.points), P0 * np.sqrt(o.a0)
        excess = outlines.lengths(o).sum() - rest
        for k in range(n):
            corner = o.points[[k - 1, k, (k + 1) % n]]
            rows[start + k] += strained(lambda x, n=n: plain.corner(*x, KAPPA, THETA0 * 2 * np.pi / n), corner)
            edge = o.points[[k, (k + 1) % n]]
            length = strained(lambda x: plain.size(x[1] - x[0]), edge)
            spring = strained(lambda x, n=n, rest=rest: KL * n / 2 * (plain.size(x[1] - x[0]) - rest / n) ** 2, edge)
            rows[start + k] += spring
            rows[start + k] += [KP / 2 * excess**2 / n, *(KP * excess * np.array(length[1:]))]
    return rows


@RANKS
def test_atoms_have_their_shares_of_laws_of_outlines(tmp_path, ranks):
    state = outlines.scene(14)
    (tmp_path / "data").write_text(outlines.data(state))
    deck = ""
    for newton in ("on", "off"):
        here = outlines.deck("data", newton) + OUTLINE_LAWS + TALLIES
        deck += here + "run 0\n" + SHOW.format(newton) + DUMP.format(newton)
    wanted = outline_parts(state) + (area_parts(state) + contact_parts(state) + bond_parts(state)) * [1, -1, -1, -1]
    for name, row in run(tmp_path, deck, ranks).items():
        close(columns(tmp_path / f"{name.removeprefix('state-')}.dump", 9), wanted)
        close(row[4:], row[:4])


def test_energies_of_atoms_need_no_virial(lmp, tmp_path):
    """Nothing asks for one once the pressure of thermo output is gone."""
    state = outlines.scene(13)
    ask = "compute e all pe/atom\ncompute whole all reduce sum c_e\nthermo_style custom step c_whole\n"
    outlines.start(lmp, tmp_path, state, ask + "uncompute thermo_press\nrun 0\n")
    assert lmp.extract_compute("whole", 0, 0) == pytest.approx(outlines.energy(state), rel=1e-12)
