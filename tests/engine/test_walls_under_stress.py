"""fix overdamped ... stress S walls GROUP: the rate against a dense solution and against flow at a given rate, by hand
for one layer of disks; momentum, work, mirror images, restarts, ranks, and what has no answer."""

import re
from pathlib import Path

import numpy as np
import pytest
from disk_flows import COLUMNS, Flow
from droplet_flows import CONTACT, DropletFlow

import jamlab
from jamlab.mechanics.stiffness import forces

from .test_plugin_on_ranks import launch

DROPLETS = Path(__file__).parents[1] / "states" / "stable_droplets.h5"
ON_WALLS = (17, 18, 19, 20)  # shear stress and pressure, below and above


def held(packing):
    """Command for the group of what is fixed."""
    return "group held id " + " ".join(str(1 + k) for k in np.flatnonzero(packing.frame.fixed_sites))


class Walled(Flow):
    """Disks between walls of disks."""

    def lines(self, data, drag, newton):
        return [*super().lines(data, drag, newton), held(self.packing)]

    def fix(self, settings, drag):
        return f"{super().fix(settings, drag)} walls held"

    def on_walls(self):
        return np.array([self.lmp.extract_fix("flow", 0, 1, k, 0) for k in ON_WALLS])

    def velocities(self):
        """Beside the affine flow, and spins, by identity."""
        ids = np.array(self.lmp.gather_atoms("id", 0, 1))
        found = self.lmp.numpy.extract_fix("flow", 1, 2)[: len(ids)]
        own = np.array(self.lmp.numpy.extract_atom("id")[: len(ids)])
        return found[np.argsort(own)]


class WalledDroplets(Walled, DropletFlow):
    """Droplets between walls of droplets."""


@pytest.fixture(scope="module")
def slab():
    """Disks between rough walls, off balance along the whole slab."""
    found = jamlab.with_walls(jamlab.pack(n=32, pressure=1e-2, seed=2), 1.5)
    assert 4 < found.frame.fixed.sum() < 28
    return found


@pytest.fixture(scope="module")
def droplets():
    return jamlab.relax(jamlab.with_walls(jamlab.read(DROPLETS), 1.2), 1e-10)


def rate_by_hand(state, stress, background):
    """Rate and velocities: balance on free disks, and of the power of the strain, which carries both walls with it."""
    bare, n, fixed = state.with_state(fixed=None, walls=False), state.n, state.frame.fixed
    drag = jamlab.ContactDamping().matrix(bare, bare, "simple").toarray()
    push = np.concatenate([forces(bare).ravel(), np.zeros(n), [0.0]])
    push[-1] = state.area * (stress + jamlab.evaluate(bare).stress[0, 1])
    drag += np.diag(np.concatenate([np.where(fixed, 0.0, background).repeat(2), np.zeros(n + 1)]))
    free = np.concatenate([(~fixed).repeat(2), ~fixed])
    columns = np.zeros((3 * n + 1, free.sum() + 1))
    columns[np.flatnonzero(free), np.arange(free.sum())] = 1.0
    height, y = state.box[1, 1], state.positions[:, 1]
    columns[np.flatnonzero(fixed) * 2, -1] = (np.round(y / height) * height - y)[fixed]
    columns[-1, -1] = 1.0
    found = columns @ np.linalg.lstsq(columns.T @ drag @ columns, columns.T @ push, rcond=1e-13)[0]
    return found[-1], found[: 2 * n].reshape(-1, 2)


@pytest.mark.parametrize("newton", ["on", "off"])
def test_rate_and_velocities_are_those_of_a_dense_solution(tmp_path, slab, newton):
    """At rest, and after a while of flow in a box that leans."""
    stress, background = 2e-3, 1e-2
    fix = f"stress {stress} background {background} solver 1e-10"
    with Walled(tmp_path, slab, fix, newton=newton) as flow:
        for steps in (0, 60):
            row, state = flow.run(steps), flow.state()
            rate, velocities = rate_by_hand(state, stress, background)
            assert row["rate"] == pytest.approx(rate, rel=1e-6)
            assert flow.velocities()[:, :2] == pytest.approx(velocities, abs=1e-6 * np.abs(velocities).max())
            assert row["stress"] == pytest.approx(stress, rel=1e-6)
        assert row["strain"] > 1e-3


