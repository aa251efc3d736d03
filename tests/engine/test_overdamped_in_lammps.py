"""fix overdamped among commands of LAMMPS: what it refuses, with value and remedy, and what it goes along with."""

import struct
from pathlib import Path

import numpy as np
import pytest
from disk_flows import Flow, commands
from droplet_flows import CONTACT, STOKES, DropletFlow

import jamlab


@pytest.fixture(scope="module")
def disks():
    return jamlab.pack(n=16, pressure=2e-2, seed=2)


@pytest.fixture(scope="module")
def droplets():
    return jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")


@pytest.mark.parametrize(
    ("drag", "message"),
    [
        ("1", "needs: tau beta"),
        ("1 1 alpha 0.3", "alpha 0.3 must lie between 0.4 and 1"),
        ("1 1 alpha 1.5", "alpha 1.5 must lie between 0.4 and 1"),
        ("1 -1", "beta -1 must lie between 0 and 100000"),
        ("-1 1", "tau -1 must be a time"),
        ("1 1 arms long", "arms long is not one of"),
    ],
)
def test_drag_law(lmp, drag, message):
    with pytest.raises(Exception, match=message):
        lmp.command(f"pair_style disk/drag {drag}")


@pytest.mark.parametrize(
    ("fix", "message"),
    [
        ("tolerance 1e-3", "give one of: rate value, oscillate amplitude omega, stress value"),
        ("rate 1 stress 1", "give one of rate, oscillate and stress, not two"),
        ("rate", "rate needs 1 value"),
        ("rate 1e999", "rate 1e999 must be finite|1e999"),
        ("oscillate 0 1", "amplitude 0 and omega 1 of oscillate must be positive"),
        ("rate 1 tolerance 1", "tolerance 1 must lie above 0, up to 0.1"),
        ("rate 1 solver 0", "solver 0 must lie between 1e-13 and 0.1"),
        ("rate 1 background -1", "background -1, .* must not be negative"),
        ("rate 1 fluid -2", "fluid -2, .* must not be negative"),
        ("rate 1 speed 2", "speed is not one of"),
    ],
)
def test_fix(tmp_path, disks, fix, message):
    with pytest.raises(Exception, match=message), Flow(tmp_path, disks, fix):
        pass


@pytest.mark.parametrize(
    ("fix", "message"),
    [
        ("rate 1", "no drag at all: give drag tau beta alpha, or a background drag"),
        ("rate 1 drag 0 1 1", "no drag at all: tau = 0 of drag needs a background drag"),
        ("rate 1 drag 1 1", r"drag needs 3 value\(s\)"),
        ("rate 1 drag -1 1 1", "tau -1 of drag must be a time, or 0"),
        ("rate 1 drag 1 -1 1", "beta -1 of drag must lie between 0 and"),
        ("rate 1 drag 1 1 0.3", "alpha 0.3 of drag must lie between 0.4 and 1"),
    ],
)
def test_fix_of_droplets(tmp_path, droplets, fix, message):
    with pytest.raises(Exception, match=message), DropletFlow(tmp_path, droplets, fix, "") as flow:
        flow.run(0)


HYBRID = "pair_style hybrid/overlay disk/drag 1 1 zero 1.0\npair_coeff * * disk/drag 0.5 1\npair_coeff * * zero"


@pytest.mark.parametrize(
    ("line", "drag", "message"),
    [
        ("pair_style harmonic/cut\npair_coeff * * 0.5 1", "1 1", "needs pair_style disk/drag"),
        ("fix flow all overdamped rate 1", "0 1", "no drag at all: tau = 0 of pair_style disk/drag needs a background"),
        ("group one id 1\nunfix flow\nfix flow one overdamped rate 1", "1 1", "group must be all"),
        ("unfix flow\nchange_box all ortho\nfix flow all overdamped rate 1", "1 1", "periodic triclinic box"),
        ("run_style respa 2 2", "1 1", "run_style verlet only"),
        # forces that enter neither stress nor energy nor steps
        ("fix push all addforce 0.1 0 0", "1 1", "fix push of style addforce pushes disks too, .* remove it"),
        ("fix move all nve", "1 1", "fix move of style nve moves atoms, too, .* unfix it"),
        (HYBRID, "1 1", "pair_style hybrid/overlay pushes disks too"),
        ("unfix area", STOKES, "droplets need one fix polygon/area, of group all"),
        # no Hessian of it is known: steps that took it as given lost 50 times the work
        ("angle_style zero nocoeff", STOKES, "angle_style zero pushes droplets too"),
    ],
)
def test_setting(tmp_path, disks, droplets, line, drag, message):
    kind, packing = (DropletFlow, droplets) if drag == STOKES else (Flow, disks)
    with kind(tmp_path, packing, "rate 1", drag) as flow:
        for command in line.splitlines():
            flow.lmp.command(command)
        with pytest.raises(Exception, match=message):
            flow.run(1)


