"""fix gravity and fix addforce with fix overdamped: speeds, forces on walls and energies that are known exactly."""

import numpy as np
import pytest
from disk_flows import COLUMNS

from jamlab.engine.installation import start_lammps

HEAD = "units lj\ndimension 2\natom_modify map array sort 0 0.0\nprocessors 1 * 1\nneighbor 0.3 bin\nthermo 1"


NUMBERS = [*COLUMNS, *"unsettled lower_shear lower_pressure upper_shear upper_pressure".split()]
BOX = ["region box prism 0 10 0 12 -0.5 0.5 0 0 0", "create_box 2 box"]
DISK_LAW = ["pair_style disk/drag 1 1", "pair_coeff * * 0.5 1.0", "mass 1 2.0", "mass 2 1.0"]
AREA = 120.0


class Fall:
    """Disks or droplets of the lines, in a box of 10 x 12, pushed by fixes, with a fix overdamped of these words."""

    def __init__(self, lines, fix, pushes=()):
        self.lmp = start_lammps()
        self.lines = [*pushes, f"fix flow all overdamped {fix}"]
        self.lmp.commands_list([*HEAD.splitlines(), *lines, *self.lines])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.lmp.close()

    def run(self, steps=10**9):
        self.lmp.command(f"run {steps} post no")
        return {name: self.lmp.extract_fix("flow", 0, 1, k, 0) for k, name in enumerate(NUMBERS)}

    def places(self):
        x = np.array(self.lmp.gather_atoms("x", 1, 3)).reshape(-1, 3)[:, :2]
        image = np.array(self.lmp.gather_atoms("image", 0, 3)).reshape(-1, 3)[:, :2]
        return x + image * np.array([10.0, 12.0])


def disks(*places):
    return [
        *["atom_style atomic", *BOX],
        *(f"create_atoms {kind} single {x:.17g} {y:.17g} 0" for kind, x, y in places),
        *DISK_LAW,
    ]


def droplets(folder, *polygons, eta=0.0):
    """Regular polygons (type, corners, x, y) with circumradius 0.5, at rest by themselves: tension and area balance.
    `eta` is for droplets that others push: vertices come together."""
    radius, ka, gamma = 0.5, 300.0, 0.4
    atoms, bonds, rest = [], [], []
    for molecule, (kind, corners, x, y) in enumerate(polygons, 1):
        first = len(atoms) + 1
        angles = 2 * np.pi * np.arange(corners) / corners
        area = 0.5 * corners * radius**2 * np.sin(2 * np.pi / corners)
        length = 2 * corners * radius * np.sin(np.pi / corners)
        for k, (c, s) in enumerate(zip(np.cos(angles), np.sin(angles), strict=True)):
            atoms.append(f"{first + k} {molecule} {kind} {x + radius * c:.17g} {y + radius * s:.17g} 0")
            bonds.append(f"{first + k} 1 {first + k} {first + (k + 1) % corners}")
            rest.append(f"{first + k} {area + gamma * length / (2 * ka * area):.17g}")
    (folder / "droplets.data").write_text(
        f"\n\n{len(atoms)} atoms\n{len(bonds)} bonds\n2 atom types\n1 bond types\n2 extra bond per atom\n\n"
        "0 10 xlo xhi\n0 12 ylo yhi\n-0.5 0.5 zlo zhi\n0 0 0 xy xz yz\n\n"
        "Masses\n\n1 2\n2 1\n\nAtoms # molecular\n\n" + "\n".join(atoms) + "\n\nBonds\n\n" + "\n".join(bonds)
        + "\n\nd_a0\n\n" + "\n".join(rest) + "\n"
    )  # fmt: skip
    return [
        *["atom_style molecular", "fix d_a0 all property/atom d_a0", "bond_style line/tension"],
        *["special_bonds lj/coul 1 1 1", "pair_style circuloline 0.25 1.5"],
        *[f"read_data {folder / 'droplets.data'} fix d_a0 NULL d_a0", f"bond_coeff * {gamma} {eta}"],
        *["pair_coeff * * 1.0", f"fix area all polygon/area {ka} d_a0"],
    ]