@pytest.mark.parametrize("drag", ["1 1", "1 0.3 alpha 0.5", "1 1 arms none exponent 2.5"])
def test_the_stress_of_a_flow_gives_back_its_rate(tmp_path, slab, drag):
    with Walled(tmp_path, slab, "rate 0.05 solver 1e-10", drag) as flow:
        row = flow.run(60)
        flow.lmp.command("unfix flow")
        flow.lmp.command(f"fix flow all overdamped stress {row['stress']:.17g} solver 1e-10 walls held")
        again = flow.run(0)
    assert again["rate"] == pytest.approx(0.05, rel=1e-5)
    assert again["dissipation"] == pytest.approx(row["dissipation"], rel=1e-5)


@pytest.mark.parametrize("kind", [Walled, WalledDroplets])
def test_both_walls_bear_the_stress_and_its_work_is_stored_or_lost(tmp_path, slab, droplets, kind):
    """Nothing else pushes the slab; walls push each other across the edge of the box, which stays as it is."""
    packing, drag, stress = (slab, "1 1", 2e-3) if kind is Walled else (droplets, CONTACT, 5e-3)
    with kind(tmp_path, packing, f"stress {stress} solver 1e-10 longest 0.05", drag) as flow:
        start, between = flow.run(0), None
        rows = []
        for _ in range(5):
            rows.append(flow.run(20))
            on_walls = flow.on_walls()
            between = on_walls if between is None else between
            assert on_walls[0] - between[0] == pytest.approx(0.0, abs=1e-6 * stress)
            assert on_walls[2] - on_walls[0] == pytest.approx(0.0, abs=1e-6 * stress)
        end = flow.state()
    assert abs(end.box[1, 0] - packing.box[1, 0]) == pytest.approx(rows[-1]["strain"] * packing.box[1, 1], rel=1e-9)
    moved = (end.positions - packing.positions)[packing.frame.fixed_sites]
    plane = np.round(packing.centroids[packing.particle[packing.frame.fixed_sites], 1] / packing.box[1, 1])
    assert moved[:, 0] == pytest.approx(rows[-1]["strain"] * packing.box[1, 1] * plane, abs=1e-10)
    assert np.abs(moved[:, 1]).max() < 1e-12
    for row in rows:
        assert row["stress"] == pytest.approx(stress, rel=1e-6)
        stored = row["energy"] - start["energy"]
        assert row["work"] - row["dissipated"] == pytest.approx(stored, abs=2e-3 * row["work"])
    later = rows[-1]["work"] - rows[0]["work"]
    assert later == pytest.approx(stress * (rows[-1]["strain"] - rows[0]["strain"]), rel=1e-6)


@pytest.mark.parametrize("kind", [Walled, WalledDroplets])
def test_a_mirror_image_goes_the_other_way(tmp_path, slab, droplets, kind):
    packing, drag, stress = (slab, "1 1", 2e-3) if kind is Walled else (droplets, CONTACT, 5e-3)
    turn = np.diag([-1.0, 1.0])
    box = packing.box @ turn * [[-1], [1]]
    order = np.arange(len(packing.positions))
    if kind is WalledDroplets:  # outlines go round as before
        order = np.concatenate(
            [order[a:b][::-1] for a, b in zip(packing.offsets[:-1], packing.offsets[1:], strict=True)]
        )
    image = packing.with_state(positions=(packing.positions @ turn)[order], box=box)
    rows = []
    for each, sign in ((packing, 1), (image, -1)):
        with kind(tmp_path, each, f"stress {sign * stress} solver 1e-11 longest 0.02 stop 0.5", drag) as flow:
            rows.append(flow.run())
    one, two = rows
    assert one["strain"] > 0 and two["strain"] == pytest.approx(-one["strain"], rel=1e-6)
    assert two["stress"] == pytest.approx(-one["stress"], rel=1e-6)
    for name in ("energy", "work", "dissipated", "pressure"):
        assert two[name] == pytest.approx(one[name], rel=1e-6), name