def test_a_solver_that_does_not_converge_says_what_is_left(tmp_path, disks):
    with Flow(tmp_path, disks, "rate 1 solver 1e-12 iterations 3") as flow:
        with pytest.raises(Exception, match=r"a residual of .* is left after 3 iterations: the background drag is"):
            flow.run(1)


@pytest.mark.parametrize(("layout", "who"), [(-18.0, "Fix overdamped"), (-2.0, "Pair style disk/drag")])
def test_a_restart_file_of_another_version(tmp_path, disks, layout, who):
    """Those of 0.2.0 have a time where the fix now has its layout, and beta where the pair style has its own."""
    file = tmp_path / "flow.restart"
    with Flow(tmp_path, disks, "rate 1", "1 0.4") as flow:
        flow.run(1)
        flow.lmp.command(f"write_restart {file}")
        ours = struct.pack("d", layout) + (b"" if layout < -2.0 else struct.pack("d", 0.4))
        assert file.read_bytes().count(ours) == 1
        file.write_bytes(file.read_bytes().replace(ours, bytes(8) + ours[8:]))
        with pytest.raises(Exception, match=f"{who}: the restart file was written by another version"):
            flow.lmp.commands_list(["clear", f"read_restart {file}", "fix flow all overdamped rate 1"])


def test_disks_in_one_place_are_refused(lmp, tmp_path, disks):
    jamlab.write_data(tmp_path / "flow.data", disks)
    for line in [*commands(disks, str(tmp_path / "flow.data")), "displace_atoms all ramp x 0 0 y 0 1"]:
        lmp.command(line)
    lmp.command("set atom 1*2 x 0 y 0")
    with pytest.raises(Exception, match="are in one place, where their contact has no direction"):
        lmp.command("run 0")


@pytest.mark.parametrize(
    ("fix", "drag", "message"),
    [
        # ghosts reach as far as the longest edge allowed: beyond, contacts would be missed without a word
        pytest.param(
            "rate 30 tolerance 0.1 solver 1e-2 stop 0.05",
            "background 1",
            r"the edge between atoms \d+ and \d+ is .* long, more than the 1.5",
            marks=pytest.mark.slow,
        ),
        # what no drag holds moves at once; a background drag takes it through
        (
            "rate 0.1 tolerance 0.1 solver 1e-3 stop 0.5",
            CONTACT,
            r"droplets slip past each other, .* background drag is 0",
        ),
    ],
)
def test_flow_of_droplets_that_cannot_go_on(tmp_path, droplets, fix, drag, message):
    with DropletFlow(tmp_path, droplets, fix, drag) as flow:
        with pytest.raises(Exception, match=message):
            for _ in range(20):
                flow.run()


def test_a_contact_without_direction_has_no_flow(tmp_path, droplets):
    positions, end = droplets.positions.copy(), droplets.offsets[1]
    apart = np.linalg.norm(positions[:end, None] - positions[end:], axis=2)
    i, j = np.unravel_index(apart.argmin(), apart.shape)
    positions[i] = positions[end + j]
    with pytest.raises(Exception, match=r"\[flow-crosses\]"):
        with DropletFlow(tmp_path, droplets.with_state(positions=positions), "rate 0.1", STOKES) as flow:
            flow.run(0)