def falling(kind, folder):
    """Disks that fall on held ones, or droplets on droplets, and the lines of groups."""
    if kind == "disks":
        fallen = disks(*((2, 0.8 * k, 2.0) for k in range(5)), *((1, 0.5 + 1.1 * k, 3.2 + 0.3 * k) for k in range(3)))
    else:
        fallen = droplets(
            folder, *((2, 8, 1.2 * k + 1, 2.0) for k in range(3)), (1, 12, 1.7, 3.2), (1, 10, 2.9, 3.4), eta=1e-2
        )
    return [*fallen, "group held type 2", "group free type 1"]


WEIGHT = {"disks": 0.05, "droplets": 0.005}
DOWN = "fix weight all gravity {} vector 0 -1 0"
KINDS = {"disks": "background 0.5", "droplets": "background 0.5 drag 1 1 1"}


def test_a_disk_falls_with_its_weight_over_the_drag():
    """Forces of several fixes add up; the work is dissipated."""
    push = ["group one id 1", DOWN.format(0.05), "fix wind one addforce 0.03 0.02 0"]
    with Fall(disks((1, 5.0, 6.0), (2, 1.0, 1.0)), "rate 0 background 0.5 stop 30", push) as flow:
        row, found = flow.run(), flow.places()
    forces = np.array([[0.03, 0.02 - 0.05 * 2.0], [0.0, -0.05]])
    assert found == pytest.approx(np.array([[5.0, 6.0], [1.0, 1.0]]) + 30.0 * forces / 0.5, abs=1e-12)
    assert row["work"] == pytest.approx(30.0 * np.sum(forces**2) / 0.5 / AREA, rel=1e-12)
    assert row["dissipated"] == pytest.approx(row["work"], rel=1e-12)
    assert row["stress"] == row["pressure"] == row["energy"] == 0.0


def test_a_force_that_another_fix_has_replaced_is_refused_without_setup():
    with Fall(disks((1, 5.0, 6.0)), "rate 0 background 0.5", [DOWN.format(0.05)]) as flow:
        flow.run(2)
        flow.lmp.command("unfix weight")
        with pytest.raises(Exception, match="fix weight was not in the last run: leave out pre no"):
            flow.lmp.command("run 2 pre no post no")


def test_another_run_may_have_another_force():
    with Fall(disks((1, 5.0, 6.0)), "rate 0 background 0.5 stop 1", [DOWN.format(0.05)]) as flow:
        flow.run()
        flow.lmp.commands_list(["unfix flow", "unfix weight", DOWN.format(0.1), flow.lines[-1]])
        flow.run()
        assert flow.places() == pytest.approx(np.array([[5.0, 6.0 - 2.0 * (0.05 + 0.1) / 0.5]]), abs=1e-12)


@pytest.mark.parametrize("drag", ["", "drag 1 1 1", "drag 1 0.3 0.5"])
def test_a_droplet_falls_as_a_whole(tmp_path, drag):
    """Each vertex bears its mass and its share of the background drag: the outline does not change."""
    lines = droplets(tmp_path, (1, 12, 5.0, 6.0))
    with Fall(
        lines, f"rate 0 background 0.5 {drag} stop 1", [DOWN.format(0.05), "fix wind all addforce 0.03 0 0"]
    ) as flow:
        start, row = flow.places(), flow.run()
        moved = flow.places() - start
    speed = 12 * np.array([0.03, -0.05 * 2.0]) / 0.5
    assert moved == pytest.approx(np.broadcast_to(speed, moved.shape), abs=1e-9)
    assert row["work"] == pytest.approx(0.5 * np.sum(speed**2) / AREA, rel=1e-9)
    assert row["dissipated"] == pytest.approx(row["work"], rel=1e-6)  # but for the first step, from rest


@pytest.mark.parametrize("kind", KINDS)
def test_what_has_come_to_rest_bears_its_weight(tmp_path, kind):
    """Held particles bear that of the others, not their own; energy is neither made nor lost."""
    fix = f"rate 0 {KINDS[kind]} fixed held stop 60"
    with Fall(falling(kind, tmp_path), fix, [DOWN.format(WEIGHT[kind])]) as flow:
        start, row = flow.run(0), flow.run()
        weight = WEIGHT[kind] * 2.0 * (3 if kind == "disks" else 22)
    assert -10.0 * row["upper_pressure"] == pytest.approx(weight, rel=1e-2)
    stored = row["energy"] - start["energy"]
    assert row["work"] - row["dissipated"] == pytest.approx(stored, abs=1e-3 * row["work"])
    assert row["work"] > 0.0