def test_without_stress_a_slab_relaxes_and_does_not_drift(tmp_path, slab):
    """The residual stress goes, and with it all motion: at rest on its own modulus."""
    with Walled(tmp_path, slab, "stress 0 longest 1000") as flow:
        start = flow.run(0)
        for _ in range(40):
            row = flow.run(50)
            if abs(row["rate"]) < 1e-10:
                break
        still = flow.run(50)
    assert abs(start["elastic"]) > 1e-5 and abs(row["elastic"]) < 1e-7 * start["pressure"]
    assert still["strain"] == pytest.approx(row["strain"], abs=1e-6)
    assert row["strain"] * start["elastic"] < 0 and row["work"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("kind", [Walled, pytest.param(WalledDroplets, marks=pytest.mark.slow)])
def test_a_restarted_run_goes_on(tmp_path, slab, droplets, kind):
    """The length of steps follows from velocities, which without background are noise where nothing drags."""
    packing, drag, stress = (slab, "1 1", 2e-3) if kind is Walled else (droplets, f"{CONTACT} background 1e-2", 5e-3)
    fix = f"stress {stress} solver 1e-12 longest 0.05"
    with kind(tmp_path, packing, fix, drag) as flow:
        flow.run(15)
        flow.lmp.command(f"write_restart {tmp_path}/half.restart")
        first = [flow.run(1) for _ in range(4)]
        again = ["clear", f"read_restart {tmp_path}/half.restart", "neigh_modify every 1 delay 0 check yes"]
        if kind is WalledDroplets:
            again += ["fix d_a0 all property/atom d_a0", "special_bonds lj/coul 1.0 1.0 1.0"]
            again += [line for line in flow.lines("x", drag, "on") if line.startswith("fix area")]
        for line in (*again, f"fix flow all overdamped {flow.fix(fix, drag)}"):
            flow.lmp.command(line)
        more = [flow.run(1) for _ in range(4)]
    for name in ("time", "strain", "rate", "stress", "viscous", "energy", "work", "dissipated", "step"):
        expected = [row[name] for row in first]
        assert [row[name] for row in more] == pytest.approx(expected, rel=1e-7, abs=1e-14), name


def test_pairs_that_rub_leave_the_stress_as_it_is(tmp_path):
    """Forces that keep a disk and one of a wall together act on the wall too."""
    packing = jamlab.with_walls(jamlab.pack(n=24, pressure=1e-2, seed=3), 1.3)
    marginal = []
    with Walled(tmp_path, packing, "stress 8e-3 solver 1e-8 tolerance 1e-2") as flow:
        for _ in range(120):
            assert flow.run(1)["stress"] == pytest.approx(8e-3, rel=1e-6)
            marginal.append(flow.lmp.extract_fix("flow", 0, 1, 21, 0))
        assert np.count_nonzero(marginal) > 10 and flow.lmp.extract_fix("flow", 0, 1, 16, 0) == 0


LAYER = """
dimension 2
atom_modify map array
region box prism 0 3 0 2.9 -0.5 0.5 0 0 0
create_box 2 box
create_atoms 1 single 0.3 1.45 0
create_atoms 2 single 0.0 1.0 0
create_atoms 2 single 0.7 1.9 0
pair_style disk/drag 4.0 0.5 arms none
pair_coeff 1 1 1.0 1.0
pair_coeff 1 2 1.0 0.5
pair_coeff 2 2 1.0 0.0
mass * 1
group held type 2
"""


def test_one_disk_that_does_not_turn_between_flat_walls(lmp):
    """By hand: either wall slips past it at half the velocity V of the upper one, so that S L = k tau beta V/2."""
    lmp.commands_list(
        [*LAYER.strip().splitlines(), "fix flow all overdamped stress 0.01 walls held longest 0.5 stop 2"]
    )
    expected = 0.01 * 3.0 * 2 / (2.0 * 4.0 * 0.5) / 2.9
    for time in (0, 2, 4):
        lmp.command(f"run {1000 * min(time, 1)} post no")
        row = [lmp.extract_fix("flow", 0, 1, k, 0) for k in range(22)]
        found = dict(zip(COLUMNS, row, strict=False))
        assert row[17] == pytest.approx(0.01, rel=1e-12) and row[19] == pytest.approx(0.01, rel=1e-12)
        assert found["rate"] == pytest.approx(expected, rel=1e-12) and found["elastic"] == 0
        for name, value in (("time", time), ("strain", time * expected), ("stress", 0.01)):
            assert found[name] == pytest.approx(value, rel=1e-12), name
        for name in ("work", "dissipated"):
            assert found[name] == pytest.approx(0.01 * time * expected, rel=1e-12, abs=1e-16), name


PRINT = " ".join(f"$(f_flow[{k}]:%.17g)" for k in range(1, 22))


@pytest.mark.parametrize(
    ("model", "ranks", "newton"),
    [("sp", 2, "off"), ("sp", 4, "on"), ("dp", 2, "off"), ("dp", 1, "off")],
)
@pytest.mark.slow
def test_any_number_of_ranks(tmp_path, slab, droplets, model, ranks, newton):
    packing, kind = (slab, Walled) if model == "sp" else (droplets, WalledDroplets)
    drag, fix = ("1 1", "stress 2e-3") if model == "sp" else (f"{CONTACT} background 5", "stress 0.01")
    jamlab.write(tmp_path / "flow.data", packing)
    deck = kind.__new__(kind)
    deck.packing = packing
    rows = []
    for count, way in ((1, "on"), (ranks, newton)):
        how = deck.fix(f"{fix} tolerance 0.1 solver 1e-11 longest 0.02", drag)
        lines = [
            *deck.lines("flow.data", drag, way),
            f"fix flow all overdamped {how}",
            "run 20",
            f'print "row {PRINT}"',
        ]
        code, output = launch(tmp_path, "\n".join(lines) + "\n", count)
        assert code == 0, output[-2000:]
        rows.append(np.array(re.findall(r"^row (.*)", output, re.MULTILINE)[0].split(), dtype=float))
    counted = [COLUMNS.index(name) for name in ("iterations", "last_iterations")]
    one, two = (np.delete(row, counted) for row in rows)
    assert one[1] > 1e-6 and two == pytest.approx(one, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("between", [True, False])
def test_without_drag_on_a_shear_no_rate_is_found(tmp_path, slab, between):
    """A background follows the flow. With a fluid the rate has an answer."""
    packing, kind = (slab, Walled) if between else (slab.with_state(fixed=None, walls=False), Flow)
    with kind(tmp_path, packing, "stress 1e-3 background 1 longest 1", "0 1") as flow:
        with pytest.raises(Exception, match=r"\[flow-singular\] nothing resists a shear rate .* a fluid"):
            flow.run(0)
    with kind(tmp_path, packing, "stress 1e-3 background 1 fluid 2", "0 1") as flow:
        row = flow.run(0)
    assert row["rate"] == pytest.approx(0.5 * (1e-3 - row["elastic"]), rel=1e-9)


def test_a_stress_that_strains_droplets_at_once_rises_in_parts(tmp_path):
    """Where no drag resists the strain: a hundredth of the strain of a droplet is more than a step takes. The work is
    that of a stress that rises."""
    with DropletFlow(tmp_path, jamlab.read(DROPLETS), "stress 5e-3 stop 0.05", CONTACT) as flow:
        start, row = flow.run(0), flow.run()
    assert row["stress"] == pytest.approx(5e-3, rel=1e-5) and row["strain"] > 0.01
    stored = row["energy"] - start["energy"]
    assert row["work"] - row["dissipated"] == pytest.approx(stored, abs=2e-2 * row["work"])


def test_droplets_whose_drag_is_a_power_begin_to_creep(tmp_path):
    """From rest, where such drag has no bound."""
    with DropletFlow(tmp_path, jamlab.read(DROPLETS), "stress 5e-3 background 1", "drag 1 1 0.5") as flow:
        assert flow.run(0)["rate"] == 0
        row = flow.run(20)
    assert row["stress"] == pytest.approx(5e-3, rel=1e-3) and row["rate"] > 0 and row["time"] > 1e-5


@pytest.mark.parametrize(
    ("group", "fix", "named"),
    [
        ("group held empty", "walls held", "walls: the group has no atoms"),
        ("group held empty", "fixed held", "fixed: the group has no atoms"),
        ("group held id 1:10", "fixed held", "held in part"),
        ("middle", "walls some", "near the lower or the upper edge"),
        ("group held molecule 1\ngroup other molecule 2", "walls held fixed other", "fixed other: give one group"),
    ],
)  # fmt: skip
def test_groups_that_are_refused(tmp_path, group, fix, named):
    packing = jamlab.read(DROPLETS)
    with DropletFlow(tmp_path, packing, "rate 1", CONTACT) as flow:
        lines = group.splitlines()
        if group == "middle":  # a droplet that reaches beyond it
            height = packing.box[1, 1]
            y = packing.positions[:, 1] - np.floor(packing.centroids[packing.particle, 1] / height) * height
            upper = np.bincount(packing.particle, y > 0.5 * height) / np.bincount(packing.particle)
            lines = [f"group some molecule {1 + np.flatnonzero((upper > 0) & (upper < 1))[0]}"]
        flow.lmp.commands_list(["unfix flow", *lines])
        with pytest.raises(Exception, match=named):
            flow.lmp.commands_list([f"fix flow all overdamped rate 0.1 {CONTACT} {fix}", "run 0"])