def test_fast_flow_without_sliding_drag_survives(tmp_path, disks):
    """B is nearly singular at times: the fastest disk moves at hundreds of times the flow, and steps shrink."""
    with Flow(tmp_path, disks, "rate 0.1 tolerance 0.1 solver 1e-3 stop 1", "1 0") as flow:
        rows = [flow.run() for _ in range(20)]
    assert rows[-1]["strain"] == pytest.approx(2.0)
    assert max(row["energy"] for row in rows) < 0.1


def test_fixes_that_push_nothing_are_welcome(tmp_path, disks):
    with Flow(tmp_path, disks, "rate 1e-2 stop 1") as flow:
        for line in ("fix flat all enforce2d", "variable s equal f_flow[2]", "fix mean all ave/time 1 1 1 v_s"):
            flow.lmp.command(line)
        assert flow.run()["strain"] == pytest.approx(1e-2)


def test_dumps_at_given_times(tmp_path, disks):
    """Steps have any length: LAMMPS must be told of each."""
    path = tmp_path / "flow.dump"
    with Flow(tmp_path, disks, "rate 1e-2 longest 0.07") as flow:
        flow.lmp.command(f"dump rows all custom 100 {path} id x y")
        flow.lmp.command("dump_modify rows every/time 0.5 time yes")
        end = flow.run(60)["time"]
    times = [float(line) for before, line in zip(["", *path.read_text().splitlines()], path.read_text().splitlines(),
                                                 strict=False) if before == "ITEM: TIME"]  # fmt: skip
    assert len(times) == int(end / 0.5) + 1
    for k, time in enumerate(times):
        assert 0.5 * k - 1e-9 <= time < 0.5 * k + 0.08


def test_what_has_no_mass_has_no_kinetic_pressure(tmp_path, disks):
    with Flow(tmp_path, disks, "rate 1e-2 stop 1") as flow:
        for line in ("mass * 1", "velocity all create 1.0 1", "thermo_style custom step press", "thermo 1"):
            flow.lmp.command(line)
        flow.run()
        native = jamlab.evaluate(flow.state())
        assert flow.lmp.get_thermo("press") == pytest.approx(native.pressure, rel=1e-6)


@pytest.mark.parametrize("kind", [Flow, DropletFlow])
def test_a_compute_of_the_fix_that_is_gone_is_named(tmp_path, disks, droplets, kind):
    """It was a segmentation fault."""
    packing, drag = (disks, "1 1") if kind is Flow else (droplets, STOKES)
    with kind(tmp_path, packing, "rate 1e-2", drag) as flow:
        flow.run(1)
        flow.lmp.command("uncompute flow_virial")
        with pytest.raises(Exception, match="compute flow_virial or flow_energy is gone, which belong to it"):
            flow.run(1)
        flow.lmp.command("unfix flow")


def test_a_minimisation_between_two_flows_is_a_new_start(tmp_path, droplets):
    """Velocities from before it dragged at first: 2.2e-3 for 9e-6."""
    fix = f"rate 1e-2 {CONTACT} background 1e-2 stop 5"
    with DropletFlow(tmp_path, droplets, fix, "") as flow:
        flow.run()
        flow.lmp.command("minimize 0 1e-10 2000 20000")
        viscous = flow.run(0)["viscous"]
        relaxed = flow.state()
    with DropletFlow(tmp_path, relaxed, fix, "") as flow:
        assert viscous == pytest.approx(flow.run(0)["viscous"], rel=1e-3)


def test_energy_and_stress_of_droplets_at_the_end_of_a_step(tmp_path, droplets):
    """Forces are those of the prediction: what the correction adds is known to second order."""
    with DropletFlow(tmp_path, droplets, "rate 0.1 longest 0.02 tolerance 1e-3", f"{CONTACT} background 1e-2") as flow:
        flow.run(40)
        before = jamlab.evaluate(flow.state())
        row = flow.run(1)
        after = jamlab.evaluate(flow.state())
    moved = abs(after.energy - before.energy)
    assert row["energy"] * droplets.area == pytest.approx(after.energy, abs=1e-3 * moved)
    assert row["elastic"] == pytest.approx(-after.stress[0, 1], abs=1e-3 * abs(after.stress - before.stress).max())