def test_disks_fall_with_drag_that_grows_as_a_power(tmp_path):
    """Held disks that touch do not move: their relaxation time has no bound, and limits no step."""
    law = [line.replace("drag 1 1", "drag 1 0.3 alpha 0.5") for line in falling("disks", tmp_path)]
    with Fall(law, "rate 0 background 0.5 fixed held solver 1e-8 stop 2", [DOWN.format(0.05)]) as flow:
        start, row = flow.run(0), flow.run()
    assert row["work"] - row["dissipated"] == pytest.approx(row["energy"] - start["energy"], abs=1e-6 * row["work"])


@pytest.mark.parametrize("kind", KINDS)
def test_energy_closes_under_shear(tmp_path, kind):
    """Body forces do work beside the affine flow, in which the stress does its own."""
    push = ["fix left held addforce 0.02 0.01 0", "fix right free addforce -0.03 -0.02 0"]
    ends = []
    for tolerance in (1e-3, 1e-4):
        fix = f"rate 0.05 {KINDS[kind]} tolerance {tolerance} stop 2"
        with Fall(falling(kind, tmp_path), fix, push) as flow:
            start, row = flow.run(0), flow.run()
        ends.append(row["work"] - row["dissipated"] - row["energy"] + start["energy"])
    assert abs(ends[0]) < 2e-3 * row["work"]
    assert abs(ends[1]) < 3e-4 * row["work"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_restarted_fall_goes_on(tmp_path, kind):
    """To the last digit of places in the leaning box, which LAMMPS finds anew in each run."""
    fix = f"rate 0 {KINDS[kind]} fixed held"
    with Fall(falling(kind, tmp_path), fix, [DOWN.format(WEIGHT[kind])]) as flow:
        flow.run(20)
        flow.lmp.command(f"write_restart {tmp_path}/fall")
        row = flow.run(20)
        again = ["clear", f"read_restart {tmp_path}/fall", "neighbor 0.3 bin"]
        if kind == "droplets":
            again += ["fix d_a0 all property/atom d_a0", "special_bonds lj/coul 1 1 1"]
            again += ["fix area all polygon/area 300 d_a0"]
        flow.lmp.commands_list([*again, *flow.lines])
        found = flow.run(20)
        if kind == "droplets":  # factors of the matrix are new, and need not be as good as those before
            for name in ("iterations", "last_iterations"):
                found[name] = row[name]
        assert found == (row if kind == "disks" else pytest.approx(row, rel=1e-9))


@pytest.mark.parametrize(
    ("push", "named"),
    [
        ("fix push all gravity v_ramp vector 0 -1 0", "fix push of style gravity: the force over the mass along y"),
        ("fix push all addforce 0 v_ramp 0", "fix push of style addforce: the force along y"),
        ("fix push all addforce v_place 0 0", "along x"),
        ("fix push all addforce 0.1 0 0 region part", "without region"),
        ("fix push all addforce 0.1 0 0 every 2", "leave out every"),
        ("fix push all addforce 0.1 0 0.1", "along z"),
        ("fix push some addforce 0.1 0 0", "fix push of style addforce has the dynamic group some"),
        ("fix push all setforce 0 0 0", "setforce"),
        ("unfix flow\nfix flow all overdamped rate 0\nfix push all addforce 0.1 0 0", "define it before"),
        ("fix push all addforce 0.1 0 0\nfix flow all overdamped rate 0 longest 1", "give a background drag"),
    ],
)
def test_forces_that_are_not_constant(push, named):
    lines = [*disks((1, 5.0, 6.0), (2, 1.0, 1.0)), "variable ramp equal 1+0.1*step", "variable place atom 0.1*x"]
    lines += ["region part block 0 3 INF INF INF INF", "group some dynamic all region part every 1"]
    with Fall(lines, "rate 0 background 1") as flow:
        if "fix flow" not in push:
            push = f"unfix flow\n{push}\nfix flow all overdamped rate 0 background 1"
        elif "longest" in push:
            push = f"unfix flow\n{push}"
        with pytest.raises(Exception, match="Fix overdamped") as found:
            flow.lmp.commands_list([*push.splitlines(), "run 3"])
    assert named in str(found.value)
